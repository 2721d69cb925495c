//! The thread of the camera connection and its sockets.

use std::io::{self, Read, Write};
use std::net::TcpStream;
use std::sync::Arc;
use std::time::Duration;

use super::connection::Clients;
use super::frame::{frame, frame_of};
use super::test_card::TestCard;
use super::{CameraRun, Format};
use crate::simulator::end::End;
use crate::simulator::machine::Machine;
use crate::simulator::shared::{is_due_to_waiting, Shared, Stopped, POLL};
use crate::wire::{CameraFrameHeader, CAMERA_FRAME_ACKNOWLEDGE};

/// How the camera behaves with any requested settings.
#[derive(Clone, Copy, Debug)]
pub(in crate::simulator) struct CameraSettings {
    /// The time from the command until the camera serves.
    pub(in crate::simulator) start_up: Duration,
    /// Whether the frames have their Huffman tables.
    pub(in crate::simulator) tables: bool,
    /// After how many frames a connection sends nothing more.
    pub(in crate::simulator) stall_after: Option<u64>,
}

/// Serves one camera client after another while the camera is started.
pub(in crate::simulator) struct CameraServer {
    pub(in crate::simulator) clients: Clients,
    pub(in crate::simulator) shared: Arc<Shared>,
    pub(in crate::simulator) settings: CameraSettings,
}

impl CameraServer {
    /// Serves clients until the thread should end.
    pub(in crate::simulator) fn run(self) {
        while let Ok(stream) = self.clients.next(&self.shared, self.settings.start_up) {
            let Ok(run) = self.wait_until_ready() else { return };
            let Some(run) = run else {
                log::info!("the camera does not serve: the connection is closed");
                continue;
            };
            if let Err(end) = self.serve(stream, run) {
                end.tell("the camera client");
            }
        }
    }

    /// The start of the camera, once its start-up time has passed; `None` when it is off.
    fn wait_until_ready(&self) -> Result<Option<CameraRun>, Stopped> {
        loop {
            let (run, now) = self.shared.look(|machine| (machine.camera_run(), machine.now()));
            if run.is_none_or(|run| now.saturating_sub(run.since) >= self.settings.start_up) {
                return Ok(run);
            }
            self.shared.rest(POLL)?;
        }
    }

    fn serve(&self, stream: TcpStream, run: CameraRun) -> Result<(), End> {
        stream.set_write_timeout(Some(POLL))?;
        let begin = self.shared.look(Machine::now);
        let mut connection = Connection { server: self, stream, run, begin, sent: 0, next: 0 };
        loop {
            connection.send_frame()?;
            connection.read_acknowledge()?;
        }
    }
}

struct Connection<'a> {
    server: &'a CameraServer,
    stream: TcpStream,
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
        let number = self.next_frame()?;
        let frames_ready = number - self.next + 1;
        let bytes = self.packet(number, frames_ready)?;
        // Counted before the client can read it.
        self.server.shared.with_machine(Machine::note_camera_frame);
        self.write(&bytes)?;
        log::trace!("camera frame {number} is sent, {frames_ready} were ready");
        self.sent += 1;
        self.next = number + 1;
        Ok(())
    }

    /// Waits until there is a new frame. Returns the number of the newest.
    fn next_frame(&self) -> Result<u64, End> {
        let due = self.run.format.due(self.next);
        loop {
            let wait = due.saturating_sub(self.elapsed());
            self.rest(wait.min(POLL))?;
            let newest = self.run.format.newest(self.elapsed());
            if newest >= self.next {
                return Ok(newest);
            }
        }
    }

    /// The time for which this client has been served.
    fn elapsed(&self) -> Duration {
        self.server.shared.look(Machine::now).saturating_sub(self.begin)
    }

    /// The frame with this number, and its header before it.
    fn packet(&self, number: u64, frames_ready: u64) -> Result<Vec<u8>, End> {
        let Format { width, height, .. } = self.run.format;
        let tables = self.server.settings.tables;
        let frame = match self.server.shared.look(Machine::camera_picture) {
            Some(picture) => frame_of(&picture, number, tables),
            None => frame(TestCard::new(width, height, number), number, tables)
                .map_err(io::Error::other)?,
        };
        let header = CameraFrameHeader {
            frames_ready: i32::try_from(frames_ready).unwrap_or(i32::MAX),
            // Width and height are at most 4096, so their products fit.
            width: width as i16,
            height: height as i16,
            size_raw: i32::from(width) * i32::from(height) * 2,
            size_compressed: frame.len() as i32,
        };
        let mut packet = Vec::with_capacity(CameraFrameHeader::LEN + frame.len());
        header.emit(&mut packet);
        packet.extend(frame);
        Ok(packet)
    }

    /// Reads the acknowledge of the frame.
    fn read_acknowledge(&mut self) -> Result<(), End> {
        let mut id = [0; CAMERA_FRAME_ACKNOWLEDGE.len()];
        let mut read = 0;
        while read < id.len() {
            read += self.read(&mut id[read..])?;
        }
        if id != CAMERA_FRAME_ACKNOWLEDGE {
            return Err(End::Misbehaved(format!("{id:02X?} is not the acknowledge of a frame")));
        }
        self.server.shared.with_machine(Machine::note_camera_acknowledge);
        Ok(())
    }

    /// Sends nothing more, until the connection ends.
    fn fall_silent(&mut self) -> Result<(), End> {
        log::info!("the camera sends nothing more, as ordered");
        loop {
            self.read(&mut [0; 64])?;
        }
    }

    /// Reads some bytes, at least one.
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize, End> {
        loop {
            self.rest(Duration::ZERO)?;
            match self.stream.read(buffer) {
                Ok(0) => return Err(End::Left),
                Ok(count) => return Ok(count),
                Err(error) if is_due_to_waiting(&error) => {}
                Err(error) => return Err(error.into()),
            }
        }
    }

    /// Writes all bytes, as slowly as the client reads them.
    fn write(&mut self, mut bytes: &[u8]) -> Result<(), End> {
        while !bytes.is_empty() {
            self.rest(Duration::ZERO)?;
            match self.stream.write(bytes) {
                Ok(0) => return Err(End::Left),
                Ok(count) => bytes = &bytes[count..],
                Err(error) if is_due_to_waiting(&error) => {}
                Err(error) => return Err(error.into()),
            }
        }
        Ok(())
    }

    /// Waits for this time, if the connection may go on.
    fn rest(&self, time: Duration) -> Result<(), End> {
        self.server.shared.rest(time)?;
        if self.server.shared.look(Machine::camera_run) == Some(self.run) {
            Ok(())
        } else {
            Err(End::Closed("the camera was stopped"))
        }
    }
}

#[cfg(test)]
mod tests {
    use std::net::{Ipv4Addr, TcpListener};
    use std::thread;

    use super::*;
    use crate::wire::StartCameraOnline;

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
        let _client = TcpStream::connect(listener.local_addr().unwrap()).unwrap();
        let (stream, _) = listener.accept().unwrap();
        stream.set_write_timeout(Some(POLL)).unwrap();
        let settings = CameraSettings { start_up: POLL, tables: true, stall_after: None };
        let shared = Arc::new(Shared::new(machine));
        let clients = Clients::Open(listener);
        let server = CameraServer { clients, shared: Arc::clone(&shared), settings };
        let begin = Duration::ZERO;
        let mut connection = Connection { server: &server, stream, run, begin, sent: 0, next: 0 };
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
