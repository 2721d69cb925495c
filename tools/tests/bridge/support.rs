//! What the tests need: a broker, a bridge, and somebody who listens.

use std::env;
use std::io::{self, BufRead, BufReader, Write};
use std::net::{TcpListener, TcpStream};
#[cfg(unix)]
use std::os::{fd::OwnedFd, unix::net::UnixStream};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Condvar, Mutex};
use std::thread;
use std::time::{Duration, Instant};

use ft_transfer_area_simulator::{Machine, SimulatedTxt};
use rumqttc::{Client, Event, MqttOptions, Packet, QoS};
use serde_json::Value;
use tempfile::TempDir;

use crate::running;

/// For everything that has to happen; a busy machine may need long.
pub(crate) const LONGEST_WAIT: Duration = Duration::from_secs(40);

/// Where Mosquitto is; `None`, and a sentence, when it is not installed.
pub(crate) fn mosquitto() -> Option<PathBuf> {
    if let Some(given) = env::var_os("TXT_MOSQUITTO") {
        return Some(given.into());
    }
    let path = env::var_os("PATH").unwrap_or_default();
    // Debian puts it where only the administrator's programs are found.
    let places = env::split_paths(&path).chain(["/usr/sbin".into(), "/usr/local/sbin".into()]);
    let found = places.map(|place: PathBuf| place.join("mosquitto")).find(|file| file.is_file());
    if found.is_none() {
        // Not into the test's captured output, so that the note is always shown.
        let note = "SKIPPED: Mosquitto is not installed; TXT_MOSQUITTO can name it\n";
        io::stderr().write_all(note.as_bytes()).unwrap();
    }
    found
}

/// Mosquitto on a port of its own.
pub(crate) struct Broker {
    pub(crate) port: u16,
    program: PathBuf,
    files: TempDir,
    child: Child,
}

impl Broker {
    pub(crate) fn start() -> Option<Self> {
        Self::with("allow_anonymous true\n", |_| {})
    }

    /// A broker with these lines in its configuration, and with what `prepare` puts beside it.
    pub(crate) fn with(lines: &str, prepare: impl Fn(&Path)) -> Option<Self> {
        let program = mosquitto()?;
        let files = tempfile::tempdir().unwrap();
        prepare(files.path());
        let lines = lines.replace("{dir}", files.path().to_str().unwrap());
        let mut tries = 0;
        loop {
            let port = free_port();
            let config = format!(
                "listener {port} 127.0.0.1\nmax_queued_messages 100000\nuser root\n{lines}"
            );
            std::fs::write(files.path().join("mosquitto.conf"), config).unwrap();
            match launch(&program, files.path(), port) {
                Ok(child) => return Some(Self { port, program, files, child }),
                // Another test may have taken the port.
                Err(said) => assert!(tries < 10, "Mosquitto does not start: {said}"),
            }
            tries += 1;
        }
    }

    pub(crate) fn kill(&mut self) {
        self.child.kill().unwrap();
        self.child.wait().unwrap();
    }

    pub(crate) fn start_again(&mut self) {
        let deadline = Instant::now() + LONGEST_WAIT;
        loop {
            match launch(&self.program, self.files.path(), self.port) {
                Ok(child) => {
                    self.child = child;
                    return;
                }
                Err(said) => assert!(Instant::now() < deadline, "{said}"),
            }
        }
    }

    /// Sends a signal to the broker's process: STOP, CONT.
    pub(crate) fn signal(&self, signal: &str) {
        assert!(running::is_sent(&self.child, signal));
    }
}

impl Drop for Broker {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Starts Mosquitto, and waits until it accepts connections.
fn launch(program: &Path, files: &Path, port: u16) -> Result<Child, String> {
    let mut command = Command::new(program);
    command.arg("-c").arg(files.join("mosquitto.conf"));
    command.stdout(Stdio::null()).stderr(Stdio::null());
    let mut child = command.spawn().map_err(|error| format!("{}: {error}", program.display()))?;
    let deadline = Instant::now() + LONGEST_WAIT;
    loop {
        if let Ok(Some(status)) = child.try_wait() {
            return Err(format!("it ended with {status}"));
        }
        if TcpStream::connect(("127.0.0.1", port)).is_ok() {
            return Ok(child);
        }
        assert!(Instant::now() < deadline, "Mosquitto does not listen");
        thread::sleep(Duration::from_millis(10));
    }
}

fn free_port() -> u16 {
    TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port()
}

/// Lines or messages that come in, and somebody who waits for them.
struct Incoming<T> {
    all: Mutex<Vec<T>>,
    came: Condvar,
}

impl<T: Clone + std::fmt::Debug> Incoming<T> {
    fn new() -> Arc<Self> {
        Arc::new(Self { all: Mutex::default(), came: Condvar::new() })
    }

