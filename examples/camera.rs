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
//! cargo run --example camera -- --pause 1000                   # a slow consumer, in ms
//! ```
//!
//! Without `--folder` the pictures go to a new folder among the temporary files. A YUV file has
//! Y0 Cb Y1 Cr for each two pixels, row by row; `ffplay -f rawvideo -pixel_format yuyv422
//! -video_size 320x240 FILE` shows it. Ctrl-C stops the camera and goes offline before the program
//! exits. The sample motor_on_off_switch shows inputs and outputs.

use std::error::Error;
use std::fs;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::Arc;
use std::thread;
use std::time::{Duration, Instant};

use ft_transfer_area::simulator::SimulatedTxt;
use ft_transfer_area::{CameraOptions, TransferAreaComHandler, PORT};

const USAGE: &str = "usage: camera [--folder DIR] [--size WIDTHxHEIGHT] [--pause MS] [HOST[:PORT]]";

/// How many frames are saved.
const FRAMES: usize = 20;

fn main() -> ExitCode {
    match run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}

fn run() -> Result<(), Box<dyn Error>> {
    let Some(arguments) = Arguments::parse()? else {
        println!("{USAGE}");
        return Ok(());
    };
    let interrupted = Arc::new(AtomicBool::new(false));
    ctrlc::set_handler({
        let interrupted = Arc::clone(&interrupted);
        move || interrupted.store(true, Ordering::Relaxed)
    })?;

    // Without a host, a simulated TXT takes the controller's place for as long as this lives.
    let simulated = match arguments.host {
        Some(_) => None,
        None => Some(SimulatedTxt::builder().camera_tables(false).start()?),
    };
    let (host, port) = match (&arguments.host, &simulated) {
        (None, Some(txt)) => ("127.0.0.1", txt.port()),
        (host, _) => host_and_port(host.as_deref().unwrap_or_default())?,
    };
    fs::create_dir_all(&arguments.folder)?;

    // The camera has the port behind this one.
    let mut handler = TransferAreaComHandler::builder(host).port(port).build()?;
    handler.begin_transfer()?;
    let options = CameraOptions {
        width: arguments.width,
        height: arguments.height,
        ..CameraOptions::default()
    };
    let frames = handler.start_camera(options)?;
    println!("Camera started at {host}; its first frame takes a second or two.");

    let (start, cycles) = (Instant::now(), handler.statistics().cycles);
    let mut last: Option<Instant> = None;
    for (number, frame) in frames.iter().take(FRAMES).enumerate() {
        let age = frame.arrived.elapsed();
        let yuv = frame.to_yuv422()?;
        let path = arguments.folder.join(format!("frame_{number:02}"));
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
        if interrupted.load(Ordering::Relaxed) {
            break;
        }
        thread::sleep(arguments.pause);
    }
    let cycles = handler.statistics().cycles - cycles;
    let seconds = start.elapsed().as_secs_f64();
    let ended_by = handler.camera_error();
    handler.stop_camera()?;
    handler.end_transfer()?;
    println!("{:.0} cycles a second meanwhile", cycles as f64 / seconds);
    println!("pictures are in {}", arguments.folder.display());
    ended_by.map_or(Ok(()), |error| Err(error.into()))
}

/// Host and port of `HOST[:PORT]`. An IPv6 address has colons of its own, and no port here.
fn host_and_port(text: &str) -> Result<(&str, u16), String> {
    match text.split_once(':') {
        Some((host, port)) if !port.contains(':') => match port.parse() {
            Ok(port) => Ok((host, port)),
            Err(_) => Err(format!("{port:?} in {text:?} is no port\n{USAGE}")),
        },
        _ => Ok((text, PORT)),
    }
}

struct Arguments {
    host: Option<String>,
    folder: PathBuf,
    width: u16,
    height: u16,
    /// What a slow consumer does between two frames.
    pause: Duration,
}

impl Arguments {
    /// The command line, or `None` when it asks for help.
    fn parse() -> Result<Option<Self>, Box<dyn Error>> {
        use lexopt::prelude::{Long, Short, Value, ValueExt};

        let CameraOptions { width, height, .. } = CameraOptions::default();
        let folder = std::env::temp_dir().join(format!("txt-camera-{}", std::process::id()));
        let mut arguments = Self { host: None, folder, width, height, pause: Duration::ZERO };
        let mut parser = lexopt::Parser::from_env();
        while let Some(argument) = parser.next()? {
            match argument {
                Long("folder") => arguments.folder = parser.value()?.into(),
                Long("size") => {
                    let size = parser.value()?.string()?;
                    let (width, height) = size.split_once('x').ok_or(USAGE)?;
                    (arguments.width, arguments.height) = (width.parse()?, height.parse()?);
                }
                Long("pause") => arguments.pause = Duration::from_millis(parser.value()?.parse()?),
                Long("help") | Short('h') => return Ok(None),
                Value(host) if arguments.host.is_none() => arguments.host = Some(host.string()?),
                other => return Err(format!("{}\n{USAGE}", other.unexpected()).into()),
            }
        }
        Ok(Some(arguments))
    }
}
