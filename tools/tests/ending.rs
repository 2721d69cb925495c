//! Programs end at Ctrl-C whatever becomes of what they write.
#![cfg(target_os = "linux")]

use std::fs::{File, OpenOptions};
use std::io::{self, BufRead, BufReader, Write};
use std::net::SocketAddr;
use std::process::{Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use ft_transfer_area::wire::CommandId;
use ft_transfer_area_simulator::{Machine, SimulatedTxt};
use nix::pty::{openpty, OpenptyResult};
use nix::sys::termios::{tcflow, FlowArg};
use tempfile::TempDir;

use crate::recording::{self, in_folder, said, DEADLINE};
use crate::running::Running;
use crate::watch::away::{at_free_ports, started};
use crate::watch::slow::Killed;
use crate::watch::support::{command, listener, listening, logged, KitClient};

/// A pipe that takes so many bytes and no more: nobody reads it.
pub(crate) fn pipe(folder: &TempDir, room: usize) -> (String, File) {
    let path = in_folder(folder, "pipe");
    assert!(Command::new("mkfifo").arg(&path).status().unwrap().success());
    // On Linux, opening it for both waits for nobody.
    let mut pipe = OpenOptions::new().read(true).write(true).open(&path).unwrap();
    pipe.write_all(&vec![0; (64 << 10) - room]).unwrap();
    (path, pipe)
}

/// A pipe that takes nothing, in a folder of its own.
pub(crate) fn full_pipe() -> (TempDir, (String, File)) {
    let folder = tempfile::tempdir().unwrap();
    let pipe = pipe(&folder, 0);
    (folder, pipe)
}

/// A recording into such a pipe that has begun.
fn begun(txt: &SimulatedTxt, path: &str) -> Running {
    let arguments = ["record", &txt.address().to_string(), "-o", path];
    let running = Running::start(&mut recording::txt(&arguments));
    assert!(txt.wait_until(|machine| machine.exchanges() > 20, DEADLINE));
    running
}

#[test]
fn a_recording_into_a_pipe_that_takes_no_more_ends_and_says_that_it_is_incomplete() {
    let (txt, folder) = (SimulatedTxt::builder().start().unwrap(), tempfile::tempdir().unwrap());
    let (path, _pipe) = pipe(&folder, 4 << 10);
    let running = begun(&txt, &path);
    running.signal("INT");
    let output = running.end();
    assert_eq!(output.status.code(), Some(1), "{}", said(&output));
    assert!(said(&output).contains("the recording is incomplete"), "{}", said(&output));
}

#[test]
fn a_second_ctrl_c_ends_it_at_once() {
    let (txt, folder) = (SimulatedTxt::builder().start().unwrap(), tempfile::tempdir().unwrap());
    let (path, _pipe) = pipe(&folder, 4 << 10);
    let running = begun(&txt, &path);
    running.signal("TERM");
    // The transfer ends before the file.
    assert!(txt.wait_until(|machine| !machine.online(), DEADLINE));
    // Signals that come together are one.
    thread::sleep(Duration::from_millis(400));
    running.signal("INT");
    assert_eq!(running.end().status.code(), Some(130));
}

#[test]
fn a_pipe_that_nobody_opens_is_left_at_ctrl_c() {
    let (txt, folder) = (SimulatedTxt::builder().start().unwrap(), tempfile::tempdir().unwrap());
    let (path, pipe) = pipe(&folder, 0);
    drop(pipe);
    let host = txt.address().to_string();
    for arguments in [&["record", &host, "-o", &path][..], &["watch", &host, "--record", &path]] {
        let running = Running::start(&mut recording::txt(arguments));
        // It waits for a reader, or has not got so far.
        thread::sleep(Duration::from_millis(100));
        running.signal("INT");
        assert!(!running.end().status.success());
    }
}

/// A simulated TXT warns of what clients do wrong, each time in this way of its own: here of an exchange without a
/// configuration.
fn exchanges_oddly(with: SocketAddr) {
    let mut client = KitClient::without_configuration(with);
    (0..20).for_each(|duty| client.simple_exchange([duty; 8]));
}

#[test]
fn warnings_that_nobody_reads_hold_up_no_simulated_controller() {
    let (folder, (path, _pipe)) = full_pipe();
    let recorded = in_folder(&folder, "run.mcap");
    recording::run(&["record", "--simulate", "-o", &recorded, "--seconds", "0.5"]);
    for arguments in [
        &["simulate", "--port", "0"][..],
        &["lesson", "--port", "0", "--no-browser"],
        &["classroom", "2", "--port", "0"],
        &["replay", &recorded, "--port", "0"],
    ] {
        let mut command = recording::txt(arguments);
        let running =
            Running::start(command.stderr(File::options().write(true).open(&path).unwrap()));
        let addresses = |line: &String| -> Vec<SocketAddr> {
            // Pages have a path, too.
            line.split([' ', ','])
                .filter_map(|word| word.trim_end_matches('.').parse().ok())
                .collect()
        };
        let lines = std::iter::from_fn(|| Some(running.line()));
        let count = if arguments[0] == "classroom" { 2 } else { 1 };
        let pupils = lines.flat_map(|line| addresses(&line)).take(count).collect::<Vec<_>>();
        pupils.into_iter().for_each(exchanges_oddly);
        running.signal("INT");
        assert!(running.end().status.success(), "{arguments:?}");
    }
}

/// A command of `txt` that a closed terminal should not end.
fn without_hangup(arguments: &[&str]) -> Command {
    let mut command = Command::new("nohup");
    command.arg(env!("CARGO_BIN_EXE_txt")).args(arguments).stderr(Stdio::null());
    command
}

#[test]
fn signals_end_commands_that_were_started_where_they_are_held_back() {
    let (txt, folder) = (SimulatedTxt::builder().start().unwrap(), tempfile::tempdir().unwrap());
    let (host, path) = (txt.address().to_string(), in_folder(&folder, "run.mcap"));
    for arguments in [
        &["record", &host, "-o", &path][..],
        &["watch", &host, "--port", "0", "--no-page"],
        &["simulate", "--port", "0"],
    ] {
        let mut blocked = Command::new("env");
        blocked.arg("--block-signal=INT,TERM,HUP").arg(env!("CARGO_BIN_EXE_txt")).args(arguments);
        let running = Running::start(&mut blocked);
        if arguments[0] == "record" {
            assert!(txt.wait_until(|machine| machine.exchanges() > 20, DEADLINE));
        } else {
            running.line();
        }
        running.signal("TERM");
        assert!(running.leaves_nothing(), "{arguments:?}: it does not end");
    }
}

/// As in the background of a script.
#[test]
fn signals_end_commands_that_were_started_where_they_are_ignored() {
    for (signal, status) in [("INT", 130), ("TERM", 143)] {
        let (silent, address) = listener();
        let mut ignored = Command::new("env");
        ignored.arg("--ignore-signal=INT,TERM").arg(env!("CARGO_BIN_EXE_txt"));
        let running = Running::start(ignored.args(["stop", &address.to_string()]));
        let _connection = silent.accept().unwrap();
        running.signal(signal);
        assert_eq!(running.end().status.code(), Some(status), "{signal}");
    }
}

#[test]
fn with_nohup_a_closed_terminal_ends_nothing() {
    let (txt, folder) = (SimulatedTxt::builder().start().unwrap(), tempfile::tempdir().unwrap());
    let (path, host) = (in_folder(&folder, "run.mcap"), txt.address().to_string());
    for arguments in
        [&["record", &host, "-o", &path][..], &["panel", &host, "--no-browser", "--port", "0"]]
    {
        let before = txt.with_machine(|machine| machine.exchanges());
        let running = Running::start(&mut without_hangup(arguments));
        assert!(txt.wait_until(|machine| machine.exchanges() > before + 20, DEADLINE));
        running.signal("HUP");
        let before = txt.with_machine(|machine| machine.exchanges());
        let goes_on = |machine: &Machine| machine.exchanges() > before + 50 || !machine.online();
        assert!(txt.wait_until(goes_on, DEADLINE));
        assert!(txt.with_machine(|machine| machine.online()), "{arguments:?}");
        running.signal("INT");
        assert!(running.end().status.success(), "{arguments:?}");
        assert!(txt.wait_until(|machine| !machine.online(), DEADLINE));
    }
}

#[test]
fn a_closed_terminal_does_not_end_the_program_of_watch_with_nohup_either() {
    let (txt, folder) = (SimulatedTxt::builder().start().unwrap(), tempfile::tempdir().unwrap());
    let (out, host) = (in_folder(&folder, "out"), txt.address().to_string());
    let hung_up = format!("kill -HUP $$; echo goes on > {out}");
    let arguments = ["watch", &host, "--port", "0", "--no-page", "--", "sh", "-c", &hung_up];
    let output = Running::start(&mut without_hangup(&arguments)).end();
    assert!(output.status.success(), "{output:?}");
    assert_eq!(std::fs::read_to_string(out).unwrap(), "goes on\n");
}

#[test]
fn a_closed_terminal_ends_a_recording_well() {
    let (txt, folder) = (SimulatedTxt::builder().start().unwrap(), tempfile::tempdir().unwrap());
    let running = begun(&txt, &in_folder(&folder, "run.mcap"));
    running.signal("HUP");
    assert_eq!(running.end().status.code(), Some(0));
    assert!(txt.wait_until(|machine| !machine.online(), DEADLINE));
}

/// As after Ctrl-S. Both ends have to stay.
fn paused_terminal() -> OpenptyResult {
    let terminal = openpty(None, None).unwrap();
    tcflow(&terminal.slave, FlowArg::TCOOFF).unwrap();
    terminal
}

#[test]
fn a_recording_on_a_paused_terminal_ends_in_time_and_at_ctrl_c() {
    let (txt, folder) = (SimulatedTxt::builder().start().unwrap(), tempfile::tempdir().unwrap());
    let terminal = paused_terminal();
    for limit in ["0.5", "1000"] {
        let path = in_folder(&folder, limit);
        let host = txt.address().to_string();
        let mut record = recording::txt(&["record", &host, "-o", &path, "--seconds", limit]);
        let running = Running::start(record.stderr(terminal.slave.try_clone().unwrap()));
        if limit == "1000" {
            assert!(txt.wait_until(|machine| machine.online(), DEADLINE));
            running.signal("INT");
        }
        let output = running.end();
        assert_eq!(output.status.code(), Some(0), "{}", said(&output));
        let info = said(&recording::run(&["info", &path]));
        assert!(!info.contains("cut off"), "{info}");
    }
}

#[test]
fn a_recording_whose_warning_nobody_reads_goes_on_and_ends_whole() {
    let (folder, (pipe, _pipe)) = full_pipe();
    let path = in_folder(&folder, "run.mcap");
    let first = at_free_ports(|port| SimulatedTxt::builder().port(port).device_name("ONE"));
    let (address, port) = (first.address().to_string(), first.port());
    let mut record = recording::txt(&["record", &address, "-o", &path]);
    let running = Running::start(record.stderr(File::options().write(true).open(&pipe).unwrap()));
    assert!(first.wait_until(|machine| machine.exchanges() > 20, DEADLINE));
    drop(first);
    // It warns of another name within a tenth of a second.
    let second = started(|| SimulatedTxt::builder().port(port).device_name("TWO"));
    assert!(second.wait_until(|machine| machine.exchanges() > 40, DEADLINE));
    running.signal("INT");
    let output = running.end();
    assert_eq!(output.status.code(), Some(0), "{}", said(&output));
    let info = said(&recording::run(&["info", &path]));
    assert!(!info.contains("cut off"), "{info}");
}

#[test]
fn watch_stops_the_motors_before_it_gives_up_the_file() {
    let (txt, duties) = logged(SimulatedTxt::builder());
    let folder = tempfile::tempdir().unwrap();
    let (path, _pipe) = pipe(&folder, 4 << 10);
    let arguments = ["--no-page", "--json", "--record", &path];
    let running = Running::start(command(txt.address(), &arguments).stderr(Stdio::piped()));
    let to = ([127, 0, 0, 1], listening(&running.line())).into();
    let mut program = KitClient::online(to);
    program.exchange([512; 8]);
    running.signal("INT");
    let output = running.end();
    assert_eq!(output.status.code(), Some(1), "{}", said(&output));
    assert!(said(&output).contains("the recording is incomplete"), "{}", said(&output));
    assert_eq!(duties.lock().unwrap().last().unwrap()[..], [[0; 8]]);
}

#[test]
fn readers_that_go_away_end_nothing_that_drives() {
    let (txt, folder) = (SimulatedTxt::builder().start().unwrap(), tempfile::tempdir().unwrap());
    let (path, pipe) = pipe(&folder, 32 << 10);
    let mut watch = command(txt.address(), &["--json", "--record", &path]);
    let watch = watch.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn();
    let mut watch = Killed(watch.unwrap());
    let mut line = String::new();
    BufReader::new(watch.0.stdout.take().unwrap()).read_line(&mut line).unwrap();
    let mut program = KitClient::online(([127, 0, 0, 1], listening(&line)).into());
    program.exchange([1; 8]);
    drop(pipe);
    let mut errors = BufReader::new(watch.0.stderr.take().unwrap()).lines();
    let is_broken = |line: io::Result<String>| line.unwrap().contains("Broken pipe");
    thread::scope(|scope| {
        let reported = scope.spawn(|| errors.any(is_broken));
        while !reported.is_finished() {
            program.exchange([2; 8]);
        }
        assert!(reported.join().unwrap());
    });
    program.exchange([3; 8]);
    program.end();
}

#[test]
fn a_limit_for_the_size_of_files_ends_no_command_in_the_middle() {
    let folder = tempfile::tempdir().unwrap();
    let limited = "ulimit -f 0; exec \"$0\" find --only 127.0.0.1:1 --json > \"$1\"";
    let status = Command::new("sh")
        .args(["-c", limited, env!("CARGO_BIN_EXE_txt")])
        .arg(folder.path().join("found.json"))
        .status()
        .unwrap();
    // A signal has no code.
    assert_eq!(status.code(), Some(1), "{status}");
}

/// Ends a command that writes to a pipe with this room, and says whether it has ended well.
fn ends_well(arguments: &[&str], room: usize) -> bool {
    let (txt, folder) = (SimulatedTxt::builder().start().unwrap(), tempfile::tempdir().unwrap());
    let (path, _pipe) = pipe(&folder, room);
    let mut command = Command::new(env!("CARGO_BIN_EXE_txt"));
    command.args(arguments).arg(txt.address().to_string()).stdin(Stdio::null());
    command.stdout(File::options().write(true).open(path).unwrap());
    let mut child = Killed(command.spawn().unwrap());
    // It may be online for a moment only.
    let was_online = |machine: &Machine| machine.commands().any(|it| it == CommandId::StartOnline);
    assert!(txt.wait_until(was_online, DEADLINE));
    let id = child.0.id().to_string();
    assert!(Command::new("kill").args(["-INT", &id]).status().unwrap().success());
    let status = child.0.wait().unwrap();
    assert!(txt.wait_until(|machine| !machine.online(), DEADLINE));
    status.success()
}

#[test]
fn a_panel_whose_address_nobody_reads_ends_well() {
    assert!(ends_well(&["panel", "--no-browser"], 0));
}

#[test]
fn a_recording_whose_last_words_nobody_reads_ends_well_and_soon() {
    let folder = tempfile::tempdir().unwrap();
    let path = in_folder(&folder, "run.mcap");
    let begin = Instant::now();
    assert!(ends_well(&["record", "-o", &path], 0));
    // Three seconds are theirs; twenty are the most that the end may take.
    assert!(begin.elapsed() < Duration::from_secs(15), "{:?}", begin.elapsed());
    let info = said(&recording::run(&["info", &path]));
    assert!(!info.contains("cut off"), "{info}");
}

#[test]
fn a_self_test_whose_lines_nobody_reads_keeps_its_results() {
    let folder = tempfile::tempdir().unwrap();
    let path = in_folder(&folder, "results.json");
    assert!(!ends_well(&["selftest", "--output", &path], 200));
    assert!(std::fs::read_to_string(path).unwrap().contains("ended_early"));
}