    fn add(&self, one: T) {
        self.all.lock().unwrap().push(one);
        self.came.notify_all();
    }

    /// The first one from `from` on that is right.
    fn wait<R>(&self, what: &str, from: usize, mut right: impl FnMut(&T) -> Option<R>) -> R {
        let deadline = Instant::now() + LONGEST_WAIT;
        let (mut all, mut seen) = (self.all.lock().unwrap(), from);
        loop {
            if let Some(found) = all[seen..].iter().find_map(&mut right) {
                return found;
            }
            seen = all.len();
            let left = deadline.saturating_duration_since(Instant::now());
            let newest = &all[all.len().saturating_sub(20).max(from)..];
            assert!(!left.is_zero(), "never came: {what}; this came last: {newest:#?}");
            all = self.came.wait_timeout(all, left).unwrap().0;
        }
    }

    fn len(&self) -> usize {
        self.all.lock().unwrap().len()
    }
}

/// The program `txt bridge`.
pub(crate) struct Bridge {
    child: Child,
    lines: Arc<Incoming<String>>,
}

impl Bridge {
    pub(crate) fn start<'a>(broker: u16, arguments: impl IntoIterator<Item = &'a str>) -> Self {
        Self::start_as(broker, arguments, None)
    }

    /// With a password for the broker.
    pub(crate) fn start_as<'a>(
        broker: u16,
        arguments: impl IntoIterator<Item = &'a str>,
        password: Option<&str>,
    ) -> Self {
        let mut command = Self::command(broker, arguments);
        if let Some(password) = password {
            command.env("TXT_MQTT_PASSWORD", password);
        }
        let mut child = command.stderr(Stdio::piped()).spawn().unwrap();
        let (lines, stderr) = (Incoming::new(), child.stderr.take().unwrap());
        let printed = Arc::clone(&lines);
        thread::spawn(move || {
            for line in BufReader::new(stderr).lines().map_while(Result::ok) {
                printed.add(line);
            }
        });
        Self { child, lines }
    }

    /// With an error output that is full and that nobody reads, until the socket is dropped: like a terminal that is
    /// paused.
    #[cfg(unix)]
    pub(crate) fn start_unread<'a>(
        broker: u16,
        arguments: impl IntoIterator<Item = &'a str>,
    ) -> (Self, UnixStream) {
        let (unread, mut full) = UnixStream::pair().unwrap();
        full.set_nonblocking(true).unwrap();
        while full.write(&[b'\n'; 1024]).is_ok() {}
        full.set_nonblocking(false).unwrap();
        let mut command = Self::command(broker, arguments);
        let child = command.stderr(OwnedFd::from(full)).spawn().unwrap();
        (Self { child, lines: Incoming::new() }, unread)
    }

    fn command<'a>(broker: u16, arguments: impl IntoIterator<Item = &'a str>) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_txt"));
        command.args(["bridge", "--mqtt", &format!("127.0.0.1:{broker}")]).args(arguments);
        command
    }

    /// Waits until it prints a line with this text, counted from its start.
    pub(crate) fn wait_for(&self, text: &str) -> String {
        self.lines.wait(text, 0, |line| line.contains(text).then(|| line.clone()))
    }

    /// How many lines with this text it has printed so far.
    pub(crate) fn count(&self, text: &str) -> usize {
        self.lines.all.lock().unwrap().iter().filter(|line| line.contains(text)).count()
    }

    pub(crate) fn interrupt(&self) {
        self.signal("INT");
    }

    /// Sends it a signal: TERM, STOP, CONT.
    pub(crate) fn signal(&self, signal: &str) {
        assert!(running::is_sent(&self.child, signal));
    }

    pub(crate) fn kill(&mut self) {
        self.child.kill().unwrap();
    }

    pub(crate) fn wait(&mut self) -> ExitStatus {
        let deadline = Instant::now() + LONGEST_WAIT;
        loop {
            if let Some(status) = self.child.try_wait().unwrap() {
                return status;
            }
            assert!(Instant::now() < deadline, "the bridge does not end");
            thread::sleep(Duration::from_millis(10));
        }
    }
}

