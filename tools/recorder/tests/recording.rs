//! What a recorder writes, a recording gives back, whatever has happened to the file.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use ft_transfer_area::transfer_area::{InputMode, UniConfig, LOCAL_IO, REMOTE_IO_1};
use ft_transfer_area::tx::Input;
use ft_transfer_area::{
    CameraFrame, FishX1Transfer, LoggedCycle, TransferAreaComHandler, TransferAreaComHandlerBuilder,
};
use ft_transfer_area_recorder::{
    Cycle, Entry, Error, Failure, FailureKind, Options, Parts, Recorded, Recorder, Recording,
    Transfer,
};
use ft_transfer_area_simulator::{Fault, FaultKind, SimulatedTxt, SimulatedTxtBuilder};
use tempfile::TempDir;

/// Room for all cycles of a test, however slow the disk is.
fn roomy() -> Options {
    Options::default().capacity(5_000)
}

fn unpaced() -> SimulatedTxtBuilder {
    SimulatedTxt::builder().pace(Duration::ZERO)
}

fn handler_for(txt: &SimulatedTxt) -> TransferAreaComHandlerBuilder {
    TransferAreaComHandler::builder(txt.address().to_string())
}

pub(crate) fn folder() -> TempDir {
    tempfile::tempdir().expect("there is a folder for temporary files")
}

/// The entries of a file and whether it is cut off.
pub(crate) fn read(path: &Path) -> Result<(Vec<Entry>, bool), Error> {
    let mut recording = Recording::open(path)?;
    let entries = recording.by_ref().collect::<Result<_, _>>()?;
    Ok((entries, recording.is_cut_off()))
}

fn cycles(entries: &[Entry]) -> Vec<&Cycle> {
    let cycle = |entry| match entry {
        &Entry { what: Recorded::Cycle(ref cycle), .. } => Some(cycle),
        _ => None,
    };
    entries.iter().filter_map(cycle).collect()
}

fn transfers(entries: &[Entry]) -> Vec<&Transfer> {
    let transfer = |entry| match entry {
        &Entry { what: Recorded::Transfer(ref transfer), .. } => Some(transfer),
        _ => None,
    };
    entries.iter().filter_map(transfer).collect()
}

/// Records a program that writes I1 + 1 to O2, over this many responses.
fn record(path: &Path, cycles: usize) {
    let mut number = 0;
    let txt = unpaced().on_exchange(move |machine| {
        number += 1;
        machine.controllers[0].uni[0] = number % 500;
    });
    let txt = txt.start().unwrap();
    let handler = handler_for(&txt).build().unwrap();
    let recorder = Recorder::start(&handler, path, roomy()).unwrap();
    handler.areas().lock()[LOCAL_IO].config.uni[0] = UniConfig::analog(InputMode::Voltage);
    handler.begin_transfer().unwrap();
    for _ in 0..cycles {
        let mut areas = handler.areas().wait_cycle().unwrap();
        areas[LOCAL_IO].output.duty[1] = areas[LOCAL_IO].input.uni[0] + 1;
    }
    handler.end_transfer().unwrap();
    recorder.finish().unwrap();
}

/// Each is shorter than a second, after which the statistics are written anyway.
#[test]
fn each_transfer_has_the_statistics_of_its_last_cycle() {
    let folder = folder();
    let path = folder.path().join("run.mcap");
    let txt = unpaced().start().unwrap();
    let handler = handler_for(&txt).build().unwrap();
    let recorder = Recorder::start(&handler, &path, roomy()).unwrap();
    for _ in 0..3 {
        handler.begin_transfer().unwrap();
        drop(handler.areas().wait_cycle().unwrap());
        handler.end_transfer().unwrap();
    }
    recorder.finish().unwrap();
    let (entries, _) = read(&path).unwrap();
    let ends = entries.windows(2).filter_map(|pair| match (&pair[0].what, &pair[1].what) {
        (Recorded::Statistics(statistics), Recorded::Transfer(Transfer::Ended)) => {
            Some(statistics.cycles)
        }
        _ => None,
    });
    let ends: Vec<u64> = ends.collect();
    assert_eq!(ends.len(), 3, "{entries:?}");
    assert_eq!(ends.iter().sum::<u64>(), cycles(&entries).len() as u64);
}

