//! `txt plot`: a picture of a recording.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::OnceLock;
use std::time::Duration;

use ft_transfer_area::transfer_area::{InputMode, UniConfig};
use ft_transfer_area::tx::Motor;
use ft_transfer_area::{TimeLimits, TransferAreaComHandler};
use ft_transfer_area_recorder::{Options, Recorder};
use ft_transfer_area_simulator::world::World;
use ft_transfer_area_simulator::SimulatedTxt;
use serde_json::Value;
use tempfile::TempDir;

/// Longer than anything takes on a busy machine.
const DEADLINE: Duration = Duration::from_secs(60);

/// After this time without a response, the connection counts as lost.
const GAP: Duration = Duration::from_millis(400);

/// A folder with a recording, which is made once.
pub(crate) fn recording() -> (TempDir, PathBuf) {
    static MADE: OnceLock<PathBuf> = OnceLock::new();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("slide.mcap");
    fs::copy(MADE.get_or_init(record), &path).unwrap();
    (folder, path)
}

/// Records a slide that moves, is lost for a moment, and comes back by a distance.
fn record() -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("slide.mcap");
    let builder = SimulatedTxt::builder().world(World::shipped("slide").unwrap()).extensions(1);
    let fault = "silence@exchange:120".parse().unwrap();
    let txt = builder.fault(fault).device_name("<Slide>").start().unwrap();
    let limits = TimeLimits::default().read(GAP);
    let builder = TransferAreaComHandler::builder(txt.address().to_string()).areas(2);
    let handler = builder.time_limits(limits).reconnect(DEADLINE).build().unwrap();
    let recorder = Recorder::start(&handler, &path, Options::default()).unwrap();
    handler.areas().lock()[0].config.uni[3] = UniConfig::analog(InputMode::Ultrasonic);
    handler.areas().lock()[0].raise_config_id();
    handler.begin_transfer().unwrap();
    handler.areas().lock()[0].output.duty[0] = 512;
    while handler.areas().wait_cycle().is_ok() {}
    // The gap stops the motors, and each handle gets one error for it.
    handler.areas().wait_cycle().unwrap()[0].output.duty[1] = 512;
    handler.areas().lock()[0].output.distance[0] = 50;
    handler.areas().lock()[0].raise_motor_ex_cmd_id(Motor::M1);
    while handler.areas().wait_cycle().unwrap()[0].input.motor_ex_reached[0] == 0 {}
    handler.end_transfer().unwrap();
    recorder.finish().unwrap();
    path
}

fn plot(recording: &Path, options: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_txt"));
    command.arg("plot").arg(recording).args(options).output().unwrap()
}

fn text(bytes: &[u8]) -> &str {
    std::str::from_utf8(bytes).unwrap()
}

/// The picture of a recording.
fn svg(recording: &Path, options: &[&str]) -> String {
    let output = plot(recording, options);
    assert!(output.status.success(), "{output:?}");
    let path = text(&output.stdout).trim_end();
    fs::read_to_string(path).unwrap()
}

/// The points of all lines of this colour.
fn points(svg: &str, colour: &str) -> Vec<(i32, i32)> {
    let lines = svg.lines().filter(|line| line.starts_with("<polyline") && line.contains(colour));
    let points = lines.filter_map(|line| line.split_once("points=\"")?.1.split_once('"'));
    let pairs = points.flat_map(|(points, _)| points.split_whitespace());
    pairs
        .map(|pair| pair.split_once(',').unwrap())
        .map(|(x, y)| (x.parse().unwrap(), y.parse().unwrap()))
        .collect()
}

/// The widths of the rectangles that show a gap.
fn shaded(svg: &str) -> Vec<u32> {
    let rectangles =
        svg.lines().filter(|line| line.starts_with("<rect") && line.contains("#F1DCDC"));
    let widths = rectangles.filter_map(|line| line.split_once("width=\"")?.1.split_once('"'));
    widths.map(|(width, _)| width.parse().unwrap()).collect()
}

#[test]
fn each_unit_has_a_panel_with_its_axis_and_its_names() {
    let (_folder, path) = recording();
    let svg = svg(
        &path,
        &["I4", "c1", "M1", "O1", "E1.I2", "-o", path.with_file_name("a.svg").to_str().unwrap()],
    );
    for part in ["distance in cm", "pulses", "duty, 512 is full", "0 or 1", "time since"] {
        assert_eq!(svg.matches(part).count(), 1, "{part}");
    }
    for name in ["I4", "C1", "M1", "O1", "E1.I2"] {
        assert!(svg.lines().any(|line| line.trim() == name), "{name}");
    }
    assert!(svg.contains("slide.mcap (&lt;Slide&gt;)"), "the title is escaped");
    assert!(svg.contains("@media (prefers-color-scheme: dark)"));
    // The motor goes forward and backward, so its line is as high as its panel, which is the third.
    let motor =
        points(&svg, "#0969DA").into_iter().map(|(_, y)| y).filter(|y| (526..720).contains(y));
    assert!(motor.clone().max().unwrap() - motor.min().unwrap() > 150);
    // One in each of the four panels, from the last response on and not only from when it was noticed.
    let gaps = shaded(&svg);
    assert!(gaps.len() == 4 && gaps.iter().all(|width| *width > 40), "{gaps:?}");
}

