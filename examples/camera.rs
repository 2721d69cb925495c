//! Camera: receives 20 frames and saves each as JPEG and as YUV 4:2:2, while the exchange goes on.
//! A port of the kit's sample Camera.
//!
//! Wiring: the fischertechnik camera on the TXT's USB socket.
//!
//! ```text
//! cargo run --example camera                           # a simulated TXT
//! cargo run --example camera -- 192.168.7.2            # a TXT on USB
//! cargo run --example camera -- 192.168.7.2 pictures   # the pictures go into this folder
//!
//! in your own project, where FOLDER is the folder of ft-transfer-area:
//! cargo add ft-transfer-area --path FOLDER
//! cargo add ft-transfer-area-simulator --path FOLDER/simulator
//! cargo add ctrlc@3 --features termination
//! ```
//!
//! Without a folder, the pictures go to a new one in the folder for temporary files. A YUV file has
//! Y0 Cb Y1 Cr for every two pixels, row by row; `ffplay -f rawvideo -pixel_format yuyv422
//! -video_size 320x240 FILE` shows it. Ctrl-C stops the camera and ends the transfer. Next:
//! `motor_on_off_switch` for inputs and outputs.

use std::env;
use std::fs;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use ft_transfer_area::prelude::*;
use ft_transfer_area::CameraOptions;
use ft_transfer_area_simulator::{Error, SimulatedTxt};

/// How many frames are saved.
const FRAMES: usize = 20;

/// Their size in pixels.
const WIDTH: u16 = 320;
const HEIGHT: u16 = 240;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // Without an address, a simulated TXT runs as long as the second value lives.
    let (address, _simulated) = controller()?;
    let handler = TransferAreaComHandler::builder(address).build()?;
    let areas = handler.areas();
    handler.begin_transfer()?;

    // Ctrl-C ends the transfer, and with it the frames.
    let on_ctrl_c = handler.areas().clone();
    ctrlc::set_handler(move || on_ctrl_c.ask_to_end())?;

    let folder = env::args().nth(2).map_or_else(temporary_folder, PathBuf::from);
    fs::create_dir_all(&folder)?;

    let frames = handler.start_camera(CameraOptions::default().size(WIDTH, HEIGHT))?;
    println!("The camera is started; its first frame takes a second or two.");

    let (start, cycles) = (Instant::now(), areas.statistics().cycles);
    let mut last: Option<Instant> = None;
    for (number, frame) in frames.iter().take(FRAMES).enumerate() {
        let age = frame.arrived.elapsed();
        let yuv = frame.to_yuv422()?;
        let path = folder.join(format!("frame_{number:02}"));
        fs::write(path.with_extension("jpg"), frame.jpeg()?)?;
        fs::write(path.with_extension("yuv"), &yuv.data)?;
        println!(
            "frame {:3}: {}x{}, {:5} bytes, {:4} ms after the one before, {:3} ms old, {} dropped",
            frame.sequence,
            yuv.width,
            yuv.height,
            frame.data.len(),
            last.map_or(Duration::ZERO, |last| frame.arrived - last).as_millis(),
            age.as_millis(),
            handler.camera_statistics().dropped,
        );
        last = Some(frame.arrived);
    }
    let cycles = areas.statistics().cycles - cycles;
    let seconds = start.elapsed().as_secs_f64();
    // The reason why the frames have ended, unless all have come or it was Ctrl-C.
    let ended_by = handler.camera_error();
    handler.stop_camera()?;
    handler.end_transfer()?;
    if let Some(error) = ended_by {
        println!("The frames have ended. Is the camera plugged into the TXT's USB socket?");
        return Err(error.into());
    }
    println!("The pictures are in {}.", folder.display());
    println!("{:.0} exchanges a second were done meanwhile.", cycles as f64 / seconds);
    Ok(())
}

/// A new folder in the folder for temporary files.
fn temporary_folder() -> PathBuf {
    env::temp_dir().join(format!("txt-camera-{}", std::process::id()))
}

/// The controller on the command line, or a simulated TXT, which runs as long as the second value lives.
fn controller() -> Result<(String, Option<SimulatedTxt>), Error> {
    if let Some(address) = env::args().nth(1) {
        return Ok((address, None));
    }
    println!("No address is given, so this is a simulated TXT. Its camera shows a test card.");
    let txt = SimulatedTxt::builder().start()?;
    Ok((txt.address().to_string(), Some(txt)))
}
