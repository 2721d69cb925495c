//! The button for recordings, and what is in their files.

use std::fs;
use std::path::Path;

use ft_transfer_area_recorder::{Cycle, Recorded, Recording, Transfer};
use ft_transfer_area_simulator::SimulatedTxt;
use serde_json::{json, Value};
use tempfile::TempDir;

use super::page::Page;
use super::program::{command, Panel};

/// What is in a file.
pub(crate) struct InFile {
    pub(crate) cycles: Vec<Cycle>,
    pub(crate) transfers: Vec<Transfer>,
    pub(crate) is_cut_off: bool,
}

impl InFile {
    pub(crate) fn read(path: &Path) -> Self {
        let mut recording = Recording::open(path).unwrap();
        let (mut cycles, mut transfers) = (Vec::new(), Vec::new());
        for entry in recording.by_ref() {
            match entry.unwrap().what {
                Recorded::Cycle(cycle) => cycles.push(cycle),
                Recorded::Transfer(what) => transfers.push(what),
                _ => {}
            }
        }
        Self { cycles, transfers, is_cut_off: recording.is_cut_off() }
    }

    /// The numbers of the first and the last cycle. There are all between them.
    pub(crate) fn range(&self) -> (u64, u64) {
        let numbers: Vec<_> = self.cycles.iter().map(|cycle| cycle.number).collect();
        assert!(numbers.windows(2).all(|two| two[1] == two[0] + 1), "{numbers:?}");
        assert!(self.cycles.iter().all(|cycle| cycle.lost == 0));
        assert!(!self.is_cut_off);
        (numbers[0], numbers[numbers.len() - 1])
    }

    fn has_duty(&self, duty: i16) -> bool {
        self.cycles.iter().any(|cycle| cycle.areas[0].output.duty[0] == duty)
    }
}

/// A panel that was started in this folder.
fn panel_in(folder: &TempDir, txt: &SimulatedTxt) -> Panel {
    Panel::by(command(&[&txt.address().to_string()]).current_dir(folder.path()))
}

fn cycles(state: &Value) -> u64 {
    state["link"]["cycles"].as_u64().unwrap()
}

/// Waits for so many cycles more; returns how many there were then.
pub(crate) fn wait_for_cycles(page: &mut Page, more: u64) -> u64 {
    let now = cycles(&page.state(0, |_| true));
    cycles(&page.state(0, |state| cycles(state) >= now + more))
}

/// Starts a recording, and waits until it grows.
pub(crate) fn start(page: &mut Page) -> String {
    page.done(json!({"do": "record", "on": true}));
    let grows = |state: &Value| {
        state["recording"]["phase"] == "on" && state["recording"]["bytes"].as_u64() > Some(0)
    };
    let state = page.state(0, grows);
    assert_eq!(state["recording"]["error"], Value::Null);
    state["recording"]["file"].as_str().unwrap().to_owned()
}

/// Stops it; returns its last state.
pub(crate) fn stop(page: &mut Page) -> Value {
    page.done(json!({"do": "record", "on": false}));
    page.state(0, |state| state["recording"]["phase"] == "off")
}

fn turn(page: &mut Page, duty: i16) {
    page.done(json!({"do": "motor", "motor": 0, "duty": duty}));
}

#[test]
fn a_recording_begins_before_the_click_and_ends_at_the_stop_and_none_is_replaced() {
    let folder = tempfile::tempdir().unwrap();
    let txt = SimulatedTxt::builder().start().unwrap();
    let panel = panel_in(&folder, &txt);
    let mut driver = panel.driver();
    // It moves nothing, so a page that only looks may do it.
    let mut page = panel.page();
    turn(&mut driver, 300);
    wait_for_cycles(&mut page, 30);
    turn(&mut driver, 400);
    wait_for_cycles(&mut page, 5);
    assert_eq!(start(&mut page), "run-0001.mcap");
    // It goes on.
    assert_eq!(start(&mut page), "run-0001.mcap");
    turn(&mut driver, 500);
    let before = wait_for_cycles(&mut page, 30);
    let stopped = stop(&mut page);
    let path = folder.path().join("run-0001.mcap");
    let size = fs::metadata(&path).unwrap().len();
    assert_eq!(stopped["recording"]["bytes"], size);
    wait_for_cycles(&mut page, 20);

    let first = InFile::read(&path);
    let (begin, end) = first.range();
    assert_eq!(begin, 1, "all that came since the panel began");
    // A response reaches the program before the log.
    assert!((before - 1..=cycles(&stopped)).contains(&end), "{end} of {before} to {stopped}");
    assert!(matches!(&first.transfers[..], [Transfer::Began { .. }]), "{:?}", first.transfers);
    assert!([300, 400, 500].into_iter().all(|duty| first.has_duty(duty)));

    assert_eq!(start(&mut page), "run-0002.mcap");
    stop(&mut page);
    let second = InFile::read(&folder.path().join("run-0002.mcap"));
    assert!(second.range().0 == 1 && second.range().1 > end + 20);
    assert_eq!(fs::metadata(&path).unwrap().len(), size);
}