/// Cycles come while the file is changed, and nothing depends on how many files there are.
#[test]
fn a_recording_in_parts_has_each_cycle_once_and_each_part_begins_with_the_controller() {
    let folder = folder();
    let txt = SimulatedTxt::builder().device_name("Night").start().unwrap();
    let handler = handler_for(&txt).build().unwrap();
    let parts = Parts::of_time(Duration::from_millis(50));
    let path = folder.path().join("run.mcap");
    let mut recorder = Recorder::start(&handler, &path, roomy().parts(parts)).unwrap();
    assert_eq!(recorder.path(), folder.path().join("run-0001.mcap"));
    handler.begin_transfer().unwrap();
    while !recorder.newest().ends_with("run-0005.mcap") {
        drop(handler.areas().wait_cycle().unwrap());
    }
    handler.end_transfer().unwrap();
    assert!(recorder.rename(&path).is_err());
    let totals = recorder.finish().unwrap();
    let mut files: Vec<_> =
        fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.sort();
    assert!(files.len() >= 5, "{files:?}");
    let mut numbers = Vec::new();
    let mut last_end = None;
    for file in &files {
        let started = Recording::open(file).unwrap().started();
        assert!(last_end.is_none_or(|end| started > end), "{file:?}");
        let (entries, is_cut_off) = read(file).unwrap();
        assert!(!is_cut_off);
        let cycles = cycles(&entries);
        let Some(first) = cycles.first() else {
            // The transfer ended when it had just begun, or began later on a busy computer.
            assert!(numbers.is_empty() || Some(file) == files.last(), "{entries:?}");
            continue;
        };
        let Transfer::Began { device_name, firmware, address, areas } = transfers(&entries)[0]
        else {
            panic!("{entries:?}");
        };
        // Several simulated controllers have one address.
        assert_eq!(*address, txt.address().to_string());
        assert_eq!((&**device_name, &**firmware, *areas), ("Night", "4.7.0", 1));
        assert_eq!(first.first, numbers.is_empty(), "{file:?}");
        assert_eq!(first.areas[0].config.motor[0], 1, "the configuration is there");
        numbers.extend(cycles.iter().map(|cycle| cycle.number));
        let of_cycle = |entry: &&Entry| matches!(entry.what, Recorded::Cycle(_));
        last_end = entries.iter().rfind(of_cycle).map(|entry| started + entry.at);
    }
    assert_eq!(numbers, (1..=totals.cycles).collect::<Vec<_>>());
    assert_eq!(totals.lost, 0);
}

#[test]
fn a_part_that_is_due_in_a_gap_begins_with_the_controller_that_answers_then() {
    // On a busy machine the recorder may be late by more than a short part.
    let begins = [50, 200, 800, 3200].into_iter().any(|length| {
        let (transfers, cycles) = part_of_gap(Duration::from_millis(length));
        matches!(&transfers[..], [Transfer::Began { device_name, address, .. }]
            if device_name == "BETA" && address == "127.0.0.3" && cycles == [3])
    });
    assert!(begins);
}