impl Drop for Bridge {
    fn drop(&mut self) {
        running::end(&mut self.child);
    }
}

/// A client that hears everything.
pub(crate) struct Listener {
    client: Client,
    heard: Arc<Incoming<(String, Value, bool)>>,
}

impl Listener {
    pub(crate) fn new(broker: &Broker) -> Self {
        static NUMBER: AtomicUsize = AtomicUsize::new(0);
        // The broker ends the connection of another one with the same name.
        let name = format!("listener-{}", NUMBER.fetch_add(1, Ordering::Relaxed));
        let mut options = MqttOptions::new(name, "127.0.0.1", broker.port);
        options.set_max_packet_size(4 << 20, 4 << 20);
        let (client, mut connection) = Client::new(options, 10_000);
        let (heard, again) = (Incoming::new(), client.clone());
        let hears = Arc::clone(&heard);
        thread::spawn(move || {
            for event in connection.iter() {
                match event {
                    Ok(Event::Incoming(Packet::ConnAck(_))) => {
                        let _ = again.try_subscribe("ft/#", QoS::AtLeastOnce);
                    }
                    Ok(Event::Incoming(Packet::SubAck(_))) => {
                        hears.add(("subscribed".to_owned(), Value::Null, false));
                    }
                    Ok(Event::Incoming(Packet::Publish(message))) => {
                        let payload = serde_json::from_slice(&message.payload).unwrap_or_default();
                        hears.add((message.topic, payload, message.retain));
                    }
                    Ok(_) => {}
                    Err(_) if Arc::strong_count(&hears) == 1 => return,
                    Err(_) => thread::sleep(Duration::from_millis(20)),
                }
            }
        });
        let listener = Self { client, heard };
        listener.wait(0, "subscribed", |_| true);
        listener
    }

    /// How many messages have come. A wait from here on sees only later ones.
    pub(crate) fn now(&self) -> usize {
        self.heard.len()
    }

    /// The first payload of this topic from `from` on that is right.
    pub(crate) fn wait(&self, from: usize, topic: &str, right: impl Fn(&Value) -> bool) -> Value {
        self.heard.wait(topic, from, |(of, payload, _)| {
            (of == topic && right(payload)).then(|| payload.clone())
        })
    }

    /// The last payload of this topic before the first one of a state from `from` on that is right.
    pub(crate) fn before_state(
        &self,
        from: usize,
        state: &str,
        right: impl Fn(&Value) -> bool,
        topic: &str,
    ) -> Option<Value> {
        let all = self.heard.all.lock().unwrap();
        let is_it = |(of, payload, _): &(String, Value, bool)| of == state && right(payload);
        let end = from + all[from..].iter().position(is_it)?;
        let mut before = all[..end].iter().rev();
        before.find(|(of, ..)| of == topic).map(|(_, payload, _)| payload.clone())
    }

    /// All payloads of this topic so far.
    pub(crate) fn all(&self, topic: &str) -> Vec<Value> {
        let all = self.heard.all.lock().unwrap();
        all.iter().filter(|(of, ..)| of == topic).map(|(_, payload, _)| payload.clone()).collect()
    }

    pub(crate) fn send(&self, topic: &str, payload: impl Into<Vec<u8>>) {
        self.client.publish(topic, QoS::AtLeastOnce, false, payload).unwrap();
    }

    pub(crate) fn send_retained(&self, topic: &str, payload: &str) {
        self.client.publish(topic, QoS::AtLeastOnce, true, payload).unwrap();
    }
}

impl Drop for Listener {
    fn drop(&mut self) {
        let _ = self.client.disconnect();
    }
}

/// Whether the payload has this state.
pub(crate) fn is_state(state: &'static str) -> impl Fn(&Value) -> bool {
    move |payload| payload["state"] == state
}

/// Waits until the simulated machine is as it should be.
pub(crate) fn wait_machine(txt: &SimulatedTxt, what: &str, right: impl FnMut(&Machine) -> bool) {
    assert!(txt.wait_until(right, LONGEST_WAIT), "the machine never came to this: {what}");
}

/// The duty of the master's M1, clockwise.
pub(crate) fn m1(machine: &Machine) -> i16 {
    machine.controllers[0].outputs.duty[0]
}
