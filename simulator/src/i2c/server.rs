//! The thread of the I2C connection and its sockets.

use std::time::{Duration, Instant};

use ft_transfer_area::wire::{I2cRequestHeader, I2cResponseHeader, I2C_NO_DEVICE};
use ft_transfer_area::Error;
use mio::net::TcpStream;

use super::{ADDRESS_MAX, I2C_REGISTERS};
use crate::server::port::{End, Link, Port};

/// The most bytes to write: the number of a register and a value for each register.
const WRITE_MAX: u32 = 1 + I2C_REGISTERS as u32;

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
        let address = u8::try_from(header.device).ok().filter(|address| *address <= ADDRESS_MAX);
        let address = address.ok_or("an I2C address has 7 bits")?;
        let write = header.write_len;
        if write > WRITE_MAX {
            return Err(format!("{write} bytes to write are more than {WRITE_MAX}"));
        }
        Ok(Self { address, write: write as usize, read: header.read_len })
    }
}

/// The bytes of a response with what a device has answered.
fn response(read: Option<Vec<u8>>) -> Vec<u8> {
    let Some(read) = read else { return I2C_NO_DEVICE.to_vec() };
    let mut bytes = Vec::new();
    I2cResponseHeader::default().emit(&mut bytes);
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
            None => log::warn!("there is no I2C device with the address {address:#04x}"),
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

    fn header(device: u32, write_len: u32, read_len: u16) -> Vec<u8> {
        let mut bytes = Vec::new();
        I2cRequestHeader { command: 1, device, write_len, read_len }.emit(&mut bytes);
        bytes
    }

    #[test]
    fn a_request_has_an_id_7_bits_of_address_and_a_limit() {
        let request = Request { address: 0x18, write: 2, read: 6 };
        assert_eq!(Request::parse(&header(0x18, 2, 6)), Ok(request));
        assert!(Request::parse(&[0; I2cRequestHeader::LEN]).unwrap_err().contains("0x00000000"));
        assert!(Request::parse(&header(0x80, 2, 6)).unwrap_err().contains("7 bits"));
        assert!(Request::parse(&header(0x1_0018, 2, 6)).unwrap_err().contains("7 bits"));
        assert!(Request::parse(&header(0x18, 257, 6)).is_ok());
        assert!(Request::parse(&header(0x18, 258, 6)).unwrap_err().contains("258 bytes"));
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
        client.write_all(&header(1, 0, u16::MAX).repeat(500)).unwrap();
        let shared = Arc::new(Shared::new(machine));
        let mut server = I2cServer {
            port: Port::new(shared, "I2C", false).unwrap(),
            idle_limit: Duration::MAX,
            write_limit: Duration::from_millis(100),
        };
        assert!(matches!(server.serve(TcpStream::from_std(stream)), End::Unread));
    }
}
