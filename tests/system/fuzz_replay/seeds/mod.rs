//! Regenerates the seeds in `fuzz/corpus`, from the recorded packets and from small pictures.

use std::fs;

use ft_transfer_area::wire::{
    CameraFrameHeader, I2cRequestHeader, I2cResponseHeader, StartCameraOnline,
};
use serde_json::Value;

use super::folder;
use vectors::{bytes, load, session_names};

mod camera;
#[allow(dead_code, reason = "only the bytes are needed")]
#[path = "../../../suite/vectors.rs"]
mod vectors;

/// How many exchanges of a recorded session a seed has.
const EXCHANGES: usize = 12;

/// The most bytes of compressed data in a seed's packet.
const PACKET_MAX: usize = 1000;

#[test]
#[ignore = "writes the seeds: cargo test --workspace --test system fuzz_replay -- --ignored"]
fn write_seeds() {
    wire();
    expansion();
    exchange();
    camera::write_all();
    i2c();
    session();
    text();
    built_worlds();
}

/// Writes a seed of this target.
fn write(target: &str, name: &str, bytes: impl AsRef<[u8]>) {
    let folder = folder("corpus").join(target);
    fs::create_dir_all(&folder).unwrap();
    fs::write(folder.join(name), bytes).unwrap();
}

/// An input as the `arbitrary` crate reads it.
#[derive(Default)]
struct Input(Vec<u8>);

impl Input {
    /// A value of `int_in_range(0..=most)`, which is also used for a place in a list.
    fn int(&mut self, value: usize, most: usize) -> &mut Self {
        let count = (usize::BITS - most.leading_zeros()).div_ceil(8) as usize;
        let big_endian = value.to_be_bytes();
        self.bytes(&big_endian[big_endian.len() - count..])
    }

    /// Bytes as they are.
    fn bytes(&mut self, bytes: &[u8]) -> &mut Self {
        self.0.extend_from_slice(bytes);
        self
    }

    /// What `take` reads: a count of bytes, at most `most`, then the bytes.
    fn take(&mut self, bytes: &[u8], most: usize) -> &mut Self {
        self.int(bytes.len(), most).bytes(bytes)
    }
}

/// The recorded sessions: their names without the common parts, and their content.
fn sessions() -> impl Iterator<Item = (String, Value)> {
    session_names().into_iter().map(|file| {
        let name = file.trim_start_matches("session_").trim_end_matches(".json");
        (name.to_owned(), load(&file))
    })
}

/// The requests or responses of a session, beginning with the handshake.
fn packets(session: &Value, which: &str) -> Vec<Vec<u8>> {
    let all = ["handshake", "cycles"].map(|part| session[part].as_array().unwrap());
    all.into_iter().flatten().map(|packet| bytes(&packet[which])).collect()
}

fn wire() {
    for (_, session) in sessions() {
        for which in ["request", "response"] {
            for packet in packets(&session, which) {
                // Only the header of a compressed exchange is read as a packet.
                let whole = matches!(packet.len(), 4 | 24 | 60 | 68 | 80 | 96);
                let packet = if whole { &packet[..] } else { &packet[..16] };
                let id: String = packet[..4].iter().map(|byte| format!("{byte:02x}")).collect();
                write("wire", &format!("{which}_{id}"), packet);
            }
        }
    }
    let mut packet = Vec::new();
    StartCameraOnline { width: 320, height: 240, framerate: 15, power_line_frequency: 50 }
        .emit(&mut packet);
    write("wire", "start_camera", packet);
    write(
        "wire",
        "camera_frame_header",
        camera::frame(&[0; 100]).split_at(CameraFrameHeader::LEN).0,
    );
    write("wire", "i2c_request", i2c_request(1, 6));
    write("wire", "i2c_response", i2c_response(Some(&[])));
}

fn expansion() {
    let cases = load("codec.json");
    let mut packed = Input::default();
    for (number, case) in cases.as_array().unwrap().iter().enumerate() {
        let mut input = Input::default();
        for frame in case["frames"].as_array().unwrap() {
            let count = frame["words"].as_array().unwrap().len();
            let data = bytes(&frame["data"]);
            if count > 5000 || data.len() > PACKET_MAX {
                continue;
            }
            input.int(count, 5000).take(&data, PACKET_MAX);
        }
        packed.bytes(&input.0);
        if input.0.len() < 100 && number % 4 == 0 || input.0.len() > 2000 {
            input.0.truncate(4000);
            write("expansion", &format!("case_{number}"), &input.0);
        }
    }
    packed.0.truncate(4000);
    write("expansion", "many", packed.0);
}

