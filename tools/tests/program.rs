//! The program of a user that `txt check` and `txt watch` start, and what it has started: nothing of it is left.
//!
//! All of them have the standard output, so its end is theirs.

use std::process::{Command, Stdio};
use std::thread;

use ft_transfer_area_simulator::SimulatedTxt;

use crate::running::Running;

/// It starts another program and goes on.
const GOES_ON: &str = "sleep 600 & echo ready; wait";
/// The same, and only SIGKILL ends them.
const IGNORES_ALL: &str = "trap '' INT TERM HUP; sleep 600 & echo ready; while :; do wait; done";
/// What it starts has a session of its own, and another parent.
#[cfg(target_os = "linux")]
const SESSION: &str = "(setsid sleep 600 &); echo ready; wait; sleep 600";
/// Only Linux finds those.
#[cfg(not(target_os = "linux"))]
const SESSION: &str = GOES_ON;

/// The commands that start this script.
fn commands(txt: &SimulatedTxt, script: &str) -> [Command; 2] {
    commands_with(txt, &["sh", "-c", script])
}

/// The commands that start this program.
fn commands_with(txt: &SimulatedTxt, program: &[&str]) -> [Command; 2] {
    let host = txt.address().to_string();
    let check = ["check", "--language", "en", "1"];
    let watch = ["watch", &host, "--port", "0", "--no-page", "--"];
    [&check[..], &watch[..]].map(|arguments| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_txt"));
        command.args(arguments).args(program).stderr(Stdio::null());
        command
    })
}

#[cfg_attr(not(unix), ignore = "the programs are scripts of a shell")]
#[test]
fn nothing_of_it_is_left_when_this_program_is_ended() {
    let txt = &SimulatedTxt::builder().start().unwrap();
    let signals = ["KILL", "TERM", "INT"].into_iter();
    let cases =
        signals.flat_map(|signal| [GOES_ON, IGNORES_ALL, SESSION].map(|script| (signal, script)));
    thread::scope(|scope| {
        for (signal, script) in cases {
            for mut command in commands(txt, script) {
                scope.spawn(move || {
                    let running = Running::start(&mut command);
                    while running.line() != "ready" {}
                    running.signal(signal);
                    assert!(running.leaves_nothing(), "{signal} {command:?}");
                });
            }
        }
    });
}

#[cfg_attr(not(unix), ignore = "the programs are scripts of a shell")]
#[test]
fn what_it_has_started_is_not_left_when_it_ends() {
    let txt = SimulatedTxt::builder().start().unwrap();
    for (mut command, status) in commands(&txt, "sleep 600 & exit 7").into_iter().zip([1, 7]) {
        let running = Running::start(&mut command);
        assert!(running.leaves_nothing(), "{command:?}");
        assert_eq!(running.end().status.code(), Some(status), "{command:?}");
    }
}

#[cfg(target_os = "linux")]
#[test]
fn it_holds_back_no_signal_that_would_end_it() {
    let txt = SimulatedTxt::builder().start().unwrap();
    // Those that would suspend it, so that it can end in order: bits 19 to 21.
    let masks = ["0000000000000000", "0000000000380000"];
    let commands = commands_with(&txt, &["grep", "-h", "SigBlk", "/proc/self/status"]);
    for (mut command, mask) in commands.into_iter().zip(masks) {
        let running = Running::start(&mut command);
        let mut lines = std::iter::repeat_with(|| running.line());
        let line = lines.find(|line| line.starts_with("SigBlk")).unwrap();
        assert_eq!(line, format!("SigBlk:\t{mask}"), "{command:?}");
    }
}

#[cfg(target_os = "linux")]
#[test]
fn nothing_of_it_is_left_when_its_keeper_was_killed() {
    let txt = SimulatedTxt::builder().start().unwrap();
    let [_, mut watch] = commands(&txt, "sleep 600 & echo $TXT_KEEPER; wait");
    let running = Running::start(&mut watch);
    let keeper = running.line();
    assert!(Command::new("kill").args(["-KILL", &keeper]).status().unwrap().success());
    running.signal("TERM");
    assert!(running.leaves_nothing());
}

#[cfg(target_os = "linux")]
#[test]
fn a_keeper_that_was_killed_is_told() {
    let txt = SimulatedTxt::builder().start().unwrap();
    // The keeper has its number until it is noticed that it has ended.
    let script =
        "echo $TXT_KEEPER; for _ in $(seq 200); do kill -0 $TXT_KEEPER || exit 7; sleep 0.05; done";
    for mut command in commands(&txt, script) {
        let running = Running::start(command.stderr(Stdio::piped()));
        let is_number = |line: &String| line.parse::<u32>().is_ok();
        let keeper = std::iter::repeat_with(|| running.line()).find(is_number).unwrap();
        assert!(Command::new("kill").args(["-KILL", &keeper]).status().unwrap().success());
        let errors = String::from_utf8(running.end().stderr).unwrap();
        // It may have been killed before it knew the program, which then does not go on.
        let is_told = ["the program goes on then", "the process that ends the program is gone"];
        assert!(is_told.iter().any(|told| errors.contains(told)), "{errors}");
    }
}

#[cfg_attr(not(unix), ignore = "the programs are scripts of a shell")]
#[test]
fn it_may_end_by_itself_at_ctrl_c() {
    let txt = SimulatedTxt::builder().start().unwrap();
    let script = "trap 'sleep 0.3; echo bye; exit 5' INT; echo ready; while :; do sleep 0.1; done";
    let [_, mut watch] = commands(&txt, script);
    let watch = Running::start(&mut watch);
    assert_eq!(watch.line(), "ready");
    watch.signal("INT");
    assert_eq!(watch.line(), "bye");
    assert_eq!(watch.end().status.code(), Some(5));
}
