//! The thread of the camera connection and its sockets.

use std::io;
use std::time::{Duration, Instant};

use ft_transfer_area::wire::{CameraFrameHeader, StartCameraOnline, CAMERA_FRAME_ACKNOWLEDGE};
use mio::net::TcpStream;

use super::connection::Clients;
use super::frame::{frame, frame_of};
use super::test_card::TestCard;
use super::{CameraRun, Format};
use crate::machine::journal::notice;
use crate::machine::Machine;
use crate::server::port::{End, Link, Port};
use crate::server::shared::{Shared, Stopped};

/// Why a connection ends when the camera is stopped or started again.
const STOPPED: End = End::Closed("the camera was stopped");

/// How the camera behaves with any requested settings.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CameraSettings {
    /// The time from the command until the camera serves.
    pub(crate) start_up: Duration,
    /// Whether the frames have their Huffman tables.
    pub(crate) tables: bool,
    /// After how many frames a connection sends nothing more.
    pub(crate) stall_after: Option<u64>,
}

/// Serves one camera client after another while the camera is started.
pub(crate) struct CameraServer {
    pub(crate) clients: Clients,
    pub(crate) port: Port,
    pub(crate) settings: CameraSettings,
}

impl CameraServer {
    /// Serves clients until the thread should end.
    pub(crate) fn run(mut self) {
        while let Ok(stream) = self.clients.next(&mut self.port, self.settings.start_up) {
            let Ok(run) = self.wait_until_ready() else { return };
            let Some(run) = run else {
                notice!(Info, "the camera does not serve: the connection is closed");
                continue;
            };
            if let Err(end) = self.serve(stream, run) {
                end.log("the camera client");
            }
        }
    }

    /// The start of the camera, once its start-up time has passed; `None` when it is off.
    fn wait_until_ready(&self) -> Result<Option<CameraRun>, Stopped> {
        self.port.shared().wait_for_camera(|machine| {
            let Some(run) = machine.camera_run() else { return Ok(None) };
            let due = run.since.saturating_add(self.settings.start_up);
            machine.time_until(due).map_or(Ok(Some(run)), Err)
        })
    }

    fn serve(&mut self, stream: TcpStream, run: CameraRun) -> Result<(), End> {
        let begin = self.port.shared().read(Machine::now);
        let link = Link::new(&self.port, stream)?;
        let mut connection = Connection { server: self, link, run, begin, sent: 0, next: 0 };
        loop {
            let served = connection.send_frame().and_then(|()| connection.read_acknowledgement());
            if matches!(served, Err(End::Closed(_))) && connection.link.is_open() {
                connection.server.port.shared().with_machine(Machine::note_camera_left_open);
            }
            served?;
        }
    }
}

struct Connection<'a> {
    server: &'a mut CameraServer,
    link: Link,
    run: CameraRun,
    /// When the first frame was produced, by the machine's clock.
    begin: Duration,
    /// The number of frames sent.
    sent: u64,
    /// The number of the last sent frame plus 1.
    next: u64,
}

