//! This library's handler through it: cycles, reconnects, camera, I2C, a recording.

use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::process::Command;
use std::time::Duration;

use ft_transfer_area::transfer_area::{InputMode, DUTY_MAX, LOCAL_IO};
use ft_transfer_area::tx::{Direction, Input, Motor};
use ft_transfer_area::wire::{CameraFrameHeader, CommandId};
use ft_transfer_area::{
    CameraOptions, FishX1Transfer, I2cClient, TimeLimits, TransferAreaComHandler,
};
use ft_transfer_area_recorder::{Options, Recorded, Recorder, Recording, Transfer};
use ft_transfer_area_simulator::world::World;
use ft_transfer_area_simulator::{CameraConnection, SimulatedTxt};

use super::away::at_free_ports;
use super::support::{accept, connect, KitClient, Watch};
use super::LIMIT;

#[test]
fn ten_thousand_cycles_pass() {
    let txt = SimulatedTxt::builder().pace(Duration::ZERO).extensions(1).start().unwrap();
    let watch = Watch::start(txt.address(), &[]);
    let handler = watch.handler().areas(2).build().unwrap();
    handler.begin_transfer().unwrap();
    for number in 0..10_000_u16 {
        let mut areas = handler.areas().wait_cycle_for(LIMIT).unwrap();
        areas[LOCAL_IO].output.duty[0] = (number % 513) as i16;
        areas[1].output.duty[7] = (number % 511) as i16;
    }
    assert_eq!(handler.areas().statistics().gaps, 0);
    // The page has not lost its way among the words of two controllers.
    let mut page = watch.page();
    page.state(0, |state| {
        let cycles = state["link"]["cycles"].as_u64().unwrap();
        cycles >= 10_000 && state["areas"][1]["alive"] == true
    });
    handler.end_transfer().unwrap();
    page.state(0, |state| state["link"]["phase"] == "idle" && state["link"]["gaps"] == 0);
}

#[test]
fn a_program_may_come_a_thousand_times() {
    let txt = SimulatedTxt::builder().start().unwrap();
    let watch = Watch::start(txt.address(), &["--no-page"]);
    let mut answers = Vec::new();
    for _ in 0..1000 {
        // A controller serves one program at a time, so this fails if the one before is not gone.
        let mut stream = watch.connect();
        stream.write_all(&CommandId::QueryStatus.id().to_le_bytes()).unwrap();
        let mut answer = [0; 24];
        stream.read_exact(&mut answer).unwrap();
        answers.push(answer);
    }
    assert!(answers.iter().all(|answer| *answer == answers[0]));
}

/// Cycles of a recording: their areas without what a recorder of a handler knows better.
fn cycles(path: &std::path::Path) -> Vec<Vec<FishX1Transfer>> {
    let entries = Recording::open(path).unwrap().map(|entry| entry.unwrap().what);
    let cycle = |what| if let Recorded::Cycle(cycle) = what { Some(cycle.areas) } else { None };
    entries.filter_map(cycle).collect()
}

/// How the transfers of a recording began and ended.
pub(super) fn transfers(path: &std::path::Path) -> Vec<Transfer> {
    let entries = Recording::open(path).unwrap().map(|entry| entry.unwrap().what);
    let transfer =
        |what| if let Recorded::Transfer(transfer) = what { Some(transfer) } else { None };
    entries.filter_map(transfer).collect()
}

/// Sends a picture to the client of a camera.
fn send_picture(client: &mut TcpStream) {
    let picture = [0xFF, 0xD8, 0xFF, 0xD9];
    let mut packet = Vec::new();
    let (width, height, size_compressed) = (320, 240, picture.len() as i32);
    CameraFrameHeader { frames_ready: 0, width, height, size_raw: 153_600, size_compressed }
        .emit(&mut packet);
    packet.extend(picture);
    client.write_all(&packet).unwrap();
}

