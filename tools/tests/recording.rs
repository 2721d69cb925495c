//! `txt record`, `info` and `csv`, as they are used.

use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

use ft_transfer_area::{FirmwareVersion, TransferAreaComHandler};
use ft_transfer_area_recorder::{Options, Recorder};
use ft_transfer_area_simulator::SimulatedTxt;
use tempfile::TempDir;

use crate::replay::record;
use crate::running::{wait_for, Running};
use crate::watch::away::{at_free_ports, started};

pub(crate) const DEADLINE: Duration = Duration::from_secs(60);

pub(crate) fn txt(args: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_txt"));
    command.args(args).stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

pub(crate) fn run(args: &[&str]) -> Output {
    txt(args).output().unwrap()
}

pub(crate) fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr)
}

pub(crate) fn in_folder(folder: &TempDir, name: &str) -> String {
    folder.path().join(name).to_str().unwrap().to_owned()
}

#[test]
fn a_recording_by_the_program_has_a_table_and_is_not_replaced() {
    let folder = tempfile::tempdir().unwrap();
    let path = in_folder(&folder, "run.mcap");
    let args = ["record", "--simulate", "slide", "--seconds", "0.6", "--input", "I4=cm", "-o"];
    let args: Vec<&str> = args.into_iter().chain([&*path]).collect();
    let recorded = run(&args);
    assert!(recorded.status.success(), "{}", said(&recorded));
    assert!(said(&recorded).contains(" cycles, 0 lost, "), "{}", said(&recorded));

    let again = run(&args);
    assert_eq!(again.status.code(), Some(1));
    assert!(said(&again).contains("is there already; --force replaces it"), "{}", said(&again));

    let info = run(&["info", &path, "--json"]);
    let info: serde_json::Value = serde_json::from_slice(&info.stdout).unwrap();
    assert_eq!((&info["device_name"], &info["is_cut_off"]), (&"TX2013".into(), &false.into()));
    let table = run(&["csv", &path, "I4", "C1"]);
    let table = String::from_utf8(table.stdout).unwrap();
    let mut lines = table.lines();
    assert_eq!(lines.next(), Some("time,cycle,I4,C1,local_time"));
    assert_eq!(lines.clone().count() as u64, info["cycles"].as_u64().unwrap());
    // The slide is half way between 5 and 25 cm.
    assert!(lines.clone().all(|line| line.contains(",15,0,")), "{table}");
    // The time of day, to the millisecond and with its offset.
    let is_time = |line: &str| line.rsplit_once(',').is_some_and(|(_, time)| time.len() == 29);
    assert!(lines.all(is_time), "{table}");
}

#[test]
fn an_extension_that_is_not_connected_has_no_values() {
    let folder = tempfile::tempdir().unwrap();
    let path = in_folder(&folder, "run.mcap");
    // The first one is pressed, is cut off, and is released then. The second one comes as late.
    let builder = SimulatedTxt::builder().extensions(2).on_exchange(|machine| {
        let is_later = machine.exchanges() > 10;
        machine.alive[..2].copy_from_slice(&[!is_later, is_later]);
        machine.controllers[1].uni[0] = i16::from(!is_later);
        machine.controllers[2].uni[0] = (machine.exchanges() / 5 % 2) as i16;
    });
    let txt = builder.lock_step().start().unwrap();
    let builder = TransferAreaComHandler::builder(txt.address().to_string()).areas(3);
    let handler = builder.lock_step().build().unwrap();
    let recorder = Recorder::start(&handler, &path, Options::default()).unwrap();
    handler.begin_transfer().unwrap();
    (0..30).for_each(|_| drop(handler.areas().wait_cycle().unwrap()));
    handler.end_transfer().unwrap();
    recorder.finish().unwrap();
    let table = String::from_utf8(run(&["csv", &path, "E1.I1", "E2.I1"]).stdout).unwrap();
    let lines = table.lines().skip(1).map(|line| line.split(',').collect());
    let lines: Vec<Vec<&str>> = lines.collect();
    let is_there = |line: &&Vec<&str>| [!line[2].is_empty(), !line[3].is_empty()];
    let (first, later): (Vec<_>, Vec<_>) = lines.iter().partition(|line| line[2] == "1");
    assert!(!first.is_empty() && first.iter().all(|line| is_there(line) == [true, false]));
    assert!(
        later.len() > 10 && later.iter().all(|line| is_there(line) == [false, true]),
        "{table}"
    );

    // Without names it is enough that some are there.
    for picture in ["run.svg", "run.html"] {
        let picture = in_folder(&folder, picture);
        let kind = if picture.ends_with("html") { "--html" } else { "-o" };
        let plot = run(&["plot", &path, kind, &picture]);
        assert!(plot.status.success(), "{}", said(&plot));
    }
    let never = run(&["plot", &path, "E1.I1", "--from", "0.25"]);
    assert!(said(&never).contains("or the extension was not connected"), "{}", said(&never));
    // It may come after the first cycle.
    let same = run(&["compare", &path, &path, "E2.I1"]);
    assert!(same.status.success(), "{}", said(&same));
}

