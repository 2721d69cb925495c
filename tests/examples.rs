//! The examples as a user runs them.
#![cfg(unix)]

mod program;

use std::process::{Command, Output, Stdio};
use std::time::Instant;

use ft_transfer_area::transfer_area::{InputMode, UniConfig};
use ft_transfer_area::FirmwareVersion;

use program::{example, Program, DEADLINE};

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

#[test]
fn the_simulated_txt_serves_one_client_after_another_until_ctrl_c() {
    let mut program = Program::start(&[
        "--world",
        "none",
        "--extensions",
        "1",
        "--firmware",
        "4.1.6",
        "--name",
        "Hugo",
    ]);
    assert_eq!(program.ports[1..], [program.ports[0] + 1, program.ports[0] + 2]);
    // Lines are carried out in their order, so this one is before those that are waited for.
    program.type_line("I9 1");
    for (line, area, value) in [("I1 1", 0, 1), ("e1.i1 7", 1, 7), ("I1 -3", 0, -3)] {
        program.type_line(line);
        let mut handler = program.handler().areas(2).build().unwrap();
        handler.begin_transfer().unwrap();
        assert_eq!(handler.device_name().as_deref(), Some("Hugo"));
        assert_eq!(handler.version(), Some(FirmwareVersion::new(4, 1, 6)));
        let begin = Instant::now();
        while handler.wait_cycle().unwrap()[area].input.uni[0] != value {
            assert!(begin.elapsed() < DEADLINE, "{line} does nothing");
        }
        handler.end_transfer().unwrap();
    }
    // The end of its input does not end it.
    program.stdin = None;
    program.handler().build().unwrap().begin_transfer().unwrap();
    let log = program.interrupt();
    assert!(log.contains("connects to the main port"), "{log}");
    assert!(log.contains("the client sends StartOnline"), "{log}");
    assert!(log.contains("there is no \"I9\" to set"), "{log}");
}

#[test]
fn typed_lines_press_the_buttons_of_a_world() {
    let mut program = Program::start(&[]);
    let mut handler = program.handler().areas(2).build().unwrap();
    handler.lock()[0].config.uni[3] = UniConfig::analog(InputMode::Ultrasonic);
    handler.lock()[0].state.config_id += 1;
    handler.begin_transfer().unwrap();
    // Lines are carried out in their order, so this one is before those that are waited for.
    program.type_line("I8 1");
    for (line, input, value) in [("I3 1", 2, 1), ("I3 0", 2, 0)] {
        program.type_line(line);
        let begin = Instant::now();
        while handler.wait_cycle().unwrap()[0].input.uni[input] != value {
            assert!(begin.elapsed() < DEADLINE, "{line} does nothing");
        }
    }
    // The slide moves away from its sensor until it runs into the switch at its end.
    let distance = handler.wait_cycle().unwrap()[0].input.uni[3];
    assert!((5..=25).contains(&distance), "{distance} cm");
    handler.lock()[0].output.duty[0] = 512;
    let begin = Instant::now();
    let mut areas = handler.wait_cycle().unwrap();
    while areas[0].input.uni[1] != 1 {
        assert!(begin.elapsed() < DEADLINE, "the slide does not arrive");
        drop(areas);
        areas = handler.wait_cycle().unwrap();
    }
    assert!(areas[0].input.uni[3] > distance);
    drop(areas);
    handler.end_transfer().unwrap();
    assert!(program.interrupt().contains("nothing is plugged into I8 in this world"));
}

#[test]
fn the_simulated_txt_commits_the_faults_that_are_ordered() {
    let program = Program::start(&["--fault", "close:3@exchange:2", "--fault", "id@response:0"]);
    let mut handler = program.handler().areas(2).build().unwrap();
    handler.begin_transfer().unwrap_err();
    handler.begin_transfer().unwrap();
    while handler.wait_cycle().is_ok() {}
    assert!(matches!(
        handler.error(),
        Some(ft_transfer_area::Error::ConnectionClosed { received: 3, .. })
    ));
    program.interrupt();
}

#[test]
fn a_wrong_option_of_the_simulated_txt_ends_in_one_sentence() {
    for (options, status, part) in [
        (&["--fault", "fire@exchange:1"][..], 2, "there is no fault \"fire\""),
        (&["--firmware", "4.x"], 2, "a version such as 4.6.6"),
        (&["--world", "no/such/world.toml"], 2, "no/such/world.toml"),
        (&["--prot", "1"], 2, "--prot"),
        (&["--port"], 2, "--port"),
        (&["somewhere"], 2, "somewhere"),
        (&["--extensions", "9"], 1, "8 extensions"),
    ] {
        let output = example("simulated_txt").args(options).output().unwrap();
        assert_eq!(output.status.code(), Some(status), "{options:?}");
        let message = text(&output.stderr);
        assert_eq!(message.lines().count(), 1, "{options:?}: {message}");
        assert!(message.contains(part), "{options:?}: {message}");
    }
    let output = example("simulated_txt").arg("--help").output().unwrap();
    assert!(output.status.success());
    assert!(text(&output.stdout).contains("--no-huffman-tables"));
}