#[test]
fn without_names_all_that_changes_is_drawn() {
    let (_folder, path) = recording();
    let svg = svg(&path, &[]);
    assert!(path.with_extension("svg").exists());
    let has = |name: &str| svg.lines().any(|line| line.trim() == name);
    assert_eq!(
        ["I4", "C1", "M1", "I3", "M2", "E1.M1"].map(has),
        [true, true, true, false, false, false]
    );
}

/// All pairs are single outputs, and all are switched on together.
#[test]
fn lamps_are_drawn_and_in_the_table_as_single_outputs() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("lamps.mcap");
    let txt = SimulatedTxt::builder().start().unwrap();
    let handler = TransferAreaComHandler::builder(txt.address().to_string()).build().unwrap();
    let recorder = Recorder::start(&handler, &path, Options::default()).unwrap();
    Motor::ALL.into_iter().for_each(|motor| {
        handler.areas().lock()[0].set_ft_motor_config(motor, false);
    });
    handler.begin_transfer().unwrap();
    for cycle in 0..40 {
        handler.areas().wait_cycle().unwrap()[0].output.duty =
            [i16::from(cycle > 20) * 512; 8].into();
    }
    handler.end_transfer().unwrap();
    recorder.finish().unwrap();
    let picture = svg(&path, &[]);
    let has = |name: &str| picture.lines().any(|line| line.trim() == name);
    assert_eq!(["O1", "O8", "M1"].map(has), [true, true, false]);
    let mut csv = Command::new(env!("CARGO_BIN_EXE_txt"));
    let table = csv.arg("csv").arg(&path).output().unwrap().stdout;
    assert!(text(&table)
        .lines()
        .next()
        .unwrap()
        .ends_with(",M4,O1,O2,O3,O4,O5,O6,O7,O8,local_time"));
    assert!(text(&table).lines().any(|line| line.contains(",0,512,512,")), "M4, O1 and O2");
}

