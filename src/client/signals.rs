//! Tests that signals do not lengthen time limits, with real signals and over real connections.

use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::sync::Arc;
use std::thread;
use std::time::{Duration, Instant};

use nix::sys::pthread::{pthread_kill, pthread_self};
use nix::sys::signal::Signal;

use super::{Connection, Endpoint, TimeLimits, TxtClient, TCP};
use crate::error::Error;
use crate::i2c::I2cClient;
use crate::wire::{CommandId, ResponseId};

/// The limit that has to hold.
pub(crate) const LIMIT: Duration = Duration::from_millis(300);

const LIMITS: TimeLimits = TimeLimits { connect: LIMIT, read: LIMIT, write: LIMIT };

/// The time between two signals.
const GUST: Duration = Duration::from_millis(50);

/// The longest that a storm lasts. A limit that starts again with each signal would outlast it.
const STORM: Duration = Duration::from_secs(20);

/// Makes a call while this thread gets a storm of signals, handled with SA_RESTART, as in a program
/// that does not want to notice them. The call has to return before the storm is over.
pub(crate) fn in_a_storm<T>(call: impl FnOnce() -> T) -> T {
    let signal = Signal::SIGUSR1;
    let handled = Arc::new(AtomicBool::new(false));
    let handler = signal_hook::flag::register(signal as i32, Arc::clone(&handled)).unwrap();
    let target = pthread_self();
    let (calm, calms_down) = mpsc::channel::<()>();
    let (result, time) = thread::scope(|scope| {
        scope.spawn(move || {
            let begin = Instant::now();
            while begin.elapsed() < STORM {
                // The target thread exists: it waits for this one.
                pthread_kill(target, signal).unwrap();
                if calms_down.recv_timeout(GUST) == Err(RecvTimeoutError::Disconnected) {
                    break;
                }
            }
        });
        let begin = Instant::now();
        let result = call();
        let time = begin.elapsed();
        drop(calm);
        (result, time)
    });
    signal_hook::low_level::unregister(handler);
    assert!(handled.load(Ordering::Relaxed), "there was no storm");
    assert!(time < STORM, "the signals kept it for {time:?}");
    result
}

fn listen() -> (TcpListener, u16) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = listener.local_addr().unwrap().port();
    (listener, port)
}

#[test]
fn the_limit_for_a_response_holds_in_a_storm_of_signals() {
    let (_silent, port) = listen();
    let mut client = TxtClient::connect(format!("127.0.0.1:{port}"), LIMITS).unwrap();
    let no_answer = |command| Err(Error::NoAnswer { command, limit: LIMIT, received: 0 });
    assert_eq!(in_a_storm(|| client.query_status()).map(drop), no_answer("QueryStatus"));
    let mut client = I2cClient::connect(format!("127.0.0.1:{port}"), LIMITS).unwrap();
    assert_eq!(in_a_storm(|| client.write(0x18, 1, &[2])), no_answer("an I2C request"));
}

#[test]
fn a_response_that_comes_in_a_storm_of_signals_is_taken() {
    let (listener, port) = listen();
    let limits = TimeLimits { read: STORM, ..LIMITS };
    let mut client = TxtClient::connect(format!("127.0.0.1:{port}"), limits).unwrap();
    let server = thread::spawn(move || {
        let mut stream = listener.accept().unwrap().0;
        stream.read_exact(&mut [0; 68]).unwrap();
        thread::sleep(4 * GUST);
        let mut response = Vec::new();
        ResponseId::StartOnline.emit(&mut response);
        stream.write_all(&response).unwrap();
    });
    assert_eq!(in_a_storm(|| client.start_online()), Ok(()));
    server.join().unwrap();
}

#[test]
fn the_limit_for_sending_holds_in_a_storm_of_signals() {
    let (_reads_nothing, port) = listen();
    let endpoint = Endpoint::new(&TCP, "127.0.0.1", port).unwrap();
    let mut connection = Connection::open(&endpoint, LIMITS).unwrap();
    // More than any system buffers.
    let bytes = vec![0; 64 << 20];
    let result = in_a_storm(|| connection.send("a long command", &bytes));
    assert_eq!(result, Err(Error::NotTaken { command: "a long command", limit: LIMIT }));
}

#[test]
fn signals_do_not_cut_the_last_bytes_short() {
    let (listener, port) = listen();
    let mut client = TxtClient::connect(format!("127.0.0.1:{port}"), LIMITS).unwrap();
    let server = thread::spawn(move || {
        let mut stream = listener.accept().unwrap().0;
        let mut words = Vec::new();
        stream.read_to_end(&mut words).unwrap();
        thread::sleep(4 * GUST);
        words
    });
    let begin = Instant::now();
    in_a_storm(|| client.abandon(&[1, 2, 3]));
    assert!(begin.elapsed() >= 4 * GUST, "it did not wait for the other side");
    let mut expected = vec![1, 2, 3];
    CommandId::StopOnline.emit(&mut expected);
    assert_eq!(server.join().unwrap(), expected);

    let (_silent, port) = listen();
    let mut client = TxtClient::connect(format!("127.0.0.1:{port}"), LIMITS).unwrap();
    in_a_storm(|| client.abandon(&[1, 2, 3]));
}

// On other systems a full queue refuses connections.
#[cfg(target_os = "linux")]
#[test]
fn the_limit_for_connecting_holds_in_a_storm_of_signals() {
    let (listener, port) = listen();
    let address = listener.local_addr().unwrap();
    let mut queue = Vec::new();
    while let Ok(stream) = TcpStream::connect_timeout(&address, LIMIT) {
        queue.push(stream);
        assert!(queue.len() < 10_000, "the queue is never full");
    }
    let result = in_a_storm(|| TxtClient::connect(format!("127.0.0.1:{port}"), LIMITS));
    let timed_out = Error::ConnectTimedOut { address: address.to_string(), limit: LIMIT };
    assert_eq!(result.unwrap_err(), timed_out);
}
