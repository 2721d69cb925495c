//! Values in a program's memory, read and written by accesses of their width.

use std::sync::atomic::{AtomicI16, AtomicU16, AtomicU32, AtomicU8, Ordering};

/// A value, or an array of them, that a program may read or write at the same time.
pub(crate) trait Cell: Copy {
    /// Reads it.
    ///
    /// # Safety
    ///
    /// `at` is aligned and points to memory that is there during the call. Nobody has a Rust reference to
    /// that memory; others reach it by atomic accesses or from C.
    unsafe fn load(at: *mut Self) -> Self;

    /// Writes it.
    ///
    /// # Safety
    ///
    /// As for [`load`](Self::load).
    unsafe fn store(at: *mut Self, value: Self);
}

macro_rules! cells {
    ($($integer:ty: $atomic:ty),+) => {$(
        impl Cell for $integer {
            unsafe fn load(at: *mut Self) -> Self {
                // SAFETY: as the caller promises.
                unsafe { <$atomic>::from_ptr(at) }.load(Ordering::Acquire)
            }

            unsafe fn store(at: *mut Self, value: Self) {
                // SAFETY: as the caller promises.
                unsafe { <$atomic>::from_ptr(at) }.store(value, Ordering::Release);
            }
        }
    )+};
}

cells!(u8: AtomicU8, u16: AtomicU16, i16: AtomicI16, u32: AtomicU32);

impl<T: Cell, const N: usize> Cell for [T; N] {
    unsafe fn load(at: *mut Self) -> Self {
        // SAFETY: element `index` lies within the array that the caller promises.
        std::array::from_fn(|index| unsafe { T::load(at.cast::<T>().add(index)) })
    }

    unsafe fn store(at: *mut Self, value: Self) {
        for (index, element) in value.into_iter().enumerate() {
            // SAFETY: element `index` lies within the array that the caller promises.
            unsafe { T::store(at.cast::<T>().add(index), element) };
        }
    }
}

/// Makes a plain struct a [`Cell`], by all of its fields.
macro_rules! struct_cells {
    ($($name:ident { $($field:ident)+ })+) => {$(
        impl Cell for $name {
            unsafe fn load(at: *mut Self) -> Self {
                // SAFETY: the fields lie within the struct that the caller promises.
                unsafe { Self { $($field: Cell::load(&raw mut (*at).$field)),+ } }
            }

            unsafe fn store(at: *mut Self, value: Self) {
                // SAFETY: the fields lie within the struct that the caller promises.
                unsafe { $(Cell::store(&raw mut (*at).$field, value.$field);)+ }
            }
        }
    )+};
}

use ft_transfer_area::transfer_area::{
    Change, Config, CounterConfig, Info, InputValues, IrInput, OutputValues, Status, Timer,
    TxtInputs, TxtInputs2, TxtOutputs, UniConfig, Versions,
};

struct_cells!(
    Info { hostname btaddr dummy shared_memory_start app_area_start app_area_size version }
    Versions { hardware firmware shm_if fish_x1 }
    Config { pgm_state_req old_ft_transfer dummy motor uni cnt motor_config }
    UniConfig { mode digital dummy }
    CounterConfig { mode dummy }
    InputValues {
        uni cnt_in counter display_button_left display_button_right cnt_resetted motor_ex_reached
        cnt_reset_cmd_id motor_ex_cmd_id
    }
    OutputValues { cnt_reset_cmd_id master duty distance motor_ex_cmd_id }
    Status { status iostatus com_err }
    Change {
        upd_interface change_status change_uni change_cnt_in change_counter change_timer reserved
    }
    Timer { timer_1ms timer_10ms timer_100ms timer_1s timer_10s timer_1min }
    TxtInputs {
        txt_power txt_temp txt_ref txt_vb ir_input sound_cmd_id sec min hour24 hour12 pm_flag m_day
        month year w_day
    }
    IrInput {
        joy_left_x joy_left_x_to_left joy_left_x_to_right joy_left_y joy_left_y_to_forward
        joy_left_y_to_backwards joy_right_x joy_right_x_to_left joy_right_x_to_right joy_right_y
        joy_right_y_to_forward joy_right_y_to_backwards button_on button_off dip_switch_1
        dip_switch_2
    }
    TxtOutputs { sound_cmd_id sound_index sound_repeat led_color_r led_color_g led_color_b dummy }
    TxtInputs2 { mic_lin mic_log }
);