#[cfg_attr(not(unix), ignore = "Windows does not remove the folder of a program")]
#[test]
fn a_folder_that_takes_no_file_is_told_and_the_panel_drives_on() {
    let folder = tempfile::tempdir().unwrap();
    let txt = SimulatedTxt::builder().start().unwrap();
    let panel = panel_in(&folder, &txt);
    let mut page = panel.driver();
    turn(&mut page, 300);
    drop(folder);
    page.done(json!({"do": "record", "on": true}));
    let told = page.state(0, |state| state["recording"]["error"] != Value::Null);
    let RecordingState { phase, code, text } = RecordingState::of(&told);
    assert_eq!((phase, code), ("off", "record_failed"), "{told}");
    assert!(text.starts_with("can't record in the folder "), "{text}");
    assert_eq!(told["areas"][0]["motors"][0]["duty"][0], 300, "it still turns");
    turn(&mut page, 400);
    page.state(0, |state| state["areas"][0]["motors"][0]["duty"][0] == 400);
}

#[cfg_attr(not(unix), ignore = "Windows does not remove a file that is open")]
#[test]
fn a_recording_whose_file_is_removed_ends_and_that_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let txt = SimulatedTxt::builder().start().unwrap();
    let panel = panel_in(&folder, &txt);
    let mut page = panel.driver();
    for is_replaced in [false, true] {
        let file = start(&mut page);
        let path = folder.path().join(&file);
        if is_replaced {
            let other = folder.path().join("other");
            std::fs::write(&other, "another").unwrap();
            std::fs::rename(other, path).unwrap();
        } else {
            std::fs::remove_file(path).unwrap();
        }
        let told = page.state(0, |state| {
            state["recording"]["phase"] == "off" && state["recording"]["error"] != Value::Null
        });
        let RecordingState { code, text, .. } = RecordingState::of(&told);
        let gone = format!("{file} is not there any more");
        assert_eq!((code, text), ("record_gone", &*gone), "{told}");
    }
    start(&mut page);
    assert_eq!(stop(&mut page)["recording"]["error"], Value::Null);
}

struct RecordingState<'a> {
    phase: &'a str,
    code: &'a str,
    text: &'a str,
}

impl<'a> RecordingState<'a> {
    fn of(state: &'a Value) -> Self {
        let recording = &state["recording"];
        let text = |value: &'a Value| value.as_str().unwrap_or_default();
        let (code, sentence) = (&recording["error"]["code"], &recording["error"]["text"]);
        Self { phase: text(&recording["phase"]), code: text(code), text: text(sentence) }
    }
}

#[cfg_attr(not(target_os = "linux"), ignore = "elsewhere a limit for files ends a program")]
#[test]
fn a_full_disk_ends_only_the_recording() {
    let folder = tempfile::tempdir().unwrap();
    let txt = SimulatedTxt::builder().start().unwrap();
    let panel = command(&[&txt.address().to_string()]);
    let mut limited = std::process::Command::new("sh");
    // In blocks of 512 bytes.
    limited.args(["-c", "ulimit -f 60; exec \"$0\" \"$@\""]).arg(panel.get_program());
    let panel = Panel::by(limited.args(panel.get_args()).current_dir(folder.path()));
    let mut page = panel.driver();
    turn(&mut page, 300);
    start(&mut page);
    let has_ended = |state: &Value| state["recording"]["phase"] == "off";
    let told = page.state(0, has_ended);
    let RecordingState { code, text, .. } = RecordingState::of(&told);
    assert_eq!(code, "record_full", "{told}");
    assert!(text.starts_with("can't write run-0001.mcap; it has about "), "{text}");
    turn(&mut page, 400);
    page.state(0, |state| state["areas"][0]["motors"][0]["duty"][0] == 400);
    let mut recording = Recording::open(folder.path().join("run-0001.mcap")).unwrap();
    assert!(recording.by_ref().filter(Result::is_ok).count() > 20);
}

#[cfg_attr(not(unix), ignore = "the test sends a signal of Unix")]
#[test]
fn a_recording_that_is_on_at_the_end_has_the_end() {
    let folder = tempfile::tempdir().unwrap();
    let txt = SimulatedTxt::builder().start().unwrap();
    let panel = panel_in(&folder, &txt);
    let mut page = panel.driver();
    turn(&mut page, 300);
    start(&mut page);
    panel.running.signal("INT");
    assert!(panel.running.end().status.success());
    let all = InFile::read(&folder.path().join("run-0001.mcap"));
    all.range();
    assert_eq!(all.transfers.last(), Some(&Transfer::Ended));
    let last = all.cycles.last().unwrap();
    assert_eq!(last.areas[0].output.duty[..], [0; 8]);
}
