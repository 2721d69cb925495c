//! The samples and the simulated TXT as a user runs them.

mod checks;
mod factory;
mod picture;
mod run;
mod sample;
mod samples;
mod two_models;
mod wifi;

use std::io::{Read, Write};
use std::net::{Ipv4Addr, TcpStream};
use std::time::{Duration, Instant};

use ft_transfer_area::transfer_area::{InputMode, UniConfig, LOCAL_IO};
use ft_transfer_area::tx::Motor;
use ft_transfer_area::wire::{ExchangeData, StartOnline};
use ft_transfer_area::{FirmwareVersion, FishX1Transfer, TransferAreaComHandler};

use crate::program::{output_in_time, simulate, Program, DEADLINE};

/// Without a pace, a step of the world is still one exchange of 10 ms.
const UNPACED_SLIDE: [&str; 4] = ["--pace", "0", "--world", "slide"];

fn text(bytes: &[u8]) -> &str {
    std::str::from_utf8(bytes).unwrap()
}

#[cfg_attr(not(unix), ignore = "Ctrl-C can't be sent to a single program there")]
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
        let handler = program.handler().areas(2).build().unwrap();
        handler.begin_transfer().unwrap();
        assert_eq!(handler.device_name().as_deref(), Some("Hugo"));
        assert_eq!(handler.version(), Some(FirmwareVersion::new(4, 1, 6)));
        let begin = Instant::now();
        while handler.areas().wait_cycle().unwrap()[area].input.uni[0] != value {
            assert!(begin.elapsed() < DEADLINE, "{line} does nothing");
        }
        handler.end_transfer().unwrap();
    }
    // The end of the program's input does not end it.
    program.stdin = None;
    program.handler().build().unwrap().begin_transfer().unwrap();
    let log = program.interrupt();
    assert!(log.contains("connects to the main port"), "{log}");
    assert!(log.contains("the client sends StartOnline"), "{log}");
    assert!(log.contains("there is no \"I9\" to set"), "{log}");
}

#[cfg_attr(not(unix), ignore = "Ctrl-C can't be sent to a single program there")]
#[test]
fn typed_lines_press_the_buttons_of_a_world() {
    let mut program = Program::start(&UNPACED_SLIDE);
    let handler = program.handler().areas(2).build().unwrap();
    handler.areas().lock()[0].config.uni[3] = UniConfig::analog(InputMode::Ultrasonic);
    handler.areas().lock()[0].raise_config_id();
    handler.begin_transfer().unwrap();
    // Lines are carried out in their order, so this one is before those that are waited for.
    program.type_line("I8 1");
    for (line, input, value) in [("I3 1", 2, 1), ("I3 0", 2, 0)] {
        program.type_line(line);
        let begin = Instant::now();
        while handler.areas().wait_cycle().unwrap()[0].input.uni[input] != value {
            assert!(begin.elapsed() < DEADLINE, "{line} does nothing");
        }
    }
    // The slide moves away from its sensor until it presses the switch at its end.
    let distance = handler.areas().wait_cycle().unwrap()[0].input.uni[3];
    assert!((5..=25).contains(&distance), "{distance} cm");
    handler.areas().lock()[0].output.duty[0] = 512;
    let begin = Instant::now();
    let mut areas = handler.areas().wait_cycle().unwrap();
    while areas[0].input.uni[1] != 1 {
        assert!(begin.elapsed() < DEADLINE, "the slide does not arrive");
        drop(areas);
        areas = handler.areas().wait_cycle().unwrap();
    }
    assert!(areas[0].input.uni[3] > distance);
    drop(areas);
    handler.end_transfer().unwrap();
    assert!(program.interrupt().contains("nothing is plugged into I8 in this world"));
}

/// Waits for cycles until the master's area fulfils the condition.
fn wait_until(handler: &TransferAreaComHandler, condition: impl Fn(&FishX1Transfer) -> bool) {
    let begin = Instant::now();
    while !condition(&handler.areas().wait_cycle().unwrap()[LOCAL_IO]) {
        assert!(begin.elapsed() < DEADLINE, "it does not happen");
    }
}

#[cfg_attr(not(unix), ignore = "Ctrl-C can't be sent to a single program there")]
#[test]
fn the_slide_goes_to_its_end_switch_and_back_by_a_distance() {
    let program = Program::start(&UNPACED_SLIDE);
    let handler = program.handler().areas(2).build().unwrap();
    handler.areas().lock()[LOCAL_IO].config.uni[3] = UniConfig::analog(InputMode::Ultrasonic);
    handler.areas().lock()[LOCAL_IO].raise_config_id();
    handler.begin_transfer().unwrap();
    handler.areas().lock()[LOCAL_IO].output.duty[0] = 512;
    wait_until(&handler, |area| area.input.uni[1] == 1);
    handler.areas().lock()[LOCAL_IO].output.duty[0] = 0;
    wait_until(&handler, |area| area.input.uni[3] == 25);
    {
        let area = &mut handler.areas().lock()[LOCAL_IO];
        area.output.duty[1] = 512;
        area.output.distance[0] = 600;
        area.raise_motor_ex_cmd_id(Motor::M1);
    }
    wait_until(&handler, |area| area.input.motor_ex_reached[0] == 1);
    {
        let area = handler.areas().lock()[LOCAL_IO];
        assert!((600..=603).contains(&area.input.counter[0]), "{area}");
        // 1000 pulses are the way from 5 cm to 25 cm.
        assert!((12..=13).contains(&area.input.uni[3]), "{area}");
        assert_eq!(area.input.uni[..2], [0, 0]);
    }
    handler.end_transfer().unwrap();
    let log = program.interrupt();
    assert!(log.contains("the master: M1 gets command 1: distance 600"), "{log}");
}