#[cfg_attr(not(unix), ignore = "a time zone is chosen by TZ there")]
#[test]
fn a_part_is_given_by_the_time_of_day() {
    let folder = tempfile::tempdir().unwrap();
    let path = in_folder(&folder, "run.mcap");
    record(&path, None, 1);
    let run = |zone: &str, args: &[&str]| txt(args).env("TZ", zone).output().unwrap();
    let info = run("XYZ-5", &["info", &path, "--json"]);
    let info: serde_json::Value = serde_json::from_slice(&info.stdout).unwrap();
    let started = info["started_at"].as_str().unwrap();
    assert!(started.ends_with("+05:00"), "{started}");
    let begin = &started["2025-01-01 ".len()..started.len() - "+05:00".len()];
    let [whole, from] = [&[][..], &["--from", begin, "--to", "3600"]]
        .map(|part| run("XYZ-5", &[&["csv", &path, "I1"], part].concat()));
    assert!(from.status.success(), "{}", said(&from));
    assert_eq!((from.stdout, whole.stdout.len() > 1000), (whole.stdout, true));
    let picture = in_folder(&folder, "run.svg");
    let plot = run("XYZ-5", &["plot", &path, "M1", "--around", begin, "-o", &picture]);
    assert!(plot.status.success(), "{}", said(&plot));
    let picture = fs::read_to_string(picture).unwrap();
    assert!(picture.lines().any(|line| line.starts_with(begin)), "{begin} in {picture}");
    // An hour before, where it is an hour earlier.
    for command in ["csv", "plot", "replay"] {
        let other = run("XYZ-4", &[command, &path, "--from", begin]);
        assert_eq!(other.status.code(), Some(1), "{}", said(&other));
        let sentence = format!("{begin} is not in the recording, which lasts from ");
        assert!(said(&other).starts_with(&sentence), "{}", said(&other));
    }
}

