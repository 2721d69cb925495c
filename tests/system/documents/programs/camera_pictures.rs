//! Saves three pictures of the camera, turned upside down, as PNG files.

use std::fs::File;

use ft_transfer_area::prelude::*;
use ft_transfer_area::CameraOptions;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let host = std::env::args().nth(1).unwrap_or("auto".to_owned());
    let handler = TransferAreaComHandler::builder(host).build()?;
    handler.begin_transfer()?;
    let frames = handler.start_camera(CameraOptions::default().size(320, 240))?;
    for frame in frames.iter().take(3) {
        let rgb = frame.to_rgb()?;
        // The last pixel comes first.
        let turned: Vec<u8> = rgb.data.rchunks_exact(3).flatten().copied().collect();
        let file = format!("picture{}.png", frame.sequence);
        let (width, height) = (rgb.width.into(), rgb.height.into());
        let mut encoder = png::Encoder::new(File::create(&file)?, width, height);
        encoder.set_color(png::ColorType::Rgb);
        encoder.write_header()?.write_image_data(&turned)?;
        println!("{file} is saved");
    }
    if let Some(error) = handler.camera_error() {
        return Err(error.into());
    }
    handler.end_transfer()?;
    Ok(())
}