/// What is in the second part, which is due in a gap after ALPHA and before BETA.
fn part_of_gap(length: Duration) -> (Vec<Transfer>, Vec<u64>) {
    let folder = folder();
    let parts = Parts::of_time(length);
    let path = folder.path().join("run.mcap");
    let (recorder, mut feed) = Recorder::fed(&path, roomy().parts(parts)).unwrap();
    let [name, firmware] = ["BETA", "4.7.0"].map(str::to_owned);
    let address = "127.0.0.3".to_owned();
    let areas = vec![FishX1Transfer::default()];
    let began = Transfer::Began {
        device_name: "ALPHA".to_owned(),
        firmware: firmware.clone(),
        address: "127.0.0.2".to_owned(),
        areas: 1,
    };
    let cycle = |number, first| {
        let mut cycle = LoggedCycle::new(number, &areas);
        cycle.first = first;
        cycle
    };
    feed.transfer(Instant::now(), began);
    feed.cycle(cycle(1, true));
    let away = Failure { kind: FailureKind::NoAnswer, error: "away".to_owned() };
    feed.transfer(Instant::now(), Transfer::Lost(away));
    std::thread::sleep(2 * length);
    feed.cycle(cycle(2, true));
    let (device_name, after_ms) = (name.clone(), 100);
    feed.transfer(Instant::now(), Transfer::Restored { after_ms, device_name, firmware, address });
    feed.cycle(cycle(3, false));
    recorder.finish().unwrap();
    let Ok((entries, _)) = read(&folder.path().join("run-0002.mcap")) else {
        return Default::default();
    };
    let transfers = transfers(&entries).into_iter().cloned().collect();
    (transfers, cycles(&entries).iter().map(|cycle| cycle.number).collect())
}

/// As of a program that goes online and offline again and again, behind `txt watch`.
#[test]
fn a_part_has_its_size_also_without_a_cycle() {
    let folder = folder();
    let parts = Parts::of_bytes(50_000);
    let path = folder.path().join("run.mcap");
    let (recorder, mut feed) = Recorder::fed(&path, roomy().parts(parts)).unwrap();
    let mut number = 0_u32;
    while recorder.newest() == recorder.path() {
        // Something that does not get small.
        let error = std::array::from_fn::<_, 20, _>(|_| {
            number = number.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            char::from(b'a' + (number >> 16) as u8 % 26)
        });
        let failure = Failure { kind: FailureKind::Other, error: error.iter().collect() };
        feed.transfer(Instant::now(), Transfer::EndedBy(failure));
        std::thread::sleep(Duration::from_micros(100));
        let size = fs::metadata(recorder.path()).unwrap().len();
        // Half a second comes at once.
        assert!(size < 2_000_000, "{size}");
    }
    recorder.finish().unwrap();
}

/// The parts of areas that are recorded, with the inputs that the simulated TXT gave.
#[test]
fn every_cycle_comes_back_with_its_outputs_inputs_and_configuration() {
    let folder = folder();
    let path = folder.path().join("run.mcap");
    let seen = Arc::new(Mutex::new(Vec::new()));
    let exchanged = Arc::clone(&seen);
    let mut number = 0;
    let txt = unpaced().extensions(1).on_exchange(move |machine| {
        number += 1;
        for (index, controller) in (1..).zip(&mut machine.controllers) {
            controller.uni = [number * index; 8];
            controller.ir[2].right_x = (number % 16) as i8;
            controller.ir[2].right_y = -4;
            controller.mic_log = number as u16;
        }
        machine.alive[0] = number < 40;
        let master = &machine.controllers[0];
        exchanged.lock().unwrap().push((master.outputs, master.uni, master.counter));
    });
    let txt = txt.start().unwrap();
    let handler = handler_for(&txt).areas(2).build().unwrap();
    let recorder = Recorder::start(&handler, &path, roomy()).unwrap();
    handler.areas().lock()[REMOTE_IO_1].set_ft_uni_config(Input::I3, InputMode::Ultrasonic, false);
    handler.begin_transfer().unwrap();
    for cycle in 0..60 {
        let mut areas = handler.areas().wait_cycle().unwrap();
        areas[LOCAL_IO].output.duty[0] = 5 * cycle;
        areas[LOCAL_IO].output.distance[0] = 1000;
        if cycle % 10 == 0 {
            areas[LOCAL_IO].raise_motor_ex_cmd_id(ft_transfer_area::tx::Motor::M1);
        }
    }
    handler.end_transfer().unwrap();
    let totals = recorder.finish().unwrap();

    let (entries, cut_off) = read(&path).unwrap();
    assert!(!cut_off);
    let cycles = cycles(&entries);
    let seen = seen.lock().unwrap();
    assert_eq!((totals.cycles, totals.lost), (seen.len() as u64, 0));
    assert_eq!(cycles.len(), seen.len());
    for ((number, cycle), (outputs, uni, counter)) in (1..).zip(&cycles).zip(&*seen) {
        let master = &cycle.areas[LOCAL_IO];
        assert_eq!((cycle.number, cycle.first, cycle.lost), (number, number == 1, 0));
        assert_eq!((*master.input.uni, *master.input.counter), (*uni, *counter));
        assert_eq!(master.output.duty, outputs.duty, "cycle {number}");
        assert_eq!(master.output.distance, outputs.distance);
        assert_eq!(master.output.motor_ex_cmd_id, outputs.motor_command_id);
        assert_eq!(master.txt_inputs2.mic_log, number as u16);
        assert_eq!(i64::from(master.txt_inputs.ir_input[2].joy_right_x), number as i64 % 16);
        assert_eq!(master.slaves_alive(), usize::from(number < 40));
        let extension = &cycle.areas[REMOTE_IO_1];
        assert_eq!(extension.input.uni[0], 2 * number.min(39) as i16);
        assert_eq!(extension.config.uni[2], UniConfig::analog(InputMode::Ultrasonic));
    }
    let transfers = transfers(&entries);
    assert!(
        matches!(transfers[..], [Transfer::Began { areas: 2, .. }, Transfer::Ended]),
        "{transfers:?}"
    );
    let moved = entries.iter().find_map(|entry| match &entry.what {
        Recorded::Event(event) if event.event == "JoystickMoved" => Some(event),
        _ => None,
    });
    let moved = moved.expect("the remote's joystick was moved");
    assert_eq!((moved.y, moved.terminal.ends_with("Right")), (Some(-4), true), "{moved:?}");
    let events = entries.iter().filter(|entry| {
        matches!(&entry.what,
        Recorded::Event(event) if event.event == "ExtensionChanged" && event.controller == "E1")
    });
    assert_eq!(events.count(), 1);
}