#[test]
fn a_recording_in_parts_has_files_that_can_be_read_alone() {
    let folder = tempfile::tempdir().unwrap();
    let path = in_folder(&folder, "run.mcap");
    let args = ["record", "--simulate", "slide", "--seconds", "2.5", "--parts", "1s", "-o", &path];
    let recorded = run(&args);
    assert!(recorded.status.success(), "{}", said(&recorded));
    let mut files = names(&folder);
    files.sort();
    assert!(files.len() >= 2 && files[0] == "run-0001.mcap", "{files:?}");
    let newest = in_folder(&folder, files.last().unwrap());
    assert!(said(&recorded).contains(&format!(" to {newest}: ")), "{}", said(&recorded));
    let info = run(&["info", &newest, "--json"]);
    let info: serde_json::Value = serde_json::from_slice(&info.stdout).unwrap();
    assert_eq!((&info["device_name"], &info["transfers"]), (&"TX2013".into(), &1.into()));
    assert_eq!(info["unusual_counts"].get("gap"), None);
    let all = run(&["info", &path]);
    let all = String::from_utf8(all.stdout).unwrap();
    let listed = all.lines().filter_map(|line| line.strip_prefix("file "));
    let expected: Vec<_> = files.iter().map(|name| in_folder(&folder, name)).collect();
    assert_eq!(listed.map(str::trim).collect::<Vec<_>>(), expected);
    let all = run(&["info", "--json", &path]);
    let all: serde_json::Value = serde_json::from_slice(&all.stdout).unwrap();
    assert_eq!(all.as_array().unwrap().len(), files.len());
    assert_eq!(all[0]["file"], *expected[0]);
    assert_eq!(all[0]["device_name"], "TX2013");
    for reads in ["plot", "csv", "replay"] {
        let sentence = format!("{path} is in parts, {} to {newest}: name one of them", expected[0]);
        let one = run(&[reads, &path]);
        assert_eq!(one.status.code(), Some(1));
        assert!(said(&one).starts_with(&sentence), "{}", said(&one));
    }
    let both = run(&["record", "--simulate", "--parts", "1s", "--force", "-o", &path]);
    assert_eq!(both.status.code(), Some(2), "{}", said(&both));

    // As after a power cut.
    fs::write(&expected[0], "").unwrap();
    let rest = run(&["info", &path]);
    assert_eq!(rest.status.code(), Some(1));
    assert!(said(&rest).contains(&format!("1 of {} parts can't be read", files.len())));
    let shown = String::from_utf8(rest.stdout).unwrap();
    assert!(shown.contains("is empty") && shown.contains("TX2013"), "{shown}");
    let rest: serde_json::Value =
        serde_json::from_slice(&run(&["info", "--json", &path]).stdout).unwrap();
    assert!(rest[0]["error"].as_str().unwrap().contains("is empty"), "{rest}");
    assert_eq!(rest[1]["device_name"], "TX2013");
}

#[cfg_attr(windows, ignore = "Windows keeps a file that is written")]
#[test]
fn a_file_that_somebody_has_given_another_name_is_missed_at_the_end() {
    let folder = tempfile::tempdir().unwrap();
    let [path, other] = ["run.mcap", "other.mcap"].map(|name| in_folder(&folder, name));
    let txt = SimulatedTxt::builder().start().unwrap();
    let host = txt.address().to_string();
    for arguments in
        [&["record", &host, "-o", &path][..], &["watch", &host, "--port", "0", "--record", &path]]
    {
        let running = Running::start(&mut recording(arguments));
        wait_for("nothing is recorded", || fs::metadata(&path).is_ok_and(|file| file.len() > 0));
        fs::rename(&path, &other).unwrap();
        running.signal("INT");
        let output = running.end();
        assert_eq!(output.status.code(), Some(1), "{}", said(&output));
        let last = said(&output).lines().last().unwrap_or_default().to_owned();
        assert!(last.ends_with(&format!("{path} is not there any more")), "{last}");
    }
}

#[cfg_attr(not(unix), ignore = "only Unix says which file has a name")]
#[test]
fn a_file_in_whose_place_somebody_puts_another_is_missed_at_the_end() {
    let folder = tempfile::tempdir().unwrap();
    let [path, other] = ["run.mcap", "other.mcap"].map(|name| in_folder(&folder, name));
    let txt = SimulatedTxt::builder().start().unwrap();
    let host = txt.address().to_string();
    for arguments in
        [&["record", &host, "-o", &path][..], &["watch", &host, "--port", "0", "--record", &path]]
    {
        let replaced = Running::start(&mut recording(arguments));
        wait_for("nothing is recorded", || fs::metadata(&path).is_ok_and(|file| file.len() > 0));
        fs::write(&other, "another").unwrap();
        fs::rename(&other, &path).unwrap();
        replaced.signal("INT");
        let output = replaced.end();
        assert_eq!(output.status.code(), Some(1), "{}", said(&output));
        let last = said(&output).lines().last().unwrap_or_default().to_owned();
        let sentence =
            format!("{path} is another file now, so this recording is not there any more");
        assert!(last.ends_with(&sentence), "{last}");
        fs::remove_file(&path).unwrap();
    }
}

