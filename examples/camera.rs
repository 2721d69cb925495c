//! Camera: receives 20 frames and saves each as JPEG and as YUV 4:2:2, while the transfer area keeps
//! cycling. A port of the kit's sample Camera.
//!
//! Wiring: the fischertechnik camera on the TXT's USB socket.
//!
//! ```text
//! cargo run --example camera                                   # a simulated TXT
//! cargo run --example camera -- 192.168.7.2                    # a TXT on USB
//! cargo run --example camera -- 127.0.0.1:65000                # the program simulated_txt
//! cargo run --example camera -- --folder pictures --size 640x480
//! cargo run --example camera -- --pause 1000 --seconds 60      # a slow consumer, in ms
//! ```
//!
//! Without `--folder` the pictures go to a new folder among the temporary files. A YUV file has
//! Y0 Cb Y1 Cr for each two pixels, row by row; `ffplay -f rawvideo -pixel_format yuyv422
//! -video_size 320x240 FILE` shows it. Ctrl-C stops the camera and goes offline before the program
//! exits. The sample motor_on_off_switch shows inputs and outputs.

mod common;

use std::fs;
use std::path::PathBuf;
use std::process::ExitCode;
use std::thread;
use std::time::{Duration, Instant};

use common::Example;
use ft_transfer_area::simulator::SimulatedTxt;
use ft_transfer_area::CameraOptions;
use lexopt::prelude::ValueExt;

const USAGE: &str =
    "usage: camera [--folder DIR] [--size WIDTHxHEIGHT] [--pause MS] [--seconds N] \
                     [HOST[:PORT]]";

/// How many frames are saved.
const FRAMES: usize = 20;

fn main() -> ExitCode {
    common::main(run)
}

/// What the example's own options say.
struct Options {
    folder: PathBuf,
    width: u16,
    height: u16,
    /// What a slow consumer does between two frames.
    pause: Duration,
}

impl Options {
    /// Takes an option, if it is one of these.
    fn take(&mut self, option: &str, parser: &mut lexopt::Parser) -> common::Result<bool> {
        match option {
            "folder" => self.folder = parser.value()?.into(),
            "size" => {
                let size = parser.value()?.string()?;
                let (width, height) = size.split_once('x').ok_or(USAGE)?;
                (self.width, self.height) = (width.parse()?, height.parse()?);
            }
            "pause" => self.pause = Duration::from_millis(parser.value()?.parse()?),
            _ => return Ok(false),
        }
        Ok(true)
    }
}

fn run() -> common::Result {
    let CameraOptions { width, height, .. } = CameraOptions::default();
    let folder = std::env::temp_dir().join(format!("txt-camera-{}", std::process::id()));
    let mut options = Options { folder, width, height, pause: Duration::ZERO };
    let simulated = || Ok(SimulatedTxt::builder().camera_tables(false));
    let example =
        Example::start_with(USAGE, simulated, |option, parser| options.take(option, parser))?;
    let Options { folder, width, height, pause } = options;

    // The camera has the port behind this one.
    let handler = example.handler().build()?;
    handler.begin_transfer()?;
    fs::create_dir_all(&folder)?;
    let frames =
        handler.start_camera(CameraOptions { width, height, ..CameraOptions::default() })?;
    println!("Camera started at {}; its first frame takes a second or two.", example.host);

    let (start, cycles) = (Instant::now(), handler.statistics().cycles);
    let mut last: Option<Instant> = None;
    for (number, frame) in frames.iter().take(FRAMES).enumerate() {
        let age = frame.arrived.elapsed();
        let yuv = frame.to_yuv422()?;
        let path = folder.join(format!("frame_{number:02}"));
        fs::write(path.with_extension("jpg"), frame.jpeg()?)?;
        fs::write(path.with_extension("yuv"), &yuv.data)?;
        println!(
            "frame {:3}: {}x{}, {:5} bytes, {:4} ms after the one before, {:3} ms old, {} dropped, \
             cycle {}",
            frame.sequence,
            yuv.width,
            yuv.height,
            frame.data.len(),
            last.map_or(Duration::ZERO, |last| frame.arrived - last).as_millis(),
            age.as_millis(),
            handler.camera_statistics().dropped,
            handler.statistics().cycles,
        );
        last = Some(frame.arrived);
        if !example.goes_on() {
            break;
        }
        thread::sleep(pause);
    }
    let cycles = handler.statistics().cycles - cycles;
    let seconds = start.elapsed().as_secs_f64();
    let ended_by = handler.camera_error();
    handler.stop_camera()?;
    handler.end_transfer()?;
    println!("{:.0} cycles a second meanwhile", cycles as f64 / seconds);
    println!("pictures are in {}", folder.display());
    ended_by.map_or(Ok(()), |error| Err(error.into()))
}