/// The connection to the camera is still that to the controller of the program before, where another one has its place.
#[test]
fn the_page_shows_no_picture_of_a_connection_that_is_older_than_the_program() {
    let txt = at_free_ports(|port| SimulatedTxt::builder().port(port).camera_port(0));
    let camera = TcpListener::bind(("127.0.0.1", txt.port() + 1)).unwrap();
    let watch = Watch::start(txt.address(), &[]);
    let mut page = watch.page();
    let to = ([127, 0, 0, 1], watch.port).into();
    let to_camera = ([127, 0, 0, 1], watch.port + 1).into();
    let first = KitClient::online(to);
    let mut first_watches = connect(to_camera);
    let mut shown_first = accept(&camera);
    send_picture(&mut shown_first);
    page.state(0, |state| state["camera"]["frames"] == 1);
    first.end();
    let second = KitClient::online(to);
    send_picture(&mut shown_first);
    // It has passed.
    first_watches.read_exact(&mut [0; 2 * (CameraFrameHeader::LEN + 4)]).unwrap();
    let _second_watches = connect(to_camera);
    send_picture(&mut accept(&camera));
    let state = page
        .state(0, |state| state["link"]["phase"] == "running" && state["camera"]["frames"] != 0);
    assert_eq!(state["camera"]["frames"], 1, "{state}");
    second.end();
}

#[cfg_attr(not(unix), ignore = "only Unix can end another program like Ctrl-C")]
#[test]
fn a_camera_that_is_not_understood_ends_no_transfer() {
    let txt = at_free_ports(|port| SimulatedTxt::builder().port(port).camera_port(0));
    let camera = TcpListener::bind(("127.0.0.1", txt.port() + 1)).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    let arguments = ["--no-page", "--record", path.to_str().unwrap()];
    let watch = Watch::start(txt.address(), &arguments);
    let handler = watch.handler().build().unwrap();
    handler.begin_transfer().unwrap();
    let mut program = connect(([127, 0, 0, 1], watch.port + 1).into());
    program.write_all(&[0; 64]).unwrap();
    // It has passed.
    accept(&camera).read_exact(&mut [0; 64]).unwrap();
    handler.end_transfer().unwrap();
    watch.running.signal("INT");
    assert!(watch.running.end().status.success());
    let transfers = transfers(&path);
    assert!(matches!(&transfers[..], [Transfer::Began { .. }, Transfer::Ended]), "{transfers:?}");
}

#[cfg_attr(not(unix), ignore = "only Unix can end another program like Ctrl-C")]
#[test]
fn what_passes_is_recorded_as_by_the_program_itself() {
    let world = World::shipped("slide").unwrap();
    let txt = SimulatedTxt::builder().world(world).lock_step().start().unwrap();
    let folder = tempfile::tempdir().unwrap();
    let (own, passed) = (folder.path().join("own.mcap"), folder.path().join("passed.mcap"));
    let arguments = ["--no-page", "--record", passed.to_str().unwrap()];
    let watch = Watch::start(txt.address(), &arguments);
    let handler = watch.handler().lock_step().build().unwrap();
    let recorder = Recorder::start(&handler, &own, Options::default()).unwrap();
    handler.areas().lock()[LOCAL_IO].set_ft_uni_config(Input::I3, InputMode::Voltage, false);
    handler.begin_transfer().unwrap();
    drive(&handler);
    handler.end_transfer().unwrap();
    recorder.finish().unwrap();
    watch.running.signal("INT");
    assert!(watch.running.end().status.success());

    let (own, expected) = (cycles(&passed), cycles(&own));
    assert!(expected.len() > 50, "{}", expected.len());
    assert_eq!(own.len(), expected.len());
    for (number, (own, expected)) in own.iter().zip(&expected).enumerate() {
        assert!(own == expected, "cycle {number}: {own:?}\ninstead of {expected:?}");
    }
    let transfers = transfers(&passed);
    assert!(
        matches!(&transfers[..], [Transfer::Began { device_name, .. }, Transfer::Ended] if device_name == "TX2013"),
        "{transfers:?}"
    );
    for tool in ["info", "csv", "plot"] {
        let mut command = Command::new(env!("CARGO_BIN_EXE_txt"));
        command.args([tool, passed.to_str().unwrap()]).current_dir(folder.path());
        if tool == "plot" {
            command.args(["I1", "C1", "M1"]);
        }
        let output = command.output().unwrap();
        assert!(output.status.success(), "{tool}: {}", String::from_utf8_lossy(&output.stderr));
    }
}

