//! The camera of a handler: a thread that reads frames, so that the program gets the newest one.

use std::io::{self, ErrorKind, Read, Write};
use std::net::{SocketAddr, TcpStream, ToSocketAddrs};
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
/// How late bytes, and the end, may be seen.
const NAP: Duration = Duration::from_millis(2);
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
        self.shared.state.lock().stopped = true;
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

    fn read_from(&self, stream: TcpStream, any: &mut bool) -> io::Result<std::convert::Infallible> {
        stream.set_nodelay(true)?;
        stream.set_nonblocking(true)?;
        let mut connection = Connection { camera: self, stream, deadline: Instant::now() };
        loop {
            connection.deadline = Instant::now() + FRAME_LIMIT;
            let frame = read_frame(&mut connection)?;
            *any = true;
            connection.write_all(&CAMERA_FRAME_ACKNOWLEDGE)?;
            self.state.lock().newest = Some(frame);
            self.changed.notify_all();
        }
    }
}

/// The connection to the controller's server. It does not block, so its thread sees within a moment that the
/// camera is to stop: on Windows no other thread can end a wait on a connection.
struct Connection<'a> {
    camera: &'a Shared,
    stream: TcpStream,
    /// For one frame and its acknowledge.
    deadline: Instant,
}

impl Connection<'_> {
    fn wait<T>(
        &mut self,
        mut attempt: impl FnMut(&mut TcpStream) -> io::Result<T>,
    ) -> io::Result<T> {
        loop {
            if self.camera.state.lock().stopped {
                return Err(ErrorKind::ConnectionAborted.into());
            }
            match attempt(&mut self.stream) {
                Err(error) if error.kind() == ErrorKind::WouldBlock => {}
                result => return result,
            }
            if self.deadline <= Instant::now() {
                let why = format!("no whole frame came in within {FRAME_LIMIT:?}");
                return Err(io::Error::new(ErrorKind::TimedOut, why));
            }
            thread::sleep(NAP);
        }
    }
}

impl Read for Connection<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.wait(|stream| stream.read(buffer))
    }
}

impl Write for Connection<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.wait(|stream| stream.write(bytes))
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

fn read_frame(stream: &mut impl Read) -> io::Result<CameraFrame> {
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

#[cfg(test)]
mod tests {
    use std::net::TcpListener;

    use super::*;

    /// A camera whose server has sent these bytes, and then falls silent; and the server's side.
    fn camera(bytes: &[u8]) -> (Camera, TcpStream) {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let port = listener.local_addr().unwrap().port();
        let camera = Camera::before_start("127.0.0.1", port).start().ok().unwrap();
        let mut server = listener.accept().unwrap().0;
        server.write_all(bytes).unwrap();
        (camera, server)
    }

    fn frame() -> Vec<u8> {
        let mut frame = Vec::new();
        CameraFrameHeader { frames_ready: 1, width: 1, height: 1, size_raw: 2, size_compressed: 1 }
            .emit(&mut frame);
        frame.push(7);
        frame
    }

    #[test]
    fn a_frame_is_acknowledged_and_the_newest_is_taken() {
        let (camera, mut server) = camera(&frame());
        let mut acknowledge = [0; 4];
        server.read_exact(&mut acknowledge).unwrap();
        assert_eq!(acknowledge, CAMERA_FRAME_ACKNOWLEDGE);
        assert_eq!(camera.next().ok().unwrap().data, [7]);
        camera.stop();
        assert_eq!(server.read(&mut [0]).unwrap(), 0, "the connection goes on");
    }

    #[test]
    fn a_stop_ends_every_wait_for_a_silent_server_long_before_the_limit() {
        for sent in [0, 1, CameraFrameHeader::LEN] {
            let (camera, _server) = camera(&frame()[..sent]);
            // It waits for the rest.
            thread::sleep(10 * NAP);
            let begin = Instant::now();
            camera.stop();
            assert!(begin.elapsed() < FRAME_LIMIT / 2, "it waited for the limit");
        }
    }
}