/// The clock of a handler in lock-step is that of its cycles, which may be behind.
#[test]
fn cycles_in_lock_step_keep_their_times() {
    const STEP: Duration = Duration::from_millis(10);

    let folder = folder();
    let path = folder.path().join("run.mcap");
    let txt = unpaced().lock_step().start().unwrap();
    let handler = handler_for(&txt).lock_step().build().unwrap();
    // Longer than a few cycles.
    std::thread::sleep(5 * STEP);
    let recorder = Recorder::start(&handler, &path, roomy()).unwrap();
    handler.begin_transfer().unwrap();
    (0..20).for_each(|_| drop(handler.areas().wait_cycle().unwrap()));
    handler.end_transfer().unwrap();
    recorder.finish().unwrap();
    let (entries, _) = read(&path).unwrap();
    let cycles = entries.iter().filter(|entry| matches!(entry.what, Recorded::Cycle(_)));
    let times: Vec<Duration> = cycles.map(|entry| entry.at).collect();
    assert!(
        times.len() >= 20 && times.windows(2).all(|pair| pair[1] - pair[0] == STEP),
        "{times:?}"
    );
}

#[test]
fn gaps_and_errors_are_in_the_file() {
    let folder = folder();
    let path = folder.path().join("run.mcap");
    let txt = unpaced().fault(Fault::at_exchange(10, FaultKind::WrongCrc)).start().unwrap();
    let handler = handler_for(&txt).reconnect(Duration::from_secs(30)).build().unwrap();
    let recorder = Recorder::start(&handler, &path, roomy()).unwrap();
    handler.begin_transfer().unwrap();
    assert!(txt.wait_until(|machine| machine.exchanges() > 30, Duration::from_secs(30)));
    handler.end_transfer().unwrap();
    drop(handler);
    recorder.finish().unwrap();
    let (entries, _) = read(&path).unwrap();
    match transfers(&entries)[..] {
        [Transfer::Began { device_name, firmware, address, .. }, Transfer::Lost(lost), Transfer::Restored { device_name: now, firmware: newest, address: at, .. }, Transfer::Ended] =>
        {
            assert_eq!((&**device_name, lost.kind), ("TX2013", FailureKind::WrongData));
            assert_eq!((now, newest, at), (device_name, firmware, address));
            assert_eq!(*at, txt.address().to_string());
        }
        ref other => panic!("{other:?}"),
    }
    let firsts = cycles(&entries).into_iter().filter(|cycle| cycle.first);
    assert_eq!(firsts.map(|cycle| cycle.number).collect::<Vec<_>>(), [1, 11]);
}

