//! How programs end that were started by hand, without `tx_run`.

#[cfg(target_os = "linux")]
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
#[cfg(target_os = "linux")]
use std::process::{Command, Stdio};
use std::sync::OnceLock;
use std::thread;
use std::time::{Duration, Instant};

use ft_transfer_area_simulator::SimulatedTxt;

use super::support::{
    command, compile, set_input, simulated, wait_duty, wait_stopped, wait_until, Running, DEADLINE,
};
use crate::terminal::AtTerminal;

/// The program at a terminal.
fn at_terminal(program: &Path, txt: &SimulatedTxt, how: &str) -> AtTerminal {
    AtTerminal::start(command(program, &txt.address().to_string()).arg(how))
}

fn program() -> Option<&'static PathBuf> {
    static PROGRAM: OnceLock<Option<PathBuf>> = OnceLock::new();
    let source = include_str!("programs/ends.cpp");
    PROGRAM.get_or_init(|| compile("", "c++11", source, "ends")).as_ref()
}

/// Starts the program with what it should do, and waits until its motor turns.
fn started(txt: &SimulatedTxt, how: &str) -> Option<Running> {
    let mut running = Running::with(program()?, txt, &[how]);
    running.expect("turns");
    wait_duty(txt, 0, 512);
    Some(running)
}

/// Polls for a condition that wakes no thread when it becomes true.
#[track_caller]
fn wait(what: &str, mut condition: impl FnMut() -> bool) {
    let begun = Instant::now();
    while !condition() {
        assert!(begun.elapsed() < DEADLINE, "never: {what}");
        thread::sleep(Duration::from_millis(5));
    }
}

#[test]
fn whatever_signal_ends_a_program_its_motors_stop_first() {
    let all = [libc::SIGQUIT, libc::SIGPIPE, libc::SIGALRM, libc::SIGUSR1, libc::SIGXCPU];
    #[cfg(target_os = "linux")]
    let all = all.into_iter().chain([libc::SIGIO, libc::SIGRTMIN(), libc::SIGRTMAX() - 1]);
    for signal in all {
        let txt = simulated().start().unwrap();
        let Some(running) = started(&txt, "return") else { return };
        running.signal(signal);
        let ended = running.end();
        assert_eq!((ended.code, ended.signal), (None, Some(signal)), "{}", ended.err);
        wait_stopped(&txt);
    }
}

/// The default action of a signal does not end the first process of a container.
#[cfg(target_os = "linux")]
#[test]
fn a_signal_ends_the_first_process_of_a_container_too() {
    let Some(program) = program() else { return };
    let apart = |program: &Path| [OsStr::new("-rpf"), program.as_os_str()].map(OsStr::to_owned);
    let is_possible = Command::new("unshare").args(apart(Path::new("true"))).status();
    if !is_possible.is_ok_and(|status| status.success()) {
        return eprintln!("SKIPPED: no process can be the first one of a name space here");
    }
    let txt = simulated().start().unwrap();
    let mut command = command(Path::new("unshare"), &txt.address().to_string());
    command.args(apart(program)).arg("return").stdout(Stdio::null());
    let mut outside = command.spawn().unwrap();
    wait_duty(&txt, 0, 512);
    let children = format!("/proc/{0}/task/{0}/children", outside.id());
    let first = std::fs::read_to_string(children).unwrap();
    // SAFETY: a call without pointers, for a process that `unshare` waits for.
    assert_eq!(unsafe { libc::kill(first.trim().parse().unwrap(), libc::SIGTERM) }, 0);
    wait_stopped(&txt);
    let begun = Instant::now();
    while outside.try_wait().unwrap().is_none() {
        if begun.elapsed() > DEADLINE {
            // SAFETY: as above.
            unsafe { libc::kill(first.trim().parse().unwrap(), libc::SIGKILL) };
        }
        thread::sleep(Duration::from_millis(5));
    }
    assert_eq!(outside.wait().unwrap().code(), Some(128 + libc::SIGTERM));
}

#[cfg(target_os = "linux")]
#[test]
fn a_program_without_memory_stops_its_motors() {
    let txt = simulated().start().unwrap();
    let Some(mut running) = started(&txt, "memory") else { return };
    set_input(&txt, 0, 1);
    running.expect("none left");
    running.signal(libc::SIGTERM);
    let ended = running.end();
    assert_eq!(ended.signal, Some(libc::SIGTERM), "{}", ended.err);
    wait_stopped(&txt);
}

#[test]
fn a_crash_stops_the_motors_first() {
    for (how, signals) in [
        ("pointer", &[libc::SIGSEGV][..]),
        ("timer", &[libc::SIGSEGV]),
        ("abort", &[libc::SIGABRT]),
        ("stack", &[libc::SIGSEGV, libc::SIGBUS]),
        ("a full stack in a callback", &[libc::SIGSEGV, libc::SIGBUS]),
        ("heap", &[libc::SIGABRT, libc::SIGSEGV]),
    ] {
        let txt = simulated().start().unwrap();
        let Some(running) = started(&txt, how) else { return };
        set_input(&txt, 0, 1);
        let ended = running.end();
        assert!(ended.signal.is_some_and(|it| signals.contains(&it)), "{how}: {}", ended.err);
        wait_stopped(&txt);
    }
}

