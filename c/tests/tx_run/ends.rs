//! How programs end, and what they leave behind. What needs signals is in `signals`.

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

use ft_transfer_area::wire::CommandId;
use ft_transfer_area_simulator::{Fault, FaultKind, SimulatedTxt, SimulatedTxtBuilder};

use super::support::{has_compiler, own_port, run_on, tx_run, txt, wait_for, Ended, Run};

/// How a wrong pointer is named.
pub(super) const WRONG_POINTER: &str =
    if cfg!(windows) { "an access violation" } else { "SIGSEGV" };

/// Runs a program that turns a motor until I1 is pressed, and then does what `kind` says.
pub(super) fn with_a_motor(kind: &str, then: impl FnOnce(&SimulatedTxt, &Run)) -> Ended {
    let txt = txt().start().unwrap();
    let run = run_on(&txt, "ends.c", &format!("-w -D{kind}"));
    goes_on_with_a_motor(&txt, run, then)
}

#[track_caller]
pub(super) fn goes_on_with_a_motor(
    txt: &SimulatedTxt,
    run: Run,
    then: impl FnOnce(&SimulatedTxt, &Run),
) -> Ended {
    wait_for(txt, "the motor turns", |machine| machine.controllers[0].outputs.duty[0] == 512);
    then(txt, &run);
    wait_for(txt, "the motor is off", |machine| machine.controllers[0].outputs.duty == [0; 8]);
    wait_for(txt, "the connection is closed", |machine| !machine.connected());
    run.end()
}

pub(super) fn press(txt: &SimulatedTxt, _: &Run) {
    txt.with_machine(|machine| machine.controllers[0].uni[0] = 1);
}

#[track_caller]
fn ends(kind: &str, sentence: &str) {
    if !has_compiler() {
        return;
    }
    let ended = with_a_motor(kind, press);
    ended.badly(sentence);
    assert_eq!(ended.status, Some(1), "{ended:?}");
    assert!(ended.err.contains("all outputs are off"), "{}", ended.err);
}

#[test]
fn an_error_code_is_printed() {
    ends("CODE=42", "PrgTic has returned the error 42");
    ends("CODE=-1", "PrgTic has returned the error -1");
}

#[test]
fn a_wrong_pointer_is_named() {
    ends("POINTER", &format!("crashed in PrgTic with {WRONG_POINTER}"));
}

#[test]
fn a_division_by_zero_is_named() {
    // Some processors know no such error.
    if cfg!(target_arch = "x86_64") {
        let signal = if cfg!(windows) { "" } else { "SIGFPE: " };
        ends("DIVISION", &format!("crashed in PrgTic with {signal}a division by zero"));
    }
}

#[test]
fn abort_is_named() {
    if cfg!(windows) && has_compiler() {
        // It belongs to a C library of the program's own.
        let ended = with_a_motor("ABORT", press);
        ended.badly("ended with the exit status 3");
        ended.badly("tx_run has sent it: all outputs are off");
    } else if cfg!(unix) {
        ends("ABORT", "crashed in PrgTic with SIGABRT: abort");
    }
}

#[cfg(unix)]
#[test]
fn what_only_a_debugger_or_a_container_knows_is_named() {
    ends("TRAP=SIGTRAP", "crashed in PrgTic with SIGTRAP");
    ends("TRAP=SIGSYS", "crashed in PrgTic with SIGSYS");
}

#[test]
fn exit_is_named() {
    ends("EXIT", "exit was called in PrgTic");
    if cfg!(all(unix, target_env = "gnu")) {
        ends("LEAVE=quick_exit(0)", "exit was called in PrgTic");
    }
}

#[test]
fn the_last_exchange_waits_for_an_answer_that_is_late() {
    if !has_compiler() {
        return;
    }
    let late =
        |response| Fault::at_response(response, FaultKind::Delay(Duration::from_millis(700)));
    let txt = (20..40).map(late).fold(txt(), SimulatedTxtBuilder::fault).start().unwrap();
    let run = run_on(&txt, "ends.c", "-w -DEXIT");
    let ended = goes_on_with_a_motor(&txt, run, press);
    ended.badly("exit was called in PrgTic");
    assert!(ended.err.contains("all outputs are off"), "{}", ended.err);
    assert!(!ended.err.contains("last exchange"), "{}", ended.err);
}

#[test]
fn an_end_past_the_runtime_is_followed_by_an_exchange_that_stops_everything() {
    if !has_compiler() {
        return;
    }
    for (call, status) in [("_Exit(4)", 4), ("_exit(0)", 0), ("_exit(1)", 1)] {
        let ended = with_a_motor(&format!("LEAVE={call}"), press);
        assert_eq!(ended.status, Some(status), "{ended:?}");
        assert!(ended.err.contains("tx_run has sent it: all outputs are off"), "{ended:?}");
    }
}

