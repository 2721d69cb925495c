//! The camera's connection: a thread that reads frames, acknowledges them and puts them into the
//! channel.

#[cfg(feature = "__fuzzing")]
use std::net::SocketAddr;
use std::net::TcpStream;
use std::panic::{catch_unwind, AssertUnwindSafe};
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use super::control::{CameraControl, Server};
use super::server::CameraServer;
use super::{CameraFrame, CameraOptions};
use crate::client::{connect_error, connect_to, Connection, TimeLimits, WaitEnds};
use crate::error::Error;
use crate::notices::notice;
use crate::wire::{CameraFrameHeader, CAMERA_FRAME_ACKNOWLEDGE};
use crossbeam_channel::{bounded, Receiver, Sender, TrySendError};

/// How long to wait before the next attempt to connect to a server that does not listen yet.
const RETRY: Duration = Duration::from_millis(50);

/// The longest that a single attempt to connect may take, so that stopping does not take longer.
const ATTEMPT: Duration = Duration::from_secs(1);

/// The name of the command in the camera connection's errors. The acknowledge of a frame is the
/// request for the next one.
const REQUEST: &str = "the request for a camera frame";

/// A running or finished stream of frames.
#[derive(Debug)]
pub(crate) struct CameraStream {
    control: Arc<CameraControl>,
    thread: Option<JoinHandle<()>>,
}

impl CameraStream {
    /// Starts a thread that connects, unless that was done before the camera's start, and reads frames
    /// until it is stopped. Does not block.
    ///
    /// When the main connection fails, the camera's fails, too, perhaps first. With `rides_out`, a failed
    /// connection ends the stream only after that time: until then the thread waits for
    /// [`CameraControl::pause`] or [`CameraControl::resume`].
    ///
    /// # Errors
    ///
    /// [`Error::ThreadNotStarted`].
    pub(crate) fn start(
        server: CameraServer,
        options: CameraOptions,
        rides_out: Option<Duration>,
    ) -> Result<(Self, Receiver<CameraFrame>), Error> {
        Self::start_with(server, options, rides_out, WaitEnds::ON_SYSTEM)
    }

    fn start_with(
        server: CameraServer,
        options: CameraOptions,
        rides_out: Option<Duration>,
        wait_ends: WaitEnds,
    ) -> Result<(Self, Receiver<CameraFrame>), Error> {
        let control = Arc::new(CameraControl::new(server));
        let (sender, receiver) = bounded(options.channel_frames);
        let reader = Reader {
            options,
            rides_out: rides_out.unwrap_or(Duration::ZERO),
            wait_ends,
            control: Arc::clone(&control),
            oldest: receiver.clone(),
            sender,
        };
        let thread = std::thread::Builder::new()
            .name("camera".to_owned())
            .spawn(move || reader.run())
            .map_err(Error::not_started)?;
        Ok((Self { control, thread: Some(thread) }, receiver))
    }

    pub(crate) fn control(&self) -> &Arc<CameraControl> {
        &self.control
    }

    /// Whether no more frames will come.
    pub(crate) fn is_finished(&self) -> bool {
        self.control.is_finished()
    }

    /// Stops the stream and waits for its thread, for a second at most.
    pub(crate) fn join(&mut self) {
        self.control.stop();
        if let Some(thread) = self.thread.take() {
            // The thread catches its own panics, so there is nothing to report here.
            let _ = thread.join();
        }
    }
}

struct Reader {
    options: CameraOptions,
    /// How long to wait for a gap after a failed connection.
    rides_out: Duration,
    wait_ends: WaitEnds,
    control: Arc<CameraControl>,
    sender: Sender<CameraFrame>,
    /// The channel's other end, to take the oldest frame out.
    oldest: Receiver<CameraFrame>,
}

impl Reader {
    fn run(self) {
        let result = catch_unwind(AssertUnwindSafe(|| self.read_frames()))
            .unwrap_or_else(|panic| Err(Error::from_panic(&*panic)));
        let error = self.control.finish(result);
        // The reason is known before the channel ends, so the program can ask for it then.
        drop(self);
        match error {
            Some(error) => notice!(Warn, "the camera stream has ended: {error}"),
            None => notice!(Info, "the camera stream has ended"),
        }
    }

