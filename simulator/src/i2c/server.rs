//! The thread of the I2C connection and its sockets.

use std::time::{Duration, Instant};

use ft_transfer_area::wire::{I2cRequestHeader, I2cResponseHeader, ID_LEN};
use ft_transfer_area::Error;
use mio::net::TcpStream;

use super::ADDRESS_MAX;
use crate::machine::journal::notice;
use crate::machine::Machine;
use crate::server::port::{End, Link, Port};
use crate::server::reserved::Reserved;
use crate::server::shared::{Shared, Stopped};

/// The most bytes to write or read. Of more to read the firmware sends this many; for more to write it closes the
/// connection.
const LEN_MAX: u16 = 1024;

/// The content of a request's header.
#[derive(Debug, PartialEq, Eq)]
struct Request {
    address: u8,
    write: usize,
    read: u16,
}

impl Request {
    /// The request with this header, or what is wrong with it.
    fn parse(bytes: &[u8]) -> Result<Self, String> {
        let header = I2cRequestHeader::parse(bytes).map_err(|error| match error {
            Error::WrongId { found, .. } => format!("no I2C request has the id {found:#010x}"),
            error => error.to_string(),
        })?;
        let I2cRequestHeader { data_len, device: address, write_len: write, read_len: read } =
            header;
        if address > ADDRESS_MAX {
            return Err("an I2C address has 7 bits".to_owned());
        }
        if write > LEN_MAX {
            return Err(format!("{write} bytes to write are more than {LEN_MAX}"));
        }
        if data_len != u32::from(write) {
            return Err(format!("{data_len} bytes follow, but {write} are to be written"));
        }
        Ok(Self { address, write: write.into(), read: read.min(LEN_MAX) })
    }
}

/// The bytes of a response with what a device has answered.
fn response(read: Option<Vec<u8>>) -> Vec<u8> {
    let is_ok = read.is_some();
    let read = read.unwrap_or_default();
    let mut bytes = Vec::new();
    // At most LEN_MAX.
    I2cResponseHeader { read_len: read.len() as u16, is_ok }.emit(&mut bytes);
    bytes.extend(read);
    bytes
}

/// Carries out a request without a connection, on a bus.
pub(crate) fn answer(bytes: &[u8], bus: &mut super::I2cBus) -> Result<Vec<u8>, String> {
    let (header, write) = bytes.split_at(bytes.len().min(I2cRequestHeader::LEN));
    let Request { address, write: size, read } = Request::parse(header)?;
    let mut write = write.to_vec();
    write.resize(size, 0);
    Ok(response(bus.transfer(address, &write, read)))
}

/// Requests for missing devices within this time of each other get one warning.
const SERIES: Duration = Duration::from_secs(5);

/// When to try again to listen.
const AGAIN: Duration = Duration::from_millis(1);

/// Serves one I2C client after another.
pub(crate) struct I2cServer {
    pub(crate) port: Port,
    pub(crate) idle_limit: Duration,
    /// [`WRITE_LIMIT`](crate::server::port::WRITE_LIMIT), and less in a test.
    pub(crate) write_limit: Duration,
    /// When a device was missing last.
    pub(crate) missing: Option<Instant>,
    /// Its port, if it refuses clients as the firmware does.
    pub(crate) reserved: Option<Reserved>,
}

impl I2cServer {
    /// Serves clients until the thread should end.
    pub(crate) fn run(mut self) {
        while let Ok(stream) = self.next_client() {
            self.port.shared().with_machine(Machine::i2c_client_came);
            let (end, link) = match Link::new(&self.port, stream) {
                Ok(mut link) => (self.serve(&mut link), Some(link)),
                Err(error) => (error.into(), None),
            };
            // Before the client sees its end: it may begin the next session at once, and connect to that one's server.
            self.refuse();
            self.port.shared().with_machine(|machine| machine.i2c().session.end());
            drop(link);
            self.port.shared().with_machine(|machine| machine.i2c().connected = false);
            end.log("the I2C client");
        }
    }

    /// Waits for a client: one in each session, in its first seconds, or any.
    fn next_client(&mut self) -> Result<TcpStream, Stopped> {
        loop {
            let Some(reserved) = &mut self.reserved else { return self.port.accept() };
            let waits_until =
                |shared: &Shared| shared.read(|machine| machine.i2c_session().waits_until());
            self.port.wait_while(|shared| waits_until(shared).is_none())?;
            if let Err(error) = reserved.listen(&mut self.port) {
                // A process that is being started has the listener of the session before for a moment.
                self.port.shared().sleep(AGAIN)?;
                if waits_until(self.port.shared()).is_none() {
                    notice!(Warn, "nothing has served I2C at {}: {error}", reserved.address);
                }
                continue;
            }
            self.port.shared().with_machine(|machine| machine.i2c().session.listens());
            let deadline = waits_until(self.port.shared());
            let waits = |shared: &Shared| waits_until(shared).is_some();
            if let Some(stream) = self.port.accept_while(waits, deadline)? {
                return Ok(stream);
            }
            self.refuse();
        }
    }

