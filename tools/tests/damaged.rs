//! What the commands do with a recording of which a part is damaged: they show the rest, and say what is missing.

use std::fs;
use std::path::Path;
#[cfg(unix)]
use std::process::{Command, Output};

use ft_transfer_area::TransferAreaComHandler;
use ft_transfer_area_recorder::{Options, Recorder};
use ft_transfer_area_simulator::SimulatedTxt;
use serde_json::Value;
use tempfile::TempDir;

use crate::recording::{in_folder, run, said, txt};
use crate::running::{wait_for, Running};

const CYCLES: u64 = 400;

/// A recording of a program that writes the number of each cycle to O2, and the same with a damaged part in the middle.
fn recordings() -> (TempDir, String, String) {
    let folder = tempfile::tempdir().unwrap();
    let (whole, damaged) = (in_folder(&folder, "whole.mcap"), in_folder(&folder, "damaged.mcap"));
    record(Path::new(&whole));
    let mut bytes = fs::read(&whole).unwrap();
    // Each chunk has the word in its head, and once more in the index at the end.
    let heads: Vec<usize> =
        (0..bytes.len()).filter(|at| bytes[*at..].starts_with(b"lz4")).collect();
    let middle = heads[heads.len() / 4];
    bytes[middle + 200] ^= 0x55;
    fs::write(&damaged, bytes).unwrap();
    (folder, whole, damaged)
}

fn record(path: &Path) {
    // By the clock, motors would turn on while more is recorded, as the time of the cycles does not.
    let txt = SimulatedTxt::builder().lock_step().start().unwrap();
    let handler = handler(txt.port());
    let recorder = Recorder::start(&handler, path, Options::default().capacity(5000)).unwrap();
    handler.begin_transfer().unwrap();
    let length = || fs::metadata(path).unwrap().len();
    // Without this, the first of them would have no cycle, and what is damaged could be the beginning.
    let mut before = length();
    // Several chunks, also when the program is faster than the recorder.
    drive(&handler, |cycle| {
        if cycle % (CYCLES / 4) == 0 {
            wait_for("more is recorded", || length() > before);
            before = length();
        }
    });
    handler.end_transfer().unwrap();
    assert_eq!(recorder.finish().unwrap().lost, 0);
}

/// A handler in lock-step, so that the program of each run is the same.
fn handler(port: u16) -> TransferAreaComHandler {
    let builder = TransferAreaComHandler::builder(format!("127.0.0.1:{port}"));
    builder.lock_step().build().unwrap()
}

fn drive(handler: &TransferAreaComHandler, mut after: impl FnMut(u64)) {
    for cycle in 1..CYCLES {
        handler.areas().wait_cycle().unwrap()[0].output.duty[1] = cycle as i16;
        after(cycle);
    }
}

fn info(path: &str) -> Value {
    serde_json::from_slice(&run(&["info", path, "--json"]).stdout).unwrap()
}

/// The lines of the table, without its head.
fn table(path: &str) -> (Vec<String>, String) {
    let output = run(&["csv", path, "O2", "I1"]);
    assert!(output.status.success(), "{}", said(&output));
    let lines = String::from_utf8(output.stdout).unwrap();
    let lines = lines.lines().skip(1).map(str::to_owned).collect();
    (lines, String::from_utf8(output.stderr).unwrap())
}

#[test]
fn info_and_csv_show_the_rest_and_say_once_what_is_missing() {
    let (_folder, whole, damaged) = recordings();
    let (all, nothing) = table(&whole);
    assert_eq!(nothing, "");
    let (rest, said_of_it) = table(&damaged);
    assert!(rest.len() < all.len() && rest.len() > all.len() / 3, "{} lines", rest.len());
    assert!(rest.iter().all(|line| all.contains(line)), "each line is one of the whole recording");
    assert_eq!((rest.first(), rest.last()), (all.first(), all.last()));
    assert_eq!(said_of_it.lines().count(), 1, "{said_of_it}");
    assert!(said_of_it.contains("damaged.mcap: a part of "), "{said_of_it}");
    assert!(said_of_it.contains(" is damaged (") && said_of_it.contains(" left out, between "));

    let (before, after) = (info(&whole), info(&damaged));
    assert_eq!((&before["damage"], &after["is_cut_off"]), (&Value::Null, &false.into()));
    assert_eq!(after["cycles"], rest.len());
    for same in ["transfers", "gaps", "lost", "seconds", "device_name"] {
        assert_eq!(before[same], after[same], "{same}");
    }
    let text = said(&run(&["info", &damaged]));
    assert_eq!(text.matches("is damaged (").count(), 1, "{text}");
}

