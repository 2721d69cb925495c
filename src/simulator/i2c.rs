//! The I2C port and the devices behind it.

use std::collections::BTreeMap;
use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::sync::Arc;
use std::time::{Duration, Instant};

use super::end::End;
#[cfg(feature = "__fuzzing")]
use super::machine::Machine;
use super::shared::{is_due_to_waiting, Shared};
use crate::error::Error;
use crate::wire::{I2cRequestHeader, I2cResponseHeader, I2C_NO_DEVICE};

/// How many registers a simulated I2C device has.
pub const I2C_REGISTERS: usize = 256;

/// The greatest address.
const ADDRESS_MAX: u8 = 0x7F;

/// The most bytes to write: the number of a register and something for each of them.
const WRITE_MAX: u32 = 1 + I2C_REGISTERS as u32;

/// How long a client may leave a response unread before it is cut off.
const WRITE_LIMIT: Duration = Duration::from_secs(1);

/// What is plugged in, and who has asked for it.
#[derive(Clone, Debug, Default)]
pub(super) struct I2cBus {
    devices: BTreeMap<u8, Device>,
    /// How many clients have come.
    pub(super) connections: u64,
    /// Whether one is there.
    pub(super) connected: bool,
}

#[derive(Clone, Debug)]
struct Device {
    registers: Box<[u8; I2C_REGISTERS]>,
    /// The register that is read or written next.
    next: u8,
}

impl Default for Device {
    fn default() -> Self {
        Self { registers: Box::new([0; I2C_REGISTERS]), next: 0 }
    }
}

impl Device {
    /// The next register; the one behind it follows.
    fn advance(&mut self) -> &mut u8 {
        let register = usize::from(self.next);
        self.next = self.next.wrapping_add(1);
        &mut self.registers[register]
    }

    /// Writes, then reads.
    fn transfer(&mut self, write: &[u8], read: u16) -> Vec<u8> {
        if let Some((register, values)) = write.split_first() {
            self.next = *register;
            values.iter().for_each(|value| *self.advance() = *value);
        }
        (0..read).map(|_| *self.advance()).collect()
    }
}

impl I2cBus {
    /// The registers of a device, which is plugged in if it isn't there.
    pub(super) fn device(&mut self, address: u8) -> &mut [u8; I2C_REGISTERS] {
        &mut self.devices.entry(address & ADDRESS_MAX).or_default().registers
    }

    pub(super) fn remove(&mut self, address: u8) -> bool {
        self.devices.remove(&(address & ADDRESS_MAX)).is_some()
    }

    pub(super) fn addresses(&self) -> impl Iterator<Item = u8> + '_ {
        self.devices.keys().copied()
    }

    fn client_came(&mut self) {
        self.connections += 1;
        self.connected = true;
    }

    fn client_left(&mut self) {
        self.connected = false;
    }

    /// What a device answers; `None` when it isn't there.
    fn transfer(&mut self, request: &Request, write: &[u8]) -> Option<Vec<u8>> {
        Some(self.devices.get_mut(&request.address)?.transfer(write, request.read))
    }
}

/// What the header of a request asks for.
#[derive(Debug, PartialEq, Eq)]
struct Request {
    address: u8,
    write: usize,
    read: u16,
}

impl Request {
    /// The request with this header; what is wrong with it otherwise.
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

/// Carries out a request without a connection.
#[cfg(feature = "__fuzzing")]
pub(super) fn answer(bytes: &[u8], machine: &mut Machine) -> Result<Vec<u8>, String> {
    let (header, write) = bytes.split_at(bytes.len().min(I2cRequestHeader::LEN));
    let request = Request::parse(header)?;
    let mut write = write.to_vec();
    write.resize(request.write, 0);
    Ok(response(machine.i2c().transfer(&request, &write)))
}

/// Serves one I2C client after another.
pub(super) struct I2cServer {
    pub(super) listener: TcpListener,
    pub(super) shared: Arc<Shared>,
    pub(super) idle_limit: Duration,
}

impl I2cServer {
    /// Serves clients until the thread should end.
    pub(super) fn run(self) {
        while let Ok(stream) = self.shared.accept(&self.listener, "I2C") {
            self.shared.with_machine(|machine| machine.i2c().client_came());
            let end = self.serve(stream);
            self.shared.with_machine(|machine| machine.i2c().client_left());
            end.tell("the I2C client");
        }
    }