#[test]
fn pictures_come_back_as_jpeg() {
    let folder = folder();
    let path = folder.path().join("run.mcap");
    let handler = TransferAreaComHandler::builder("127.0.0.1").build().unwrap();
    let recorder = Recorder::start(&handler, &path, roomy()).unwrap();
    let picture = include_bytes!("../../../tests/camera/clean_48x32_420.jpg");
    let sink = recorder.frames();
    sink.record(&CameraFrame::new(picture.to_vec()));
    sink.record(&CameraFrame::new(b"no picture".to_vec()));
    let totals = recorder.finish().unwrap();
    assert_eq!((totals.frames, totals.lost_frames), (1, 0), "one of them is none");
    let (entries, _) = read(&path).unwrap();
    let pictures: Vec<_> = entries
        .iter()
        .filter_map(|entry| match &entry.what {
            Recorded::Picture(jpeg) => Some(jpeg),
            _ => None,
        })
        .collect();
    assert_eq!(pictures.len(), 1, "the damaged one is in the log");
    assert!(pictures[0].starts_with(b"\xFF\xD8") && pictures[0].ends_with(b"\xFF\xD9"));
}

/// Wherever the file ends, its entries are the first ones of the whole file.
#[test]
fn a_file_that_is_cut_off_anywhere_is_readable_up_to_there() {
    let folder = folder();
    let path = folder.path().join("run.mcap");
    record(&path, 300);
    let whole = fs::read(&path).unwrap();
    let (entries, cut_off) = read(&path).unwrap();
    assert!(!cut_off && cycles(&entries).len() >= 300);
    let inputs = |entries: &[Entry]| -> Vec<i16> {
        cycles(entries).iter().map(|cycle| cycle.areas[0].input.uni[0]).collect()
    };
    let all = inputs(&entries);
    let cut = folder.path().join("cut.mcap");
    let (mut most, mut opened) = (0, 0);
    let step = (whole.len() / 90).max(1);
    for length in (0..whole.len()).step_by(step).chain([whole.len() - 1]) {
        fs::write(&cut, &whole[..length]).unwrap();
        match read(&cut) {
            Err(Error::Empty { .. }) => assert_eq!(opened, 0, "{length}"),
            Err(error) => panic!("{length}: {error}"),
            Ok((entries, cut_off)) => {
                let found = inputs(&entries);
                assert!(cut_off, "{length} of {}", whole.len());
                assert!(found.len() >= most && found == all[..found.len()], "{length}");
                (most, opened) = (found.len(), opened + 1);
            }
        }
    }
    assert!(opened > 60);
    assert_eq!(most, all.len(), "only the index is missing");
}

#[test]
fn what_is_no_recording_is_told_in_a_sentence() {
    let folder = folder();
    let write = |name: &str, bytes: &[u8]| -> PathBuf {
        let path = folder.path().join(name);
        fs::write(&path, bytes).unwrap();
        path
    };
    let sentence = |path: &Path| format!("{:#}", read(path).unwrap_err());

    assert!(sentence(&folder.path().join("none")).starts_with("can't read "));
    assert!(sentence(folder.path()).starts_with("can't read "));
    assert!(sentence(&write("empty", b"")).ends_with("is empty, or cut off before its first entry"));
    let text = write("text", b"I1;I2;I3\n0;1;0\n and so on, line for line");
    assert!(sentence(&text).ends_with("is not an MCAP file"), "{}", sentence(&text));

    let mut other = mcap::WriteOptions::new().library("other 1.0").profile("ros1");
    other = other.compression(None);
    let mut bytes = std::io::Cursor::new(Vec::new());
    other.create(&mut bytes).unwrap().finish().unwrap();
    let other = sentence(&write("other", bytes.get_ref()));
    assert!(other.ends_with("not a recording of a TXT: it was written by other 1.0"), "{other}");

    let path = folder.path().join("run.mcap");
    record(&path, 10);
    let whole = fs::read(&path).unwrap();
    let at = whole.windows(6).position(|bytes| bytes == b"format").unwrap();
    let mut newer = whole.clone();
    // The value follows its length.
    newer[at + 10] = b'2';
    let newer = sentence(&write("newer", &newer));
    assert!(newer.contains("has format 2, and this program knows formats up to 1"), "{newer}");
}

