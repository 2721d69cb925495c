//! The layout of the controller's memory, checked when the crate is compiled.
//!
//! Each line is a field with its offset and size in bytes. `[0]` is the first element of an array;
//! the element's type and field follow.

use std::mem::{offset_of, size_of};

use super::*;

/// The size of the field that `_field` returns.
#[allow(dead_code, reason = "Rust 1.85 does not see that the constant below uses it")]
const fn size_of_field<T, F>(_field: fn(&T) -> &F) -> usize {
    size_of::<F>()
}

macro_rules! layout {
    ($($($path:ident).+ $([0] $element:ident.$field:ident)?: $offset:literal, $size:literal;)*) => {
        $(
            let offset = offset_of!(FishX1Transfer, $($path).+)
                $(+ offset_of!($element, $field))?;
            let size = layout!(@size $($path).+ $(, $element.$field)?);
            assert!(offset == $offset, concat!("offset of ", stringify!($($path).+ $($field)?)));
            assert!(size == $size, concat!("size of ", stringify!($($path).+ $($field)?)));
        )*
    };
    (@size $($path:ident).+) => {
        size_of_field(|area: &FishX1Transfer| &area.$($path).+)
    };
    (@size $($path:ident).+, $element:ident.$field:ident) => {
        size_of_field(|element: &$element| &element.$field)
    };
}

const _: () = assert!(size_of::<FishX1Transfer>() == 1024);

