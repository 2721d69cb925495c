//! The fields of the area's structs. Their layout is checked when the crate is compiled.

use std::mem::{offset_of, size_of};

use super::*;

/// Passes all structs of the area to another macro, each with its fields in their order: the only list of
/// them.
#[cfg_attr(feature = "__structs", doc(hidden), macro_export)]
macro_rules! __transfer_area_structs {
    ($use_them:ident) => {
        $use_them! {
            FishX1Transfer {
                info state config input output display status change timer motor input_sim hook_table
                txt_inputs txt_outputs txt_inputs2 reserved
            }
            Info {
                hostname btaddr dummy shared_memory_start app_area_start app_area_size version
            }
            Versions { hardware firmware shm_if fish_x1 }
            State {
                init config dummy trace io_mode id info_id config_id io_slave_alive btstatus master_pgm
                local_pgm
            }
            BtStatus { conn_state is_listen is_receive link_quality }
            ProgramInfo { name state dummy }
            Config { pgm_state_req old_ft_transfer dummy motor uni cnt motor_config }
            UniConfig { mode digital dummy }
            CounterConfig { mode dummy }
            InputValues {
                uni cnt_in counter display_button_left display_button_right cnt_resetted motor_ex_reached
                cnt_reset_cmd_id motor_ex_cmd_id
            }
            OutputValues { cnt_reset_cmd_id master duty distance motor_ex_cmd_id }
            Display { display_msg display_frame }
            DisplayMessage { id text }
            DisplayFrame { frame id is_pgm_master_of_display }
            Status { status iostatus com_err }
            Change {
                upd_interface change_status change_uni change_cnt_in change_counter change_timer reserved
            }
            Timer { timer_1ms timer_10ms timer_100ms timer_1s timer_10s timer_1min }
            MotorValues { duty debug }
            InputSim { sim_buttons }
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
        }
    };
}

pub(super) use __transfer_area_structs;

/// The size of the field that `_field` returns.
#[allow(dead_code, reason = "Rust 1.85 does not see that the constant below uses it")]
pub(super) const fn size_of_field<T, F>(_field: fn(&T) -> &F) -> usize {
    size_of::<F>()
}

/// Checks that each field begins where the one before it ends, so that the compiler has left no gaps, and
/// neither the list nor a struct has a field that the other has not. Where each field is follows from the
/// types; the tests compare this with what a C compiler makes of the controller's header.
macro_rules! without_gaps {
    ($($name:ident { $($field:ident)+ })+) => {$(
        let end = 0;
        $(
            assert!(offset_of!($name, $field) == end, stringify!($name.$field));
            let end = end + size_of_field(|part: &$name| &part.$field);
        )+
        assert!(size_of::<$name>() == end, concat!("end of ", stringify!($name)));
    )+};
}

const _: () = {
    assert!(size_of::<FishX1Transfer>() == FishX1Transfer::LEN);
    __transfer_area_structs!(without_gaps);
};
