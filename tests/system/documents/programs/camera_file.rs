//! Records the camera for ten seconds in the file camera.mjpeg.

use std::fs::File;
use std::io::{BufWriter, Write};

use ft_transfer_area::prelude::*;
use ft_transfer_area::CameraOptions;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let host = std::env::args().nth(1).unwrap_or("auto".to_owned());
    let handler = TransferAreaComHandler::builder(host).build()?;
    handler.begin_transfer()?;
    let options = CameraOptions::default().framerate(15).channel_frames(30);
    let frames = handler.start_camera(options)?;
    let mut file = BufWriter::new(File::create("camera.mjpeg")?);
    for frame in frames.iter().take(150) {
        file.write_all(&frame.jpeg()?)?; // one picture after the other
    }
    file.flush()?;
    if let Some(error) = handler.camera_error() {
        return Err(error.into());
    }
    println!("150 frames are saved, {} were dropped", handler.camera_statistics().dropped);
    handler.end_transfer()?;
    Ok(())
}
