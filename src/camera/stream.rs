//! The camera's connection: a thread that reads frames, acknowledges them and puts them into the
//! channel.

use std::panic::{catch_unwind, AssertUnwindSafe};
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use super::control::{CameraControl, Server};
use super::server::CameraServer;
use super::{CameraFrame, CameraOptions, CameraStatistics};
use crate::client::{Connection, TimeLimits, Transport};
use crate::error::{Error, Origin};
use crate::fuzzing::{nowhere, Pieces};
use crate::notices::notice;
use crate::wire::{CameraFrameHeader, CAMERA_FRAME_ACKNOWLEDGE};
use crossbeam_channel::{bounded, Receiver, Sender};

/// How long to wait before the next attempt to connect to a server that does not listen yet.
const RETRY: Duration = Duration::from_millis(50);

/// The longest that a single attempt to connect may take, so that stopping does not take longer.
const ATTEMPT: Duration = Duration::from_secs(1);

/// The name of the command in the camera connection's errors. The acknowledgement of a frame is the
/// request for the next one.
const REQUEST: &str = "the request for a camera frame";

/// A stream of camera frames, from [`TxtClient::start_camera`](crate::TxtClient::start_camera).
///
/// Dropping it [stops](Self::stop) it. Frames that are in its channel then can still be received.
#[derive(Debug)]
pub struct CameraStream {
    control: Arc<CameraControl>,
    thread: Option<JoinHandle<()>>,
}

impl CameraStream {
    /// Starts a thread that connects, unless that was done before the camera's start, and reads frames
    /// until it is stopped. Does not block.
    ///
    /// When the main connection fails, the camera's fails, too, perhaps first. So a failed connection ends the
    /// stream only after `gap_limit`: until then the thread waits for [`CameraControl::pause`] or
    /// [`CameraControl::resume`].
    ///
    /// # Errors
    ///
    /// [`Error::ThreadNotStarted`].
    pub(crate) fn start(
        server: CameraServer,
        options: CameraOptions,
        gap_limit: Duration,
    ) -> Result<(Self, Receiver<CameraFrame>), Error> {
        let (sender, receiver) = bounded(options.channel_frames);
        let control = Arc::new(CameraControl::new(server, receiver.clone()));
        let reader = Reader { options, gap_limit, control: Arc::clone(&control), sender };
        let thread = std::thread::Builder::new()
            .name("ft/camera".to_owned())
            .spawn(move || reader.run())
            .map_err(Error::not_started)?;
        Ok((Self { control, thread: Some(thread) }, receiver))
    }

    pub(crate) fn control(&self) -> &Arc<CameraControl> {
        &self.control
    }

    /// Whether no more frames will come.
    #[must_use]
    pub fn is_finished(&self) -> bool {
        self.control.is_finished()
    }

    /// The error that ended the stream; `None` while it goes on, and when it was stopped.
    #[must_use]
    pub fn error(&self) -> Option<Error> {
        self.control.error()
    }

    /// Statistics of the stream since its start.
    #[must_use]
    pub fn statistics(&self) -> CameraStatistics {
        self.control.statistics()
    }

    /// Stops the stream and waits for its thread, for a second at most.
    #[doc(alias = "StopCamera")]
    pub fn stop(&mut self) {
        self.control.stop();
        if let Some(thread) = self.thread.take() {
            // The thread catches its own panics, so there is nothing to report here.
            let _ = thread.join();
        }
    }
}

impl Drop for CameraStream {
    fn drop(&mut self) {
        self.stop();
    }
}

struct Reader {
    options: CameraOptions,
    /// How long to wait for a gap after a failed connection.
    gap_limit: Duration,
    control: Arc<CameraControl>,
    sender: Sender<CameraFrame>,
}

impl Reader {
    fn run(self) {
        let mut from = String::new();
        let result = catch_unwind(AssertUnwindSafe(|| self.read_frames(&mut from)))
            .unwrap_or_else(|panic| Err(Error::from_panic(&*panic)));
        let error = self.control.finish(result);
        // The reason is known before the channel ends, so the program can ask for it then.
        drop(self);
        match error {
            Some(error) => notice!(Warn, "the camera stream{from} has ended: {error:#}"),
            None => notice!(Info, "the camera stream{from} has ended"),
        }
    }

    /// Reads frames until the stream is stopped, across gaps. `from` tells the log which server it was.
    fn read_frames(&self, from: &mut String) -> Result<(), Error> {
        let mut sequence = 0;
        while let Some(server) = self.control.server() {
            *from = format!(" from {}", server.endpoint);
            let error = self.read_from_server(&server, &mut sequence);
            let limit = match error.origin() {
                Origin::Connection => self.gap_limit,
                Origin::Bytes | Origin::Other => Duration::ZERO,
            };
            if !self.control.wait_for_change(&server, limit) {
                return Err(error);
            }
        }
        Ok(())
    }