/// `txt` with these arguments, without a page.
pub(crate) fn recording(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_txt"));
    command.args(arguments).stdout(Stdio::null()).stderr(Stdio::piped());
    if arguments[0] == "watch" {
        command.arg("--no-page");
    }
    command
}

/// The names of what is in a folder.
pub(crate) fn names(folder: &TempDir) -> Vec<String> {
    let entries = fs::read_dir(folder.path()).unwrap();
    entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect()
}

#[test]
fn with_force_the_old_file_is_there_until_the_transfer_has_begun() {
    let folder = tempfile::tempdir().unwrap();
    let path = in_folder(&folder, "run.mcap");
    fs::write(&path, "the old one").unwrap();
    let refused = run(&["record", "127.0.0.1:1", "--force", "-o", &path]);
    assert_eq!(refused.status.code(), Some(1), "{}", said(&refused));
    assert!(said(&refused).starts_with("nothing listens at 127.0.0.1:1"), "{}", said(&refused));
    assert_eq!(fs::read_to_string(&path).unwrap(), "the old one");
    assert_eq!(names(&folder), ["run.mcap"], "nothing is left beside it");

    let args = ["record", "--simulate", "--seconds", "0.3", "--force", "-o", &path];
    let recorded = run(&args);
    assert!(recorded.status.success(), "{}", said(&recorded));
    assert!(said(&recorded).starts_with(&format!("{path}: ")), "{}", said(&recorded));
    assert!(run(&["info", &path]).status.success());
    assert_eq!(names(&folder), ["run.mcap"]);
}

/// Where nothing listens, a system may connect a port of this computer with itself: here it has no other choice.
#[cfg_attr(not(target_os = "linux"), ignore = "only Linux has network namespaces")]
#[test]
fn a_port_that_is_connected_with_itself_is_no_controller() {
    let folder = tempfile::tempdir().unwrap();
    let path = in_folder(&folder, "run.mcap");
    let ports = "/proc/sys/net/ipv4/ip_local_port_range";
    let inside = format!("ip link set lo up && echo 50000 50001 > {ports} && exec \"$@\"");
    let unshare = |program: &[&str]| {
        let mut command = Command::new("unshare");
        command.args(["--user", "--map-root-user", "--net", "sh", "-c", &inside, "sh"]);
        command.args(program).output()
    };
    if !unshare(&["true"]).is_ok_and(|output| output.status.success()) {
        // Not into the test's captured output, so that the note is always shown.
        let note =
            "SKIPPED: no network of its own for a test of txt record (unshare and ip are needed)\n";
        std::io::Write::write_all(&mut std::io::stderr(), note.as_bytes()).unwrap();
        return;
    }
    for port in [50000, 50001] {
        let address = format!("127.0.0.1:{port}");
        let txt = [env!("CARGO_BIN_EXE_txt"), "record", &address, "-o", &path];
        let output = unshare(&txt).unwrap();
        assert!(said(&output).starts_with(&format!("nothing listens at {address}")), "{output:?}");
    }
}

#[cfg_attr(not(unix), ignore = "only Unix can end another program like Ctrl-C")]
#[test]
fn with_force_the_old_file_is_there_until_a_watched_program_drives() {
    let folder = tempfile::tempdir().unwrap();
    let path = in_folder(&folder, "run.mcap");
    fs::write(&path, "the old one").unwrap();
    let txt = SimulatedTxt::builder().start().unwrap();
    let address = txt.address().to_string();
    let args = ["watch", &address, "--port", "0", "--no-page", "--record", &path, "--force"];
    for drives in [false, true] {
        let watch = Running::start(&mut self::txt(&args));
        let main = watch.line();
        let port = main.rsplit_once(':').unwrap().1;
        watch.line();
        if drives {
            let handler =
                TransferAreaComHandler::builder(format!("127.0.0.1:{port}")).build().unwrap();
            handler.begin_transfer().unwrap();
            drop(handler.areas().wait_cycle_for(DEADLINE).unwrap());
            handler.end_transfer().unwrap();
        }
        watch.signal("INT");
        let ended = watch.end();
        assert!(ended.status.success(), "{}", said(&ended));
        assert_eq!(names(&folder), ["run.mcap"], "nothing is left beside it");
        let is_old = fs::read(&path).unwrap() == b"the old one";
        assert_eq!(is_old, !drives, "{}", said(&ended));
    }
    assert!(run(&["info", &path]).status.success());
}

