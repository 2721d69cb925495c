//! The camera and I2C devices.

use std::io::{Read, Write};
#[cfg(target_os = "linux")]
use std::net::SocketAddr;
use std::net::{TcpListener, TcpStream};
use std::time::{Duration, Instant};

use ft_transfer_area_simulator::SimulatedTxt;
use serde_json::json;
#[cfg(target_os = "linux")]
use socket2::{Domain, Socket, Type};

use super::http::connect;
use super::program::Panel;
use super::LIMIT;
#[cfg(target_os = "linux")]
use crate::watch::away::at_free_ports;
use crate::watch::away::started;

/// A camera's picture of 320×240.
const PICTURE: &[u8] = include_bytes!("../../../tests/camera/clean_320x240_420.jpg");

#[test]
fn i2c_devices_are_found_read_and_written() {
    let txt = SimulatedTxt::builder().start().unwrap();
    txt.with_machine(|machine| {
        machine.i2c_device(0x18)[0..3].copy_from_slice(&[0xFA, 7, 8]);
        machine.i2c_device(0x42);
    });
    let panel = Panel::of(&[&txt]);
    let mut page = panel.driver();
    assert_eq!(page.done(json!({"do": "i2c_scan"})), json!([0x18, 0x42]));
    let read = json!({"do": "i2c_read", "address": 0x18, "register": 0, "count": 3});
    assert_eq!(page.done(read), json!([0xFA, 7, 8]));
    page.done(json!({"do": "i2c_write", "address": 0x42, "register": 9, "values": [1, 2]}));
    txt.with_machine(|machine| assert_eq!(machine.i2c_device(0x42)[9..11], [1, 2]));
    let nobody = json!({"do": "i2c_read", "address": 0x50, "register": 0, "count": 1});
    assert_eq!(page.refused(nobody), "i2c_no_device");
    for (command, code) in [
        (json!({"do": "i2c_read", "address": 0x18, "register": 0, "count": 0}), "out_of_range"),
        (json!({"do": "i2c_read", "address": 0x18, "register": 0, "count": 257}), "out_of_range"),
        (json!({"do": "i2c_read", "address": 200, "register": 0, "count": 1}), "out_of_range"),
        (json!({"do": "i2c_write", "address": 0x18, "register": 0, "values": []}), "out_of_range"),
        (
            json!({"do": "i2c_write", "address": 0x18, "register": 256, "values": [1]}),
            "bad_message",
        ),
    ] {
        assert_eq!(page.refused(command.clone()), code, "{command}");
    }
}

/// A simulated TXT, and somebody else at its port for the camera (1) or for I2C (2).
fn with_port_of_another(offset: u16) -> (SimulatedTxt, TcpListener) {
    let deadline = Instant::now() + LIMIT;
    loop {
        let port = SimulatedTxt::builder().start().unwrap().port();
        // Another test may be quicker and take one of the ports.
        let other = TcpListener::bind(("127.0.0.1", port + offset));
        let txt = SimulatedTxt::builder().port(port).camera_port(0).i2c_port(0).start();
        if let (Ok(txt), Ok(other)) = (txt, other) {
            return (txt, other);
        }
        assert!(Instant::now() < deadline, "there are no ports in a row");
    }
}

#[test]
fn i2c_that_hangs_hinders_nothing_else() {
    let (txt, _silent) = with_port_of_another(2);
    let panel = Panel::of(&[&txt]);
    let mut page = panel.driver();
    page.send("{\"do\":\"i2c_scan\",\"seq\":1000}");
    page.done(json!({"do": "motor", "motor": 0, "duty": 512}));
    assert!(txt.wait_until(|machine| machine.controllers[0].counter[0] > 0, LIMIT));
    // Only now the scan is given up.
    let answer = page.wait(|answer| answer["type"] == "answer");
    assert_eq!((&answer["seq"], &answer["error"]["code"]), (&json!(1000), &json!("no_answer")));
    assert!(txt.with_machine(|machine| machine.controllers[0].outputs.duty[0] == 512));
}

/// Something at a port to which connecting takes long: nobody takes the connections that wait there.
#[cfg(target_os = "linux")]
fn full_port(port: u16) -> Vec<Socket> {
    let socket = || Socket::new(Domain::IPV4, Type::STREAM, None).unwrap();
    let address = SocketAddr::from(([127, 0, 0, 1], port)).into();
    let listener = socket();
    listener.bind(&address).unwrap();
    listener.listen(0).unwrap();
    let mut sockets = vec![listener];
    for _ in 0..3 {
        let waits = socket();
        waits.set_nonblocking(true).unwrap();
        let _ = waits.connect(&address);
        sockets.push(waits);
    }
    sockets
}

#[cfg(target_os = "linux")]
#[test]
fn i2c_that_waits_is_refused_when_the_connection_is_lost() {
    let txt = at_free_ports(|port| SimulatedTxt::builder().port(port).camera_port(0).i2c_port(0));
    let _full = full_port(txt.port() + 2);
    let panel = Panel::of(&[&txt]);
    let mut page = panel.driver();
    page.send("{\"do\":\"i2c_scan\",\"seq\":1000}");
    let write = "{\"do\":\"i2c_write\",\"address\":36,\"register\":1,\"values\":[2],\"seq\":1001}";
    page.send(write);
    page.done(json!({"do": "motor", "motor": 0, "duty": 512}));
    drop(txt);
    // While the first one still connects: the next controller may answer it.
    let answer = page.wait(|answer| answer["type"] == "answer");
    assert_eq!((&answer["seq"], &answer["error"]["code"]), (&json!(1001), &json!("not_connected")));
}