/// Moves the slide by a distance, and back until it is at its switch.
fn drive(handler: &TransferAreaComHandler) {
    let mut areas = handler.areas().lock();
    areas[LOCAL_IO].start_motor_ex_cmd(Motor::M1, DUTY_MAX, Direction::Cw, &[], 100).unwrap();
    drop(areas);
    drop(handler.areas().wait_motor_ex(LOCAL_IO, Motor::M1, LIMIT).unwrap());
    for number in 0..60 {
        handler.areas().wait_cycle().unwrap()[LOCAL_IO].output.duty[1] = number;
    }
}

#[test]
fn the_page_shows_inputs_outputs_commands_the_camera_and_i2c() {
    let txt = SimulatedTxt::builder().camera_start_up(Duration::from_millis(300)).start().unwrap();
    txt.with_machine(|machine| {
        machine.controllers[0].uni[1] = 1;
        machine.i2c_device(0x18)[7] = 99;
    });
    let watch = Watch::start(txt.address(), &[]);
    let mut page = watch.page();
    page.state(0, |state| state["link"]["phase"] == "idle" && state["watched"]["answer"].is_null());

    let handler = watch.handler().build().unwrap();
    handler.begin_transfer().unwrap();
    handler.areas().lock()[LOCAL_IO].output.duty[2] = 400;
    let state = page.state(0, |state| state["areas"][0]["motors"][1]["duty"][0] == 400);
    assert_eq!(state["link"]["phase"], "running");
    assert_eq!(
        (&state["link"]["name"], &state["link"]["firmware"]),
        (&"TX2013".into(), &"4.7.0".into())
    );
    assert_eq!(state["areas"][0]["inputs"][1]["value"], 1);
    assert!(state["watched"]["answer"]["median"].as_f64().is_some(), "{state}");
    // It drives nothing.
    page.done(serde_json::json!({"do": "drive"}));
    let motor = serde_json::json!({"do": "motor", "motor": 0, "duty": 512});
    assert_eq!(page.refused(motor), "only_looks");
    assert_eq!(page.refused(serde_json::json!({"do": "stop"})), "only_looks");
    assert_eq!(handler.areas().wait_cycle().unwrap()[LOCAL_IO].output.duty[2], 400);

    let frames = handler.start_camera(CameraOptions::default()).unwrap();
    for _ in 0..3 {
        frames.recv_timeout(LIMIT).unwrap();
    }
    page.state(0, |state| {
        let camera = &state["camera"];
        camera["running"] == true && camera["frames"].as_u64().unwrap() >= 3
    });
    handler.stop_camera().unwrap();
    page.state(0, |state| state["camera"]["running"] == false);

    let mut read = [0];
    handler.i2c().unwrap().read(0x18, 7, &mut read).unwrap();
    assert_eq!(read, [99]);
    let state = page.state(0, |state| !state["watched"]["i2c"].is_null());
    let expected = serde_json::json!({"device": 0x18, "written": [7], "read": [99]});
    assert_eq!(state["watched"]["i2c"], expected);
    handler.end_transfer().unwrap();
}

