//! A page without a browser.

use std::io::{self, ErrorKind, Read, Write};
use std::net::{Shutdown, TcpStream};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::{Duration, Instant};

use serde_json::{json, Value};
use tungstenite::client::IntoClientRequest;
use tungstenite::http::Request;
use tungstenite::{Error, HandshakeError, Message, Utf8Bytes, WebSocket};

use super::LIMIT;

/// How often a page shows that it is there.
const ALIVE_PERIOD: Duration = Duration::from_millis(100);

pub(crate) struct Page {
    socket: WebSocket<Wire>,
    pub(crate) number: u64,
    seq: u64,
    /// Whether it shows that it is there, whatever else it does.
    lively: Arc<AtomicBool>,
}

/// The connection. Messages are small enough to be written at once, so two threads can write whole ones.
struct Wire {
    stream: TcpStream,
    writing: Arc<Mutex<()>>,
}

impl Read for Wire {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.stream.read(buffer)
    }
}

impl Write for Wire {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let _whole = self.writing.lock();
        self.stream.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.stream.flush()
    }
}

/// The message `alive`.
fn alive() -> Vec<u8> {
    let text = b"{\"do\":\"alive\"}";
    // A text of this length, masked by zeros.
    let mut frame = vec![0x81, 0x80 | text.len() as u8, 0, 0, 0, 0];
    frame.extend_from_slice(text);
    frame
}

/// Sends `alive` again and again until the page is dropped.
fn keep_alive(mut stream: TcpStream, writing: &Mutex<()>, lively: &Arc<AtomicBool>) {
    let frame = alive();
    while Arc::strong_count(lively) > 1 {
        thread::sleep(ALIVE_PERIOD);
        let _whole = writing.lock();
        if lively.load(Ordering::Relaxed) && stream.write_all(&frame).is_err() {
            return;
        }
    }
}

impl Page {
    pub(crate) fn open(address: &str, token: &str) -> Self {
        Self::connect(address, request(address, token)).expect("the panel lets the page in")
    }

    /// A page by this request; the status when it is refused.
    pub(crate) fn connect(address: &str, request: Request<()>) -> Result<Self, u16> {
        let stream = TcpStream::connect(address).unwrap();
        stream.set_read_timeout(Some(LIMIT)).unwrap();
        let writing = Arc::new(Mutex::new(()));
        let (also_writes, writes) = (stream.try_clone().unwrap(), Arc::clone(&writing));
        let (socket, _) = match tungstenite::client(request, Wire { stream, writing }) {
            Ok(done) => done,
            Err(HandshakeError::Failure(Error::Http(response))) => {
                return Err(response.status().as_u16())
            }
            Err(error) => panic!("{error}"),
        };
        let lively = Arc::new(AtomicBool::new(true));
        let keeps_alive = Arc::clone(&lively);
        thread::spawn(move || keep_alive(also_writes, &writes, &keeps_alive));
        let mut page = Self { socket, number: 0, seq: 0, lively };
        let hello = page.next();
        assert_eq!(hello["type"], "hello");
        page.number = hello["page"].as_u64().unwrap();
        Ok(page)
    }

    /// From now on it says nothing by itself.
    pub(crate) fn fall_silent(&mut self) {
        self.lively.store(false, Ordering::Relaxed);
    }

    pub(crate) fn send(&mut self, message: &str) {
        // Whether it arrives is seen by what comes back.
        let _ = self.socket.send(Message::text(message));
    }

    /// Sends bytes that are not text.
    pub(crate) fn send_bytes(&mut self, bytes: Vec<u8>) {
        let _ = self.socket.send(Message::binary(bytes));
    }

    /// Sends a command, and returns its answer.
    pub(crate) fn ask(&mut self, mut message: Value) -> Value {
        self.seq += 1;
        message["seq"] = json!(self.seq);
        self.send(&message.to_string());
        self.wait(|answer| answer["type"] == "answer" && answer["seq"] == message["seq"])
    }

    /// Sends a command that has to be carried out, and returns its value.
    pub(crate) fn done(&mut self, message: Value) -> Value {
        let answer = self.ask(message.clone());
        assert_eq!(answer["ok"], true, "{message}: {answer}");
        answer["value"].clone()
    }

    /// Sends a command that has to be refused, and returns the code.
    pub(crate) fn refused(&mut self, message: Value) -> String {
        let answer = self.ask(message.clone());
        assert_eq!(answer["ok"], false, "{message}: {answer}");
        code_of(&answer)
    }

    /// The code of the next error that is reported.
    pub(crate) fn next_error(&mut self) -> String {
        code_of(&self.wait(|answer| answer["type"] == "answer" && answer["ok"] == false))
    }

