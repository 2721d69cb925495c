//! The examples as a user runs them.
#![cfg(unix)]

use std::path::PathBuf;
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

/// Longer than anything takes on a busy machine; only a test that fails waits so long.
const DEADLINE: Duration = Duration::from_secs(60);

/// An example, built along with the tests.
fn example(name: &str) -> Command {
    let tests: PathBuf = std::env::current_exe().unwrap();
    let path = tests.ancestors().nth(2).unwrap().join("examples").join(name);
    assert!(path.exists(), "{path:?} is not built: run the tests without naming a target");
    Command::new(path)
}

fn text(bytes: &[u8]) -> &str {
    std::str::from_utf8(bytes).unwrap()
}

/// The number at the start of the line that ends so.
fn number_before(output: &Output, ending: &str) -> u64 {
    let stdout = text(&output.stdout);
    let line = stdout.lines().find(|line| line.ends_with(ending));
    let line = line.unwrap_or_else(|| panic!("no {ending:?} in {stdout}"));
    line.split(' ').next().unwrap().parse().unwrap()
}

#[test]
fn the_motor_follows_the_switch_on_master_and_extension() {
    let output = example("motor_on_off_switch").args(["--seconds", "2"]).output().unwrap();
    assert!(output.status.success());
    let transfers = number_before(&output, " transfers done");
    assert!(transfers > 10, "only {transfers} transfers in two seconds");
    for id in 0..2 {
        let lines = text(&output.stdout).lines();
        let start = format!("Transfer ID={id} I=");
        let states: Vec<(bool, bool)> = lines
            .filter_map(|line| line.strip_prefix(&start))
            .map(|line| (line.starts_with('1'), line.contains("O=512-0")))
            .collect();
        for state in [(false, false), (true, true)] {
            assert!(states.contains(&state), "no {state:?} on {id}");
        }
        assert!(states.iter().all(|(pressed, runs)| pressed == runs), "{id}: {states:?}");
    }
}

#[test]
fn a_host_that_can_not_be_reached_ends_in_one_sentence_and_status_1() {
    // No part of a name has more than 63 characters, so nobody is asked for this one.
    let host = "x".repeat(64);
    for name in ["motor_on_off_switch", "camera"] {
        let output = example(name).arg(&host).output().unwrap();
        assert_eq!(output.status.code(), Some(1), "{name}");
        let message = text(&output.stderr);
        assert_eq!(message.lines().count(), 1, "{name}: {message}");
        assert!(message.contains("there is no host"), "{name}: {message}");
    }
}

#[test]
fn ctrl_c_stops_the_motors_and_goes_offline() {
    let mut child = example("motor_on_off_switch")
        .args(["--seconds", "3600"])
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let begin = Instant::now();
    let id = child.id().to_string();
    // Before it handles the signal it would be ended by it; it prints as soon as it runs.
    let mut printed = [0; 4096];
    let stdout = child.stdout.as_mut().unwrap();
    let mut seen = 0;
    while seen < 4096 {
        seen += std::io::Read::read(stdout, &mut printed).unwrap();
    }
    assert!(Command::new("kill").args(["-INT", &id]).status().unwrap().success());
    let output = child.wait_with_output().unwrap();
    assert!(begin.elapsed() < DEADLINE, "it took too long");
    assert!(output.status.success(), "{:?}", output.status);
    assert!(number_before(&output, " transfers done") > 0);
}

#[test]
fn the_camera_sample_saves_20_pictures() {
    let folder = std::env::temp_dir().join(format!("camera-test-{}", std::process::id()));
    let output = example("camera").arg("--folder").arg(&folder).output().unwrap();
    assert!(output.status.success(), "{}", text(&output.stderr));
    for number in 0..20 {
        let path = folder.join(format!("frame_{number:02}"));
        let jpeg = std::fs::read(path.with_extension("jpg")).unwrap();
        assert!(jpeg.starts_with(&[0xFF, 0xD8]) && jpeg.ends_with(&[0xFF, 0xD9]));
        let yuv = std::fs::read(path.with_extension("yuv")).unwrap();
        assert_eq!(yuv.len(), 320 * 240 * 2);
    }
    std::fs::remove_dir_all(&folder).unwrap();
}