/// Passes all fields to another macro.
macro_rules! with_fields {
    ($use_them:ident) => {
        $use_them! {
            info: 0, 64;
            info.hostname: 0, 17;
            info.btaddr: 17, 18;
            info.dummy: 35, 1;
            info.shared_memory_start: 36, 4;
            info.app_area_start: 40, 4;
            info.app_area_size: 44, 4;
            info.version: 48, 16;
            info.version.hardware: 48, 4;
            info.version.firmware: 52, 4;
            info.version.shm_if: 56, 4;
            info.version.fish_x1: 60, 4;
            state: 64, 100;
            state.init: 64, 1;
            state.config: 65, 1;
            state.dummy: 66, 2;
            state.trace: 68, 4;
            state.io_mode: 72, 1;
            state.id: 73, 1;
            state.info_id: 74, 1;
            state.config_id: 75, 1;
            state.io_slave_alive: 76, 8;
            state.btstatus: 84, 64;
            state.btstatus [0] BtStatus.conn_state: 84, 2;
            state.btstatus [0] BtStatus.is_listen: 86, 2;
            state.btstatus [0] BtStatus.is_receive: 88, 2;
            state.btstatus [0] BtStatus.link_quality: 90, 2;
            state.master_pgm: 148, 8;
            state.master_pgm.name: 148, 4;
            state.master_pgm.state: 152, 1;
            state.local_pgm: 156, 8;
            config: 164, 88;
            config.pgm_state_req: 164, 1;
            config.old_ft_transfer: 165, 1;
            config.dummy: 166, 2;
            config.motor: 168, 4;
            config.uni: 172, 32;
            config.uni [0] UniConfig.mode: 172, 1;
            config.uni [0] UniConfig.digital: 173, 1;
            config.cnt: 204, 16;
            config.cnt [0] CounterConfig.mode: 204, 1;
            config.motor_config: 220, 32;
            input: 252, 68;
            input.uni: 252, 16;
            input.cnt_in: 268, 8;
            input.counter: 276, 8;
            input.display_button_left: 284, 2;
            input.display_button_right: 286, 2;
            input.cnt_resetted: 288, 8;
            input.motor_ex_reached: 296, 8;
            input.cnt_reset_cmd_id: 304, 8;
            input.motor_ex_cmd_id: 312, 8;
            output: 320, 44;
            output.cnt_reset_cmd_id: 320, 8;
            output.master: 328, 4;
            output.duty: 332, 16;
            output.distance: 348, 8;
            output.motor_ex_cmd_id: 356, 8;
            display: 364, 108;
            display.display_msg.id: 364, 1;
            display.display_msg.text: 365, 99;
            display.display_frame.frame: 464, 4;
            display.display_frame.id: 468, 2;
            display.display_frame.is_pgm_master_of_display: 470, 2;
            status: 472, 4;
            status.status: 472, 1;
            status.iostatus: 473, 1;
            status.com_err: 474, 2;
            change: 476, 8;
            change.upd_interface: 476, 2;
            change.change_status: 478, 1;
            change.change_uni: 479, 1;
            change.change_cnt_in: 480, 1;
            change.change_counter: 481, 1;
            change.change_timer: 482, 1;
            change.reserved: 483, 1;
            timer: 484, 12;
            timer.timer_1ms: 484, 2;
            timer.timer_10ms: 486, 2;
            timer.timer_100ms: 488, 2;
            timer.timer_1s: 490, 2;
            timer.timer_10s: 492, 2;
            timer.timer_1min: 494, 2;
            motor: 496, 24;
            motor.duty: 496, 16;
            motor.debug: 512, 8;
            input_sim: 520, 4;
            input_sim.sim_buttons: 520, 4;
            hook_table: 524, 140;
            txt_inputs: 664, 188;
            txt_inputs.txt_power: 664, 2;
            txt_inputs.txt_temp: 666, 2;
            txt_inputs.txt_ref: 668, 2;
            txt_inputs.txt_vb: 670, 2;
            txt_inputs.ir_input: 672, 160;
            txt_inputs.ir_input [0] IrInput.joy_left_x: 672, 2;
            txt_inputs.ir_input [0] IrInput.joy_left_x_to_left: 674, 2;
            txt_inputs.ir_input [0] IrInput.joy_left_x_to_right: 676, 2;
            txt_inputs.ir_input [0] IrInput.joy_left_y: 678, 2;
            txt_inputs.ir_input [0] IrInput.joy_left_y_to_forward: 680, 2;
            txt_inputs.ir_input [0] IrInput.joy_left_y_to_backwards: 682, 2;
            txt_inputs.ir_input [0] IrInput.joy_right_x: 684, 2;
            txt_inputs.ir_input [0] IrInput.joy_right_x_to_left: 686, 2;
            txt_inputs.ir_input [0] IrInput.joy_right_x_to_right: 688, 2;
            txt_inputs.ir_input [0] IrInput.joy_right_y: 690, 2;
            txt_inputs.ir_input [0] IrInput.joy_right_y_to_forward: 692, 2;
            txt_inputs.ir_input [0] IrInput.joy_right_y_to_backwards: 694, 2;
            txt_inputs.ir_input [0] IrInput.button_on: 696, 2;
            txt_inputs.ir_input [0] IrInput.button_off: 698, 2;
            txt_inputs.ir_input [0] IrInput.dip_switch_1: 700, 2;
            txt_inputs.ir_input [0] IrInput.dip_switch_2: 702, 2;
            txt_inputs.sound_cmd_id: 832, 2;
            txt_inputs.sec: 834, 2;
            txt_inputs.min: 836, 2;
            txt_inputs.hour24: 838, 2;
            txt_inputs.hour12: 840, 2;
            txt_inputs.pm_flag: 842, 2;
            txt_inputs.m_day: 844, 2;
            txt_inputs.month: 846, 2;
            txt_inputs.year: 848, 2;
            txt_inputs.w_day: 850, 2;
            txt_outputs: 852, 10;
            txt_outputs.sound_cmd_id: 852, 2;
            txt_outputs.sound_index: 854, 2;
            txt_outputs.sound_repeat: 856, 2;
            txt_outputs.led_color_r: 858, 1;
            txt_outputs.led_color_g: 859, 1;
            txt_outputs.led_color_b: 860, 1;
            txt_inputs2: 862, 4;
            txt_inputs2.mic_lin: 862, 2;
            txt_inputs2.mic_log: 864, 2;
            reserved: 866, 158;
        }
    };
}

#[cfg(test)]
pub(super) use with_fields;

const _: () = {
    with_fields!(layout);
};
