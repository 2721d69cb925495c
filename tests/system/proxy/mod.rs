//! A proxy between a program and its controller that makes faults.

pub(crate) mod fault;
pub(crate) mod packets;

use std::io::{Read, Write};
use std::net::{Ipv4Addr, Shutdown, TcpListener, TcpStream};
use std::sync::atomic::{AtomicBool, AtomicU16, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use socket2::SockRef;

use packets::{is_waiting, read_request, read_response, Tracker};

use fault::{Fault, Strike};
use packets::Place;

/// Longer than anything takes on a busy machine; only a failing test waits this long.
const DEADLINE: Duration = Duration::from_secs(30);

/// How often a thread checks whether it should end.
const POLL: Duration = Duration::from_millis(20);

/// The time between two bytes that come too slowly.
const SLOW: Duration = Duration::from_millis(400);

/// A server for programs, until it is dropped.
pub(crate) struct Proxy {
    port: u16,
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

struct Shared {
    controller: AtomicU16,
    /// The faults, in turn; each strikes once.
    strikes: Vec<Strike>,
    /// When each fault has struck, as far as they have.
    struck: Mutex<Vec<Instant>>,
    stopping: AtomicBool,
}

impl Shared {
    fn stops(&self) -> bool {
        self.stopping.load(Ordering::SeqCst)
    }

    /// The fault that strikes now, if the next one belongs to this place.
    fn strike(&self, place: Option<Place>, in_request: bool) -> Option<Fault> {
        let mut struck = self.struck.lock().unwrap();
        let next = self.strikes.get(struck.len())?;
        if place != Some(next.place) || in_request != next.in_request {
            return None;
        }
        struck.push(Instant::now());
        Some(next.fault)
    }
}

impl Proxy {
    pub(crate) fn start(controller: u16, strikes: impl IntoIterator<Item = Strike>) -> Self {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).unwrap();
        let port = listener.local_addr().unwrap().port();
        let (struck, stopping) = Default::default();
        let (controller, strikes) = (controller.into(), strikes.into_iter().collect());
        let shared = Arc::new(Shared { controller, strikes, struck, stopping });
        let serving = Arc::clone(&shared);
        let thread = thread::spawn(move || {
            // A connection may still be open while the program makes another.
            thread::scope(|scope| {
                while let Ok((program, _)) = listener.accept() {
                    if serving.stops() {
                        return;
                    }
                    // Without a controller, the program gets a closed connection.
                    if let Ok(mut link) = Link::new(program, &serving) {
                        scope.spawn(move || link.serve());
                    }
                }
            });
        });
        Self { port, shared, thread: Some(thread) }
    }

    pub(crate) fn port(&self) -> u16 {
        self.port
    }

    /// Sets the controller of the next connections.
    pub(crate) fn lead_to(&self, controller: u16) {
        self.shared.controller.store(controller, Ordering::SeqCst);
    }

    /// Waits until the first fault has struck.
    pub(crate) fn wait_struck(&self) {
        let begin = Instant::now();
        while self.shared.struck.lock().unwrap().is_empty() {
            assert!(begin.elapsed() < DEADLINE, "the fault does not strike");
            thread::sleep(Duration::from_millis(1));
        }
    }

    /// When the first fault struck.
    pub(crate) fn struck(&self) -> Instant {
        *self.shared.struck.lock().unwrap().first().expect("the fault did not strike")
    }

    /// Whether all faults have struck.
    pub(crate) fn is_done(&self) -> bool {
        self.shared.struck.lock().unwrap().len() == self.shared.strikes.len()
    }
}

impl Drop for Proxy {
    fn drop(&mut self) {
        self.shared.stopping.store(true, Ordering::SeqCst);
        // Wakes the thread if it waits for a connection.
        drop(TcpStream::connect((Ipv4Addr::LOCALHOST, self.port)));
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// The two connections of a transfer.
struct Link<'a> {
    program: TcpStream,
    controller: TcpStream,
    shared: &'a Shared,
}

/// Whether the packets go on in turn.
enum Next {
    Packet,
    End,
}

impl<'a> Link<'a> {
    fn new(program: TcpStream, shared: &'a Shared) -> std::io::Result<Self> {
        let port = shared.controller.load(Ordering::SeqCst);
        let controller = TcpStream::connect((Ipv4Addr::LOCALHOST, port))?;
        for stream in [&program, &controller] {
            stream.set_nodelay(true)?;
            stream.set_read_timeout(Some(POLL))?;
        }
        Ok(Self { program, controller, shared })
    }

    fn serve(&mut self) {
        let mut tracker = Tracker::new();
        while matches!(self.relay_packet(&mut tracker), Ok(Next::Packet)) {}
    }

    /// Relays a request and its response, or makes the fault.
    fn relay_packet(&mut self, tracker: &mut Tracker) -> std::io::Result<Next> {
        let shared = self.shared;
        let Some(request) = read_request(&mut self.program, || shared.stops()) else {
            return Ok(Next::End);
        };
        let place = tracker.place(&request);
        match shared.strike(place, true) {
            Some(fault) => {
                if let Next::End = self.strike_request(fault, &request)? {
                    return Ok(Next::End);
                }
            }
            None => self.controller.write_all(&request)?,
        }
        let Some(response) = read_response(&mut self.controller, &request, || shared.stops())
        else {
            return Ok(Next::End);
        };
        match shared.strike(place, false) {
            Some(fault) => self.strike_response(fault, &response),
            None => {
                self.program.write_all(&response)?;
                Ok(Next::Packet)
            }
        }
    }

    fn strike_request(&mut self, fault: Fault, request: &[u8]) -> std::io::Result<Next> {
        match fault {
            Fault::Fin => self.close(),
            Fault::Rst => self.reset(),
            Fault::Cut => self.hold(),
            Fault::Half => {
                self.controller.write_all(&request[..request.len() / 2])?;
                self.hold()
            }
            Fault::Drip => {
                drip(&mut self.controller, request)?;
                Ok(Next::Packet)
            }
            fault => {
                self.controller.write_all(&fault.disturb(request))?;
                Ok(Next::Packet)
            }
        }
    }

    fn strike_response(&mut self, fault: Fault, response: &[u8]) -> std::io::Result<Next> {
        match fault {
            Fault::Fin => self.close(),
            Fault::Rst => self.reset(),
            Fault::Cut => self.hold(),
            Fault::HalfClose => {
                self.program.shutdown(Shutdown::Write)?;
                self.relay_requests()
            }
            Fault::Silence => self.relay_requests(),
            Fault::Half => {
                self.program.write_all(&response[..response.len() / 2])?;
                self.relay_requests()
            }
            Fault::HalfThenFin => {
                self.program.write_all(&response[..response.len() / 2])?;
                self.close()
            }
            Fault::Drip => {
                drip(&mut self.program, response)?;
                Ok(Next::Packet)
            }
            Fault::Endless => self.send_endlessly(response),
            Fault::SlowDrip => {
                self.drip_slowly(response)?;
                Ok(Next::Packet)
            }
            fault => {
                self.program.write_all(&fault.disturb(response))?;
                Ok(Next::Packet)
            }
        }
    }

    /// Closes both connections in the normal way.
    fn close(&mut self) -> std::io::Result<Next> {
        Ok(Next::End)
    }

    /// Closes both connections by a reset.
    fn reset(&mut self) -> std::io::Result<Next> {
        for stream in [&self.program, &self.controller] {
            SockRef::from(stream).set_linger(Some(Duration::ZERO))?;
        }
        Ok(Next::End)
    }

    /// From now on reads nothing, sends nothing and closes nothing.
    fn hold(&mut self) -> std::io::Result<Next> {
        while !self.shared.stops() {
            thread::sleep(POLL);
        }
        Ok(Next::End)
    }

    /// Lets requests through, but no responses.
    fn relay_requests(&mut self) -> std::io::Result<Next> {
        let mut bytes = [0; 4096];
        let mut is_open = true;
        while !self.shared.stops() {
            if is_open {
                match self.program.read(&mut bytes) {
                    Ok(0) => {
                        is_open = false;
                        self.controller.shutdown(Shutdown::Write)?;
                    }
                    Ok(count) => self.controller.write_all(&bytes[..count])?,
                    Err(error) if is_waiting(&error) => {}
                    Err(error) => return Err(error),
                }
            }
            // The responses are thrown away.
            if matches!(self.controller.read(&mut bytes), Ok(0)) {
                break;
            }
        }
        Ok(Next::End)
    }

    /// Lets requests through, and sends bytes until the program is gone.
    fn send_endlessly(&mut self, response: &[u8]) -> std::io::Result<Next> {
        let mut bytes = response.to_vec();
        bytes.resize(response.len() + 4096, 0xA5);
        self.program.write_all(&bytes)?;
        self.program.set_nonblocking(true)?;
        let mut request = [0; 4096];
        while !self.shared.stops() {
            match self.program.write(&bytes) {
                Err(error) if !is_waiting(&error) => break,
                _ => {}
            }
            match self.program.read(&mut request) {
                Ok(0) => {}
                Ok(count) => self.controller.write_all(&request[..count])?,
                Err(error) if is_waiting(&error) => {}
                Err(_) => break,
            }
        }
        // The last requests are read and answered before the connection ends.
        self.controller.shutdown(Shutdown::Write)?;
        while !self.shared.stops() && !matches!(self.controller.read(&mut request), Ok(0)) {}
        Ok(Next::End)
    }

    /// Sends bytes so slowly that the response takes too long, until the program sends something.
    fn drip_slowly(&mut self, response: &[u8]) -> std::io::Result<()> {
        for byte in response {
            self.program.write_all(&[*byte])?;
            let begin = Instant::now();
            while begin.elapsed() < SLOW {
                let peeked = self.program.peek(&mut [0]);
                if self.shared.stops() || !peeked.is_err_and(|error| is_waiting(&error)) {
                    return Ok(());
                }
            }
        }
        Ok(())
    }
}

/// Sends each byte on its own.
fn drip(stream: &mut TcpStream, bytes: &[u8]) -> std::io::Result<()> {
    for byte in bytes {
        stream.write_all(&[*byte])?;
        thread::sleep(Duration::from_millis(1));
    }
    Ok(())
}