#[test]
fn a_full_stack_is_named() {
    // Under Wine it is the time that shows it.
    let sentence = if cfg!(windows) { "PrgTic" } else { "crashed in PrgTic with SIG" };
    ends("STACK", sentence);
}

#[test]
fn a_tic_that_never_returns_is_ended() {
    ends("HANG", "PrgTic has not returned for half a second");
}

#[test]
fn a_crash_in_a_callback_is_named() {
    ends("CALLBACK", &format!("crashed in a callback with {WRONG_POINTER}"));
}

#[test]
fn a_crash_while_memory_is_locked_ends_the_program() {
    if !has_compiler() {
        return;
    }
    let name = if cfg!(windows) { "an access violation" } else { "SIG" };
    // Whether the last exchange still comes about depends on the C library.
    with_a_motor("HEAP", press).badly(&format!("crashed in PrgTic with {name}"));
}

/// The last command is the one of a client that has ended well.
pub(super) fn wait_stopped(txt: &SimulatedTxt) {
    wait_for(txt, "StopOnline", |machine| {
        machine.commands().last() == Some(CommandId::StopOnline) && !machine.connected()
    });
}

#[test]
fn a_controller_that_goes_away_ends_the_program() {
    if !has_compiler() {
        return;
    }
    let txt = txt().port(own_port()).start().unwrap();
    let run = run_on(&txt, "ends.c", "-w -DCODE=0");
    wait_for(&txt, "the motor turns", |machine| machine.controllers[0].outputs.duty[0] == 512);
    drop(txt);
    run.end().badly("the exchange has ended: ");
}

#[test]
fn a_program_with_main_ends_its_transfer_when_it_returns() {
    if !has_compiler() {
        return;
    }
    let txt = txt().start().unwrap();
    let run = run_on(&txt, "pc.c", "");
    wait_for(&txt, "the motor turns", |machine| machine.controllers[0].outputs.duty[0] == 300);
    press(&txt, &run);
    let ended = run.end();
    assert_eq!(ended.status, Some(3));
    assert!(!ended.err.contains("last exchange"), "{}", ended.err);
    wait_stopped(&txt);
}

/// A program with this text, which needs no controller.
fn run_text(folder: &Path, text: &str, set_up: impl FnOnce(&mut Command)) -> Ended {
    let path = folder.join("alone.c");
    fs::write(&path, text).unwrap();
    let mut command = tx_run(&[path.to_str().unwrap()]);
    set_up(&mut command);
    Run::start(&mut command).end()
}

#[test]
fn nothing_is_said_of_outputs_that_no_transfer_has_switched() {
    if !has_compiler() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let text = "#include <stdlib.h>\nint main(void) { abort(); }\n";
    let ended = run_text(folder.path(), text, |_| {});
    ended.badly(match cfg!(windows) {
        true => "alone has ended with the exit status 3",
        false => "alone was ended by SIGABRT (abort)",
    });
    assert!(!ended.err.contains("outputs"), "{}", ended.err);
}

/// `exit` waits for them.
#[cfg_attr(windows, ignore = "Windows has no pthread.h")]
#[test]
fn the_motors_stop_when_a_thread_calls_exit_while_another_one_reads() {
    if !has_compiler() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let source = folder.path().join("exits.c");
    let text = r#"
        #include <pthread.h>
        #include <stdio.h>
        #include <stdlib.h>
        #include <unistd.h>
        #include "ROBO_TX_PRG.h"
        static volatile int turns;
        static void *reads(void *unused) { getchar(); return unused; }
        static void *exits(void *unused) { while (!turns) usleep(1000); exit(3); return unused; }
        void PrgInit(TA *areas, int count) {
            pthread_t thread;
            pthread_create(&thread, NULL, reads, NULL);
            usleep(100000);
            pthread_create(&thread, NULL, exits, NULL);
        }
        int PrgTic(TA *areas, int count) {
            areas[TA_LOCAL].output.duty[0] = 512;
            turns = areas[TA_LOCAL].input.uni[0];
            return 0x7FFF;
        }
    "#;
    fs::write(&source, text).unwrap();
    let txt = txt().start().unwrap();
    let mut command = tx_run(&["--host", &txt.address().to_string()]);
    let mut child = command.arg(&source).stdin(Stdio::piped()).spawn().unwrap();
    wait_for(&txt, "the motor turns", |machine| machine.controllers[0].outputs.duty[0] == 512);
    txt.with_machine(|machine| machine.controllers[0].uni[0] = 1);
    // Its input stays open.
    wait_stopped(&txt);
    child.kill().unwrap();
    child.wait().unwrap();
}