#[cfg_attr(not(unix), ignore = "links need special rights there")]
#[test]
fn with_force_a_link_stays_a_link() {
    let folder = tempfile::tempdir().unwrap();
    let (path, link) = (in_folder(&folder, "run.mcap"), in_folder(&folder, "link.mcap"));
    fs::write(&path, "the old one").unwrap();
    assert!(Command::new("ln").args(["-s", "run.mcap", &link]).status().unwrap().success());
    let args = ["record", "--simulate", "--seconds", "0.3", "--force", "-o", &link];
    let recorded = run(&args);
    assert!(recorded.status.success(), "{}", said(&recorded));
    assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
    assert!(run(&["info", &path]).status.success());
}

#[cfg_attr(not(unix), ignore = "only Unix can end another program like Ctrl-C")]
#[test]
fn another_controller_after_a_gap_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let path = in_folder(&folder, "run.mcap");
    let first = at_free_ports(|port| SimulatedTxt::builder().port(port).device_name("FIRST"));
    let (address, port) = (first.address().to_string(), first.port());
    let printed = tempfile::NamedTempFile::new().unwrap();
    let mut record = txt(&["record", &address, "-o", &path]);
    let record = Running::start(record.stderr(printed.reopen().unwrap()));
    assert!(first.wait_until(|machine| machine.exchanges() > 20, DEADLINE));
    drop(first);
    let firmware = FirmwareVersion::new(4, 2, 4);
    let second = || SimulatedTxt::builder().port(port).device_name("SECOND").firmware(firmware);
    let second = started(second);
    let warning = "SECOND answers in place of FIRST, whose motors may go on";
    let deadline = Instant::now() + DEADLINE;
    while !fs::read_to_string(printed.path()).unwrap().contains(warning) {
        assert!(Instant::now() < deadline, "{:?}", fs::read_to_string(printed.path()));
        std::thread::sleep(Duration::from_millis(20));
    }
    second.with_machine(|machine| machine.controllers[0].uni[0] = 1);
    let exchanges = second.with_machine(|machine| machine.exchanges());
    assert!(second.wait_until(|machine| machine.exchanges() > exchanges + 20, DEADLINE));
    record.signal("INT");
    assert!(record.end().status.success());

    let info = said(&run(&["info", &path]));
    assert!(info.starts_with("controller   FIRST at "), "{info}");
    assert!(info.contains(" s) on SECOND, firmware 4.2.4\n"), "{info}");
    let json = run(&["info", &path, "--json"]);
    let json: serde_json::Value = serde_json::from_slice(&json.stdout).unwrap();
    assert_eq!(json["device_name"], "FIRST");
    assert_eq!(json["later_controllers"][0]["device_name"], "SECOND");
    assert_eq!(json["later_controllers"].as_array().unwrap().len(), 1);
    let picture = in_folder(&folder, "run.svg");
    let plot = run(&["plot", &path, "I1", "-o", &picture]);
    assert!(plot.status.success(), "{}", said(&plot));
    assert!(fs::read_to_string(&picture).unwrap().contains("(FIRST, then SECOND)"));
    let replay = Running::start(txt(&["replay", &path, "--port", "0"]).stderr(Stdio::piped()));
    assert!(replay.line().contains("(FIRST, "));
    replay.signal("INT");
    let errors = replay.end().stderr;
    let errors = String::from_utf8_lossy(&errors);
    assert!(errors.contains("SECOND, firmware 4.2.4, answered"), "{errors}");
}

