//! Entry points for the programs in `fuzz/`, to code that otherwise only a connection reaches.
//!
//! This is not part of the public interface and may change with any version. It is not behind a feature, because that one
//! would be offered to everybody who adds this package.

use std::collections::VecDeque;
use std::io::{self, ErrorKind};
use std::net::{Ipv4Addr, SocketAddr};
use std::sync::Arc;
use std::time::{Duration, Instant};

use parking_lot::Mutex;

pub use crate::camera::read_frames;
use crate::client::{Addresses, Close, Connection, Endpoint, TimeLimits, Transport, TCP};
pub use crate::i2c::i2c_client;

/// The connection to a server that sends these pieces, whatever it gets, and ends the connection. An empty piece is a
/// signal.
#[derive(Clone, Debug)]
pub(crate) struct Pieces {
    coming: Arc<Mutex<VecDeque<Vec<u8>>>>,
    sent: Arc<Mutex<Vec<u8>>>,
}

impl Pieces {
    pub(crate) fn new(pieces: Vec<Vec<u8>>) -> Self {
        Self { coming: Arc::new(Mutex::new(pieces.into())), sent: Arc::default() }
    }

    pub(crate) fn connection(&self) -> Connection {
        Connection::over(Box::new(self.clone()), TimeLimits::default())
    }

    /// What was sent to the server.
    pub(crate) fn sent(&self) -> Vec<u8> {
        self.sent.lock().clone()
    }
}

impl Transport for Pieces {
    fn now(&self) -> Instant {
        Instant::now()
    }

    fn read(&mut self, buffer: &mut [u8], _limit: Duration) -> io::Result<usize> {
        let mut coming = self.coming.lock();
        let Some(mut piece) = coming.pop_front() else { return Ok(0) };
        if piece.is_empty() {
            return Err(ErrorKind::Interrupted.into());
        }
        let count = piece.len().min(buffer.len());
        let rest = piece.split_off(count);
        buffer[..count].copy_from_slice(&piece);
        if !rest.is_empty() {
            coming.push_front(rest);
        }
        Ok(count)
    }

    fn write(&mut self, bytes: &[u8], _limit: Duration) -> io::Result<usize> {
        self.sent.lock().extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn end_writing(&mut self) -> io::Result<()> {
        Ok(())
    }

    fn is_silent(&self) -> bool {
        true
    }

    fn addresses(&self) -> io::Result<Addresses> {
        Ok(Addresses { own: nobody(), peer: nobody() })
    }

    fn closer(&mut self) -> io::Result<Box<dyn Close>> {
        self.quick_closer()
    }

    fn quick_closer(&self) -> io::Result<Box<dyn Close>> {
        Ok(Box::new(self.clone()))
    }
}

impl Close for Pieces {
    fn close(&self) {
        self.coming.lock().clear();
    }
}

/// A server that can't be reached.
pub(crate) fn nowhere() -> Endpoint {
    Endpoint::at(&TCP, nobody(), 0)
}

fn nobody() -> SocketAddr {
    (Ipv4Addr::LOCALHOST, 0).into()
}
