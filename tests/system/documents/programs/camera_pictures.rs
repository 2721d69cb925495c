//! Saves three pictures of the camera, turned upside down, as PNG files.

use ft_transfer_area::prelude::*;
use ft_transfer_area::CameraOptions;
use image::{imageops, RgbImage};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let host = std::env::args().nth(1).unwrap_or("auto".to_owned());
    let handler = TransferAreaComHandler::builder(host).build()?;
    handler.begin_transfer()?;
    let frames = handler.start_camera(CameraOptions::default().size(320, 240))?;
    for frame in frames.iter().take(3) {
        let rgb = frame.to_rgb()?;
        let picture = RgbImage::from_raw(rgb.width.into(), rgb.height.into(), rgb.data)
            .ok_or("a picture has 3 bytes for each pixel")?;
        let file = format!("picture{}.png", frame.sequence);
        imageops::rotate180(&picture).save(&file)?;
        println!("{file} is saved");
    }
    if let Some(error) = handler.camera_error() {
        return Err(error.into());
    }
    handler.end_transfer()?;
    Ok(())
}