#[test]
fn a_table_that_fails_tells_on_which_side() {
    let folder = tempfile::tempdir().unwrap();
    let [path, damaged, table] =
        ["run.mcap", "damaged.mcap", "run.csv"].map(|name| in_folder(&folder, name));
    record(&path, None, 1);
    let mut bytes = fs::read(&path).unwrap();
    let head = bytes.windows(9).position(|part| part == b"recording").unwrap();
    bytes[head] ^= 0x55;
    fs::write(&damaged, bytes).unwrap();
    for to in [&["-o", &table][..], &[]] {
        let output = run(&[&["csv", &damaged, "I1"], to].concat());
        assert_eq!(output.status.code(), Some(1), "{}", said(&output));
        let said = String::from_utf8(output.stderr).unwrap();
        assert!(said.starts_with(&format!("{damaged} is damaged: ")), "{said}");
    }
    let itself = run(&["csv", &path, "-o", &path]);
    assert_eq!(said(&itself).trim_end(), format!("can't write {path}: it is the recording"));
    // Nor under another name, as a table or a picture.
    for (name, command) in [("hard.csv", "csv"), ("run.svg", "plot")] {
        let other = in_folder(&folder, name);
        fs::hard_link(&path, &other).unwrap();
        let itself = run(&[command, &path, "-o", &other]);
        assert_eq!(said(&itself).trim_end(), format!("can't write {other}: it is the recording"));
    }
    assert!(run(&["info", &path]).status.success(), "it is as it was");
    if cfg!(target_os = "linux") {
        let full = said(&run(&["csv", &path, "-o", "/dev/full"]));
        assert!(full.starts_with("can't write /dev/full: No space left on device"), "{full}");
        assert!(full.trim_end().ends_with("so make room or use another one"), "{full}");
        let nowhere = fs::File::create("/dev/full").unwrap();
        let output = txt(&["csv", &path]).stdout(nowhere).output().unwrap();
        assert!(said(&output).starts_with("can't write the output: No space left"), "{output:?}");
    }
}

#[test]
fn names_in_a_recording_are_no_commands_for_the_terminal() {
    let folder = tempfile::tempdir().unwrap();
    let path = in_folder(&folder, "run.mcap");
    let txt = SimulatedTxt::builder().device_name("\u{1B}[2J\n\u{202E}red").start().unwrap();
    let handler = TransferAreaComHandler::builder(txt.address().to_string()).build().unwrap();
    let recorder = Recorder::start(&handler, &path, Options::default()).unwrap();
    handler.begin_transfer().unwrap();
    handler.areas().wait_cycle().map(drop).unwrap();
    handler.end_transfer().unwrap();
    recorder.finish().unwrap();
    let info = said(&run(&["info", &path]));
    let controller = info.lines().next().unwrap();
    assert!(controller.contains("\u{FFFD}[2J\u{FFFD}\u{FFFD}red at 127.0.0.1"), "{info:?}");
    let json = run(&["info", &path, "--json"]);
    assert!(json.stdout.is_ascii() && !json.stdout.contains(&0x1B), "{json:?}");
    let json: serde_json::Value = serde_json::from_slice(&json.stdout).unwrap();
    assert_eq!(json["device_name"], "\u{1B}[2J\n\u{202E}red", "a script gets it as it is");
    let replay = Running::start(&mut crate::recording::txt(&["replay", &path, "--port", "0"]));
    assert!(replay.line().contains("\u{FFFD}[2J\u{FFFD}\u{FFFD}red"));
}

