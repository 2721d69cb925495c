//! How camera clients connect.

use std::io;
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::time::Duration;

use crossbeam_channel::{unbounded, Receiver, RecvTimeoutError, Sender};

use crate::simulator::machine::Machine;
use crate::simulator::shared::{try_accept, Shared, Stopped, POLL};

/// When the simulated camera accepts connections.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum CameraConnection {
    /// The port accepts connections all the time. While the camera starts up, they wait for their
    /// frames; while it is off, they are closed immediately. No other program can take the port.
    #[default]
    Waits,
    /// As with a TXT: connections are refused before the camera serves, after it is stopped, and while
    /// another client is served.
    ///
    /// Meanwhile another program can take the port. Then the camera does not serve, and a warning is
    /// logged.
    Txt,
    /// As with the server program for the TXT 4.0, which ftrobopy uses: the port accepts connections all
    /// the time, but the server looks for a client only once, when StartCameraOnline arrives. A client
    /// that is already connected gets frames; a client that connects later never does.
    Txt40,
}

/// Where the camera's thread gets its clients from.
#[derive(Debug)]
pub(in crate::simulator) enum Clients {
    /// A port that accepts connections all the time.
    Open(TcpListener),
    /// A port that accepts connections while the camera serves.
    WhileServing(SocketAddr),
    /// The clients that the main connection's thread finds.
    Found(Receiver<TcpStream>),
}

/// Looks for a camera client when the camera is started, if the camera itself does not.
#[derive(Debug)]
pub(in crate::simulator) struct Doorman {
    listener: TcpListener,
    found: Sender<TcpStream>,
}

impl Clients {
    /// Where clients come from, and who looks for them when the camera is started.
    pub(in crate::simulator) fn of(
        connection: CameraConnection,
        listener: TcpListener,
    ) -> io::Result<(Self, Option<Doorman>)> {
        Ok(match connection {
            CameraConnection::Waits => (Self::Open(listener), None),
            CameraConnection::Txt => (Self::WhileServing(listener.local_addr()?), None),
            CameraConnection::Txt40 => {
                let (found, clients) = unbounded();
                (Self::Found(clients), Some(Doorman { listener, found }))
            }
        })
    }

    /// Waits for the next client.
    pub(super) fn next(&self, shared: &Shared, start_up: Duration) -> Result<TcpStream, Stopped> {
        match self {
            Self::Open(listener) => shared.accept(listener, "camera"),
            Self::WhileServing(address) => loop {
                if let Some(stream) = accept_while_serving(*address, shared, start_up)? {
                    return Ok(stream);
                }
            },
            Self::Found(clients) => loop {
                match clients.recv_timeout(POLL) {
                    Ok(stream) => return Ok(stream),
                    Err(RecvTimeoutError::Timeout) => shared.rest(Duration::ZERO)?,
                    Err(RecvTimeoutError::Disconnected) => return Err(Stopped),
                }
            },
        }
    }
}

impl Doorman {
    /// Checks once whether a client is connected.
    pub(in crate::simulator) fn look(&self) {
        match try_accept(&self.listener) {
            Some((stream, client)) => {
                log::info!("{client} is connected to the camera port and gets frames");
                // This fails only when the camera's thread, and so the simulated TXT, is ending.
                let _ = self.found.send(stream);
            }
            None => log::warn!("no client is connected to the camera port, so none gets frames"),
        }
    }
}

/// Whether the camera is started, and has been for long enough.
fn is_serving(shared: &Shared, start_up: Duration) -> bool {
    shared.look(Machine::camera_on_for).is_some_and(|elapsed| elapsed >= start_up)
}

fn listen(address: SocketAddr) -> io::Result<TcpListener> {
    let listener = TcpListener::bind(address)?;
    listener.set_nonblocking(true)?;
    Ok(listener)
}

/// Waits until the camera serves and then for a client, if one comes before it is stopped.
fn accept_while_serving(
    address: SocketAddr,
    shared: &Shared,
    start_up: Duration,
) -> Result<Option<TcpStream>, Stopped> {
    while !is_serving(shared, start_up) {
        shared.rest(POLL)?;
    }
    let listener = match listen(address) {
        Ok(listener) => listener,
        Err(error) => {
            log::warn!("the camera does not serve at {address}: {error}");
            shared.with_machine(Machine::stop_camera);
            return Ok(None);
        }
    };
    while is_serving(shared, start_up) {
        if let Some((stream, client)) = try_accept(&listener) {
            log::info!("{client} connects to the camera port");
            return Ok(Some(stream));
        }
        shared.rest(POLL)?;
    }
    Ok(None)
}
