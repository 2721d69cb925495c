//! A camera that sends frames from memory, so that it costs next to nothing.

use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::sync::mpsc::Sender;
use std::thread;
use std::time::{Duration, Instant};

use anyhow::Result;
use clap::Args;
use ft_transfer_area::wire::{CameraFrameHeader, CAMERA_FRAME_ACKNOWLEDGE};

use crate::pictures::Format;

/// Serves each client in a thread of its own. Prints its port.
#[derive(Args, Clone)]
pub(crate) struct CameraPeer {
    #[command(flatten)]
    pub(crate) format: Format,
    /// Frames per second; 0 for as many as are acknowledged
    #[arg(long, default_value_t = 0)]
    pub(crate) rate: u32,
}

impl CameraPeer {
    pub(crate) fn serve(&self) -> Result<()> {
        let packet = packet(self.format)?;
        let period = Duration::from_secs(1).checked_div(self.rate).unwrap_or_default();
        let listener = TcpListener::bind("127.0.0.1:0")?;
        println!("{}", listener.local_addr()?.port());
        thread::scope(|scope| loop {
            let (stream, _) = listener.accept()?;
            let packet = &packet;
            // A client may leave at any time.
            scope.spawn(move || send(stream, packet, period, |_| Ok(())));
        })
    }
}

/// A frame with its header, as it is sent.
pub(crate) fn packet(format: Format) -> Result<Vec<u8>> {
    let frame = format.frame()?;
    let header = CameraFrameHeader {
        frames_ready: 1,
        width: format.width.try_into()?,
        height: format.height.try_into()?,
        size_raw: frame.size_raw.try_into()?,
        size_compressed: frame.data.len().try_into()?,
    };
    let mut packet = Vec::new();
    header.emit(&mut packet);
    packet.extend(frame.data);
    Ok(packet)
}

/// Serves one client in this thread, and reports when it is about to send the last byte of each frame.
pub(crate) fn serve_and_tell(
    listener: &TcpListener,
    packet: &[u8],
    period: Duration,
    reported: &Sender<Instant>,
) -> Result<()> {
    let (stream, _) = listener.accept()?;
    send(stream, packet, period, |now| Ok(reported.send(now)?))
}

/// Sends frames until the client has left.
fn send(
    mut stream: TcpStream,
    packet: &[u8],
    period: Duration,
    mut before_last: impl FnMut(Instant) -> Result<()>,
) -> Result<()> {
    stream.set_nodelay(true)?;
    let (last, most) = packet.split_last().unwrap_or((&0, &[]));
    let mut due = Instant::now();
    loop {
        thread::sleep(due.saturating_duration_since(Instant::now()));
        due += period;
        if period.is_zero() {
            stream.write_all(packet)?;
        } else {
            stream.write_all(most)?;
            before_last(Instant::now())?;
            stream.write_all(&[*last])?;
        }
        stream.read_exact(&mut [0; CAMERA_FRAME_ACKNOWLEDGE.len()])?;
    }
}
