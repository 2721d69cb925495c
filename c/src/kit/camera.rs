//! The camera of a handler: a thread that reads frames, so that the program gets the newest one.

use std::io::{self, Read, Write};
use std::net::{Shutdown, SocketAddr, TcpStream, ToSocketAddrs};
use std::sync::Arc;
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use ft_transfer_area::wire::{CameraFrameHeader, CAMERA_FRAME_ACKNOWLEDGE};
use ft_transfer_area::CameraFrame;
use parking_lot::{Condvar, Mutex};

use super::handler::Failure;

/// How long the controller's server may take to start, and a frame to come in.
const START_LIMIT: Duration = Duration::from_secs(5);
const FRAME_LIMIT: Duration = Duration::from_secs(5);
/// The longest attempt to connect, also before the camera is started, and the pause between two.
const ATTEMPT: Duration = Duration::from_secs(1);
const EARLY_ATTEMPT: Duration = Duration::from_millis(300);
const RETRY: Duration = Duration::from_millis(50);
/// The longest JPEG picture.
const MAX_FRAME: usize = 16 << 20;

/// A camera whose start was not sent yet.
pub(super) struct NotStarted {
    address: io::Result<SocketAddr>,
    early: Option<TcpStream>,
}

/// A running camera.
pub(super) struct Camera {
    shared: Arc<Shared>,
    thread: Mutex<Option<JoinHandle<()>>>,
}

struct Shared {
    state: Mutex<State>,
    changed: Condvar,
}

#[derive(Default)]
struct State {
    newest: Option<CameraFrame>,
    stopped: bool,
    /// Why no more frames come.
    error: Option<String>,
    /// To be closed when the camera is stopped.
    connection: Option<TcpStream>,
}

impl Camera {
    /// Connects before the camera is started, if its server already listens. The one of a TXT 4.0 looks for
    /// connections only once: when it is told to start.
    pub(super) fn before_start(host: &str, port: u16) -> NotStarted {
        let address = (host, port).to_socket_addrs().and_then(|mut addresses| {
            addresses.next().ok_or_else(|| io::Error::other("the camera has no address"))
        });
        let early = address.as_ref().ok();
        let early =
            early.and_then(|address| TcpStream::connect_timeout(address, EARLY_ATTEMPT).ok());
        NotStarted { address, early }
    }

    /// The newest frame that the program does not have yet. Waits for it.
    pub(super) fn next(&self) -> Result<CameraFrame, Failure> {
        let limit = START_LIMIT + FRAME_LIMIT;
        let mut state = self.shared.state.lock();
        let waits = |state: &mut State| state.newest.is_none() && state.error.is_none();
        self.shared.changed.wait_while_for(&mut state, waits, limit);
        match (state.newest.take(), &state.error) {
            (Some(frame), _) => Ok(frame),
            (None, Some(error)) => Err(error.into()),
            (None, None) => Err("no frame of the camera came in".into()),
        }
    }

    /// Ends the thread.
    pub(super) fn stop(&self) {
        {
            let mut state = self.shared.state.lock();
            state.stopped = true;
            if let Some(connection) = state.connection.take() {
                // It may be closed already.
                let _ = connection.shutdown(Shutdown::Both);
            }
        }
        let thread = self.thread.lock().take();
        if thread.is_some_and(|thread| thread.join().is_err()) {
            log::error!("the thread of the camera panicked");
        }
    }
}

impl NotStarted {
    /// Begins to read frames. The start was sent.
    pub(super) fn start(self) -> Result<Camera, Failure> {
        let (address, early) = (self.address?, self.early);
        let shared = Arc::new(Shared { state: Mutex::default(), changed: Condvar::new() });
        let reader = Arc::clone(&shared);
        let thread = thread::Builder::new().name("camera of C".into());
        let thread = thread.spawn(move || reader.run(address, early))?;
        Ok(Camera { shared, thread: Mutex::new(Some(thread)) })
    }
}

impl Shared {
    fn run(&self, address: SocketAddr, early: Option<TcpStream>) {
        let error = self.read_frames(address, early);
        let mut state = self.state.lock();
        let why = if state.stopped { "it was stopped".to_owned() } else { error.to_string() };
        state.error = Some(format!("the camera has ended: {why}"));
        self.changed.notify_all();
    }

    /// Connects, also again when a server that has just started closes the connection without a frame.
    fn read_frames(&self, address: SocketAddr, mut early: Option<TcpStream>) -> io::Error {
        let begun = Instant::now();
        let mut any = false;
        loop {
            let connected = match early.take() {
                Some(stream) => Ok(stream),
                None => TcpStream::connect_timeout(&address, ATTEMPT),
            };
            let error = match connected.and_then(|stream| self.read_from(stream, &mut any)) {
                Ok(never) => match never {},
                Err(error) => error,
            };
            if any || self.state.lock().stopped || begun.elapsed() >= START_LIMIT {
                return error;
            }
            thread::sleep(RETRY);
        }
    }

    fn read_from(
        &self,
        mut stream: TcpStream,
        any: &mut bool,
    ) -> io::Result<std::convert::Infallible> {
        stream.set_nodelay(true)?;
        stream.set_read_timeout(Some(FRAME_LIMIT))?;
        stream.set_write_timeout(Some(FRAME_LIMIT))?;
        let other_hold = stream.try_clone()?;
        {
            let mut state = self.state.lock();
            if state.stopped {
                return Err(io::ErrorKind::Interrupted.into());
            }
            state.connection = Some(other_hold);
        }
        loop {
            let frame = read_frame(&mut stream)?;
            *any = true;
            stream.write_all(&CAMERA_FRAME_ACKNOWLEDGE)?;
            self.state.lock().newest = Some(frame);
            self.changed.notify_all();
        }
    }
}

fn read_frame(stream: &mut TcpStream) -> io::Result<CameraFrame> {
    let mut header = [0; CameraFrameHeader::LEN];
    stream.read_exact(&mut header)?;
    let header = CameraFrameHeader::parse(&header).map_err(io::Error::other)?;
    let size = usize::try_from(header.size_compressed).ok();
    let size = size.filter(|size| (1..=MAX_FRAME).contains(size));
    let size = size.ok_or_else(|| io::Error::other("the size of a frame is wrong"))?;
    let mut data = vec![0; size];
    stream.read_exact(&mut data)?;
    Ok(CameraFrame::new(data))
}
