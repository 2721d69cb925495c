//! The terminal is as it was before, however a program ends; and a program ends with its terminal.

#[cfg(target_os = "linux")]
use std::process::Command;

#[cfg(target_os = "linux")]
use super::ends::wait_stopped;
#[cfg(target_os = "linux")]
use super::support::{cache, own_port};
use super::support::{has_compiler, program, tx_run, txt, wait_for};
use crate::terminal::AtTerminal;

/// A program that has changed the settings, and got the key `q`.
fn with_keys(flags: &str) -> AtTerminal {
    let mut command = tx_run(&["--world", "none"]);
    command.arg(program("keys.c")).env("CFLAGS", flags);
    let mut run = AtTerminal::start(&mut command);
    run.expect("no key");
    assert!(!run.has_lines(), "{flags}");
    run.press("q");
    run
}

#[test]
fn a_program_that_does_not_put_the_settings_of_the_terminal_back_leaves_them_as_they_were() {
    if !has_compiler() {
        return;
    }
    // One in the background would be suspended for what it does to the terminal.
    for (flags, status) in [("-DKILLED", 1), ("-DLEFT", 4), ("-DBEHIND", 5)] {
        let mut run = with_keys(flags);
        assert_eq!(run.end("").code(), Some(status), "{flags}");
        assert!(run.has_lines(), "{flags}");
    }
    let mut run = with_keys("");
    run.expect("goes on");
    // A second one ends it.
    assert_eq!(run.end("\x03").code(), Some(1));
    assert!(run.has_lines());
}

#[test]
fn a_question_for_keys_waits_for_no_thread_that_reads_the_terminal() {
    if !has_compiler() {
        return;
    }
    let mut command = tx_run(&["--world", "none"]);
    let mut run = AtTerminal::start(command.arg(program("keys_beside.c")));
    for round in 1..=10 {
        run.press("s");
        run.expect(&format!("tick {}.", 10 * round));
    }
    run.expect("All are counted");
    run.end("\x03");
}

/// As a window that is closed, or the connection of `ssh -t` that breaks: the system tells only the first process.
#[test]
fn a_closed_terminal_ends_the_program_that_it_was_opened_for() {
    if !has_compiler() {
        return;
    }
    let txt = txt().start().unwrap();
    for name in ["motor.c", "pc.c"] {
        let mut command = tx_run(&["--host", &txt.address().to_string()]);
        let mut run = AtTerminal::start(command.arg(program(name)));
        wait_for(&txt, "M1 turns", |machine| machine.controllers[0].outputs.duty[0] != 0);
        run.close();
        assert_eq!(run.end("").code(), Some(1), "{name}");
        wait_for(&txt, "M1 stands", |machine| {
            !machine.online() && machine.controllers[0].outputs.duty == [0; 8]
        });
    }
}

/// A terminal that suspends who writes from the background. `tx_run` has a motor to stop.
#[cfg(target_os = "linux")]
#[test]
fn a_line_of_tx_run_in_the_background_does_not_suspend_it() {
    if !has_compiler() {
        return;
    }
    let gone = txt().port(own_port()).start().unwrap();
    let address = gone.address();
    let mut command = Command::new("sh");
    let script = r#"set -m; stty tostop; "$@" & read line; kill -TERM $!; wait $!"#;
    command.args(["-c", script, "sh", env!("CARGO_BIN_EXE_tx_run")]);
    command.args(["--host", &address.to_string()]).arg(program("killed.c"));
    command.env("XDG_CACHE_HOME", cache()).env("CFLAGS", "-w -DGONE -DBECOMES");
    let mut run = AtTerminal::start(&mut command);
    wait_for(&gone, "the motor turns", |machine| machine.controllers[0].outputs.duty[0] == 300);
    drop(gone);
    run.expect("tx_run could send none");
    let again = txt().port(address.port()).start().unwrap();
    wait_stopped(&again);
    run.press("\n");
    run.end("");
}

/// As behind `ssh -t`, or in a window that was opened for one command: no shell waits that could continue it.
#[test]
fn ctrl_c_ends_what_ctrl_z_can_not_suspend() {
    if !has_compiler() {
        return;
    }
    let txt = txt().start().unwrap();
    let mut command = tx_run(&["--host", &txt.address().to_string()]);
    let mut run = AtTerminal::start(command.arg(program("pc.c")));
    wait_for(&txt, "M1 turns", |machine| machine.controllers[0].outputs.duty[0] != 0);
    run.press("\x1a");
    wait_for(&txt, "M1 stands", |machine| {
        !machine.online() && machine.controllers[0].outputs.duty == [0; 8]
    });
    run.press("\x03");
    assert_eq!(run.end("").code(), Some(1));
}
