//! This test program as a child process, in another role.

use std::io::{self, BufRead, BufReader, Write};
use std::net::{Ipv4Addr, Shutdown, TcpListener, TcpStream};
use std::process::{self, ChildStdin, ChildStdout, Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::Arc;
use std::thread;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use ft_transfer_area::transfer_area::LOCAL_IO;
use ft_transfer_area::{CameraOptions, Error, TimeLimits, TransferAreaComHandler};
use ft_transfer_area_simulator::SimulatedTxt;

use super::controller::{Controller, DUTY};
use super::row::{name_of, By};
use super::system::{leave_no_descriptor, leave_no_thread, take_interrupts};

/// The role of a child process and its arguments, separated by spaces.
const ROLE: &str = "RELIABILITY_ROLE";

/// A child process that prints a line for each thing it sees.
pub(crate) struct Child {
    pub(crate) process: process::Child,
    /// When it is closed, the program ends its transfer.
    pub(crate) stdin: Option<ChildStdin>,
    lines: BufReader<ChildStdout>,
}

impl Child {
    /// Starts this program in a role.
    pub(crate) fn start(role: &str) -> Self {
        Self::start_by(Command::new(std::env::current_exe().unwrap()), role)
    }

    /// Starts it with a command that runs it.
    pub(crate) fn start_by(mut command: Command, role: &str) -> Self {
        let mut process =
            command.env(ROLE, role).stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap();
        let stdin = process.stdin.take();
        let lines = BufReader::new(process.stdout.take().unwrap());
        Self { process, stdin, lines }
    }

    /// Its next line, which has this word, a detail, and the time.
    pub(crate) fn hear(&mut self, word: &str) -> (String, SystemTime) {
        let mut line = String::new();
        self.lines.read_line(&mut line).unwrap();
        let [first, about, micros] = line.split_whitespace().collect::<Vec<_>>()[..] else {
            panic!("the child says {line:?}, not {word:?}");
        };
        assert_eq!(first, word, "the child says {line:?}");
        (about.to_owned(), UNIX_EPOCH + Duration::from_micros(micros.parse().unwrap()))
    }
}

impl Drop for Child {
    fn drop(&mut self) {
        // It has ended already unless a test failed.
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// Prints a line for the parent.
fn say(word: &str, about: &str, when: SystemTime) {
    let micros = when.duration_since(UNIX_EPOCH).unwrap().as_micros();
    println!("{word} {about} {micros}");
    io::stdout().flush().unwrap();
}

fn say_now(word: &str, about: &str) {
    say(word, about, SystemTime::now());
}

fn say_result<T>(word: &str, result: &Result<T, Error>) {
    say_now(word, result.as_ref().err().map_or("Ok", name_of));
}

pub(crate) fn role() -> Option<String> {
    std::env::var(ROLE).ok()
}

pub(crate) fn play(role: &str) {
    let words: Vec<&str> = role.split(' ').collect();
    match words[..] {
        ["program", host, port, read] => program(host, number(port), number(read)),
        ["reconnecting", host, port] => reconnecting(host, number(port)),
        ["begin", host, port] => begin(host, number(port)),
        ["signalled", port] => signalled(number(port)),
        ["controller", port] => controller(number(port)),
        ["no-descriptor", port] => {
            leave_no_descriptor();
            begin("127.0.0.1", number(port));
        }
        ["no-thread", port] => {
            leave_no_thread();
            begin("127.0.0.1", number(port));
        }
        ["no-descriptor-in-transfer", port] => in_transfer(number(port), leave_no_descriptor),
        ["no-thread-in-transfer", port] => in_transfer(number(port), leave_no_thread),
        _ => panic!("there is no role {role:?}"),
    }
}

fn number<T: std::str::FromStr>(text: &str) -> T {
    text.parse().unwrap_or_else(|_| panic!("{text:?} is not a number"))
}

/// A handler with a motor on.
fn handler(host: &str, port: u16, limits: TimeLimits) -> TransferAreaComHandler {
    let handler = TransferAreaComHandler::builder(format!("{host}:{port}")).time_limits(limits);
    let handler = handler.build().unwrap();
    handler.areas().lock()[LOCAL_IO].output.duty[0] = DUTY;
    handler
}

/// Runs a motor until there is an error or the parent ends it.
fn program(host: &str, port: u16, read_ms: u64) {
    let limits = TimeLimits::default().read(Duration::from_millis(read_ms));
    let handler = handler(host, port, limits);
    let is_wanted = begin_until_told(&handler);
    while is_wanted.load(Ordering::SeqCst) {
        if let Err(error) = handler.areas().wait_cycle() {
            say_now("ended", name_of(&error));
            return;
        }
    }
    say_result("ended", &handler.end_transfer());
}

/// Begins a transfer. Returns a flag that the parent clears to end it.
fn begin_until_told(handler: &TransferAreaComHandler) -> Arc<AtomicBool> {
    handler.begin_transfer().unwrap();
    drop(handler.areas().wait_cycle().unwrap());
    say_now("begun", "Ok");
    let is_wanted = Arc::new(AtomicBool::new(true));
    let flag = Arc::clone(&is_wanted);
    thread::spawn(move || {
        let _ = io::copy(&mut io::stdin(), &mut io::sink());
        flag.store(false, Ordering::SeqCst);
    });
    is_wanted
}

/// Runs a motor until the connection is lost, goes on when it is restored, and prints the error that it got.
fn reconnecting(host: &str, port: u16) {
    let builder = TransferAreaComHandler::builder(format!("{host}:{port}"));
    let handler = builder.reconnect(Duration::from_secs(60)).build().unwrap();
    handler.areas().lock()[LOCAL_IO].output.duty[0] = DUTY;
    let is_wanted = begin_until_told(&handler);
    let (mut reported, mut when) = ("nothing", SystemTime::now());
    let mut is_connected = true;
    while is_wanted.load(Ordering::SeqCst) || !is_connected {
        match handler.areas().wait_cycle() {
            Ok(_) => is_connected = true,
            Err(error) => {
                (reported, when) = (name_of(&error), SystemTime::now());
                is_connected = false;
            }
        }
    }
    assert!(handler.areas().statistics().gaps <= 1, "the network was cut once");
    say("reported", reported, when);
    say_result("ended", &handler.end_transfer());
}

/// Tries to begin a transfer.
fn begin(host: &str, port: u16) {
    let limits = TimeLimits::default().connect(Duration::from_secs(1));
    let handler = handler(host, port, limits);
    say_now("begins", "Ok");
    let result = handler.begin_transfer();
    say_result("begun", &result);
}

/// Begins a transfer and waits, while it handles signals: in the thread that begins the transfer,
/// and then in the transfer thread.
fn signalled(port: u16) {
    let take_no_more = take_interrupts();
    let limits = TimeLimits::default().read(Duration::from_secs(1));
    let handler = handler("127.0.0.1", port, limits);
    say_now("begins", "Ok");
    let result = handler.begin_transfer();
    take_no_more();
    while result.is_ok() && handler.areas().wait_cycle().is_ok() {}
    say_result("ended", &handler.end_transfer());
}

/// A controller that other processes reach at all addresses of this machine.
fn controller(port: u16) {
    let idle_limit = Duration::from_secs(5);
    let controller = Controller::with_idle_limit(SimulatedTxt::builder(), idle_limit);
    let inner = controller.port();
    let listener = TcpListener::bind((Ipv4Addr::UNSPECIFIED, port)).unwrap();
    thread::spawn(move || {
        while let Ok((outer, _)) = listener.accept() {
            let inner = TcpStream::connect((Ipv4Addr::LOCALHOST, inner)).unwrap();
            relay(&outer, &inner);
            relay(&inner, &outer);
        }
    });
    say_now("listens", "Ok");
    controller.wait_on();
    let (begin, began) = (Instant::now(), SystemTime::now());
    let (by, stopped) = controller.stopped_after(begin);
    let by = match by {
        By::Exchange => "Exchange",
        By::Board => "Board",
        By::NeverOn | By::GoesOn => "none",
    };
    say("off", by, began + stopped.unwrap_or_default());
    // The last response may not have arrived yet.
    let _ = io::copy(&mut io::stdin(), &mut io::sink());
}

/// Forwards all bytes, and the end of the connection.
fn relay(from: &TcpStream, to: &TcpStream) {
    from.set_nodelay(true).unwrap();
    let (mut from, mut to) = (from.try_clone().unwrap(), to.try_clone().unwrap());
    thread::spawn(move || {
        let _ = io::copy(&mut from, &mut to);
        let _ = to.shutdown(Shutdown::Write);
    });
}

/// Lets something run out during a transfer, and then starts the camera and I2C.
fn in_transfer(port: u16, run_out: fn()) {
    let handler = handler("127.0.0.1", port, TimeLimits::default());
    handler.begin_transfer().unwrap();
    say_result("begun", &handler.areas().wait_cycle());
    run_out();
    let limits = Duration::from_millis(300);
    let options = CameraOptions::default().start_limit(limits);
    let camera = handler.start_camera(options).map(|frames| for _ in frames {});
    say_result("camera", &camera.and_then(|()| handler.camera_error().map_or(Ok(()), Err)));
    say_result("i2c", &handler.i2c());
    say_result("goes-on", &handler.areas().wait_cycle());
    say_result("ended", &handler.end_transfer());
}
