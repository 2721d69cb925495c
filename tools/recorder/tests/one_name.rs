//! Several recordings with one name.

use std::fs;
use std::path::Path;
use std::sync::Barrier;
use std::thread;
use std::time::Duration;

use ft_transfer_area::{FishX1Transfer, LoggedCycle, TransferAreaComHandler};
use ft_transfer_area_recorder::{Options, Parts, Recorded, Recorder, Recording};

const REFUSED: &str = "another recording is being written into it";

/// Records so many cycles.
fn record(path: &Path, cycles: u64) {
    let (recorder, mut feed) = Recorder::fed(path, Options::default()).unwrap();
    (1..=cycles)
        .for_each(|number| feed.cycle(LoggedCycle::new(number, &[FishX1Transfer::default()])));
    assert_eq!(recorder.finish().unwrap().cycles, cycles);
}

fn cycles(recording: &mut Recording) -> usize {
    recording.filter(|entry| matches!(entry.as_ref().unwrap().what, Recorded::Cycle(_))).count()
}

fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap();
    let mut names: Vec<_> =
        entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

#[test]
fn a_file_that_another_recorder_writes_is_refused_and_stays() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    let handler = TransferAreaComHandler::builder("127.0.0.1").build().unwrap();
    let (recorder, mut feed) = Recorder::fed(&path, Options::default()).unwrap();
    feed.cycle(LoggedCycle::new(1, &[FishX1Transfer::default()]));
    let sentence = format!("can't write {}: {REFUSED}", path.display());
    let refused = [
        Recorder::start(&handler, &path, Options::default()).map(drop),
        Recorder::fed(&path, Options::default()).map(drop),
    ];
    for refused in refused {
        assert_eq!(format!("{:#}", refused.unwrap_err()), sentence);
    }
    // Nor is it replaced.
    let beside = folder.path().join("beside.mcap");
    let (mut other, _feed) = Recorder::fed(&beside, Options::default()).unwrap();
    assert_eq!(format!("{:#}", other.rename(&path).unwrap_err()), sentence);
    other.finish().unwrap();
    feed.cycle(LoggedCycle::new(2, &[FishX1Transfer::default()]));
    assert_eq!(recorder.finish().unwrap().cycles, 2);
    let mut recording = Recording::open(&path).unwrap();
    assert_eq!(cycles(&mut recording), 2);
    assert!(!recording.is_cut_off() && recording.damage().is_none());
    // Then it may be replaced.
    record(&path, 3);
    assert_eq!(names(folder.path()), ["beside.mcap", "run.mcap"]);
}

#[test]
fn a_part_that_is_written_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    let start = |parts| Recorder::fed(&path, Options::default().parts(parts));
    let (recorder, _feed) = start(Parts::of_bytes(1 << 30)).unwrap();
    let refused = Recorder::fed(recorder.newest(), Options::default()).map(drop).unwrap_err();
    assert!(format!("{refused:#}").ends_with(REFUSED), "{refused:#}");

    // Its next part is not another recording's.
    let several = [Parts::of_bytes(1 << 30), Parts::of_time(Duration::from_secs(1))];
    for parts in several {
        let refused = format!("{:#}", start(parts).map(drop).unwrap_err());
        assert!(
            refused.ends_with("another recording with this name is being written"),
            "{refused}"
        );
    }
    // One that has a single part may have the next number.
    let (single, _feed) = start(Parts::of_bytes(u64::MAX)).unwrap();
    assert_eq!(single.newest(), folder.path().join("run-0002.mcap"));
    single.finish().unwrap();
    recorder.finish().unwrap();
    let (next, _feed) = start(several[0]).unwrap();
    assert_eq!(next.newest(), folder.path().join("run-0003.mcap"));
}

#[test]
fn of_several_recordings_in_parts_that_begin_together_one_begins() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    let all = Barrier::new(8);
    let start = || {
        all.wait();
        Recorder::fed(&path, Options::default().parts(Parts::of_bytes(1 << 30)))
    };
    let begun: Vec<_> = thread::scope(|scope| {
        let threads = [(); 8].map(|()| scope.spawn(start));
        threads.into_iter().filter_map(|begun| begun.join().unwrap().ok()).collect()
    });
    assert_eq!(begun.len(), 1);
    assert_eq!(names(folder.path()), ["run-0001.mcap"]);
}

#[cfg_attr(windows, ignore = "Wine replaces no file that is open")]
#[test]
fn who_reads_an_earlier_recording_keeps_it() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    record(&path, 5);
    let mut reading = Recording::open(&path).unwrap();
    record(&path, 7);
    assert_eq!(cycles(&mut reading), 5);
    reading.rewind().unwrap();
    assert_eq!(cycles(&mut reading), 5, "once more");
    assert_eq!(cycles(&mut Recording::open(&path).unwrap()), 7);
    assert_eq!(names(folder.path()), ["run.mcap"]);
}

#[cfg(unix)]
#[test]
fn a_new_recording_has_the_place_of_an_earlier_one() {
    use std::os::unix::fs::{symlink, MetadataExt, PermissionsExt};

    let folder = tempfile::tempdir().unwrap();
    let [path, link, second] =
        ["run.mcap", "newest.mcap", "kept.mcap"].map(|name| folder.path().join(name));
    record(&path, 5);
    fs::set_permissions(&path, fs::Permissions::from_mode(0o640)).unwrap();
    symlink("run.mcap", &link).unwrap();
    fs::hard_link(&path, &second).unwrap();
    record(&link, 7);
    assert!(link.is_symlink());
    assert_eq!(cycles(&mut Recording::open(&path).unwrap()), 7);
    assert_eq!(fs::metadata(&path).unwrap().mode() & 0o777, 0o640);
    assert_eq!(cycles(&mut Recording::open(&second).unwrap()), 5, "its other name");

    // A link to what is not there yet.
    fs::remove_file(&path).unwrap();
    record(&link, 2);
    assert_eq!(cycles(&mut Recording::open(&path).unwrap()), 2);

    // Nothing new can be made in the folder, as when only the file may be written.
    let beside = folder.path().join(format!("run.mcap.{}.new", std::process::id()));
    fs::create_dir(&beside).unwrap();
    record(&path, 9);
    assert_eq!(cycles(&mut Recording::open(&path).unwrap()), 9);
    assert_eq!(names(folder.path()).len(), 4);
}
