//! What receives frames: the library's channel, and a program that reads them itself.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};

use anyhow::{ensure, Context, Result};
use ft_transfer_area::channel::Receiver;
use ft_transfer_area::wire::{CameraFrameHeader, CAMERA_FRAME_ACKNOWLEDGE};
use ft_transfer_area::{CameraFrame, CameraOptions, TransferAreaComHandler};

/// Longer than a frame ever takes here.
const LIMIT: Duration = Duration::from_secs(10);

/// Enough for a program that wakes up late.
const CHANNEL_FRAMES: usize = 100;

/// A client of a camera.
pub(crate) trait Client {
    /// Waits for the next frame; returns its size.
    fn frame(&mut self) -> Result<usize>;

    /// The frames that came in during this time, and their bytes.
    fn count(&mut self, time: Duration) -> Result<(usize, usize)> {
        let (mut frames, mut bytes) = (0, 0);
        let begin = Instant::now();
        while begin.elapsed() < time {
            bytes += self.frame()?;
            frames += 1;
        }
        Ok((frames, bytes))
    }
}

/// A program that reads and acknowledges frames itself, and does nothing else.
pub(crate) struct Plain(TcpStream);

impl Plain {
    pub(crate) fn connect(port: u16) -> Result<Self> {
        let stream = TcpStream::connect(("127.0.0.1", port))?;
        stream.set_nodelay(true)?;
        stream.set_read_timeout(Some(LIMIT))?;
        Ok(Self(stream))
    }
}

impl Client for Plain {
    fn frame(&mut self) -> Result<usize> {
        let mut header = [0; CameraFrameHeader::LEN];
        self.0.read_exact(&mut header)?;
        let header = CameraFrameHeader::parse(&header)?;
        let mut data = vec![0; header.size_compressed.try_into()?];
        self.0.read_exact(&mut data)?;
        self.0.write_all(&CAMERA_FRAME_ACKNOWLEDGE)?;
        Ok(data.len())
    }
}

/// A program that receives frames from the handler's channel.
pub(crate) struct Channel {
    handler: TransferAreaComHandler,
    frames: Receiver<CameraFrame>,
}

impl Channel {
    /// Begins a transfer with the peer on this port, and starts the camera on the other.
    pub(crate) fn connect(port: u16, camera_port: u16) -> Result<Self> {
        let handler = transfer(port, camera_port)?;
        let options = CameraOptions::default().channel_frames(CHANNEL_FRAMES);
        let frames = handler.start_camera(options)?;
        Ok(Self { handler, frames })
    }

    pub(crate) fn next(&mut self) -> Result<CameraFrame> {
        self.frames.recv_timeout(LIMIT).context("no frame comes in")
    }

    pub(crate) fn dropped(&self) -> u64 {
        self.handler.camera_statistics().dropped
    }
}

impl Client for Channel {
    fn frame(&mut self) -> Result<usize> {
        let frame = self.next()?;
        ensure!(!frame.data.is_empty(), "a frame without a byte");
        Ok(frame.data.len())
    }
}

/// A handler with a running transfer.
pub(crate) fn transfer(port: u16, camera_port: u16) -> Result<TransferAreaComHandler> {
    let builder = TransferAreaComHandler::builder(format!("127.0.0.1:{port}"));
    let handler = builder.camera_port(camera_port).build()?;
    handler.begin_transfer()?;
    Ok(handler)
}
