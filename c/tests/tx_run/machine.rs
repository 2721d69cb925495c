//! What a program does with the machine.

use std::fs;

use super::support::{has_compiler, own_port, program, run_on, tx_run, txt, wait_for, Run};

#[test]
fn a_motor_turns_until_an_input_is_pressed() {
    if !has_compiler() {
        return;
    }
    let txt = txt().start().unwrap();
    let run = run_on(&txt, "motor.c", "");
    wait_for(&txt, "the motor turns", |machine| machine.controllers[0].outputs.duty[0] == 400);
    txt.with_machine(|machine| machine.controllers[0].uni[0] = 1);
    let ended = run.end();
    ended.well();
    assert!(
        ended.err.contains("PrgTic has returned 0") && ended.err.contains("tics in"),
        "{}",
        ended.err
    );
    txt.with_machine(|machine| {
        assert_eq!(machine.controllers[0].outputs.duty, [0; 8]);
        assert!(!machine.online());
    });
}

#[test]
fn a_configuration_reaches_the_controller() {
    if !has_compiler() {
        return;
    }
    let txt = txt().start().unwrap();
    let run = run_on(&txt, "config.c", "");
    wait_for(&txt, "the configuration", |machine| {
        let config = &machine.controllers[0].config;
        config.motor == [1, 1, 0, 1]
            && config.uni[1].mode == 0
            && config.uni[1].digital == 0
            && config.cnt[2].mode == 0
    });
    txt.with_machine(|machine| machine.controllers[0].uni[1] = 4711);
    run.end().well();
}

#[test]
fn a_counter_is_reset_and_the_flag_says_when() {
    if !has_compiler() {
        return;
    }
    let txt = txt().start().unwrap();
    txt.with_machine(|machine| machine.controllers[0].counter = [7, 8, 9, 10]);
    run_on(&txt, "counter.c", "").end().well();
    txt.with_machine(|machine| assert_eq!(machine.controllers[0].counter, [7, 0, 9, 10]));
}

#[test]
fn two_motors_do_their_distance_and_the_flags_say_when() {
    if !has_compiler() {
        return;
    }
    let txt = txt().start().unwrap();
    let ended = run_on(&txt, "distance.c", "").end();
    ended.well();
    let counters = txt.with_machine(|machine| machine.controllers[0].counter);
    assert_eq!(counters[..2], [100, 100], "each command begins at 0");
}

#[test]
fn a_command_without_a_distance_does_not_set_the_flag() {
    if !has_compiler() {
        return;
    }
    let txt = txt().start().unwrap();
    run_on(&txt, "no_distance.c", "").end().well();
}

#[test]
fn the_variable_chooses_the_simple_exchange() {
    if !has_compiler() {
        return;
    }
    let txt = txt().extensions(1).port(own_port()).start().unwrap();
    let mut command = tx_run(&["--host", &txt.address().to_string()]);
    let run = Run::start(command.arg(program("extension.c")).env("FT_TXT_MODE", "simple"));
    wait_for(&txt, "the master's lamp", |machine| machine.controllers[0].outputs.duty[7] == 512);
    let before = txt.with_machine(|machine| machine.exchanges());
    wait_for(&txt, "more exchanges", |machine| machine.exchanges() > before + 20);
    txt.with_machine(|machine| assert_eq!(machine.controllers[1].outputs.duty[0], 0));
    drop(txt);
    run.end().badly("the exchange has ended: ");
}

#[test]
fn the_simulated_txt_says_what_it_sees() {
    if !has_compiler() {
        return;
    }
    let run = |log: Option<&str>| {
        let mut command = tx_run(&["--world", "none"]);
        command.arg(program("distance.c")).env_remove("RUST_LOG");
        Run::start(command.envs(log.map(|log| ("RUST_LOG", log)))).end()
    };
    let ended = run(Some("info"));
    ended.well();
    assert!(ended.err.contains("connects to the main port"), "{}", ended.err);
    let ended = run(None);
    ended.well();
    assert!(!ended.err.contains("connects to the main port"), "{}", ended.err);
}

#[test]
fn an_extension_comes_and_goes() {
    if !has_compiler() {
        return;
    }
    let txt = txt().extensions(1).start().unwrap();
    txt.with_machine(|machine| machine.alive[0] = false);
    let run = run_on(&txt, "extension.c", "");
    wait_for(&txt, "the master's lamp", |machine| machine.controllers[0].outputs.duty[7] == 512);
    txt.with_machine(|machine| machine.alive[0] = true);
    wait_for(&txt, "the extension's motor", |machine| {
        machine.controllers[1].outputs.duty[0] == 300
    });
    txt.with_machine(|machine| machine.alive[0] = false);
    run.end().well();
}

#[test]
fn a_program_for_ftmsclibex_is_called_when_an_input_changes() {
    if !has_compiler() {
        return;
    }
    let txt = txt().start().unwrap();
    let run = run_on(&txt, "changes.cpp", "");
    wait_for(&txt, "the configuration", |machine| {
        let config = machine.controllers[0].config.uni[2];
        (config.mode, config.digital) == (0, 1)
    });
    txt.with_machine(|machine| machine.controllers[0].uni[2] = 1);
    wait_for(&txt, "the motor turns", |machine| machine.controllers[0].outputs.duty[0] == 512);
    txt.with_machine(|machine| machine.controllers[0].uni[2] = 0);
    run.end().well();
}