    /// Refuses clients from now on, if it ever does.
    fn refuse(&mut self) {
        if let Some(reserved) = &mut self.reserved {
            self.port.close();
            reserved.refuse();
        }
    }

    fn serve(&mut self, link: &mut Link) -> End {
        loop {
            if let Err(end) = self.serve_request(link) {
                return end;
            }
        }
    }

    /// Reads a request, carries it out and sends the response.
    fn serve_request(&mut self, link: &mut Link) -> Result<(), End> {
        let deadline = Instant::now().checked_add(self.idle_limit);
        let mut header = [0; I2cRequestHeader::LEN];
        // It may be cut after the id and after the header.
        let (id, rest) = header.split_at_mut(ID_LEN);
        self.read(link, id, deadline)?;
        self.read(link, rest, deadline)?;
        let request = Request::parse(&header).map_err(End::Misbehaved)?;
        let mut write = vec![0; request.write];
        self.read(link, &mut write, deadline)?;
        let Request { address, read, .. } = request;
        let shared = self.port.shared();
        let read = shared.with_machine(|machine| machine.i2c().transfer(address, &write, read));
        match &read {
            Some(read) => notice!(Info, "{request:02x?}: {write:02x?} written, {read:02x?} read"),
            // Clients hold the connection open by requests for nothing.
            None if write.is_empty() && request.read == 0 => {}
            // A program that looks for devices asks for all addresses.
            None if self.missing.replace(Instant::now()).is_some_and(|last| last.elapsed() < SERIES) => {
                notice!(Info, "no I2C device with the address {address:#04x} answers");
            }
            None => notice!(
                Warn,
                "no I2C device with the address {address:#04x} answers; others that follow soon are not named"
            ),
        }
        link.write_all(&mut self.port, &response(read), Some(self.write_limit), |_| Ok(()))
    }

    /// Fills the buffer, at most until the deadline.
    fn read(
        &mut self,
        link: &mut Link,
        buffer: &mut [u8],
        deadline: Option<Instant>,
    ) -> Result<(), End> {
        let session = self.port.shared().read(Machine::i2c_session);
        let may_go_on = |shared: &Shared| match shared.read(Machine::i2c_session) == session {
            true => Ok(()),
            false => Err(End::Closed("its server has ended")),
        };
        let port = &mut self.port;
        let read = match &self.reserved {
            _ if buffer.is_empty() => Ok(()),
            Some(_) => link.read_segment(port, buffer, deadline, may_go_on),
            None => link.read_all(port, buffer, deadline, |_| Ok(())),
        };
        read.map_err(|end| match end {
            // The real controller does so too, and its clients expect it.
            End::Idle => End::Closed("no request came in time"),
            end => end,
        })
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write;
    use std::net::{Ipv4Addr, TcpListener};
    use std::sync::Arc;

    use super::*;

    fn header(device: u8, write_len: u16, read_len: u16) -> Vec<u8> {
        let mut bytes = Vec::new();
        let data_len = write_len.into();
        I2cRequestHeader { data_len, device, write_len, read_len }.emit(&mut bytes);
        bytes
    }

    #[test]
    fn a_request_has_an_id_7_bits_of_address_and_a_limit() {
        let request = Request { address: 0x18, write: 2, read: 6 };
        assert_eq!(Request::parse(&header(0x18, 2, 6)), Ok(request));
        assert!(Request::parse(&[0; I2cRequestHeader::LEN]).unwrap_err().contains("0x00000000"));
        assert!(Request::parse(&header(0x80, 2, 6)).unwrap_err().contains("7 bits"));
        assert!(Request::parse(&header(0x18, 1024, 1024)).is_ok());
        assert!(Request::parse(&header(0x18, 1025, 6))
            .unwrap_err()
            .contains("1025 bytes to write"));
        assert_eq!(Request::parse(&header(0x18, 2, 1025)).unwrap().read, 1024);
        let mut other_count = header(0x18, 2, 6);
        other_count[4] = 1;
        assert!(Request::parse(&other_count).unwrap_err().contains("1 bytes follow"));
    }

    #[test]
    fn a_client_that_never_reads_is_cut_off_for_that() {
        let mut machine = Machine::new(0);
        machine.i2c_device(1);
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).unwrap();
        let mut client = TcpStream::connect(listener.local_addr().unwrap()).unwrap();
        let (stream, _) = listener.accept().unwrap();
        stream.set_nonblocking(true).unwrap();
        // The answers are far more than the sockets hold.
        client.write_all(&header(1, 0, LEN_MAX).repeat(30_000)).unwrap();
        let shared = Arc::new(Shared::new(machine, None));
        let mut server = I2cServer {
            port: Port::new(shared, "I2C", false).unwrap(),
            idle_limit: Duration::MAX,
            missing: None,
            write_limit: Duration::from_millis(100),
            reserved: None,
        };
        let mut link = Link::new(&server.port, TcpStream::from_std(stream)).unwrap();
        assert!(matches!(server.serve(&mut link), End::Unread));
    }
}
