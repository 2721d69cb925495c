//! The frames of the simulated camera.

use std::time::{Duration, Instant};

use ft_transfer_area::wire::{CameraFrameHeader, CommandId};
use ft_transfer_area_simulator::SimulatedTxtBuilder;

use crate::camera_client::{number_shown, settings, CameraClient};
use crate::unpaced;
use crate::wire_client::{Client, LIMIT};

/// A simulated TXT whose camera serves immediately.
pub(crate) fn with_camera() -> SimulatedTxtBuilder {
    unpaced().camera_start_up(Duration::ZERO)
}

/// The segments with Huffman tables.
fn tables(jpeg: &[u8]) -> Vec<u8> {
    let (mut tables, mut at) = (Vec::new(), 2);
    while jpeg[at + 1] != 0xDA {
        let size = 2 + usize::from(u16::from_be_bytes([jpeg[at + 2], jpeg[at + 3]]));
        if jpeg[at + 1] == 0xC4 {
            tables.extend_from_slice(&jpeg[at..at + size]);
        }
        at += size;
    }
    tables
}

fn contains(bytes: &[u8], pair: [u8; 2]) -> bool {
    bytes.windows(2).any(|window| window == pair)
}

#[test]
fn frames_show_rising_numbers_and_end_with_garbage() {
    let txt = with_camera().start().unwrap();
    let mut main = Client::online(&txt);
    main.start_camera(settings(320, 240, 100));
    assert_eq!(txt.with_machine(|machine| machine.camera()), Some(settings(320, 240, 100)));
    let mut camera = CameraClient::connect(&txt);
    let mut next = 0;
    let mut garbage = Vec::new();
    for _ in 0..10 {
        let frame = camera.receive();
        let CameraFrameHeader { frames_ready, width, height, size_raw, .. } = frame.header;
        assert_eq!((width, height, size_raw), (320, 240, 153_600));
        // Frames are left out when this program or the simulated TXT comes late.
        let number = i32::from(frame.number());
        assert!(number >= next, "{number} after {next}");
        assert!((0..=1).contains(&frames_ready));
        next = number + 1;
        assert_eq!(frame.bytes[..2], [0xFF, 0xD8]);
        assert!(!contains(&frame.bytes, [0xFF, 0xD9]));
        garbage.push(frame.bytes[frame.bytes.len() - 40..].to_vec());
        for marker in [0xC0, 0xDA, 0xD3] {
            assert_eq!(contains(&garbage[garbage.len() - 1], [0xFF, marker]), number % 2 == 1);
        }
        camera.acknowledge();
    }
    garbage.sort();
    garbage.dedup();
    assert_eq!(garbage.len(), 10);
    assert!(txt.wait_until(|machine| machine.camera_acknowledges() == 10, LIMIT));
    assert!(txt.with_machine(|machine| machine.camera_frames()) >= 10);
}

#[test]
fn huffman_tables_are_left_out_on_request() {
    let frame_of = |with_tables| {
        let txt = with_camera().camera_tables(with_tables).start().unwrap();
        let mut main = Client::online(&txt);
        main.start_camera(settings(160, 120, 15));
        CameraClient::connect(&txt).receive()
    };
    let (with, without) = (frame_of(true), frame_of(false));
    let tables = tables(&with.bytes);
    assert!(!tables.is_empty());
    assert!(!contains(&without.bytes, [0xFF, 0xC4]));
    // Right after the start of the image they are as valid as in their usual place.
    let mut jpeg = without.jpeg();
    jpeg.splice(2..2, tables);
    assert_eq!(number_shown(&jpeg), 0);
}

/// Width and height in the header of a baseline JPEG file.
fn jpeg_size(bytes: &[u8]) -> (i16, i16) {
    let at = bytes.windows(2).position(|marker| marker == [0xFF, 0xC0]).unwrap();
    let number = |at: usize| i16::from_be_bytes([bytes[at], bytes[at + 1]]);
    (number(at + 7), number(at + 5))
}

