//! What a page records, and what it shows of a recording from the beginning on.

use ft_transfer_area::transfer_area::LOCAL_IO;
use ft_transfer_area_recorder::Transfer;
use ft_transfer_area_simulator::SimulatedTxt;
use serde_json::{json, Value};

use super::support::{command, Watch};
use crate::panel::recording::{start, stop, wait_for_cycles, InFile};

#[test]
fn a_recording_by_the_page_begins_before_the_click_and_ends_at_the_stop() {
    let folder = tempfile::tempdir().unwrap();
    let txt = SimulatedTxt::builder().start().unwrap();
    let watch = Watch::by(command(txt.address(), &[]).current_dir(folder.path()), txt.address());
    let mut page = watch.page();
    let handler = watch.handler().build().unwrap();
    handler.begin_transfer().unwrap();
    handler.areas().lock()[LOCAL_IO].output.duty[0] = 300;
    wait_for_cycles(&mut page, 20);
    assert_eq!(start(&mut page), "run-0001.mcap");
    handler.areas().lock()[LOCAL_IO].output.duty[0] = 400;
    let before = wait_for_cycles(&mut page, 20);
    stop(&mut page);
    let after = wait_for_cycles(&mut page, 20);
    handler.end_transfer().unwrap();

    let file = InFile::read(&folder.path().join("run-0001.mcap"));
    let (begin, end) = file.range();
    assert_eq!(begin, 1);
    assert!(before <= end && end < after, "{before} {end} {after}");
    let [Transfer::Began { address, .. }] = &file.transfers[..] else {
        panic!("{:?}", file.transfers);
    };
    assert_eq!(*address, txt.address().to_string());
    let duties = file.cycles.iter().map(|cycle| cycle.areas[0].output.duty[0]);
    assert!([300, 400].into_iter().all(|duty| duties.clone().any(|one| one == duty)));

    // This one has the end of the transfer, which was before the click.
    page.state(0, |state| state["link"]["phase"] == "idle");
    assert_eq!(start(&mut page), "run-0002.mcap");
    stop(&mut page);
    let file = InFile::read(&folder.path().join("run-0002.mcap"));
    assert!(matches!(&file.transfers[..], [Transfer::Began { .. }, Transfer::Ended]));
}

#[test]
fn a_page_shows_the_file_that_is_recorded_from_the_beginning_and_makes_no_second_one() {
    let folder = tempfile::tempdir().unwrap();
    let txt = SimulatedTxt::builder().start().unwrap();
    let mut command = command(txt.address(), &["--record", "mine.mcap"]);
    let watch = Watch::by(command.current_dir(folder.path()), txt.address());
    let mut page = watch.page();
    let handler = watch.handler().build().unwrap();
    handler.begin_transfer().unwrap();
    let state = page.state(0, |state| state["recording"]["bytes"].as_u64() > Some(10_000));
    let RecordingState(phase, by_page, file) = RecordingState::of(&state);
    assert_eq!((phase, by_page, file), ("on", false, "mine.mcap"), "{state}");
    assert_eq!(page.refused(json!({"do": "record", "on": true})), "not_recorded");
    assert_eq!(page.refused(json!({"do": "record", "on": false})), "not_recorded");
    wait_for_cycles(&mut page, 5);
    assert_eq!(folder.path().read_dir().unwrap().count(), 1);
}

/// Its phase, whether a page may start and stop it, and its file.
struct RecordingState<'a>(&'a str, bool, &'a str);

impl<'a> RecordingState<'a> {
    fn of(state: &'a Value) -> Self {
        let recording = &state["recording"];
        let text = |key: &str| recording[key].as_str().unwrap_or_default();
        Self(text("phase"), recording["by_page"] == true, text("file"))
    }
}