/// Whatever a file says, reading it ends, without a panic.
#[test]
fn no_damage_is_more_than_an_error() {
    let folder = folder();
    let path = folder.path().join("run.mcap");
    record(&path, 30);
    let whole = fs::read(&path).unwrap();
    let damaged = folder.path().join("damaged.mcap");
    let (mut errors, mut damages) = (0, 0);
    for place in 0..150 {
        let mut bytes = whole.clone();
        let at = place * whole.len() / 150;
        bytes[at] = bytes[at].wrapping_add(1 | place as u8);
        fs::write(&damaged, &bytes).unwrap();
        match Recording::open(&damaged) {
            // Only what is wrong at the beginning.
            Err(_) => errors += 1,
            Ok(mut recording) => {
                recording.by_ref().for_each(|entry| drop(entry.unwrap()));
                damages += usize::from(recording.damage().is_some());
            }
        }
    }
    assert!(errors < 20 && damages > 40, "{errors}, {damages}");
}

/// A pipe that nobody reads is a disk that is too slow.
#[cfg(unix)]
#[test]
fn on_a_slow_disk_cycles_are_lost_and_counted_and_the_transfer_goes_on() {
    use std::io::Read;

    let folder = folder();
    let pipe = folder.path().join("pipe");
    nix::unistd::mkfifo(&pipe, nix::sys::stat::Mode::S_IRWXU).unwrap();
    let opening = std::thread::spawn({
        let pipe = pipe.clone();
        move || fs::File::open(pipe).unwrap()
    });
    let txt = unpaced().start().unwrap();
    let handler = handler_for(&txt).build().unwrap();
    let recorder = Recorder::start(&handler, &pipe, Options::default().capacity(20)).unwrap();
    let mut file = opening.join().unwrap();
    handler.begin_transfer().unwrap();
    let mut noise = 0_u32;
    for _ in 0..3_000 {
        // Something that does not get small.
        noise = noise.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let duty = std::array::from_fn(|output| (noise >> (2 * output) & 511) as i16);
        *handler.areas().wait_cycle().unwrap()[LOCAL_IO].output.duty = duty;
    }
    handler.end_transfer().unwrap();
    let total = handler.areas().statistics().cycles;
    // The disk works again.
    let copied = std::thread::spawn(move || {
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes).map(|_| bytes)
    });
    let totals = recorder.finish().unwrap();
    let path = folder.path().join("run.mcap");
    fs::write(&path, copied.join().unwrap().unwrap()).unwrap();
    let (entries, cut_off) = read(&path).unwrap();
    assert!(!cut_off);
    let cycles = cycles(&entries);
    let before_cycles: u64 = cycles.iter().map(|cycle| cycle.lost).sum();
    let before_others = transfers(&entries).into_iter().map(|transfer| match transfer {
        Transfer::NotRecorded { entries } => *entries,
        _ => 0,
    });
    assert!(totals.lost > 0, "there was nothing to lose");
    assert_eq!(cycles.len() as u64 + totals.lost, total);
    assert_eq!(before_cycles + before_others.sum::<u64>(), totals.lost, "also before the end");
    for pair in cycles.windows(2) {
        assert_eq!(pair[1].number, pair[0].number + pair[1].lost + 1, "the loss is where it was");
    }
}

#[cfg(not(unix))]
#[test]
#[ignore = "only Unix has a pipe with a name like a file"]
fn on_a_slow_disk_cycles_are_lost_and_counted_and_the_transfer_goes_on() {}

