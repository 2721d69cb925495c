//! How long decoding and repairing a camera frame takes.
//!
//! ```text
//! cargo bench --bench camera
//! ```

use std::hint::black_box;
use std::time::Duration;

use divan::Bencher;
use ft_transfer_area::simulator::SimulatedTxt;
use ft_transfer_area::{CameraFrame, CameraOptions, TransferAreaComHandler};

fn main() {
    divan::main();
}

const SIZES: [(u16, u16); 2] = [(320, 240), (640, 480)];

/// A frame as the simulated camera sends it: no end marker, garbage at the end, no Huffman tables.
fn frame((width, height): (u16, u16)) -> CameraFrame {
    let txt = SimulatedTxt::builder()
        .camera_tables(false)
        .camera_start_up(Duration::ZERO)
        .start()
        .expect("a simulated TXT starts");
    let handler = TransferAreaComHandler::builder("127.0.0.1")
        .port(txt.port())
        .camera_port(txt.camera_port())
        .build()
        .expect("one area is right");
    handler.begin_transfer().expect("the simulated TXT answers");
    let options = CameraOptions::default().with_size(width, height);
    let frames = handler.start_camera(options).expect("the camera starts");
    frames.recv().expect("a frame comes in")
}

#[divan::bench(args = SIZES)]
fn to_rgb(bencher: Bencher, size: (u16, u16)) {
    let frame = frame(size);
    bencher.bench_local(|| black_box(&frame).to_rgb());
}

#[divan::bench(args = SIZES)]
fn to_yuv422(bencher: Bencher, size: (u16, u16)) {
    let frame = frame(size);
    bencher.bench_local(|| black_box(&frame).to_yuv422());
}

/// Repairs without decoding.
#[divan::bench(args = SIZES)]
fn jpeg(bencher: Bencher, size: (u16, u16)) {
    let frame = frame(size);
    bencher.bench_local(|| black_box(&frame).jpeg().map(|jpeg| jpeg.len()));
}
