//! The camera's connection: a thread that reads frames, acknowledges them and puts them into the
//! channel.

use std::io::{ErrorKind, Read, Write};
use std::net::{Shutdown, SocketAddr, TcpStream};
use std::panic::{catch_unwind, AssertUnwindSafe};
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use crossbeam_channel::{bounded, Receiver, Sender, TrySendError};
use log::{info, warn};
use parking_lot::{Condvar, Mutex};

use super::{CameraFrame, CameraOptions, CameraStatistics};
use crate::client::{connect_to, io_error, SHORTEST_LIMIT};
use crate::error::Error;
use crate::wire::{CameraFrameHeader, CAMERA_FRAME_ACKNOWLEDGE};

/// How long to wait before connecting to a server that does not listen yet is tried again.
const RETRY: Duration = Duration::from_millis(50);

/// The longest that a single attempt to connect may take, so that stopping does not take longer.
const ATTEMPT: Duration = Duration::from_secs(1);

/// What stands for the command in the camera connection's errors.
const REQUEST: &str = "the request for a camera frame";

/// A running or finished stream of frames.
#[derive(Debug)]
pub(crate) struct CameraStream {
    control: Arc<CameraControl>,
    thread: Option<JoinHandle<()>>,
}

/// The other threads' hold on a stream.
#[derive(Debug, Default)]
pub(crate) struct CameraControl {
    state: Mutex<State>,
    stopped: Condvar,
}

#[derive(Debug, Default)]
struct State {
    stopping: bool,
    finished: bool,
    /// The connection, by which a thread that reads is woken.
    stream: Option<TcpStream>,
    /// Why the stream has ended.
    error: Option<Error>,
    statistics: CameraStatistics,
}

impl CameraStream {
    /// Starts a thread that connects and reads frames until it is stopped. Does not block.
    pub(crate) fn start(
        address: SocketAddr,
        options: CameraOptions,
    ) -> Result<(Self, Receiver<CameraFrame>), Error> {
        let (sender, receiver) = bounded(options.channel_frames);
        let control = Arc::new(CameraControl::default());
        let reader = Reader {
            address,
            options,
            control: Arc::clone(&control),
            oldest: receiver.clone(),
            sender,
        };
        let thread = std::thread::Builder::new()
            .name("camera".to_owned())
            .spawn(move || reader.run())
            .map_err(|error| Error::not_started(&error))?;
        Ok((Self { control, thread: Some(thread) }, receiver))
    }

    pub(crate) fn control(&self) -> &Arc<CameraControl> {
        &self.control
    }

    /// Whether no more frames will come.
    pub(crate) fn is_finished(&self) -> bool {
        self.control.state.lock().finished
    }

    /// Stops the stream and waits for its thread, which takes moments, a second at most.
    pub(crate) fn join(&mut self) {
        self.control.stop();
        if let Some(thread) = self.thread.take() {
            // The thread catches its own panics, so there is nothing to learn here.
            let _ = thread.join();
        }
    }
}

impl CameraControl {
    /// Makes the thread end soon. Does not block.
    pub(crate) fn stop(&self) {
        let mut state = self.state.lock();
        state.stopping = true;
        if let Some(stream) = &state.stream {
            // It may be closed already.
            let _ = stream.shutdown(Shutdown::Both);
        }
        self.stopped.notify_all();
    }

    /// Why the stream has ended, unless it was stopped or goes on.
    pub(crate) fn error(&self) -> Option<Error> {
        self.state.lock().error.clone()
    }

    pub(crate) fn statistics(&self) -> CameraStatistics {
        self.state.lock().statistics
    }

    fn is_stopping(&self) -> bool {
        self.state.lock().stopping
    }

    /// Waits so long, or until it is stopped.
    fn pause(&self, time: Duration) {
        let mut state = self.state.lock();
        self.stopped.wait_while_for(&mut state, |state| !state.stopping, time);
    }

    /// Lets others reach the connection; errs when they have stopped it before.
    fn keep(&self, stream: &TcpStream) -> std::io::Result<()> {
        let stream = stream.try_clone()?;
        let mut state = self.state.lock();
        if state.stopping {
            stream.shutdown(Shutdown::Both)?;
        }
        state.stream = Some(stream);
        Ok(())
    }
}

struct Reader {
    address: SocketAddr,
    options: CameraOptions,
    control: Arc<CameraControl>,
    sender: Sender<CameraFrame>,
    /// The channel's other end, to take the oldest frame out.
    oldest: Receiver<CameraFrame>,
}

impl Reader {
    fn run(self) {
        let result = catch_unwind(AssertUnwindSafe(|| self.read_frames()))
            .unwrap_or_else(|panic| Err(Error::from_panic(&*panic)));
        let error = {
            let mut state = self.control.state.lock();
            state.stream = None;
            state.finished = true;
            state.error = result.err().filter(|_| !state.stopping);
            state.error.clone()
        };
        // The reason is known before the channel ends, so whoever sees that can ask for it.
        drop(self);
        match error {
            Some(error) => warn!("the camera stream has ended: {error}"),
            None => info!("the camera stream has ended"),
        }
    }