#[test]
fn the_size_is_the_one_asked_for_if_possible() {
    let txt = with_camera().start().unwrap();
    let mut main = Client::online(&txt);
    for (asked, delivered) in [
        ((1280, 960), (1280, 720)),
        ((640, 480), (640, 480)),
        ((16, 16), (16, 16)),
        ((4096, 16), (4096, 16)),
        ((17, 4096), (17, 4096)),
    ] {
        main.start_camera(settings(asked.0, asked.1, 0));
        let frame = CameraClient::connect(&txt).receive();
        // The header has the size that was asked for.
        let said = (frame.header.width.into(), frame.header.height.into());
        assert_eq!(said, asked);
        assert_eq!(frame.header.size_raw, 2 * asked.0 * asked.1);
        assert_eq!(jpeg_size(&frame.bytes), delivered);
        assert_eq!(frame.number(), 0);
    }
    for (width, height) in [(0, 240), (-320, 240), (320, 4097), (i32::MIN, i32::MAX)] {
        main.start_camera(settings(width, height, 15));
        assert_eq!(txt.with_machine(|machine| machine.camera()), None);
        assert_eq!(CameraClient::connect(&txt).until_closed(), 0);
    }
}

/// Waits until this many frames were produced since then.
fn wait_for_frames(begin: Instant, frames: u32, rate: u32) {
    let until = Duration::from_secs(1) * frames / rate;
    while begin.elapsed() < until {
        std::thread::sleep(Duration::from_millis(1));
    }
}

#[test]
fn a_slow_client_gets_the_newest_frame_and_never_two_together() {
    let txt = with_camera().start().unwrap();
    let mut main = Client::online(&txt);
    main.start_camera(settings(160, 120, 200));
    let mut camera = CameraClient::connect(&txt);
    let first = camera.receive();
    // The connection began before the first frame came.
    let begin = Instant::now();
    wait_for_frames(begin, 20, 200);
    camera.stream.set_nonblocking(true).unwrap();
    let nothing = camera.stream.peek(&mut [0]).unwrap_err();
    assert_eq!(nothing.kind(), std::io::ErrorKind::WouldBlock);
    camera.stream.set_nonblocking(false).unwrap();
    assert_eq!(txt.with_machine(|machine| machine.camera_frames()), 1);
    camera.acknowledge();
    let second = camera.receive();
    assert!(second.number() >= 20);
    assert_eq!((first.header.frames_ready, second.header.frames_ready), (0, 1));
}

#[test]
fn a_frame_is_not_sent_before_its_time() {
    let txt = with_camera().start().unwrap();
    let mut main = Client::online(&txt);
    main.start_camera(settings(160, 120, 20));
    let begin = Instant::now();
    let mut camera = CameraClient::connect(&txt);
    for _ in 0..4 {
        let number = camera.receive().number();
        assert!(begin.elapsed() >= Duration::from_millis(50) * u32::from(number));
        camera.acknowledge();
    }
}

#[test]
fn every_connection_counts_its_frames_from_0() {
    let txt = with_camera().start().unwrap();
    let mut main = Client::online(&txt);
    main.start_camera(settings(160, 120, 15));
    for clients in 1..=3 {
        assert_eq!(CameraClient::connect(&txt).receive().number(), 0);
        assert_eq!(txt.with_machine(|machine| machine.camera_frames()), clients);
    }
}

#[test]
fn the_exchange_goes_on_beside_the_camera() {
    let txt = with_camera().pace(Duration::from_millis(1)).start().unwrap();
    let mut main = Client::online(&txt);
    main.exchange_compressed(&[[1; 27]], 0);
    main.start_camera(settings(320, 240, 30));
    let mut camera = CameraClient::connect(&txt);
    for exchange in 0..50 {
        txt.with_machine(|machine| machine.controllers[0].uni[0] = exchange);
        let inputs = main.exchange_compressed(&[[exchange as u16; 27]], 0);
        assert_eq!(inputs.words[0], exchange as u16);
        if exchange % 10 == 5 {
            camera.receive();
            camera.acknowledge();
        }
    }
    drop(camera);
    main.exchange_compressed(&[[0; 27]], 0);
    main.stop_camera();
    main.exchange_compressed(&[[0; 27]], 0);
    txt.with_machine(|machine| {
        assert_eq!((machine.exchanges(), machine.camera()), (53, None));
        assert!(machine.connected() && machine.online());
        assert!(machine.commands().eq([
            CommandId::StartOnline,
            CommandId::StartCameraOnline,
            CommandId::StopCameraOnline
        ]));
    });
}