#[cfg_attr(not(unix), ignore = "Ctrl-C can't be sent to a single program there")]
#[test]
fn there_is_a_warning_about_extensions_of_the_world_that_are_left_out() {
    let warning = "the world's extensions from 1 on are left out";
    for (options, warned) in [(&["--extensions", "0"][..], true), (&[], false)] {
        let program = Program::start(&[&["--world", "kit"], options].concat());
        let log = program.interrupt();
        assert_eq!(log.contains(warning), warned, "{log}");
    }
}

#[cfg_attr(not(unix), ignore = "Ctrl-C can't be sent to a single program there")]
#[test]
fn the_reason_why_a_client_is_cut_off_is_logged() {
    let program = Program::start(&["--pace", "0", "--idle-limit", "0.2"]);
    let begin = Instant::now();
    let mut silent = TcpStream::connect((Ipv4Addr::LOCALHOST, program.ports[0])).unwrap();
    silent.set_read_timeout(Some(DEADLINE)).unwrap();
    assert_eq!(silent.read(&mut [0]).unwrap(), 0);
    assert!(begin.elapsed() >= Duration::from_millis(200));

    let mut deaf = TcpStream::connect((Ipv4Addr::LOCALHOST, program.ports[0])).unwrap();
    deaf.set_write_timeout(Some(DEADLINE)).unwrap();
    let mut commands = Vec::new();
    StartOnline::new().emit(&mut commands);
    (0..1000).for_each(|_| ExchangeData::default().emit(&mut commands));
    deaf.write_all(&commands).unwrap();
    // Sends until all buffers are full.
    while deaf.write_all(&commands[StartOnline::LEN..]).is_ok() {}
    let log = program.interrupt();
    assert!(log.contains(" is cut off: it sent no command"), "{log}");
    assert!(log.contains(" is cut off: it reads no responses"), "{log}");
}

#[cfg_attr(not(unix), ignore = "Ctrl-C can't be sent to a single program there")]
#[test]
fn the_simulated_txt_makes_the_faults_that_are_ordered() {
    let program = Program::start(&["--fault", "close:3@exchange:2", "--fault", "id@response:0"]);
    let handler = program.handler().areas(2).build().unwrap();
    handler.begin_transfer().unwrap_err();
    handler.begin_transfer().unwrap();
    while handler.areas().wait_cycle().is_ok() {}
    assert!(matches!(
        handler.areas().error(),
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
        (
            &["--world", "slides"],
            2,
            "processing_station, slide, sorting_line, factory; those of the lessons",
        ),
        (&["--prot", "1"], 2, "--prot"),
        (&["--camera-connection", "usb"], 2, "usb"),
        (&["--port"], 2, "--port"),
        (&["somewhere"], 2, "somewhere"),
        (&["--extensions", "9"], 2, "'9' for '--extensions <N>': a number from 0 to 8 is expected"),
        (
            &["--extensions", "-1"],
            2,
            "'-1' for '--extensions <N>': a number from 0 to 8 is expected",
        ),
        (&["--idle-limit", "0"], 2, "seconds are expected, more than 0"),
        (&["--idle-limit", "nan"], 2, "seconds are expected, more than 0"),
        (&["--name", "seventeen letters"], 2, "at most 16 bytes are expected, and this has 17"),
        (&["--name", "Schülerin Käthe"], 2, "at most 16 bytes are expected, and this has 17"),
        (&["--port", "65536"], 2, "a port from 0 to 65535"),
        (&["--port", "65535"], 1, "the main port is 65535, but has to be 0 to 65533"),
        (
            &["--world", "factory", "--name", "x"],
            1,
            "--name is for one controller, and this world has 4",
        ),
        (
            &["--world", "factory", "--port", "65530"],
            1,
            "the main port of the first controller is 65530, but has to be 0 to 65524",
        ),
    ] {
        let output = output_in_time(simulate().args(options));
        assert_eq!(output.status.code(), Some(status), "{options:?}");
        let message = text(&output.stderr);
        // The arguments are followed by a hint at --help.
        let sentence = message.lines().next().unwrap();
        assert!(sentence.contains(part), "{options:?}: {message}");
    }
    let output = simulate().arg("--help").output().unwrap();
    assert!(output.status.success());
    assert!(text(&output.stdout).contains("--no-huffman-tables"));
}
