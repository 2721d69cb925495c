//! Runs M1 while a point of the camera's picture is bright. Each cycle uses the newest frame, and does not
//! wait for a new one.

use ft_transfer_area::prelude::*;
use ft_transfer_area::{CameraFrame, CameraOptions};

fn main() -> Result<(), Error> {
    let host = std::env::args().nth(1).unwrap_or("auto".to_owned());
    let handler = TransferAreaComHandler::builder(host).build()?;
    let areas = handler.areas();
    handler.begin_transfer()?;
    let frames = handler.start_camera(CameraOptions::default().channel_frames(1))?;
    let (mut bright, mut looks) = (false, 0);
    while looks < 100 {
        // This comes before the areas are locked, because decoding takes some milliseconds.
        if let Ok(frame) = frames.try_recv() {
            bright = brightness(&frame)? >= 128;
            looks += 1;
        }
        if let Some(error) = handler.camera_error() {
            return Err(error);
        }
        areas.wait_cycle()?[LOCAL_IO].output.duty[O1] = if bright { 512 } else { 0 };
    }
    handler.end_transfer()
}

/// The brightness of a point near the upper edge, 0 to 255.
fn brightness(frame: &CameraFrame) -> Result<u8, Error> {
    let picture = frame.to_yuv422()?; // two bytes per pixel, the first is its brightness
    let (width, height) = (usize::from(picture.width), usize::from(picture.height));
    let row = width.div_ceil(2) * 4;
    Ok(picture.data[height / 8 * row + width / 2 * 2])
}
