//! The connections to the server, with limits for everything that somebody may send or not send.

use std::io;
use std::net::SocketAddr;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::Arc;
use std::time::Duration;

use axum::{Extension, Router};
use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use socket2::{SockRef, TcpKeepalive};
use tokio::net::{TcpListener, TcpSocket, TcpStream};
use tokio::task::{self, JoinHandle};
use tokio::time;
use tokio_io_timeout::TimeoutStream;

use crate::lines::Rarely;
use crate::open_files;

/// How long the head of a request may take, and how long a connection may be idle.
const HEAD_LIMIT: Duration = Duration::from_secs(3);
/// How long a browser may take nothing of what is sent to it.
const WRITE_LIMIT: Duration = Duration::from_secs(2);
/// How long a browser that is silent, and to which nothing is sent, may be gone before the system asks for it.
const SILENCE: Duration = Duration::from_secs(20);
/// How long the head of a request may be, in bytes.
const HEAD_MAX: usize = 16 * 1024;
/// How many connections may be open that are neither a page's nor a camera's. A further one ends the oldest, as does one
/// for which the system allows too few open files.
const PASSING: usize = 400;
/// What the system keeps for a slow browser, in bytes: old states are of no use to it.
const SEND_BUFFER: u32 = 64 * 1024;
const BACKLOG: u32 = 128;

/// Whether a connection is a page's or a camera's. Their number has a limit of its own.
#[derive(Clone, Default)]
pub(crate) struct Kept(Arc<AtomicBool>);

/// As long as this is there, the connection is one of those.
pub(crate) struct Keeping(Kept);

impl Kept {
    pub(crate) fn keep(&self) -> Keeping {
        self.0.store(true, Ordering::Relaxed);
        Keeping(self.clone())
    }

    fn is_passing(&self) -> bool {
        !self.0.load(Ordering::Relaxed)
    }
}

impl Drop for Keeping {
    fn drop(&mut self) {
        self.0 .0.store(false, Ordering::Relaxed);
    }
}

struct Open {
    kept: Kept,
    task: JoinHandle<()>,
}

pub(crate) fn listen(address: SocketAddr) -> io::Result<TcpListener> {
    let socket = if address.is_ipv4() { TcpSocket::new_v4() } else { TcpSocket::new_v6() }?;
    // A port that was in use a moment ago is free, but not one that is in use.
    #[cfg(unix)]
    socket.set_reuseaddr(true)?;
    socket.set_send_buffer_size(SEND_BUFFER)?;
    socket.bind(address)?;
    socket.listen(BACKLOG)
}

/// Serves whoever connects, forever.
pub(crate) async fn serve(listener: TcpListener, router: Router) {
    let mut open: Vec<Open> = Vec::new();
    // That of a page is another task, and counted there.
    let most = open_files::for_others();
    let mut warning = Rarely::default();
    loop {
        let stream = match listener.accept().await {
            Ok((stream, _)) => stream,
            Err(error) => {
                // Too many files may be open for a while.
                if warning.is_due() {
                    log::warn!("a connection can't be accepted: {error}");
                }
                time::sleep(Duration::from_millis(50)).await;
                continue;
            }
        };
        open.retain(|one| !one.task.is_finished());
        let passing: Vec<usize> =
            (0..open.len()).filter(|at| open[*at].kept.is_passing()).collect();
        if passing.len() >= PASSING || open.len() >= most {
            match passing.first() {
                Some(oldest) => {
                    open.remove(*oldest).task.abort();
                    // Its file is closed in its turn.
                    task::yield_now().await;
                }
                // The others are looked at. The browser tries again.
                None => continue,
            }
        }
        let kept = Kept::default();
        let router = router.clone().layer(Extension(kept.clone()));
        open.push(Open { kept, task: tokio::spawn(answer(stream, router)) });
    }
}

/// Answers the requests of one connection.
async fn answer(stream: TcpStream, router: Router) {
    if let Err(error) = stream.set_nodelay(true) {
        log::debug!("a connection stays slow: {error}");
    }
    // A browser to which nothing is sent may be gone, as with the Wi-Fi.
    let alive = TcpKeepalive::new().with_time(SILENCE).with_interval(SILENCE / 4);
    if let Err(error) = SockRef::from(&stream).set_tcp_keepalive(&alive) {
        log::debug!("a connection may outlast its browser: {error}");
    }
    let mut stream = TimeoutStream::new(stream);
    stream.set_write_timeout(Some(WRITE_LIMIT));
    let connection = http1::Builder::new()
        .timer(TokioTimer::new())
        .header_read_timeout(HEAD_LIMIT)
        .max_buf_size(HEAD_MAX)
        .serve_connection(TokioIo::new(Box::pin(stream)), TowerToHyperService::new(router))
        .with_upgrades();
    if let Err(error) = connection.await {
        log::debug!("a connection ended: {error}");
    }
}
