//! Where fields lie: with 32-bit pointers as on the TX, with this machine's pointers as the library has them.

use std::fmt::Write;
use std::mem::{offset_of, size_of};

use super::compilers;
use super::tables::{lines, STRUCTURES};
use super::values::claim;

/// The library's own type; nothing outside of the library is to see it, so it is compiled here once more.
#[path = "../../src/memory/ta.rs"]
#[allow(dead_code, reason = "only its layout is used")]
mod ta;

use ta::{DisplayFrame, HookTable, PgmInfo, Ta, TaDisplay, TaState};

#[test]
fn with_32_bit_pointers_fields_lie_as_on_the_tx() {
    let mut text = "#include <stddef.h>\n#include \"ROBO_TX_FW.h\"\n".to_owned();
    for [structure, field, offset, size] in lines::<4>(STRUCTURES) {
        // The beginning of a program's code, the only structure of the other header.
        if structure.starts_with("struct ") {
            continue;
        }
        let name = format!("of_{structure}_{field}");
        if field.is_empty() {
            text += &claim(&name, &format!("sizeof({structure}) == {size}"));
        } else {
            text += &claim(&name, &format!("offsetof({structure}, {field}) == {offset}"));
            let its_size = format!("sizeof((({structure} *) 0)->{field}) == {size}");
            text += &claim(&format!("size_{name}"), &its_size);
        }
    }
    let mut checked = false;
    for compiler in compilers::for_c() {
        // The header needs nothing from the system, so a compiler without 32-bit libraries suffices.
        if compiler.check("c89", &["-m32"], "int number;\n").is_err() {
            eprintln!("not checked with {}, which does not know -m32", compiler.program);
            continue;
        }
        compiler.check("c89", &["-m32"], &text).unwrap_or_else(|said| panic!("{said}"));
        checked = true;
    }
    if !checked {
        eprintln!("not checked: no compiler for 32 bits is here");
    }
}

/// Claims that a path of fields in C lies where one in Rust does.
macro_rules! claims {
    ($text:ident, $c:literal, $rust:ty: $($c_path:literal => $($rust_path:ident).+;)+) => {
        writeln!($text, "/* {} */", $c).unwrap();
        let size = format!("sizeof({}) == {}", $c, size_of::<$rust>());
        $text += &claim(&format!("size_of_{}", $c), &size);
        $(
            let place = offset_of!($rust, $($rust_path).+);
            let name = format!("of_{}_{}", $c, $c_path).replace(['.', '[', ']'], "_");
            $text += &claim(&name, &format!("offsetof({}, {}) == {place}", $c, $c_path));
        )+
    };
}

#[test]
fn with_pointers_of_this_machine_fields_lie_as_in_the_library() {
    let mut text = "#include <stddef.h>\n#include \"ROBO_TX_FW.h\"\n".to_owned();
    claims!(text, "TA", Ta:
        "info" => info;
        "info.device_name" => info.hostname;
        "info.bt_addr" => info.btaddr;
        "info.ta_array_start_addr" => info.shared_memory_start;
        "info.pgm_area_start_addr" => info.app_area_start;
        "info.pgm_area_size" => info.app_area_size;
        "info.version.hardware" => info.version.hardware;
        "info.version.firmware" => info.version.firmware;
        "info.version.ta" => info.version.shm_if;
        "info.version.reserved" => info.version.fish_x1;
        "state" => state;
        "config" => config;
        "config.pgm_state_req" => config.pgm_state_req;
        "config.motor" => config.motor;
        "config.uni" => config.uni;
        "config.cnt" => config.cnt;
        "config.reserved_2" => config.motor_config;
        "input" => input;
        "input.uni" => input.uni;
        "input.cnt_in" => input.cnt_in;
        "input.counter" => input.counter;
        "input.display_button_left" => input.display_button_left;
        "input.display_button_right" => input.display_button_right;
        "input.cnt_resetted" => input.cnt_resetted;
        "input.motor_pos_reached" => input.motor_ex_reached;
        "input.reserved" => input.cnt_reset_cmd_id;
        "output" => output;
        "output.cnt_reset_cmd_id" => output.cnt_reset_cmd_id;
        "output.master" => output.master;
        "output.duty" => output.duty;
        "output.distance" => output.distance;
        "output.motor_ex_cmd_id" => output.motor_ex_cmd_id;
        "display" => display;
        "display.display_msg.id" => display.display_msg.id;
        "display.display_msg.text" => display.display_msg.text;
        "status" => status;
        "status.status" => status.status;
        "status.iostatus" => status.iostatus;
        "status.ComErr" => status.com_err;
        "change" => change;
        "change.ChangeStatus" => change.change_status;
        "change.ChangeUni" => change.change_uni;
        "change.ChangeCntIn" => change.change_cnt_in;
        "change.ChangeCounter" => change.change_counter;
        "timer" => timer;
        "timer.Timer1ms" => timer.timer_1ms;
        "timer.Timer10ms" => timer.timer_10ms;
        "timer.Timer100ms" => timer.timer_100ms;
        "timer.Timer1s" => timer.timer_1s;
        "timer.Timer10s" => timer.timer_10s;
        "timer.Timer1min" => timer.timer_1min;
        "reserved_1" => reserved_1;
        "hook_table" => hook_table;
        "reserved_2" => txt_inputs;
    );
    claims!(text, "TA_STATE", TaState:
        "pgm_initialized" => pgm_initialized;
        "reserved_1" => reserved_1;
        "dev_mode" => dev_mode;
        "id" => id;
        "info_id" => info_id;
        "config_id" => config_id;
        "ext_dev_connect_state" => ext_dev_connect_state;
        "btstatus" => btstatus;
        "reserved_2" => reserved_2;
        "local_pgm" => local_pgm;
    );
    claims!(text, "PGM_INFO", PgmInfo: "name" => name; "state" => state; "reserved" => reserved;);
    claims!(text, "TA_DISPLAY", TaDisplay:
        "display_msg" => display_msg;
        "display_frame" => display_frame;
    );
    claims!(text, "DISPLAY_FRAME", DisplayFrame:
        "frame" => frame;
        "id" => id;
        "is_pgm_master_of_display" => is_pgm_master_of_display;
    );
    text += &claim("of_hooks", &format!("sizeof(TA_HOOK_TABLE) == {}", size_of::<HookTable>()));
    for compiler in compilers::for_c() {
        compiler.check_all(&text);
    }
}
