//! The thread of the I2C connection and its sockets.

use std::time::{Duration, Instant};

use ft_transfer_area::wire::{I2cRequestHeader, I2cResponseHeader};
use ft_transfer_area::Error;
use mio::net::TcpStream;

use super::ADDRESS_MAX;
use crate::server::port::{End, Link, Port};

/// The most bytes to write or read: the firmware closes the connection of a client that asks for more.
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
        for (count, what) in [(write, "write"), (read, "read")] {
            if count > LEN_MAX {
                return Err(format!("{count} bytes to {what} are more than {LEN_MAX}"));
            }
        }
        if data_len != u32::from(write) {
            return Err(format!("{data_len} bytes follow, but {write} are to be written"));
        }
        Ok(Self { address, write: write.into(), read })
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
#[cfg(feature = "__fuzzing")]
pub(crate) fn answer(bytes: &[u8], bus: &mut super::I2cBus) -> Result<Vec<u8>, String> {
    let (header, write) = bytes.split_at(bytes.len().min(I2cRequestHeader::LEN));
    let Request { address, write: size, read } = Request::parse(header)?;
    let mut write = write.to_vec();
    write.resize(size, 0);
    Ok(response(bus.transfer(address, &write, read)))
}

/// Serves one I2C client after another.
pub(crate) struct I2cServer {
    pub(crate) port: Port,
    pub(crate) idle_limit: Duration,
    /// [`WRITE_LIMIT`](crate::server::port::WRITE_LIMIT), and less in a test.
    pub(crate) write_limit: Duration,
}

impl I2cServer {
    /// Serves clients until the thread should end.
    pub(crate) fn run(mut self) {
        while let Ok(stream) = self.port.accept() {
            self.port.shared().with_machine(|machine| machine.i2c().client_came());
            let end = self.serve(stream);
            self.port.shared().with_machine(|machine| machine.i2c().client_left());
            end.log("the I2C client");
        }
    }

    fn serve(&mut self, stream: TcpStream) -> End {
        let mut link = match Link::new(&self.port, stream) {
            Ok(link) => link,
            Err(error) => return error.into(),
        };
        loop {
            if let Err(end) = self.serve_request(&mut link) {
                return end;
            }
        }
    }

    /// Reads a request, carries it out and sends the response.
    fn serve_request(&mut self, link: &mut Link) -> Result<(), End> {
        let deadline = Instant::now().checked_add(self.idle_limit);
        let mut header = [0; I2cRequestHeader::LEN];
        self.read(link, &mut header, deadline)?;
        let request = Request::parse(&header).map_err(End::Misbehaved)?;
        let mut write = vec![0; request.write];
        self.read(link, &mut write, deadline)?;
        let Request { address, read, .. } = request;
        let shared = self.port.shared();
        let read = shared.with_machine(|machine| machine.i2c().transfer(address, &write, read));
        match &read {
            Some(read) => log::info!("{request:02x?}: {write:02x?} written, {read:02x?} read"),
            // Clients hold the connection open by requests for nothing.
            None if write.is_empty() && request.read == 0 => {}
            None => log::warn!("no I2C device with the address {address:#04x} answers"),
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
        link.read_all(&mut self.port, buffer, deadline, |_| Ok(())).map_err(|end| match end {
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
    use crate::machine::Machine;
    use crate::server::shared::Shared;

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
        assert!(Request::parse(&header(0x18, 2, 1025)).unwrap_err().contains("1025 bytes to read"));
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
        let shared = Arc::new(Shared::new(machine));
        let mut server = I2cServer {
            port: Port::new(shared, "I2C", false).unwrap(),
            idle_limit: Duration::MAX,
            write_limit: Duration::from_millis(100),
        };
        assert!(matches!(server.serve(TcpStream::from_std(stream)), End::Unread));
    }
}