#[cfg_attr(not(target_os = "linux"), ignore = "only Linux has a file that is always full")]
#[test]
fn a_full_disk_is_told_in_a_sentence() {
    let handler = TransferAreaComHandler::builder("127.0.0.1").build().unwrap();
    let full = Recorder::start(&handler, "/dev/full", roomy()).unwrap_err();
    let full = format!("{full:#}");
    assert!(full.starts_with("can't write /dev/full: No space left on device"), "{full}");
    let missing = Recorder::start(&handler, "/no/such/folder/run.mcap", roomy()).unwrap_err();
    assert!(
        format!("{missing:#}").starts_with("can't write /no/such/folder/run.mcap: "),
        "{missing}"
    );
}

/// Set for the process that has the limit: its file, which ends this test there.
const LIMITED: &str = "RECORD_LIMITED";

#[cfg_attr(not(target_os = "linux"), ignore = "only Linux tells the thread that has written")]
#[test]
fn a_limit_for_the_size_of_files_ends_the_recording_and_nothing_else() {
    if let Some(path) = std::env::var_os(LIMITED) {
        return record_up_to_the_limit(Path::new(&path));
    }
    let folder = folder();
    let path = folder.path().join("run.mcap");
    let name = "recording::a_limit_for_the_size_of_files_ends_the_recording_and_nothing_else";
    let output = Command::new("sh")
        .args(["-c", "ulimit -f 40; exec \"$0\" --nocapture --exact \"$1\""])
        .arg(std::env::current_exe().unwrap())
        .arg(name)
        .env(LIMITED, &path)
        .output()
        .unwrap();
    assert!(output.status.success(), "{output:?}");
    assert!(read(&path).unwrap().1, "it is cut off");
}

/// Drives until nothing more is recorded, and then a cycle more.
fn record_up_to_the_limit(path: &Path) {
    let txt = unpaced().start().unwrap();
    let handler = handler_for(&txt).build().unwrap();
    let recorder = Recorder::start(&handler, path, roomy()).unwrap();
    handler.begin_transfer().unwrap();
    let mut noise = 0_u32;
    while recorder.error().is_none() {
        noise = noise.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        let duty = std::array::from_fn(|output| (noise >> (2 * output) & 511) as i16);
        *handler.areas().wait_cycle().unwrap()[LOCAL_IO].output.duty = duty;
    }
    handler.areas().wait_cycle().map(drop).unwrap();
    handler.end_transfer().unwrap();
    let error = format!("{:#}", recorder.finish().unwrap_err());
    assert!(error.contains("File too large"), "{error}");
}

#[test]
fn a_recorder_of_a_handler_that_is_gone_has_finished_its_file() {
    let folder = folder();
    let path = folder.path().join("run.mcap");
    let txt = unpaced().start().unwrap();
    let handler = handler_for(&txt).build().unwrap();
    let recorder = Recorder::start(&handler, &path, roomy()).unwrap();
    handler.begin_transfer().unwrap();
    handler.areas().wait_cycle().map(drop).unwrap();
    drop(handler);
    drop(recorder);
    let (entries, cut_off) = read(&path).unwrap();
    assert!(!cut_off && !cycles(&entries).is_empty());
    let new = FishX1Transfer::default();
    let last = cycles(&entries).last().unwrap().areas[0].output.duty;
    assert_eq!(last, new.output.duty, "motors off");
}

#[test]
fn what_was_lost_last_is_told_at_the_end() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    let (recorder, mut feed) = Recorder::fed(&path, Options::default().capacity(1)).unwrap();
    for number in 1..=1000 {
        feed.cycle(LoggedCycle::new(number, &[FishX1Transfer::default()]));
    }
    drop(feed);
    let totals = recorder.finish().unwrap();
    assert_eq!(totals.cycles + totals.lost, 1000);
    let entries = Recording::open(&path).unwrap().map(|entry| match entry.unwrap().what {
        Recorded::Cycle(cycle) => 1 + cycle.lost,
        Recorded::Transfer(Transfer::NotRecorded { entries }) => entries,
        _ => 0,
    });
    assert_eq!(entries.sum::<u64>(), 1000);
}
