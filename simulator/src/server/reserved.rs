//! Ports that refuse connections at times, and are still given to nobody else.

use std::io;
use std::net::{SocketAddr, TcpListener};

use socket2::{Domain, Socket, Type};

use crate::server::port::Port;

/// A port that refuses connections.
#[derive(Debug)]
pub(crate) struct Reserved {
    pub(crate) address: SocketAddr,
    socket: Option<Socket>,
}

impl Reserved {
    /// The port of this listener, which refuses connections from now on.
    pub(crate) fn instead_of(listener: TcpListener) -> io::Result<Self> {
        let address = listener.local_addr()?;
        drop(listener);
        Ok(Self { address, socket: Some(reserve(address)?) })
    }

    /// A port that accepts connections at present.
    pub(crate) fn open(address: SocketAddr) -> Self {
        Self { address, socket: None }
    }

    /// Refuses connections from now on. The listener is closed.
    pub(crate) fn refuse(&mut self) {
        // If it fails, the next attempt is before the port accepts connections again.
        self.socket = reserve(self.address).ok();
    }

    /// Accepts connections from now on.
    pub(crate) fn listen(&mut self, port: &mut Port) -> io::Result<()> {
        let socket = self.socket.take().map_or_else(|| reserve(self.address), Ok)?;
        reuse(&socket, true)?;
        socket.listen(128)?;
        socket.set_nonblocking(true)?;
        port.listen(socket.into())
    }
}

/// A socket that has this port but does not listen. The system gives the port to nobody else.
fn reserve(address: SocketAddr) -> io::Result<Socket> {
    let socket = Socket::new(Domain::for_address(address), Type::STREAM, None)?;
    reuse(&socket, true)?;
    socket.bind(&address.into())?;
    reuse(&socket, false)?;
    Ok(socket)
}

/// Whether connections that have ended at its port are no obstacle. On Windows they never are. But then others can have
/// the port, too, unless it listens.
fn reuse(socket: &Socket, does: bool) -> io::Result<()> {
    if cfg!(unix) {
        socket.set_reuse_address(does)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::io::ErrorKind;
    use std::net::Ipv4Addr;

    use super::*;

    #[test]
    fn a_reserved_port_refuses_clients_and_is_given_to_nobody_else() {
        let socket = reserve((Ipv4Addr::LOCALHOST, 0).into()).unwrap();
        let address = socket.local_addr().unwrap().as_socket().unwrap();
        let refused = std::net::TcpStream::connect(address).unwrap_err();
        assert_eq!(refused.kind(), ErrorKind::ConnectionRefused);
        for reuses in [false, true] {
            let other = Socket::new(Domain::for_address(address), Type::STREAM, None).unwrap();
            reuse(&other, reuses).unwrap();
            assert_eq!(other.bind(&address.into()).unwrap_err().kind(), ErrorKind::AddrInUse);
        }
        socket.listen(1).unwrap();
        std::net::TcpStream::connect(address).unwrap();
    }
}