#[test]
fn a_part_of_the_time_has_only_its_values() {
    let (_folder, path) = recording();
    let whole = svg(&path, &["C1"]);
    let part = svg(&path, &["C1", "--from", "0.2", "--to", "0.6"]);
    let labels = |svg: &str| {
        svg.lines().filter(|line| line.ends_with(" s")).map(str::to_owned).collect::<Vec<_>>()
    };
    assert!(
        labels(&whole).contains(&"0 s".to_owned()) || labels(&whole).contains(&"1 s".to_owned())
    );
    assert!(labels(&part).iter().all(|label| {
        let second: f64 = label.trim_end_matches(" s").parse().unwrap();
        (0.2..=0.6).contains(&second)
    }));
    assert!(shaded(&part).is_empty(), "the gap is later");
    let output = plot(&path, &["C1", "--from", "3000"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(text(&output.stderr).contains("slide.mcap has no cycle in this time"), "{output:?}");
}

#[test]
fn unusual_moments_are_listed_drawn_and_told() {
    let (_folder, path) = recording();
    let info = Command::new(env!("CARGO_BIN_EXE_txt")).arg("info").arg(&path).output().unwrap();
    let info = text(&info.stdout);
    assert!(info.lines().any(|line| line.starts_with("unusual      1 gap")), "{info}");
    let gap = info.lines().find(|line| line.contains("the connection was lost: ")).unwrap();
    assert!(gap.contains("; it was back after "), "{gap}");
    let number = gap.split_whitespace().next().unwrap();
    let output = plot(&path, &["C1", "--unusual", number]);
    assert!(output.status.success(), "{output:?}");
    let said = text(&output.stderr);
    assert!(said.contains(&format!("unusual {number}: ")), "{said}");
    let svg = fs::read_to_string(text(&output.stdout).trim_end()).unwrap();
    assert!(svg.lines().any(|line| line.starts_with("<polyline") && line.contains("#BF8700")));
    assert!(svg.lines().any(|line| line.trim() == number), "its number is in the picture");
    let before = plot(&path, &["C1", "--to", "0.5"]);
    assert!(!text(&before.stderr).contains("the connection was lost"), "{before:?}");
    let missing = plot(&path, &["C1", "--unusual", "1000"]);
    assert_eq!(missing.status.code(), Some(1));
    assert!(text(&missing.stderr).starts_with("txt info lists unusual moments"), "{missing:?}");
}

#[test]
fn a_page_has_the_unusual_moments_of_its_part_and_the_times_of_day() {
    let (folder, path) = recording();
    let mut info = Command::new(env!("CARGO_BIN_EXE_txt"));
    let info = info.args(["info", "--json"]).arg(&path).output().unwrap();
    let info: Value = serde_json::from_slice(&info.stdout).unwrap();
    let listed = info["unusual"].as_array().unwrap();
    let gap = listed.iter().find(|moment| moment["kind"] == "gap").unwrap();
    let page = |options: &[&str]| {
        let html = folder.path().join("page.html");
        let mut command = Command::new(env!("CARGO_BIN_EXE_txt"));
        command.env("TZ", "Europe/Berlin").arg("plot").arg(&path).args(options);
        let output = command.arg("--html").arg(&html).output().unwrap();
        assert!(output.status.success(), "{output:?}");
        let page = fs::read_to_string(html).unwrap();
        let (_, rest) = page.split_once("type=\"application/json\">").unwrap();
        serde_json::from_str::<Value>(rest.split_once("</script>").unwrap().0).unwrap()
    };
    let whole = page(&[]);
    let marked = whole["unusual"].as_array().unwrap();
    assert_eq!(marked.len(), listed.len(), "{whole}");
    let mark = marked.iter().find(|mark| mark["kind"] == "gap").unwrap();
    assert_eq!(mark["number"], gap["number"]);
    let seconds = |value: &Value| value.as_f64().unwrap();
    assert!((seconds(&mark["at"]) - seconds(&gap["seconds"])).abs() < 0.01, "{mark}");
    let begins = |what: &Value, with| what.as_str().unwrap().starts_with(with);
    assert!(begins(&mark["what"]["en"], "the connection was lost: "), "{mark}");
    assert!(begins(&mark["what"]["de"], "die Verbindung riss ab: "), "{mark}");
    let started = (info["started"].as_f64().unwrap() * 1000.0) as i64;
    assert!((whole["started"].as_i64().unwrap() - started).abs() <= 1, "{}", whole["started"]);
    if cfg!(unix) {
        assert_eq!(whole["zone"], "Europe/Berlin");
    }
    let end = format!("{:.3}", seconds(&gap["seconds"]) - 0.01);
    let before = page(&["--to", &end]);
    assert!(before["unusual"].as_array().unwrap().iter().all(|mark| mark["kind"] != "gap"));
}

#[test]
fn a_recording_that_is_cut_off_is_drawn_up_to_there() {
    let (folder, path) = recording();
    let bytes = fs::read(&path).unwrap();
    let cut = folder.path().join("cut.mcap");
    fs::write(&cut, &bytes[..bytes.len() * 2 / 3]).unwrap();
    let output = plot(&cut, &["C1"]);
    assert!(output.status.success(), "{output:?}");
    assert!(text(&output.stderr).contains("cut.mcap is cut off"), "{output:?}");
    assert!(!points(&fs::read_to_string(cut.with_extension("svg")).unwrap(), "#0969DA").is_empty());
}

#[test]
fn mistakes_end_with_a_sentence() {
    let (folder, path) = recording();
    let other = folder.path().join("other.mcap");
    fs::write(&other, "something else, long enough for a beginning").unwrap();
    let missing = folder.path().join("missing.mcap");
    let recording = path.to_str().unwrap();
    for (file, options, status, part) in [
        (&path, &["I9"][..], 2, "there is no \"I9\""),
        (&path, &["E4.I1"], 1, "E4.I1 is not in slide.mcap"),
        (&path, &["I1", "-o", recording], 1, "the name of a picture ends with .svg"),
        (&path, &["--html", recording], 1, "the name of a page ends with .html"),
        (&path, &["I1", "-o", "/no/such/folder/a.svg"], 1, "can't write /no/such/folder/a.svg: "),
        (&path, &["I1", "--from", "2", "--to", "1"], 1, "--from has to be before --to"),
        (&path, &["I1", "--from", "x"], 2, "seconds are expected"),
        (&other, &["I1"], 1, "other.mcap is not an MCAP file"),
        (&missing, &["I1"], 1, "can't read"),
    ] {
        let output = plot(file, options);
        assert_eq!(output.status.code(), Some(status), "{options:?}: {output:?}");
        assert!(text(&output.stderr).contains(part), "{options:?}: {output:?}");
    }
    assert!(fs::read(&path).unwrap().starts_with(b"\x89MCAP"));
}