#[test]
fn what_can_not_be_recorded_or_read_is_told_in_a_sentence() {
    let folder = tempfile::tempdir().unwrap();
    let path = in_folder(&folder, "run.mcap");
    let sentence = |args: &[&str]| {
        let output = run(args);
        assert_eq!(output.status.code(), Some(1), "{}", said(&output));
        let said = said(&output);
        assert_eq!(said.lines().filter(|line| !line.is_empty()).count(), 1, "{said}");
        said
    };
    for command in ["info", "csv", "replay"] {
        assert!(sentence(&[command, &path]).starts_with("can't read "));
    }
    fs::write(&path, "no recording").unwrap();
    for command in ["info", "csv", "replay"] {
        assert!(sentence(&[command, &path]).trim_end().ends_with("is not an MCAP file"));
    }
    let missing = sentence(&["record", "--simulate", "nowhere", "-o", "other.mcap"]);
    assert!(missing.contains("nowhere"), "{missing}");
    // Nobody listens there, and nothing is in the way of the next attempt.
    let path = in_folder(&folder, "none.mcap");
    let nobody = sentence(&["record", "127.0.0.1:1", "-o", &path]);
    assert!(nobody.starts_with("nothing listens at 127.0.0.1:1"), "{nobody}");
    assert!(!Path::new(&path).exists());
    let folder = in_folder(&folder, "no/such/run.mcap");
    assert!(sentence(&["record", "--simulate", "-o", &folder]).starts_with("can't write "));
}

#[cfg_attr(not(target_os = "linux"), ignore = "only Linux has a file that is always full")]
#[test]
fn an_output_that_takes_nothing_is_told_in_a_sentence() {
    let folder = tempfile::tempdir().unwrap();
    let path = in_folder(&folder, "run.mcap");
    record(&path, None, 1);
    let full = fs::File::create("/dev/full").unwrap();
    let output = txt(&["info", &path]).stdout(full).output().unwrap();
    assert_eq!(output.status.code(), Some(1), "{}", said(&output));
    let full = "can't write the output: No space left on device";
    assert!(said(&output).starts_with(full), "{}", said(&output));
}

#[cfg_attr(not(unix), ignore = "Ctrl-C can't be sent to a single program there")]
#[test]
fn ctrl_c_ends_a_recording_well() {
    let folder = tempfile::tempdir().unwrap();
    let path = in_folder(&folder, "run.mcap");
    let running = Running::start(&mut txt(&["record", "--simulate", "-o", &path]));
    let begin = Instant::now();
    let has_cycles = || {
        let info = run(&["info", "--json", &path]);
        let info: serde_json::Value = serde_json::from_slice(&info.stdout).unwrap_or_default();
        info["cycles"].as_u64().unwrap_or(0) > 0
    };
    // While it is written, it can be read up to there.
    while !has_cycles() {
        assert!(begin.elapsed() < DEADLINE, "nothing was written");
    }
    running.signal("INT");
    let output = running.end();
    assert!(output.status.success(), "{}", said(&output));
    let info = run(&["info", &path]);
    assert!(info.status.success() && !said(&info).contains("cut off"), "{}", said(&info));
}

/// A limit for the size of a file is a full disk.
#[cfg_attr(not(target_os = "linux"), ignore = "only Linux tells the thread that has written")]
#[test]
fn on_a_full_disk_it_ends_with_a_sentence_and_what_was_written_can_be_read() {
    let folder = tempfile::tempdir().unwrap();
    let path = in_folder(&folder, "run.mcap");
    let limited = "ulimit -f 40; exec \"$0\" \"$@\"";
    let output = Command::new("sh")
        .args(["-c", limited, env!("CARGO_BIN_EXE_txt"), "record", "--simulate", "-o", &path])
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(1), "{}", said(&output));
    let said_last = said(&output).lines().last().unwrap().to_owned();
    assert!(said_last.starts_with("can't write "), "{said_last}");
    assert!(said_last.contains(" cycles from before, which can be read: "), "{said_last}");
    let info = run(&["info", &path, "--json"]);
    let info: serde_json::Value = serde_json::from_slice(&info.stdout).unwrap();
    assert_eq!(info["is_cut_off"], true);
    assert!(info["cycles"].as_u64() > Some(10), "{info}");
}

#[cfg(target_os = "linux")]
#[test]
fn a_part_that_can_not_begin_leaves_no_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    let mut command = Command::new("sh");
    command.args(["-c", "ulimit -f 0; exec \"$0\" \"$@\"", env!("CARGO_BIN_EXE_txt")]);
    command.args(["record", "--simulate", "slide", "--seconds", "1", "--parts", "1h", "-o"]);
    let output = command.arg(&path).output().unwrap();
    assert!(!output.status.success());
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}