    /// Waits until a controller's state is as wanted, and returns it.
    pub(crate) fn state(&mut self, host: usize, wanted: impl Fn(&Value) -> bool) -> Value {
        self.wait(|state| state["type"] == "state" && state["host"] == host && wanted(state))
    }

    /// Waits until there is a connection to the first controller.
    pub(crate) fn wait_until_running(&mut self) {
        self.state(0, is_running);
    }

    /// Waits for a message.
    pub(crate) fn wait(&mut self, wanted: impl Fn(&Value) -> bool) -> Value {
        self.wait_and_read(|text| Some(parse(text)).filter(&wanted))
    }

    /// Waits for a message whose text is as wanted. It costs far less time than to read each of them.
    pub(crate) fn wait_for_text(&mut self, wanted: impl Fn(&str) -> bool) -> Value {
        self.wait_and_read(|text| wanted(text).then(|| parse(text)))
    }

    /// Waits until `read` returns a message.
    fn wait_and_read(&mut self, read: impl Fn(&str) -> Option<Value>) -> Value {
        let deadline = Instant::now() + LIMIT;
        loop {
            let text = self.next_text();
            if let Some(message) = read(&text) {
                return message;
            }
            assert!(Instant::now() < deadline, "the last message is {text}");
        }
    }

    /// The next message.
    fn next(&mut self) -> Value {
        parse(&self.next_text())
    }

    fn next_text(&mut self) -> Utf8Bytes {
        loop {
            match self.socket.read().expect("the connection goes on") {
                Message::Text(text) => return text,
                other => assert!(other.is_ping(), "{other:?}"),
            }
        }
    }

    /// Reads until the panel closes the connection.
    pub(crate) fn wait_for_end(&mut self) {
        loop {
            match self.socket.read() {
                Ok(_) => {}
                Err(Error::Io(error)) if error.kind() == ErrorKind::WouldBlock => {
                    panic!("the connection goes on")
                }
                Err(_) => return,
            }
        }
    }

    /// From now on all that comes is read and thrown away, as long as the connection is there.
    pub(crate) fn ignore_all(&self) {
        let mut stream = self.socket.get_ref().stream.try_clone().unwrap();
        thread::spawn(move || io::copy(&mut stream, &mut io::sink()));
    }

    /// Says that it is there without end, until the other end closes the connection or this is dropped.
    pub(crate) fn flood(&self) -> impl FnOnce() + Send {
        let mut stream = self.socket.get_ref().stream.try_clone().unwrap();
        let frames = alive().repeat(10_000);
        move || while stream.write_all(&frames).is_ok() {}
    }

    /// Sends so many pings, each with as many bytes as there may be, and reads a part of the answers, until the panel closes
    /// the connection, as it may when a state comes while its room is full of answers.
    #[cfg(target_os = "linux")]
    pub(crate) fn ping_and_read_slowly(mut self, pings: usize) {
        let stream = &self.socket.get_ref().stream;
        socket2::SockRef::from(stream).set_recv_buffer_size(64 << 10).unwrap();
        let mut writes = stream.try_clone().unwrap();
        // A ping of this length, masked by zeros.
        let frame = [&[0x89, 0x80 | 125, 0, 0, 0, 0][..], &[0; 125]].concat().repeat(1000);
        self.fall_silent();
        let sent = thread::spawn(move || {
            (0..pings / 1000).all(|_| writes.write_all(&frame).is_ok());
        });
        while !sent.is_finished() {
            let _ = self.socket.get_mut().read(&mut [0; 8 << 10]);
            thread::sleep(Duration::from_millis(10));
        }
        sent.join().unwrap();
    }

    /// Ends the connection as a browser does that is closed, or without a word.
    pub(crate) fn close(mut self, politely: bool) {
        self.fall_silent();
        if politely {
            self.socket.close(None).unwrap();
            self.socket.flush().unwrap();
        }
    }
}

impl Drop for Page {
    fn drop(&mut self) {
        // The thread that keeps it alive has the connection, too.
        let _ = self.socket.get_ref().stream.shutdown(Shutdown::Both);
    }
}

/// The request for a page's connection.
pub(crate) fn request(address: &str, token: &str) -> Request<()> {
    format!("ws://{address}/ws?token={token}").into_client_request().unwrap()
}

pub(crate) fn is_running(state: &Value) -> bool {
    state["link"]["phase"] == "running"
}

fn parse(text: &str) -> Value {
    serde_json::from_str(text).unwrap()
}

fn code_of(answer: &Value) -> String {
    let error = &answer["error"];
    assert!(error["text"].as_str().unwrap().len() > 10, "a sentence: {answer}");
    error["code"].as_str().unwrap().to_owned()
}