#[test]
fn the_camera_shows_its_pictures() {
    let txt = SimulatedTxt::builder().camera_start_up(Duration::ZERO).start().unwrap();
    let panel = Panel::of(&[&txt]);
    let mut page = panel.driver();
    page.done(json!({"do": "camera", "on": true, "width": 160, "height": 120, "fps": 30}));
    assert_eq!(page.refused(json!({"do": "camera", "on": true})), "camera_on");
    let received = pictures(&mut viewer(&panel), 3);
    assert_eq!(count(&received, b"content-type: multipart/x-mixed-replace; boundary="), 1);
    assert!(count(&received, &[0xFF, 0xD8, 0xFF]) >= 2);
    let settings = txt.with_machine(|machine| machine.camera()).unwrap();
    assert_eq!((settings.width, settings.height, settings.framerate), (160, 120, 30));
    page.state(0, |state| state["camera"]["frames"].as_u64() > Some(2));
    page.done(json!({"do": "camera", "on": false}));
    assert!(txt.wait_until(|machine| machine.camera().is_none(), LIMIT));
    page.state(0, |state| state["camera"]["running"] == false);

    // Until the next picture comes there is none.
    txt.with_machine(|machine| machine.set_camera_picture(Some(PICTURE.to_vec())));
    page.done(json!({"do": "camera", "on": true, "width": 320, "height": 240}));
    let received = pictures(&mut viewer(&panel), 2);
    assert!(begins_with(&received, PICTURE), "it begins with an old picture");
}

#[test]
fn a_picture_is_not_shown_after_the_connection_it_came_by() {
    let txt = SimulatedTxt::builder().camera_start_up(Duration::ZERO).start().unwrap();
    let port = txt.port();
    txt.with_machine(|machine| machine.set_camera_picture(Some(PICTURE.to_vec())));
    let panel = Panel::of(&[&txt]);
    let mut page = panel.driver();
    page.done(json!({"do": "camera", "on": true}));
    page.state(0, |state| state["camera"]["frames"].as_u64() > Some(0));
    drop(txt);
    let state = page.state(0, |state| state["link"]["phase"] == "gap");
    assert_eq!(state["camera"], json!({"running": true, "frames": 0, "error": null}));
    let mut stream = viewer(&panel);
    pictures(&mut stream, 0);

    // Another controller is there now. It sends no more than some pictures.
    let next = || SimulatedTxt::builder().port(port).camera_start_up(Duration::ZERO);
    let txt = started(|| next().camera_stall_after(3));
    assert!(!begins_with(&pictures(&mut stream, 2), PICTURE), "it is that of the one before");
    txt.with_machine(|machine| machine.set_camera_picture(Some(PICTURE.to_vec())));
    page.state(0, |state| !state["camera"]["error"].is_null());
    let mut stream = viewer(&panel);
    pictures(&mut stream, 0);
    page.done(json!({"do": "camera", "on": true}));
    assert!(begins_with(&pictures(&mut stream, 2), PICTURE), "it is of before the error");
    // While the controller is there.
    drop(panel);
}

#[test]
fn a_camera_that_sends_garbage_is_told_and_the_motor_turns_on() {
    let (txt, camera) = with_port_of_another(1);
    let garbage = std::thread::spawn(move || {
        for stream in camera.incoming() {
            // The first connection may be one that only looks whether the camera is there.
            if stream.unwrap().write_all(&[0xFF; 256]).is_err() {
                return;
            }
        }
    });
    let panel = Panel::of(&[&txt]);
    let mut page = panel.driver();
    assert_eq!(page.refused(json!({"do": "camera", "on": true, "width": 0})), "out_of_range");
    page.done(json!({"do": "drive"}));
    page.done(json!({"do": "motor", "motor": 0, "duty": 512}));
    page.done(json!({"do": "camera", "on": true}));
    page.state(0, |state| {
        !state["camera"]["error"].is_null() && state["camera"]["running"] == false
    });
    assert_eq!(txt.with_machine(|machine| machine.controllers[0].outputs.duty[0]), 512);
    drop(garbage);
}

/// A browser that asks for the pictures.
fn viewer(panel: &Panel) -> TcpStream {
    let mut stream = connect(panel);
    let (token, address) = (&panel.token, &panel.address);
    write!(stream, "GET /camera/0?token={token} HTTP/1.1\r\nHost: {address}\r\n\r\n").unwrap();
    stream
}

/// What comes until so many pictures have begun; for 0, until there may be one.
fn pictures(stream: &mut TcpStream, number: usize) -> Vec<u8> {
    let mut received = Vec::new();
    while count(&received, b"--picture\r\n") == 0
        || count(&received, b"\r\nContent-Type: image/jpeg\r\n") < number
    {
        let mut bytes = [0; 4096];
        let length = stream.read(&mut bytes).unwrap();
        assert!(length > 0, "{}", String::from_utf8_lossy(&received));
        received.extend_from_slice(&bytes[..length]);
    }
    received
}

/// Whether the first picture is this one.
fn begins_with(received: &[u8], picture: &[u8]) -> bool {
    let begin = received.windows(3).position(|bytes| bytes == [0xFF, 0xD8, 0xFF]).unwrap();
    received[begin..].starts_with(picture)
}

fn count(bytes: &[u8], part: &[u8]) -> usize {
    bytes.windows(part.len()).filter(|window| *window == part).count()
}
