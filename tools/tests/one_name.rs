//! Several recordings with one name.

use std::fs;

use ft_transfer_area::{FishX1Transfer, LoggedCycle};
use ft_transfer_area_recorder::{Options, Recorder};
use ft_transfer_area_simulator::SimulatedTxt;

use crate::recording::{in_folder, names, recording, run, said, DEADLINE};
use crate::replay::record;
use crate::running::{wait_for, Running};

const REFUSED: &str = "another recording is being written into it";

/// Nothing listens there, and nobody asks.
const NOBODY: &str = "127.0.0.1:1";

/// Sees each that records into this file refused.
fn all_are_refused(path: &str) {
    for arguments in [
        &["record", NOBODY, "-o", path][..],
        &["record", NOBODY, "-o", path, "--force"],
        &["watch", NOBODY, "--port", "0", "--record", path, "--force"],
    ] {
        let output = recording(arguments).output().unwrap();
        assert_eq!(output.status.code(), Some(1), "{arguments:?}: {}", said(&output));
        let sentence = format!("can't write {path}: {REFUSED}");
        assert!(said(&output).ends_with(&format!("{sentence}\n")), "{}", said(&output));
    }
    let refused = Recorder::fed(path, Options::default()).map(drop).unwrap_err();
    assert!(format!("{refused:#}").ends_with(REFUSED), "{refused:#}");
}

#[cfg_attr(not(unix), ignore = "only Unix can end another program like Ctrl-C")]
#[test]
fn what_a_command_records_into_no_other_one_does() {
    let folder = tempfile::tempdir().unwrap();
    let path = in_folder(&folder, "run.mcap");
    let txt = SimulatedTxt::builder().start().unwrap();
    let host = txt.address().to_string();
    let watch = ["watch", &host, "--port", "0", "--record", &path];
    for arguments in [&["record", &host, "-o", &path][..], &watch] {
        let first = Running::start(&mut recording(arguments));
        wait_for("nothing is recorded", || fs::metadata(&path).is_ok_and(|file| file.len() > 0));
        all_are_refused(&path);
        first.signal("INT");
        let output = first.end();
        assert_eq!(output.status.code(), Some(0), "{}", said(&output));
        assert!(run(&["info", &path]).status.success());
        assert_eq!(names(&folder), ["run.mcap"]);
        fs::remove_file(&path).unwrap();
    }

    // Also what waits for a program, to replace an earlier file.
    fs::write(&path, "the old one").unwrap();
    let mut command = recording(&watch);
    let first = Running::start(command.arg("--force").stdout(std::process::Stdio::piped()));
    assert!(first.line().starts_with("main "));
    all_are_refused(&path);
    first.signal("INT");
    assert_eq!(first.end().status.code(), Some(0));
    assert_eq!(fs::read_to_string(&path).unwrap(), "the old one");
    assert_eq!(names(&folder), ["run.mcap"]);
}

#[test]
fn what_a_program_records_into_no_command_does() {
    let folder = tempfile::tempdir().unwrap();
    let path = in_folder(&folder, "run.mcap");
    let (recorder, mut feed) = Recorder::fed(&path, Options::default()).unwrap();
    all_are_refused(&path);
    feed.cycle(LoggedCycle::new(1, &[FishX1Transfer::default()]));
    assert_eq!(recorder.finish().unwrap().cycles, 1);
    let info = run(&["info", &path]);
    assert!(info.status.success(), "{}", said(&info));
    assert_eq!(names(&folder), ["run.mcap"]);
}

#[cfg_attr(not(unix), ignore = "only Unix can end another program like Ctrl-C")]
#[test]
fn two_films_have_two_files() {
    let folder = tempfile::tempdir().unwrap();
    let film = in_folder(&folder, "film.mjpeg");
    let txt = SimulatedTxt::builder().start().unwrap();
    let other = SimulatedTxt::builder().start().unwrap();
    let into_film = |txt: &SimulatedTxt, options: &[&str]| {
        let mut command = recording(&["camera", &txt.address().to_string(), "--force"]);
        command.args(["-o", &film]).args(options);
        command
    };
    let first = Running::start(&mut into_film(&txt, &[]));
    wait_for("no picture comes", || fs::metadata(&film).is_ok_and(|file| file.len() > 0));
    let refused = into_film(&other, &["--count", "1"]).output().unwrap();
    assert_eq!(refused.status.code(), Some(1), "{}", said(&refused));
    assert!(said(&refused).ends_with(&format!("{film}: {REFUSED}\n")), "{}", said(&refused));
    first.signal("INT");
    assert_eq!(first.end().status.code(), Some(0));
    assert!(fs::read(&film).unwrap().ends_with(&[0xFF, 0xD9]));
    assert!(txt.wait_until(|machine| !machine.connected(), DEADLINE));
}

#[test]
fn a_later_recording_in_parts_is_not_passed_over_in_silence() {
    let folder = tempfile::tempdir().unwrap();
    let [path, plain] = ["run.mcap", "rec"].map(|name| in_folder(&folder, name));
    record(&path, None, 1);
    let csv = run(&["csv", &path, "I1"]);
    assert!(csv.status.success() && csv.stderr.is_empty(), "{}", said(&csv));
    for path in [&path, &plain] {
        let args = ["record", "--simulate", "--seconds", "0.2", "--parts", "1s", "-o", path];
        let recorded = run(&args);
        assert!(recorded.status.success(), "{}", said(&recorded));
    }
    let part = in_folder(&folder, "run-0001.mcap");
    let note = format!("there is a later recording in parts, {part} to {part}: this is {path}\n");
    for reads in [&["info", &path][..], &["info", "--json", &path], &["csv", &path, "I1"]] {
        let read = run(reads);
        assert!(read.status.success(), "{}", said(&read));
        assert_eq!(String::from_utf8_lossy(&read.stderr), note);
    }
    let info = run(&["info", &path]);
    assert!(String::from_utf8_lossy(&info.stdout).contains("SLIDE"), "{}", said(&info));

    // A name without an ending.
    assert!(folder.path().join("rec-0001").is_file());
    let info = run(&["info", &plain]);
    assert!(info.status.success(), "{}", said(&info));

    // A newer recording is the one that is meant.
    let again = ["record", "--simulate", "--seconds", "0.2", "--force", "-o", &path];
    assert!(run(&again).status.success());
    let info = run(&["info", &path]);
    assert!(info.status.success() && info.stderr.is_empty(), "{}", said(&info));
}