/// The end of the program takes as long as the first controller does, so the second one answers meanwhile.
#[test]
fn a_transfer_that_begins_while_the_program_ends_turns_no_motor() {
    let source = include_str!("programs/late.cpp");
    let Some(program) = compile("", "c++11", source, "late") else { return };
    let with = |fault: &str| simulated().fault(fault.parse().unwrap()).start().unwrap();
    let first = with("delay:700@exchange:each");
    let late = with("delay:300@exchange:0");
    let host = late.address().to_string();
    let mut running = Running::with(&program, &first, &[&first.address().to_string(), &host]);
    running.expect("begins");
    wait_until(&late, "StartOnline", |machine| machine.online());
    running.signal(libc::SIGTERM);
    let ended = running.end();
    assert_eq!(ended.signal, Some(libc::SIGTERM), "{}", ended.err);
    wait_until(&late, "the end of the connection", |machine| !machine.online());
    late.with_machine(|machine| assert_eq!(machine.controllers[0].outputs.duty, [0; 8]));
}

#[cfg(target_env = "gnu")]
#[test]
fn quick_exit_stops_the_motors() {
    let txt = simulated().start().unwrap();
    let Some(running) = started(&txt, "quick_exit") else { return };
    set_input(&txt, 0, 1);
    assert_eq!(running.end().code, Some(3));
    wait_stopped(&txt);
}

#[test]
fn a_callback_may_end_the_program_and_its_thread_may_not_be_ended() {
    for (how, code, signal) in [
        ("exit in a callback", Some(5), None),
        ("pthread_exit in a callback", None, Some(libc::SIGABRT)),
    ] {
        let txt = simulated().start().unwrap();
        let Some(running) = started(&txt, how) else { return };
        set_input(&txt, 0, 1);
        let ended = running.end();
        assert_eq!((ended.code, ended.signal), (code, signal), "{how}: {}", ended.err);
        wait_stopped(&txt);
    }
}

/// The state of a process, as `ps` names it.
#[cfg(target_os = "linux")]
fn state_of(process: u32) -> char {
    let stat = std::fs::read_to_string(format!("/proc/{process}/stat")).unwrap();
    stat.rsplit_once(") ").and_then(|(_, rest)| rest.chars().next()).unwrap()
}

#[cfg(target_os = "linux")]
#[test]
fn a_program_is_suspended_with_its_motors_off_and_may_begin_again() {
    for signal in [libc::SIGTSTP, libc::SIGTTIN] {
        let txt = simulated().start().unwrap();
        let Some(mut running) = started(&txt, "again") else { return };
        running.signal(signal);
        wait_stopped(&txt);
        wait("it is suspended", || state_of(running.id()) == 'T');
        running.signal(libc::SIGCONT);
        running.expect("turns again");
        wait_duty(&txt, 0, 512);
        set_input(&txt, 0, 1);
        running.end().well();
        wait_stopped(&txt);
    }
}

#[test]
fn a_program_that_takes_a_signal_itself_gets_it() {
    let txt = simulated().start().unwrap();
    let Some(mut running) = started(&txt, "takes") else { return };
    running.signal(libc::SIGINT);
    running.expect("taken");
    set_input(&txt, 0, 1);
    assert_eq!(running.end().code, Some(3));
    wait_stopped(&txt);
}

#[test]
fn a_thread_that_is_cancelled_in_a_call_ends_alone() {
    let txt = simulated().start().unwrap();
    let Some(mut running) = started(&txt, "cancel") else { return };
    running.expect("cancelled");
    set_input(&txt, 0, 1);
    running.end().well();
    wait_stopped(&txt);
}

#[test]
fn what_a_program_prints_without_an_output_does_not_go_to_the_controller() {
    let Some(program) = program() else { return };
    let txt = simulated().start().unwrap();
    let mut child = command(program, &txt.address().to_string()).arg("closed").spawn().unwrap();
    wait_duty(&txt, 0, 512);
    let before = txt.with_machine(|machine| machine.exchanges());
    wait_until(&txt, "more exchanges", |machine| machine.exchanges() > before + 20);
    set_input(&txt, 0, 1);
    assert_eq!(child.wait().unwrap().code(), Some(0));
    wait_stopped(&txt);
}

#[test]
fn a_program_that_takes_ctrl_c_itself_gets_it_after_kbhit() {
    let Some(program) = program() else { return };
    let txt = simulated().start().unwrap();
    let mut running = at_terminal(program, &txt, "keys and takes");
    running.expect("turns");
    running.press("\x03");
    running.expect("taken");
    set_input(&txt, 0, 1);
    wait("it has ended", || running.child.try_wait().unwrap().is_some());
    wait_stopped(&txt);
}

#[test]
fn ctrl_c_stops_the_motors_and_gives_the_terminal_back_after_kbhit() {
    let Some(program) = program() else { return };
    for (how, word) in [("keys", "turns"), ("keys later", "keys")] {
        let txt = simulated().start().unwrap();
        let mut running = at_terminal(program, &txt, how);
        running.expect(word);
        wait_duty(&txt, 0, 512);
        assert!(!running.has_lines(), "{how}");
        running.press("\x03");
        wait("it has ended", || running.child.try_wait().unwrap().is_some());
        wait_stopped(&txt);
        assert!(running.has_lines(), "{how}");
    }
}