#[cfg_attr(windows, ignore = "windows.h of Windows declares these functions")]
#[test]
fn a_programs_functions_may_have_names_of_the_c_librarys() {
    if !has_compiler() {
        return;
    }
    for (source, out) in [("names.c", "2 further calls"), ("names.cpp", "")] {
        let txt = txt().start().unwrap();
        let ports = format!("COM4={}", txt.address());
        let run = Run::start(tx_run(&[]).arg(program(source)).env("FT_TXT_PORTS", &ports));
        wait_for(&txt, "the motor turns", |machine| machine.controllers[0].outputs.duty[0] == 300);
        txt.with_machine(|machine| machine.controllers[0].uni[0] = 1);
        let ended = run.end();
        ended.well();
        assert_eq!(ended.out.trim_end(), out, "{source}");
    }
}

#[test]
fn only_the_named_controller_is_driven_whatever_com_ports_are_named_elsewhere() {
    if !has_compiler() {
        return;
    }
    let (named, other) = (txt().start().unwrap(), txt().start().unwrap());
    let ports = format!("COM4={}", other.address());
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("ft_txt_ports"), &ports).unwrap();
    let mut command = tx_run(&["--host", &named.address().to_string()]);
    command.arg(program("pc.c")).current_dir(folder.path()).env("FT_TXT_PORTS", &ports);
    let run = Run::start(&mut command);
    wait_for(&named, "the motor turns", |machine| machine.controllers[0].outputs.duty[0] == 300);
    named.with_machine(|machine| machine.controllers[0].uni[0] = 1);
    let ended = run.end();
    assert_eq!(ended.status, Some(3), "{}", ended.err);
    assert!(!ended.err.contains(&other.address().to_string()), "{}", ended.err);
    other.with_machine(|machine| assert_eq!(machine.commands().count(), 0));
}

#[test]
fn com_ports_of_the_variable_count_without_a_named_controller_and_are_said() {
    if !has_compiler() {
        return;
    }
    let txt = txt().start().unwrap();
    let ports = format!("COM4={} # the gate", txt.address());
    let run = Run::start(tx_run(&[]).arg(program("pc.c")).env("FT_TXT_PORTS", &ports));
    wait_for(&txt, "the motor turns", |machine| machine.controllers[0].outputs.duty[0] == 300);
    txt.with_machine(|machine| machine.controllers[0].uni[0] = 1);
    let ended = run.end();
    assert_eq!(ended.status, Some(3), "{}", ended.err);
    assert!(ended.err.contains(&format!("FT_TXT_PORTS names {ports}\n")), "{}", ended.err);
}

/// Opens the controllers that its arguments name, and begins a transfer with each.
const OPENS: &str = r#"
#include <stdio.h>
#include <windows.h>
#include "ftMscLib.h"
int main(int n, char **names)
{
    int i, opened = 0;
    ftxInitLib();
    for (i = 1; i < n; i++) {
        DWORD error = 0;
        HANDLE device = ftxOpenComDevice(names[i], 38400, &error);
        opened += device != NULL && ftxStartTransferArea(device) == 0;
    }
    printf("%d opened\n", opened);
    ftxCloseLib();
    return 0;
}
"#;

#[test]
fn a_host_in_a_program_is_the_controller_that_was_named_or_one_of_the_variable() {
    if !has_compiler() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("opens.c"), OPENS).unwrap();
    let txts = [(); 3].map(|()| txt().start().unwrap());
    let [chosen, one, two] = [0, 1, 2].map(|index| txts[index].address().to_string());
    let run = |options: &[&str], hosts: &[&String], ports: &str| {
        let mut command = tx_run(&["opens.c"]);
        command.args(options).arg("--").args(hosts).env("FT_TXT_PORTS", ports);
        Run::start(command.current_dir(folder.path())).end()
    };
    let commands =
        || txts.each_ref().map(|txt| txt.with_machine(|it| it.commands().next().is_some()));
    let to_chosen = ["--host", &*chosen];
    for options in [&[][..], &to_chosen] {
        let ended = run(options, &[&one], "");
        ended.well();
        assert_eq!(ended.out, "1 opened\n", "{}", ended.err);
    }
    assert_eq!(commands(), [true, false, false]);
    // Not both as one.
    let ended = run(&to_chosen, &[&one, &two], "");
    assert_eq!(ended.out, "1 opened\n", "{}", ended.err);
    let named = format!("FT_TXT_PORTS=\"COM4={one}, COM5={two}\"");
    assert!(ended.err.contains(&named), "{}", ended.err);
    assert_eq!(commands(), [true, false, false]);
    let ended = run(&[], &[&one, &two], &format!("COM4={one}, COM5={two}"));
    assert_eq!(ended.out, "2 opened\n", "{}", ended.err);
    assert_eq!(commands(), [true; 3]);
}

#[cfg(unix)]
#[test]
fn com_ports_of_the_variable_count_also_with_a_comment_that_is_not_utf_8() {
    use std::os::unix::ffi::OsStringExt;
    if !has_compiler() {
        return;
    }
    let txt = txt().start().unwrap();
    let ports = [format!("COM4={} # F", txt.address()).as_bytes(), b"\xf6rderband"].concat();
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("opens.c"), OPENS).unwrap();
    let mut command = tx_run(&["opens.c", "--", "COM4"]);
    command.env("FT_TXT_PORTS", std::ffi::OsString::from_vec(ports));
    let ended = Run::start(command.current_dir(folder.path())).end();
    assert_eq!(ended.out, "1 opened\n", "{}", ended.err);
    assert!(txt.with_machine(|machine| machine.commands().next().is_some()));
}
