//! Values in a program's memory, read and written by accesses of their width.

use std::sync::atomic::{AtomicI16, AtomicU16, AtomicU32, AtomicU8, Ordering};

use ft_transfer_area::transfer_area::*;

#[macro_use]
#[path = "../../../src/transfer_area/structs.rs"]
mod structs;

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

/// Makes the values of all terminals of one kind a [`Cell`], as the array of the same layout.
macro_rules! per_terminal_cells {
    ($($name:ident: $count:ident),+) => {$(
        impl<T: Cell> Cell for $name<T> {
            unsafe fn load(at: *mut Self) -> Self {
                // SAFETY: as the caller promises; the layout is that of the array.
                unsafe { <[T; $count]>::load(at.cast()) }.into()
            }

            unsafe fn store(at: *mut Self, value: Self) {
                // SAFETY: as the caller promises; the layout is that of the array.
                unsafe { <[T; $count]>::store(at.cast(), value.into()) };
            }
        }
    )+};
}

per_terminal_cells!(
    PerInput: IZ_UNI_INPUT,
    PerCounter: IZ_COUNTER,
    PerMotor: IZ_MOTOR,
    PerOutput: IZ_PWM_CHAN
);

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

transfer_area_structs!(struct_cells);
