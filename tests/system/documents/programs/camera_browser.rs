//! Shows the camera's pictures in a browser, one browser at a time.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::time::Duration;

use ft_transfer_area::channel::Receiver;
use ft_transfer_area::prelude::*;
use ft_transfer_area::{CameraFrame, CameraOptions};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let host = std::env::args().nth(1).unwrap_or("auto".to_owned());
    let address = std::env::args().nth(2).unwrap_or("127.0.0.1:8080".to_owned());
    let handler = TransferAreaComHandler::builder(host).build()?;
    handler.begin_transfer()?;
    // However slow a browser is, its next picture is the newest one.
    let frames = handler.start_camera(CameraOptions::default().channel_frames(1))?;
    let listener = TcpListener::bind(address)?;
    println!("open http://{}/", listener.local_addr()?);
    for browser in listener.incoming() {
        if let Err(gone) = show(browser?, &frames) {
            println!("the browser has left: {gone}");
        }
        if let Some(error) = handler.camera_error() {
            return Err(error.into());
        }
    }
    Ok(())
}

/// Sends pictures until the browser has left or the camera's channel ends.
fn show(mut browser: TcpStream, frames: &Receiver<CameraFrame>) -> std::io::Result<()> {
    browser.set_read_timeout(Some(Duration::from_secs(1)))?;
    browser.set_write_timeout(Some(Duration::from_secs(5)))?;
    // No request is longer.
    for line in BufReader::new(browser.try_clone()?.take(8192)).lines() {
        if line?.is_empty() {
            break; // the end of the request; what it asks for does not matter
        }
    }
    browser.write_all(
        b"HTTP/1.1 200 OK\r\nContent-Type: multipart/x-mixed-replace; boundary=x\r\n\r\n",
    )?;
    for frame in frames {
        let Ok(jpeg) = frame.jpeg() else { continue };
        write!(
            browser,
            "--x\r\nContent-Type: image/jpeg\r\nContent-Length: {}\r\n\r\n",
            jpeg.len()
        )?;
        browser.write_all(&jpeg)?;
        browser.write_all(b"\r\n")?;
    }
    Ok(())
}