    fn read_frames(&self) -> Result<(), Error> {
        let start = Instant::now();
        let mut sequence = 0;
        loop {
            let mut stream = self.connect(start)?;
            let error = self.read_from(&mut stream, &mut sequence);
            // A server that is not ready yet may close the connection before the first frame.
            let early =
                sequence == 0 && matches!(error, Error::ConnectionClosed { received: 0, .. });
            if !early || self.gives_up(start) {
                return Err(error);
            }
            self.control.pause(RETRY);
        }
    }

    /// Whether it is no use to try to connect once more.
    fn gives_up(&self, start: Instant) -> bool {
        self.control.is_stopping() || start.elapsed() >= self.options.start_limit
    }

    /// Connects to the server, which may take its time to listen.
    fn connect(&self, start: Instant) -> Result<TcpStream, Error> {
        loop {
            let rest = self.options.start_limit.saturating_sub(start.elapsed());
            match connect_to(self.address, rest.clamp(SHORTEST_LIMIT, ATTEMPT)) {
                Ok(stream) => {
                    let prepared = self.prepare(&stream);
                    return prepared.map(|()| stream).map_err(|error| io_error(REQUEST, &error, 0));
                }
                Err(error) if self.gives_up(start) => {
                    return Err(match error {
                        Error::ConnectTimedOut { address, .. } => {
                            Error::ConnectTimedOut { address, limit: self.options.start_limit }
                        }
                        error => error,
                    });
                }
                Err(_) => self.control.pause(RETRY),
            }
        }
    }

    fn prepare(&self, stream: &TcpStream) -> std::io::Result<()> {
        stream.set_nodelay(true)?;
        stream.set_write_timeout(Some(self.options.frame_limit.max(SHORTEST_LIMIT)))?;
        self.control.keep(stream)
    }

    /// Reads frames until something ends it, and returns that.
    fn read_from(&self, stream: &mut TcpStream, sequence: &mut u64) -> Error {
        loop {
            let frame = match self.read_frame(stream, *sequence) {
                Ok(frame) => frame,
                Err(error) => return error,
            };
            let acknowledged = stream.write_all(&CAMERA_FRAME_ACKNOWLEDGE);
            // Also when that fails: the frame is whole.
            self.put(frame);
            *sequence += 1;
            if let Err(error) = acknowledged {
                return self.failure(&error, 0);
            }
        }
    }

    fn read_frame(&self, stream: &mut TcpStream, sequence: u64) -> Result<CameraFrame, Error> {
        let deadline = Instant::now().checked_add(self.options.frame_limit);
        let mut header = [0; CameraFrameHeader::LEN];
        self.read(stream, &mut header, 0, deadline)?;
        let header = CameraFrameHeader::parse(&header)?;
        let mut data = vec![0; self.frame_size(&header)?];
        self.read(stream, &mut data, CameraFrameHeader::LEN, deadline)?;
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

    /// Fills the buffer; `before` bytes of the frame have come in already.
    fn read(
        &self,
        stream: &mut TcpStream,
        buffer: &mut [u8],
        before: usize,
        deadline: Option<Instant>,
    ) -> Result<(), Error> {
        let mut filled = 0;
        while filled < buffer.len() {
            let received = before + filled;
            let rest = deadline.map(|deadline| deadline.saturating_duration_since(Instant::now()));
            if rest == Some(Duration::ZERO) {
                return Err(self.no_answer(received));
            }
            stream
                .set_read_timeout(rest.map(|rest| rest.max(SHORTEST_LIMIT)))
                .map_err(|error| io_error(REQUEST, &error, received))?;
            match stream.read(&mut buffer[filled..]) {
                Ok(0) => return Err(Error::ConnectionClosed { command: REQUEST, received }),
                Ok(count) => filled += count,
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) => return Err(self.failure(&error, received)),
            }
        }
        Ok(())
    }

    /// The error for a connection that failed when so many bytes of a frame had come in.
    fn failure(&self, error: &std::io::Error, received: usize) -> Error {
        match error.kind() {
            ErrorKind::WouldBlock | ErrorKind::TimedOut => self.no_answer(received),
            _ => io_error(REQUEST, error, received),
        }
    }

    fn no_answer(&self, received: usize) -> Error {
        Error::NoAnswer { command: REQUEST, limit: self.options.frame_limit, received }
    }

    /// Puts a frame into the channel, and the oldest one out when there is no room.
    fn put(&self, mut frame: CameraFrame) {
        let mut dropped = 0;
        while let Err(TrySendError::Full(back)) = self.sender.try_send(frame) {
            frame = back;
            // The consumer may have taken it out meanwhile.
            dropped += u64::from(self.oldest.try_recv().is_ok());
        }
        let mut state = self.control.state.lock();
        state.statistics.frames += 1;
        state.statistics.dropped += dropped;
    }
}

/// Reads frames from a connection until something ends it: those that are left in the channel, and
/// what has ended it.
#[cfg(feature = "__fuzzing")]
pub fn read_frames(
    mut stream: TcpStream,
    options: CameraOptions,
) -> Result<(Vec<CameraFrame>, Error), Error> {
    options.command()?;
    let (sender, oldest) = bounded(options.channel_frames);
    let address = SocketAddr::from(([127, 0, 0, 1], 0));
    let reader = Reader { address, options, control: Arc::default(), sender, oldest };
    let error = reader.read_from(&mut stream, &mut 0);
    Ok((reader.oldest.try_iter().collect(), error))
}