#[test]
fn the_page_shows_nothing_of_a_program_before() {
    let txt = SimulatedTxt::builder().camera_start_up(Duration::ZERO).start().unwrap();
    txt.with_machine(|machine| machine.i2c_device(0x18)[7] = 99);
    let watch = Watch::start(txt.address(), &[]);
    let mut page = watch.page();
    let handler = watch.handler().build().unwrap();
    handler.areas().lock()[LOCAL_IO].set_ft_uni_config(Input::I3, InputMode::Voltage, false);
    handler.begin_transfer().unwrap();
    handler.areas().lock()[LOCAL_IO].output.duty[2] = 400;
    handler.i2c().unwrap().read(0x18, 7, &mut [0]).unwrap();
    let frames = handler.start_camera(CameraOptions::default()).unwrap();
    frames.recv_timeout(LIMIT).unwrap();
    let before = page.state(0, |state| {
        let is_shown = state["areas"][0]["motors"][1]["duty"][0] == 400;
        is_shown && !state["watched"]["i2c"].is_null() && state["camera"]["frames"] != 0
    });
    assert_eq!(before["areas"][0]["inputs"][2]["mode"], "voltage");
    assert!(before["watched"]["commands"].as_u64() > Some(1), "{before}");
    handler.stop_camera().unwrap();
    handler.end_transfer().unwrap();
    page.state(0, |state| state["link"]["phase"] == "idle");

    let to = ([127, 0, 0, 1], watch.port).into();
    let mut program = KitClient::without_configuration(to);
    let state = page.state(0, |state| state["link"]["phase"] == "running");
    // Nothing is known before the first exchange.
    let area = &state["areas"][0];
    assert_eq!((&area["alive"], &area["motors"][1]["duty"][0]), (&false.into(), &0.into()));
    assert_eq!(area["inputs"][2]["mode"], "");
    assert!(state["watched"]["i2c"].is_null(), "{state}");
    // So it is seen that this is another program, whatever a page has missed.
    assert_ne!(state["watched"]["program"], before["watched"]["program"]);
    // StartOnline.
    assert_eq!(state["watched"]["commands"], 1);
    assert_eq!(state["camera"]["frames"], 0);
    program.exchange([0; 8]);
    let state = page.state(0, |state| state["areas"][0]["alive"] == true);
    assert_eq!(state["areas"][0]["inputs"][2]["mode"], "");
    program.end();
}

#[test]
fn a_client_of_its_own_for_i2c_connects_two_ports_behind_the_main_port() {
    let txt = SimulatedTxt::builder().start().unwrap();
    txt.with_machine(|machine| machine.i2c_device(0x18)[7] = 99);
    let watch = Watch::start(txt.address(), &["--no-page"]);
    let handler = watch.handler().build().unwrap();
    handler.begin_transfer().unwrap();
    let host = format!("127.0.0.1:{}", watch.port + 2);
    let mut i2c = I2cClient::connect(&host, TimeLimits::default()).unwrap();
    let mut read = [0];
    i2c.read(0x18, 7, &mut read).unwrap();
    assert_eq!(read, [99]);
    handler.end_transfer().unwrap();
}

#[test]
fn pictures_come_from_a_controller_that_refuses_early_clients_and_from_one_that_refuses_late_ones()
{
    for connection in [CameraConnection::Txt, CameraConnection::Txt40] {
        let builder = SimulatedTxt::builder().camera_connection(connection);
        let txt = builder.camera_start_up(Duration::from_millis(300)).start().unwrap();
        let watch = Watch::start(txt.address(), &["--no-page"]);
        for _ in 0..3 {
            let handler = watch.handler().build().unwrap();
            handler.begin_transfer().unwrap();
            let frames = handler.start_camera(CameraOptions::default()).unwrap();
            for _ in 0..3 {
                let frame = frames.recv_timeout(LIMIT);
                assert!(frame.is_ok(), "{connection:?}: {:?}", handler.camera_error());
            }
            handler.stop_camera().unwrap();
            handler.end_transfer().unwrap();
        }
    }
}
