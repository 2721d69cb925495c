//! A page without a browser.

use std::io::ErrorKind;
use std::net::TcpStream;
use std::time::{Duration, Instant};

use serde_json::{json, Value};
use tungstenite::client::IntoClientRequest;
use tungstenite::http::Request;
use tungstenite::{Error, HandshakeError, Message, WebSocket};

use crate::LIMIT;

/// How often a page shows that it is there.
const ALIVE: Duration = Duration::from_millis(200);

pub(crate) struct Page {
    socket: WebSocket<TcpStream>,
    pub(crate) number: u64,
    seq: u64,
    last_sent: Instant,
    /// Whether it shows that it is there while it waits.
    lively: bool,
}

impl Page {
    pub(crate) fn open(address: &str, token: &str) -> Self {
        Self::connect(address, request(address, token)).expect("the panel lets the page in")
    }

    /// A page by this request; the status when it is refused.
    pub(crate) fn connect(address: &str, request: Request<()>) -> Result<Self, u16> {
        let stream = TcpStream::connect(address).unwrap();
        stream.set_read_timeout(Some(LIMIT)).unwrap();
        let (socket, _) = match tungstenite::client(request, stream) {
            Ok(done) => done,
            Err(HandshakeError::Failure(Error::Http(response))) => {
                return Err(response.status().as_u16())
            }
            Err(error) => panic!("{error}"),
        };
        let mut page = Self { socket, number: 0, seq: 0, last_sent: Instant::now(), lively: true };
        let hello = page.next();
        assert_eq!(hello["type"], "hello");
        page.number = hello["page"].as_u64().unwrap();
        Ok(page)
    }

    /// From now on it says nothing by itself.
    pub(crate) fn fall_silent(&mut self) {
        self.lively = false;
    }

    pub(crate) fn send(&mut self, message: &str) {
        self.last_sent = Instant::now();
        // Whether it arrives is seen by what comes back.
        let _ = self.socket.send(Message::text(message));
    }

    /// Sends bytes that are no text.
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

    /// The code of the next error that is told.
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
        let deadline = Instant::now() + LIMIT;
        loop {
            let message = self.next();
            if wanted(&message) {
                return message;
            }
            assert!(Instant::now() < deadline, "the last message is {message}");
        }
    }

    /// The next message. States come all the time, so the page also says that it is there.
    fn next(&mut self) -> Value {
        if self.lively && self.last_sent.elapsed() > ALIVE {
            self.send("{\"do\":\"alive\"}");
        }
        loop {
            match self.socket.read().expect("the connection goes on") {
                Message::Text(text) => return serde_json::from_str(&text).unwrap(),
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

    /// Ends the connection as a browser does that is closed, or without a word.
    pub(crate) fn close(mut self, politely: bool) {
        if politely {
            self.socket.close(None).unwrap();
            self.socket.flush().unwrap();
        }
    }
}

/// The request for a page's connection.
pub(crate) fn request(address: &str, token: &str) -> Request<()> {
    format!("ws://{address}/ws?token={token}").into_client_request().unwrap()
}

pub(crate) fn is_running(state: &Value) -> bool {
    state["link"]["phase"] == "running"
}

fn code_of(answer: &Value) -> String {
    let error = &answer["error"];
    assert!(error["text"].as_str().unwrap().len() > 10, "a sentence: {answer}");
    error["code"].as_str().unwrap().to_owned()
}
