//! How camera clients connect.

use std::io;
use std::net::{SocketAddr, TcpListener};
use std::time::{Duration, Instant};

use crossbeam_channel::{bounded, Receiver, Sender};
use mio::net::TcpStream;

use crate::machine::journal::notice;
use crate::machine::Machine;
use crate::server::port::Port;
use crate::server::reserved::Reserved;
use crate::server::shared::{Shared, Stopped};

/// When the simulated camera accepts connections.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum CameraConnection {
    /// The port accepts connections all the time. While the camera starts up, they wait for their
    /// frames; while it is off, they are closed immediately. No other program can take the port.
    #[default]
    Waits,
    /// As with a TXT: connections are refused before the camera serves, after it is stopped, and while
    /// another client is served. Meanwhile the port is reserved. On some systems a program that asks for
    /// this very port can still get it; then the camera does not serve, and a warning is logged.
    Txt,
    /// As with the server program for the TXT 4.0, which ftrobopy uses: the port accepts connections all
    /// the time, but the server looks for a client only once, when StartCameraOnline arrives. A client
    /// that is already connected gets frames; a client that connects later never does.
    Txt40,
}

/// Where the camera's thread gets its clients from.
#[derive(Debug)]
pub(crate) enum Clients {
    /// A port that accepts connections all the time.
    Open,
    /// A port that accepts connections while the camera serves.
    WhileServing(Reserved),
    /// The clients that the main connection's thread finds.
    Found(Receiver<TcpStream>),
}

/// Looks for a camera client when the camera is started, if the camera itself does not.
#[derive(Debug)]
pub(crate) struct ClientFinder {
    listener: TcpListener,
    found: Sender<TcpStream>,
    /// What the camera's thread has not taken yet.
    waiting: Receiver<TcpStream>,
}

impl Clients {
    /// Where clients come from, and who looks for them when the camera is started.
    pub(crate) fn of(
        connection: CameraConnection,
        listener: TcpListener,
        port: &mut Port,
    ) -> io::Result<(Self, Option<ClientFinder>)> {
        Ok(match connection {
            CameraConnection::Waits => {
                port.listen(listener)?;
                (Self::Open, None)
            }
            CameraConnection::Txt => (Self::WhileServing(Reserved::instead_of(listener)?), None),
            CameraConnection::Txt40 => {
                let (found, clients) = bounded(1);
                let waiting = clients.clone();
                (Self::Found(clients), Some(ClientFinder { listener, found, waiting }))
            }
        })
    }

    /// Waits for the next client.
    pub(super) fn next(
        &mut self,
        port: &mut Port,
        start_up: Duration,
    ) -> Result<TcpStream, Stopped> {
        match self {
            Self::Open => port.accept(),
            Self::WhileServing(reserved) => loop {
                if let Some(stream) = accept_while_serving(reserved, port, start_up)? {
                    return Ok(stream);
                }
            },
            // The finder is dropped when the threads should end.
            Self::Found(clients) => clients.recv().map_err(|_| Stopped),
        }
    }
}

impl ClientFinder {
    /// Checks once whether a client is connected.
    pub(crate) fn find(&self) {
        match accept(&self.listener) {
            Ok((stream, client)) => {
                notice!(Info, "{client} is connected to the camera port and gets frames");
                // The start that has found another one was replaced by this one: its connection is closed.
                drop(self.waiting.try_recv());
                // Nobody else fills the place.
                let _ = self.found.try_send(stream);
            }
            Err(error) if error.kind() == io::ErrorKind::WouldBlock => {
                notice!(Warn, "no client is connected to the camera port, so none gets frames");
            }
            Err(error) => {
                notice!(Warn, "a client could not be accepted: {error}")
            }
        }
    }
}

/// A client of a listener that does not block.
fn accept(listener: &TcpListener) -> io::Result<(TcpStream, SocketAddr)> {
    let (stream, client) = listener.accept()?;
    stream.set_nonblocking(true)?;
    stream.set_nodelay(true)?;
    Ok((TcpStream::from_std(stream), client))
}

/// Waits until the camera serves and then for a client, if one comes before it is stopped.
fn accept_while_serving(
    reserved: &mut Reserved,
    port: &mut Port,
    start_up: Duration,
) -> Result<Option<TcpStream>, Stopped> {
    port.shared().wait_for_camera(|machine| machine.camera_serves(start_up))?;
    if let Err(error) = reserved.listen(port) {
        notice!(Warn, "the camera does not serve at {}: {error}", reserved.address);
        port.shared().with_machine(Machine::stop_camera);
        return Ok(None);
    }
    let limit = port.shared().read(Machine::camera_client_limit);
    let deadline = limit.and_then(|limit| Instant::now().checked_add(limit));
    let serves = |shared: &Shared| shared.read(|machine| machine.camera_serves(start_up).is_ok());
    let client = port.accept_while(serves, deadline);
    port.shared().with_machine(Machine::note_camera_client);
    port.close();
    reserved.refuse();
    client
}