fn exchange() {
    for (name, session) in sessions() {
        let mut input = Input::default();
        let simple = u8::from(session["mode"] == "simple");
        let nine = session["areas"] != 1;
        let old = u8::from(session["firmware"] == "4.1.6");
        input.bytes(&[simple | u8::from(nine) << 1 | old << 2]);
        for cycle in session["cycles"].as_array().unwrap().iter().take(EXCHANGES) {
            input.int(0, 3).take(&bytes(&cycle["response"]), 2000);
            // A duty of the first area.
            if nine {
                input.int(0, 8);
            }
            input.int(0, 5).int(0, 7).bytes(&[0, 2]);
        }
        write("exchange", &name, input.0);
    }
    for kind in 0..8 {
        let mut input = Input::default();
        input.bytes(&[kind]);
        for mask in [0_u8, 1, 0xFF] {
            // A right response, then arbitrary data with a right checksum, then a flipped bit.
            let words = [mask; 64];
            let nothing = |input: &mut Input| {
                if kind & 2 != 0 {
                    input.int(0, 8);
                }
                input.int(5, 5);
            };
            let controllers = 1 + mask.count_ones() as usize;
            let most = if kind & 1 != 0 {
                80
            } else {
                2 * controllers * if kind & 4 != 0 { 50 } else { 52 }
            };
            let right = |input: &mut Input| {
                if kind & 1 == 0 {
                    input.bytes(&[mask]);
                }
                input.take(&words, most);
            };
            right(input.int(2, 3));
            nothing(&mut input);
            input.int(1, 3).bytes(&[mask, 0]).take(&[mask ^ 0x1B; 40], 1200);
            nothing(&mut input);
            right(input.int(3, 3));
            input.bytes(&[9, 1]);
            nothing(&mut input);
        }
        // More extensions than exist.
        input.int(1, 3).bytes(&[0xFF, 0xFF]).take(&[0xFD; 200], 1200);
        write("exchange", &format!("kind_{kind}"), input.0);
    }
}

fn i2c_request(write: usize, read: u16) -> Vec<u8> {
    let mut out = Vec::new();
    I2cRequestHeader {
        data_len: write as u32,
        device: 0x18,
        write_len: write as u16,
        read_len: read,
    }
    .emit(&mut out);
    out
}

/// `None` is a missing device.
fn i2c_response(read: Option<&[u8]>) -> Vec<u8> {
    let (is_ok, read) = (read.is_some(), read.unwrap_or_default());
    let mut out = Vec::new();
    I2cResponseHeader { read_len: read.len() as u16, is_ok }.emit(&mut out);
    out.extend_from_slice(read);
    out
}

fn i2c() {
    let [good, none] = [Some(&[1, 2, 3, 4, 5, 6][..]), None].map(i2c_response);
    let answers: [(&str, usize, &[&[u8]]); 7] = [
        ("whole", 6, &[&good, &none, &good]),
        ("in_pieces", 6, &[&good[..3], &[], &good[3..13], &good[13..], &[0; 6], &[], &[0; 6]]),
        ("nothing_to_read", 0, &[&good[..12], &good[..12]]),
        ("surplus", 5, &[&good]),
        ("surplus_behind", 5, &[&good[..17], &good[17..]]),
        ("cut", 6, &[&good, &good[..15]]),
        ("wrong_id", 6, &[&[1; 20]]),
    ];
    for (name, read, pieces) in answers {
        let mut input = Input::default();
        input.int(pieces.len(), 30);
        for piece in pieces {
            input.int(2, 3).take(piece, 320);
        }
        for _ in 0..3 {
            input.int(0x18, 127).take(&[0x3F], 255).int(read, 300);
        }
        write("i2c_client", name, input.0);
    }

    let mut input = Input::default();
    input.int(3, 30).int(0, 3).int(2, 3).take(&[7; 10], 320).int(1, 3);
    for read in [2, 300] {
        input.int(0x18, 127).take(&[], 255).int(read, 300);
    }
    write("i2c_client", "made_headers", input.0);

    let mut input = Input::default();
    for (write, read) in [(&[0x3F][..], 6), (&[0x3E, 0x80], 0), (&[0xFE, 1, 2, 3], 4), (&[], 300)] {
        input.int(0, 4).int(0x18, 127).bytes(&[0x40, 7]);
        let request = [&i2c_request(write.len(), read)[..], write].concat();
        input.int(2, 4).take(&request, 600);
        input.int(3, 4).take(write, 300).bytes(&[1]).int(0x18, 200);
        input.int(write.len(), 300).int(usize::from(read), 600);
    }
    input.int(1, 4).int(0x18, 127);
    input.int(2, 4).take(&i2c_request(0, 1), 600);
    input.int(2, 4).take(&none, 600);
    write("i2c_server", "every_kind", input.0);
}

