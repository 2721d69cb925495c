//! The area's structs and their fields: the only list of them. The C package and the tests read this file, too, so that
//! the macro is no part of the library's interface.

/// Passes all structs of the area to another macro, each with its fields in their order.
macro_rules! transfer_area_structs {
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