    fn serve(&self, mut stream: TcpStream) -> End {
        if let Err(error) = stream.set_write_timeout(Some(WRITE_LIMIT)) {
            return error.into();
        }
        loop {
            if let Err(end) = self.serve_request(&mut stream) {
                return end;
            }
        }
    }

    /// Reads a request, carries it out and sends the response.
    fn serve_request(&self, stream: &mut TcpStream) -> Result<(), End> {
        let begin = Instant::now();
        let mut header = [0; I2cRequestHeader::LEN];
        self.read(stream, &mut header, begin)?;
        let request = Request::parse(&header).map_err(End::Misbehaved)?;
        let mut write = vec![0; request.write];
        self.read(stream, &mut write, begin)?;
        let read = self.shared.with_machine(|machine| machine.i2c().transfer(&request, &write));
        match &read {
            Some(read) => log::info!("{request:02x?}: {write:02x?} written, {read:02x?} read"),
            None => log::warn!("there is no I2C device with the address {:#04x}", request.address),
        }
        Ok(stream.write_all(&response(read))?)
    }

    /// Fills the buffer, at most until the idle limit.
    fn read(
        &self,
        stream: &mut TcpStream,
        mut buffer: &mut [u8],
        begin: Instant,
    ) -> Result<(), End> {
        while !buffer.is_empty() {
            match stream.read(buffer) {
                Ok(0) => return Err(End::Left),
                Ok(count) => buffer = &mut buffer[count..],
                Err(error) if is_due_to_waiting(&error) => {}
                Err(error) => return Err(error.into()),
            }
            self.shared.rest(Duration::ZERO)?;
            if !buffer.is_empty() && begin.elapsed() >= self.idle_limit {
                // As the controller does, and its clients know.
                return Err(End::Closed("nothing was asked in time"));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use std::net::Ipv4Addr;

    use super::super::machine::Machine;
    use super::*;

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
    fn registers_are_written_and_read_one_behind_the_other() {
        let mut device = Device::default();
        assert!(device.transfer(&[254, 1, 2, 3], 0).is_empty());
        assert_eq!((device.registers[254], device.registers[255], device.registers[0]), (1, 2, 3));
        assert_eq!(device.transfer(&[255], 2), [2, 3]);
        device.registers[1] = 9;
        assert_eq!(device.transfer(&[], 1), [9]);
        assert_eq!(device.transfer(&[0], u16::MAX).len(), 65_535);
    }

    #[test]
    fn a_client_that_never_reads_is_cut_off_for_that() {
        let mut machine = Machine::new(0);
        machine.i2c_device(1);
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).unwrap();
        let mut client = TcpStream::connect(listener.local_addr().unwrap()).unwrap();
        let (stream, _) = listener.accept().unwrap();
        // Far more than the sockets hold comes back.
        client.write_all(&header(1, 0, u16::MAX).repeat(500)).unwrap();
        let shared = Arc::new(Shared::new(machine));
        let server = I2cServer { listener, shared, idle_limit: Duration::MAX };
        assert!(matches!(server.serve(stream), End::Unread));
    }

    #[test]
    fn a_device_is_there_from_its_first_use_until_it_is_removed() {
        let mut bus = I2cBus::default();
        let request = Request { address: 0x18, write: 1, read: 1 };
        assert_eq!(bus.transfer(&request, &[5]), None);
        bus.device(0x98)[5] = 7;
        assert_eq!(bus.transfer(&request, &[5]), Some(vec![7]));
        assert_eq!(bus.addresses().collect::<Vec<_>>(), [0x18]);
        assert!(bus.remove(0x18) && !bus.remove(0x18));
        assert_eq!(bus.transfer(&request, &[5]), None);
    }
}