impl Connection<'_> {
    /// Sends the newest frame, when there is one newer than the last one sent.
    fn send_frame(&mut self) -> Result<(), End> {
        if self.server.settings.stall_after == Some(self.sent) {
            return self.fall_silent();
        }
        let (number, frames_ready) = self.next_frame()?;
        let bytes = self.packet(number, frames_ready)?;
        // Counted before the client can read it.
        self.server.port.shared().with_machine(Machine::note_camera_frame);
        self.write(&bytes)?;
        notice!(Trace, "camera frame {number} is sent, {frames_ready} were ready");
        self.sent += 1;
        self.next = number + 1;
        Ok(())
    }

    /// Waits until there is a new frame. Returns the number of the newest, and 1 if it was ready before: the firmware
    /// counts no more.
    fn next_frame(&self) -> Result<(u64, i32), End> {
        let due = self.begin.saturating_add(self.run.format.due(self.next));
        let is_ready = |machine: &Machine| machine.time_until(due).is_none();
        let was_ready = self.sent > 0 && self.server.port.shared().read(is_ready);
        let number = self.server.port.shared().wait_for_camera(|machine| {
            if machine.camera_run() != Some(self.run) {
                return Ok(Err(STOPPED));
            }
            match machine.time_until(due) {
                Some(rest) => Err(rest),
                // Only now it is certain that the frame is due.
                None => {
                    let passed = machine.now().saturating_sub(self.begin);
                    Ok(Ok(self.run.format.newest(passed)))
                }
            }
        })?;
        Ok((number?, i32::from(was_ready)))
    }

    /// The frame with this number, and its header before it.
    fn packet(&self, number: u64, frames_ready: i32) -> Result<Vec<u8>, End> {
        let Format { width, height, .. } = self.run.format;
        let tables = self.server.settings.tables;
        let frame = match self.server.port.shared().read(Machine::camera_picture) {
            Some(picture) => frame_of(&picture, number, tables),
            None => frame(TestCard::new(width, height, number), number, tables)
                .map_err(io::Error::other)?,
        };
        // The firmware's header has the size that was asked for, even if the camera delivers another.
        let StartCameraOnline { width, height, .. } = self.run.settings;
        let header = CameraFrameHeader {
            frames_ready,
            // Width and height are at most 4096, so their products fit.
            width: width as i16,
            height: height as i16,
            size_raw: width * height * 2,
            size_compressed: frame.len() as i32,
        };
        let mut packet = Vec::with_capacity(CameraFrameHeader::LEN + frame.len());
        header.emit(&mut packet);
        packet.extend(frame);
        Ok(packet)
    }

    /// Reads the acknowledgement of the frame.
    fn read_acknowledgement(&mut self) -> Result<(), End> {
        let mut id = [0; CAMERA_FRAME_ACKNOWLEDGE.len()];
        self.read(&mut id)?;
        if id != CAMERA_FRAME_ACKNOWLEDGE {
            return Err(End::Misbehaved(format!(
                "{id:02X?} is not the acknowledgement of a frame"
            )));
        }
        self.server.port.shared().with_machine(Machine::note_camera_acknowledgement);
        Ok(())
    }

    /// Sends nothing more, until the connection ends.
    fn fall_silent(&mut self) -> Result<(), End> {
        notice!(Info, "the camera sends nothing more, because it is set to stall");
        loop {
            self.read(&mut [0])?;
        }
    }

    /// Fills the buffer.
    fn read(&mut self, buffer: &mut [u8]) -> Result<(), End> {
        let run = self.run;
        let port = &mut self.server.port;
        let check = |shared: &Shared| check(shared, run);
        match port.shared().read(Machine::acknowledgement_limit) {
            Some(limit) => {
                let deadline = Instant::now().checked_add(limit);
                self.link.read_segment(port, buffer, deadline, check)
            }
            None => self.link.read_all(port, buffer, None, check),
        }
    }

    /// Writes all bytes, as slowly as the client reads them.
    fn write(&mut self, bytes: &[u8]) -> Result<(), End> {
        let run = self.run;
        self.link.write_all(&mut self.server.port, bytes, None, |shared| check(shared, run))
    }
}

/// Whether the connection may go on in this run of the camera.
fn check(shared: &Shared, run: CameraRun) -> Result<(), End> {
    shared.check()?;
    if shared.read(Machine::camera_run) == Some(run) {
        Ok(())
    } else {
        Err(STOPPED)
    }
}

#[cfg(test)]
mod tests {
    use std::net::{Ipv4Addr, TcpListener};
    use std::sync::Arc;
    use std::thread;

    use super::*;

    /// Far more than the sockets hold.
    const TOO_MUCH: usize = 1 << 26;

    /// How writing to a client that never reads ends when this happens.
    fn write_until(event: impl FnOnce(&Shared)) -> End {
        let mut machine = Machine::new(0);
        let asked_for =
            StartCameraOnline { width: 16, height: 16, framerate: 15, power_line_frequency: 50 };
        machine.start_camera(asked_for);
        let run = machine.camera_run().unwrap();
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).unwrap();
        let _client = std::net::TcpStream::connect(listener.local_addr().unwrap()).unwrap();
        let (stream, _) = listener.accept().unwrap();
        stream.set_nonblocking(true).unwrap();
        let start_up = Duration::ZERO;
        let settings = CameraSettings { start_up, tables: true, stall_after: None };
        let shared = Arc::new(Shared::new(machine, None));
        let port = Port::new(Arc::clone(&shared), "camera", true).unwrap();
        let mut server = CameraServer { clients: Clients::Open, port, settings };
        let link = Link::new(&server.port, TcpStream::from_std(stream)).unwrap();
        let begin = Duration::ZERO;
        let mut connection = Connection { server: &mut server, link, run, begin, sent: 0, next: 0 };
        thread::scope(|scope| {
            let writing = scope.spawn(|| connection.write(&vec![0; TOO_MUCH]));
            event(&shared);
            writing.join().unwrap().unwrap_err()
        })
    }

    #[test]
    fn a_client_that_never_reads_blocks_no_thread() {
        assert!(matches!(write_until(Shared::stop), End::Stopped));
        let stop = |shared: &Shared| shared.with_machine(Machine::stop_camera);
        assert!(matches!(write_until(stop), End::Closed(_)));
    }
}