    /// Reads frames until the stream is stopped, across gaps.
    fn read_frames(&self) -> Result<(), Error> {
        let mut sequence = 0;
        while let Some(server) = self.control.server() {
            let error = self.read_from_server(server, &mut sequence);
            let patience = if may_be_a_gap(&error) { self.rides_out } else { Duration::ZERO };
            if !self.control.wait_for_change(server, patience) {
                return Err(error);
            }
        }
        Ok(())
    }

    /// Reads frames until an error, and returns the error.
    fn read_from_server(&self, server: Server, sequence: &mut u64) -> Error {
        let start = Instant::now();
        let first = *sequence;
        loop {
            let mut connection = match self.connect(server, start) {
                Ok(connection) => connection,
                Err(error) => return error,
            };
            let error = self.read_from(&mut connection, sequence);
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
    fn connect(&self, server: Server, start: Instant) -> Result<Connection, Error> {
        let (address, limit) = (server.address, self.options.start_limit);
        let mut early = self.control.take_early(server);
        loop {
            let rest = limit.saturating_sub(start.elapsed());
            let connected = match early.take() {
                Some(stream) => Ok(stream),
                None => connect_to(address, rest.min(ATTEMPT)),
            };
            let error = match connected.and_then(|stream| self.prepare(stream, server)) {
                Ok(connection) => return Ok(connection),
                Err(error) => error,
            };
            let given_up = start.elapsed() >= limit || self.control.wait_for_change(server, RETRY);
            if given_up {
                return Err(connect_error(address, limit, error));
            }
        }
    }

    fn prepare(&self, stream: TcpStream, server: Server) -> std::io::Result<Connection> {
        let other_hold = stream.try_clone()?;
        let limit = self.options.frame_limit;
        let limits = TimeLimits { connect: self.options.start_limit, read: limit, write: limit };
        let control = Arc::clone(&self.control);
        let is_over = move || control.has_left(server);
        let connection = Connection::that_can_end(stream, limits, self.wait_ends, is_over)?;
        self.control.keep(other_hold, server);
        Ok(connection)
    }

    /// Reads frames until an error, and returns the error.
    fn read_from(&self, connection: &mut Connection, sequence: &mut u64) -> Error {
        loop {
            let frame = match self.read_frame(connection, *sequence) {
                Ok(frame) => frame,
                Err(error) => return error,
            };
            let acknowledged = connection.send(REQUEST, &CAMERA_FRAME_ACKNOWLEDGE);
            // Even if that fails, because the frame is complete.
            self.put(frame);
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

    /// Puts a frame into the channel, and drops the oldest one if there is no room.
    fn put(&self, mut frame: CameraFrame) {
        let mut dropped = 0;
        while let Err(TrySendError::Full(back)) = self.sender.try_send(frame) {
            frame = back;
            // The program may have received it meanwhile.
            dropped += u64::from(self.oldest.try_recv().is_ok());
        }
        self.control.count_frame(dropped);
    }
}

/// Whether this error may come from a loss of the main connection.
fn may_be_a_gap(error: &Error) -> bool {
    matches!(
        error,
        Error::ConnectionClosed { .. }
            | Error::NoAnswer { .. }
            | Error::NotTaken { .. }
            | Error::Io { .. }
            | Error::ConnectionRefused { .. }
            | Error::ConnectTimedOut { .. }
            | Error::ConnectFailed { .. }
    )
}

/// Reads frames that come in these pieces until an error; an empty piece means a signal. Returns the frames
/// that are left in the channel, the error, and the bytes that were sent.
#[cfg(feature = "__fuzzing")]
pub fn read_frames(
    pieces: Vec<Vec<u8>>,
    options: CameraOptions,
) -> (Vec<CameraFrame>, Error, Vec<u8>) {
    let server = crate::client::scripted::Scripted::sending(pieces);
    let (sender, oldest) = bounded(options.channel_frames);
    let address = SocketAddr::from(([127, 0, 0, 1], 0));
    let control = Arc::new(CameraControl::new(CameraServer { address, early: None }));
    let wait_ends = WaitEnds::ON_SYSTEM;
    let reader = Reader { options, rides_out: Duration::ZERO, wait_ends, control, sender, oldest };
    let error = reader.read_from(&mut server.connection(), &mut 0);
    let sent = server.state().written.clone();
    (reader.oldest.try_iter().collect(), error, sent)
}

#[cfg(test)]
mod tests;