#[test]
fn plot_shades_the_part_and_draws_no_line_through_it() {
    let (folder, whole, damaged) = recordings();
    let [before, after] = [whole, damaged].map(|path| {
        let svg = in_folder(&folder, "plot.svg");
        let output = run(&["plot", &path, "O2", "-o", &svg]);
        assert!(output.status.success(), "{}", said(&output));
        (fs::read_to_string(svg).unwrap(), String::from_utf8(output.stderr).unwrap())
    });
    let lines = |svg: &str| svg.matches("<polyline").count();
    assert_eq!(lines(&after.0), lines(&before.0) + 1, "two lines in place of one");
    assert!(after.1.contains("is damaged ("), "{}", after.1);
    assert_eq!(before.1, "");
}

#[test]
fn compare_leaves_the_cycles_out_that_are_missing() {
    let (_folder, whole, damaged) = recordings();
    for both in [[&*whole, &damaged], [&damaged, &whole]] {
        let output = run(&["compare", both[0], both[1]]);
        assert_eq!(output.status.code(), Some(0), "{}", said(&output));
        assert!(said(&output).contains("are the same"), "{}", said(&output));
        assert!(said(&output).contains("damaged.mcap: a part of "), "{}", said(&output));
    }
}

#[test]
fn replay_plays_the_rest() {
    let (_folder, _, damaged) = recordings();
    let cycles = info(&damaged)["cycles"].as_u64().unwrap();
    let mut replay = txt(&["replay", &damaged, "--fast", "--once", "--port", "0"]);
    let running = Running::start(&mut replay);
    let line = running.line();
    let port = line.split_once(" at 127.0.0.1:").unwrap().1.split_once('.').unwrap().0.to_owned();
    let handler = handler(port.parse().unwrap());
    handler.begin_transfer().unwrap();
    drive(&handler, |_| {});
    handler.end_transfer().unwrap();
    let output = running.end();
    assert!(output.status.success(), "{}", said(&output));
    assert!(said(&output).contains(&format!("after {cycles} recorded cycles. It did the same")));
    assert!(said(&output).contains("damaged.mcap: a part of "), "{}", said(&output));
}

/// What a command says of a recording that it reads from a pipe.
#[cfg(unix)]
fn from_pipe(folder: &TempDir, path: &str, command: &str, options: &[&str]) -> Output {
    let pipe = in_folder(folder, &format!("{command}{}.pipe", options.len()));
    assert!(Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    let bytes = fs::read(path).unwrap();
    let running = Running::start(txt(&[command, &pipe]).args(options));
    fs::write(&pipe, bytes).unwrap();
    running.end()
}

/// A pipe that is opened once more waits for a second writer, for ever.
#[cfg(unix)]
#[test]
fn a_pipe_is_read_once() {
    let (folder, whole, _) = recordings();
    let from_pipe =
        |path: &str, command, options: &[&str]| from_pipe(&folder, path, command, options);
    let rows = from_pipe(&whole, "csv", &["O2"]);
    assert!(rows.status.success(), "{}", said(&rows));
    assert_eq!(String::from_utf8(rows.stdout).unwrap().lines().count(), 1 + table(&whole).0.len());

    // What the values are is damaged.
    let mut bytes = fs::read(&whole).unwrap();
    let first = (0..bytes.len()).find(|at| bytes[*at..].starts_with(b"lz4")).unwrap();
    bytes[first + 200] ^= 0x55;
    let damaged = in_folder(&folder, "begin.mcap");
    fs::write(&damaged, bytes).unwrap();
    let shown = from_pipe(&damaged, "info", &[]);
    assert!(shown.status.success() && said(&shown).contains(" damaged ("), "{}", said(&shown));

    for (command, options) in [
        ("csv", &[][..]),
        ("csv", &["O2", "--from", "00:00"]),
        ("plot", &["--unusual", "1"]),
        ("replay", &["--port", "0"]),
    ] {
        let refused = from_pipe(&whole, command, options);
        assert_eq!(refused.status.code(), Some(1), "{}", said(&refused));
        assert!(said(&refused).contains("it can be read only once"), "{}", said(&refused));
    }
}