    /// Reads frames until an error, and returns the error.
    fn read_from_server(&self, server: &Server, sequence: &mut u64) -> Error {
        let start = Instant::now();
        let first = *sequence;
        loop {
            let mut connection = match self.connect(server, start) {
                Ok(connection) => connection,
                Err(error) => return error,
            };
            let error = self.read_from(server, &mut connection, sequence);
            self.control.let_go();
            // A server that is not ready yet may close the connection before the first frame.
            let early =
                *sequence == first && matches!(error, Error::ConnectionClosed { received: 0, .. });
            if !early || start.elapsed() >= self.options.start_limit {
                return error;
            }
            drop(connection);
            if self.control.wait_for_change(server, RETRY) {
                return error;
            }
        }
    }

    /// Connects to the server, which may not listen yet.
    fn connect(&self, server: &Server, start: Instant) -> Result<Connection, Error> {
        let CameraOptions { start_limit, frame_limit, .. } = self.options;
        let mut early = self.control.take_early(server);
        loop {
            let rest = start_limit.saturating_sub(start.elapsed());
            let limits =
                TimeLimits { connect: rest.min(ATTEMPT), read: frame_limit, write: frame_limit };
            let opened = early.take().map_or_else(|| server.endpoint.open(&limits), Ok);
            let opened = opened.and_then(|transport| self.let_others_close(transport, server));
            let mut error = match opened {
                Ok(transport) => return Ok(Connection::over(transport, limits)),
                Err(error) => error,
            };
            if start.elapsed() >= start_limit || self.control.wait_for_change(server, RETRY) {
                if let Error::ConnectTimedOut { limit, .. } = &mut error {
                    *limit = start_limit;
                }
                return Err(error);
            }
        }
    }

    fn let_others_close(
        &self,
        mut transport: Box<dyn Transport>,
        server: &Server,
    ) -> Result<Box<dyn Transport>, Error> {
        let closer = transport.closer().map_err(|error| Error::ConnectFailed {
            address: server.endpoint.to_string(),
            cause: error.into(),
        })?;
        self.control.keep(closer, server);
        Ok(transport)
    }

    /// Reads frames until an error, and returns the error.
    fn read_from(&self, server: &Server, connection: &mut Connection, sequence: &mut u64) -> Error {
        loop {
            let frame = match self.read_frame(connection, *sequence) {
                Ok(frame) => frame,
                Err(error) => return error,
            };
            let acknowledged = connection.send(REQUEST, &CAMERA_FRAME_ACKNOWLEDGE);
            // Even if that fails, because the frame is complete.
            self.control.put(&self.sender, frame, server);
            *sequence += 1;
            if let Err(error) = acknowledged {
                return error;
            }
        }
    }

    fn read_frame(&self, connection: &mut Connection, sequence: u64) -> Result<CameraFrame, Error> {
        // The limit is for the whole frame.
        let mut left = connection.time_to_read();
        let mut header = [0; CameraFrameHeader::LEN];
        connection.fill(REQUEST, &mut header, 0, &mut left)?;
        let header = CameraFrameHeader::parse(&header)?;
        let mut data = vec![0; self.frame_size(&header)?];
        connection.fill(REQUEST, &mut data, CameraFrameHeader::LEN, &mut left)?;
        Ok(CameraFrame {
            sequence,
            arrived: Instant::now(),
            frames_ready: header.frames_ready.try_into().unwrap_or(0),
            width: header.width.try_into().unwrap_or(0),
            height: header.height.try_into().unwrap_or(0),
            size_raw: header.size_raw.try_into().unwrap_or(0),
            data,
        })
    }

    fn frame_size(&self, header: &CameraFrameHeader) -> Result<usize, Error> {
        let (announced, limit) = (header.size_compressed, self.options.max_frame_size);
        match usize::try_from(announced) {
            Ok(size) if (1..=limit).contains(&size) => Ok(size),
            _ => Err(Error::FrameSize { announced, limit }),
        }
    }
}

/// Reads frames that come in these pieces until an error; an empty piece means a signal. Returns the frames
/// that are left in the channel, the error, and the bytes that were sent.
pub fn read_frames(
    pieces: Vec<Vec<u8>>,
    options: CameraOptions,
) -> (Vec<CameraFrame>, Error, Vec<u8>) {
    let server = Pieces::new(pieces);
    let (sender, receiver) = bounded(options.channel_frames);
    let nowhere = CameraServer { endpoint: nowhere(), early: None };
    let control = Arc::new(CameraControl::new(nowhere, receiver.clone()));
    // A stream that goes on has a server.
    let Some(place) = control.server() else { return (Vec::new(), Error::NotStarted, Vec::new()) };
    let reader = Reader { options, gap_limit: Duration::ZERO, control, sender };
    let error = reader.read_from(&place, &mut server.connection(), &mut 0);
    (receiver.try_iter().collect(), error, server.sent())
}

#[cfg(test)]
mod tests;
