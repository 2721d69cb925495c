//! A program that `txt watch` starts.

use std::process::{Command, Stdio};

use ft_transfer_area_simulator::SimulatedTxt;
use serde_json::Value;

use super::support::{command, listening, logged, KitClient};
use super::LIMIT;
use crate::recording::{run, said};
use crate::running::{wait_for, Running};

/// The command for a controller with a program that a shell runs: there, `$0` is the address.
fn shell(txt: &SimulatedTxt, script: &str) -> Command {
    let mut command = command(txt.address(), &["--no-page", "--", "sh", "-c", script]);
    command.env("TXT", env!("CARGO_BIN_EXE_txt")).stderr(Stdio::piped());
    command
}

#[cfg_attr(not(unix), ignore = "the programs are scripts of a shell")]
#[test]
fn it_gets_the_address_and_gives_its_exit_status() {
    let txt = SimulatedTxt::builder().start().unwrap();
    let script = r#"echo "$0 $TXT_ADDRESS $FT_TXT_HOST"; exit 7"#;
    let output = shell(&txt, script).output().unwrap();
    assert_eq!(output.status.code(), Some(7), "{}", said(&output));
    let printed = String::from_utf8_lossy(&output.stdout).into_owned();
    let words: Vec<_> = printed.split_whitespace().collect();
    assert!(words[0].starts_with("127.0.0.1:"), "{printed}");
    // It prints nothing of its own.
    assert_eq!(words, [words[0]; 3]);
    // It may have driven the controller itself.
    let told = format!("txt stop {} switches them off", txt.address());
    assert!(said(&output).contains(&told), "{}", said(&output));
    let through = said(&shell(&txt, r#""$TXT" stop "$0""#).output().unwrap());
    assert!(through.contains("are off") && !through.contains("no program has"), "{through}");
    assert!(shell(&txt, "exit 0").status().unwrap().success());
}

/// As by a program that does not want to wait for what it starts.
#[cfg(target_os = "linux")]
#[test]
fn its_exit_status_is_seen_where_the_ends_of_children_are_ignored() {
    let txt = SimulatedTxt::builder().start().unwrap();
    let script =
        r#"exec env --ignore-signal=CHLD "$TXT" watch "$0" --port 0 --no-page -- sh -c 'exit 7'"#;
    let output = Command::new("sh")
        .args(["-c", script, &txt.address().to_string()])
        .env("TXT", env!("CARGO_BIN_EXE_txt"))
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(7), "{}", said(&output));
}

/// Else a file with COM ports would lead a C program past `txt watch`, which could not stop what it leaves on.
#[cfg_attr(not(unix), ignore = "the programs are scripts of a shell")]
#[test]
fn com_ports_are_only_those_that_the_user_names_for_this_start() {
    let txt = SimulatedTxt::builder().start().unwrap();
    let ports = |named: &str| {
        let mut command = shell(&txt, r#"echo $FT_TXT_PORTS"#);
        let output = command.env("FT_TXT_PORTS", named).output().unwrap();
        String::from_utf8_lossy(&output.stdout).into_owned()
    };
    assert_eq!(ports(""), "none\n");
    assert_eq!(ports("COM4=192.168.7.2"), "COM4=192.168.7.2 none\n");
}

#[cfg_attr(not(unix), ignore = "the programs are scripts of a shell")]
#[test]
fn the_controller_is_stopped_when_it_is_killed() {
    let (txt, duties) = logged(SimulatedTxt::builder());
    let folder = tempfile::tempdir().unwrap();
    let script = r#"echo $$; exec "$TXT" record "$0" -o run.mcap"#;
    let watch = Running::start(shell(&txt, script).current_dir(folder.path()));
    let program = watch.line();
    assert!(txt.wait_until(|machine| machine.exchanges() > 3, LIMIT));
    assert!(Command::new("kill").args(["-KILL", &program]).status().unwrap().success());
    let output = watch.end();
    assert_eq!(output.status.code(), Some(1), "{}", said(&output));
    assert!(said(&output).contains("were switched off"), "{}", said(&output));
    assert!(said(&output).contains("SIGKILL"), "{}", said(&output));
    assert_eq!(duties.lock().unwrap().last().unwrap()[..], [[0; 8]]);
    assert!(txt.wait_until(|machine| !machine.online(), LIMIT));
}

#[cfg_attr(not(unix), ignore = "the programs are scripts of a shell")]
#[test]
fn it_ends_at_ctrl_c_and_soon_when_it_does_not_listen() {
    let txt = SimulatedTxt::builder().start().unwrap();
    let script = "trap '' INT; echo ready; while true; do sleep 0.1; done";
    let watch = Running::start(&mut shell(&txt, script));
    assert_eq!(watch.line(), "ready");
    watch.signal("INT");
    assert_eq!(watch.end().status.code(), Some(1));
}

/// A program for two controllers may be watched by two of them, one inside the other.
#[cfg_attr(not(unix), ignore = "the programs are scripts of a shell")]
#[test]
fn the_inner_one_of_two_stops_its_controller_when_the_outer_one_is_killed() {
    let outer = SimulatedTxt::builder().start().unwrap();
    let (inner, duties) = logged(SimulatedTxt::builder());
    let (host, script) =
        (inner.address().to_string(), "trap '' INT TERM; while :; do sleep 0.1; done");
    let mut command = command(outer.address(), &["--no-page", "--", env!("CARGO_BIN_EXE_txt")]);
    command.args(["watch", &host, "--port", "0", "--no-page", "--json", "--"]);
    let watch = Running::start(command.args(["sh", "-c", script]).stderr(Stdio::null()));
    let mut client = KitClient::online(([127, 0, 0, 1], listening(&watch.line())).into());
    client.exchange([512, 0, 0, 0, 0, 0, 0, 0]);
    watch.signal("KILL");
    let stops = || duties.lock().unwrap().last().is_some_and(|last| last[..] == [[0; 8]]);
    wait_for("the motor goes on", stops);
    assert!(watch.leaves_nothing());
}

#[cfg_attr(not(unix), ignore = "the programs are scripts of a shell")]
#[test]
fn what_a_program_prints_is_not_among_the_lines_of_json() {
    let txt = SimulatedTxt::builder().start().unwrap();
    let arguments = ["--json", "--no-page", "--", "sh", "-c", "printf 'half a '; echo line"];
    let output = command(txt.address(), &arguments).stderr(Stdio::piped()).output().unwrap();
    let [out, err] = [&output.stdout, &output.stderr].map(|text| String::from_utf8_lossy(text));
    let lines: Result<Vec<Value>, _> = out.lines().map(serde_json::from_str).collect();
    assert!(!lines.unwrap_or_else(|error| panic!("{error}: {out}")).is_empty());
    assert!(err.contains("half a line"), "{err}");
}

/// It would measure what stops the motors here, and say that the controller does.
#[cfg_attr(not(unix), ignore = "the programs are scripts of a shell")]
#[test]
fn no_selftest_comes_through_it() {
    let txt = SimulatedTxt::builder().start().unwrap();
    let output = shell(&txt, r#""$TXT" selftest "$0""#).output().unwrap();
    assert_eq!(output.status.code(), Some(1), "{}", said(&output));
    assert!(said(&output).contains("behind txt watch"), "{}", said(&output));
}

#[test]
fn a_program_that_is_not_there_is_an_error() {
    let txt = SimulatedTxt::builder().start().unwrap();
    let host = txt.address().to_string();
    let output = run(&["watch", &host, "--port", "0", "--no-page", "--", "no such program"]);
    assert_eq!(output.status.code(), Some(1), "{}", said(&output));
    assert!(said(&output).contains("can't start the program no such program"), "{}", said(&output));
}
