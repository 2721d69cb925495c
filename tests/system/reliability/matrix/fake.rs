//! A server that does one thing wrong.

use std::io::Write;
use std::net::{Ipv4Addr, SocketAddr, TcpListener, TcpStream};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::Arc;
use std::thread::{self, JoinHandle};
use std::time::Duration;

use socket2::{Domain, Socket, Type};

/// Serves one client after another, until it is dropped.
pub(crate) struct Fake {
    port: u16,
    stopping: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

/// What a fake server does with a client.
pub(crate) type Script = fn(&mut Client);

/// A client of a fake server.
pub(crate) struct Client {
    pub(crate) stream: TcpStream,
    stopping: Arc<AtomicBool>,
}

impl Fake {
    pub(crate) fn start(script: Script) -> Self {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).unwrap();
        let port = listener.local_addr().unwrap().port();
        let stopping = Arc::new(AtomicBool::new(false));
        let flag = Arc::clone(&stopping);
        let thread = thread::spawn(move || {
            while let Ok((stream, _)) = listener.accept() {
                if flag.load(Ordering::SeqCst) {
                    return;
                }
                script(&mut Client { stream, stopping: Arc::clone(&flag) });
            }
        });
        Self { port, stopping, thread: Some(thread) }
    }

    pub(crate) fn port(&self) -> u16 {
        self.port
    }
}

impl Drop for Fake {
    fn drop(&mut self) {
        self.stopping.store(true, Ordering::SeqCst);
        // Wakes the thread when it accepts.
        drop(TcpStream::connect((Ipv4Addr::LOCALHOST, self.port)));
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

impl Client {
    /// Sends bytes. Returns whether the client still takes them.
    pub(crate) fn send(&mut self, bytes: &[u8]) -> bool {
        !self.stopping.load(Ordering::SeqCst) && self.stream.write_all(bytes).is_ok()
    }

    /// Sends nothing until the server is dropped.
    pub(crate) fn hold(&self) {
        while !self.stopping.load(Ordering::SeqCst) {
            thread::sleep(Duration::from_millis(5));
        }
    }
}

/// A port on which nobody listens, as long as the socket exists.
pub(crate) fn closed_port() -> (Socket, u16) {
    let socket = Socket::new(Domain::IPV4, Type::STREAM, None).unwrap();
    socket.bind(&SocketAddr::from((Ipv4Addr::LOCALHOST, 0)).into()).unwrap();
    let port = port_of(&socket);
    (socket, port)
}

/// A listener that drops new connections, because its queue is full.
pub(crate) struct Deaf {
    socket: Socket,
    _queue: Vec<TcpStream>,
}

impl Deaf {
    pub(crate) fn start() -> Self {
        let (socket, port) = closed_port();
        socket.listen(0).unwrap();
        let address = SocketAddr::from((Ipv4Addr::LOCALHOST, port));
        let mut queue = Vec::new();
        while let Ok(stream) = TcpStream::connect_timeout(&address, Duration::from_millis(300)) {
            queue.push(stream);
            assert!(queue.len() < 100, "the queue is never full");
        }
        Self { socket, _queue: queue }
    }

    pub(crate) fn port(&self) -> u16 {
        port_of(&self.socket)
    }
}

fn port_of(socket: &Socket) -> u16 {
    socket.local_addr().unwrap().as_socket().unwrap().port()
}