fn session() {
    for (name, session) in sessions() {
        for (kind, world) in [("machine", 0), ("world", 1)] {
            let areas = session["areas"].as_u64().unwrap() as usize;
            let microphone = u8::from(session["firmware"] != "4.1.6");
            let mut input = Input::default();
            input.int(areas - 1, 8).bytes(&[world, microphone, 0]);
            let requests = packets(&session, "request");
            for packet in requests.iter().take(2 + areas + EXCHANGES) {
                input.int(5, 9).take(packet, 2000);
            }
            write("session", &format!("{name}_{kind}"), input.0);
        }
    }
    let mut input = Input::default();
    input.int(2, 8).bytes(&[1, 1, 1]);
    input.int(1, 9).take(&[1, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1], 92);
    input.int(2, 9).take(&[0, 2, 0, 2], 56);
    input.int(8, 9).bytes(&[1, 0]).int(0, 7).take(&[0xFF, 0, 2, 0x5A, 0x77, 0xFF], 600);
    input.int(6, 9).int(0, 7).bytes(&[0]);
    input.int(7, 9).int(1, 2).int(3, 7).bytes(&[9, 9]).int(1, 3).bytes(&[1, 2, 3, 4]);
    input.int(8, 9).bytes(&[1, 0]).int(0, 7).take(&[0xFF; 80], 600);
    input.int(3, 9).take(&[64, 1, 0, 0, 240, 0, 0, 0, 15, 0, 0, 0, 50], 16);
    for last in 0..3 {
        input.int(4, 9).int(last, 2);
    }
    input.int(8, 9).bytes(&[0, 0]).int(7, 7).take(&[1, 2, 3], 600);
    write("session", "every_kind", input.0);

    // The compression starts again with each StartOnline.
    let mut input = Input::default();
    input.int(0, 8).bytes(&[0, 1, 1]);
    for _ in 0..2 {
        input.int(8, 9).bytes(&[0, 0]).int(0, 7).take(&[0xFF; 61], 600);
        input.int(0, 9);
        input.int(8, 9).bytes(&[0, 0]).int(0, 7).take(&[0; 7], 600);
    }
    write("session", "twice_online", input.0);
}

fn text() {
    let worlds = concat!(env!("CARGO_MANIFEST_DIR"), "/../../simulator/worlds");
    for entry in fs::read_dir(worlds).unwrap() {
        let path = entry.unwrap().path();
        write("worlds", path.file_name().unwrap().to_str().unwrap(), fs::read(&path).unwrap());
    }
    for (name, text) in [
        ("first_line", "master = 5"),
        ("third_line", "[[extensions]]\n[[extensions]]\ninputs.I1 = { heater = {} }"),
    ] {
        write("worlds", name, text);
    }
    let lines = [
        "I3 1\ni5 -10.5\nI6 50\nI7 99999\nI8 0\nC1 1\nE1.I1 1\nE1.I2 7600\nE1.C2 1\nE1 0\nE1 1",
        "IR1 0 0 0 0 1\nIR2 1 -2 15 -15 3\nIR4 0 0 0 0 12\nIR0 0 0 0 7 9\nI2C 24 63 7\nI2C 200 255 0",
        "I1 1\nI9 1\nE2.I1 1\nE0 1\nI3 nan\nI4 1e400\nIR5 0 0 0 0 1\nIR1 16 0 0 0 0\nE1 no\nE1.\nI2C 1 2\n",
    ];
    for (number, lines) in lines.iter().enumerate() {
        write("typed_lines", &format!("lines_{number}"), lines);
    }
    for (number, text) in [
        "delay:20@exchange:3",
        "jitter:7@exchange:each",
        "silence@response:0",
        "dribble@response:1",
        "id@response:2",
        "crc@exchange:100",
        "size:0xFFFFFFFF@exchange:0",
        "mask:0x0003@exchange:1",
        "cut@exchange:1",
        "surplus:5@response:3",
        "close:18446744073709551615@response:3",
        "mask:65536@exchange:-1",
    ]
    .iter()
    .enumerate()
    {
        write("fault_text", &format!("fault_{number}"), text);
    }
}

fn built_worlds() {
    let mut state = 1_u32;
    for number in 0..10 {
        let bytes: Vec<u8> = (0..400)
            .map(|_| {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                (state >> 24) as u8
            })
            .collect();
        write("built_worlds", &format!("any_{number}"), bytes);
    }
    write("built_worlds", "empty", [0; 8]);
}
