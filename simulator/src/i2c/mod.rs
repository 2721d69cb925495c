//! The I2C bus: the devices that are plugged in, and the server of their port.

pub(super) mod server;

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

/// How many registers a simulated I2C device has.
pub const I2C_REGISTERS: usize = 256;

/// The greatest address.
pub(super) const ADDRESS_MAX: u8 = 0x7F;

/// What is plugged in, and the clients of the port.
#[derive(Clone, Debug, Default)]
pub(super) struct I2cBus {
    devices: BTreeMap<u8, Device>,
    /// The number of clients that have connected.
    pub(super) connections: u64,
    /// Whether a client is connected.
    pub(super) connected: bool,
    pub(super) session: I2cSession,
}

/// The I2C server of the firmware: StartOnline starts one, which serves one client and ends.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct I2cSession {
    /// How often one has started.
    number: u64,
    state: ServerState,
    /// Whether its port has accepted connections.
    has_listened: bool,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum ServerState {
    /// There is none.
    #[default]
    Ended,
    /// It has waited for a client since then, for [`PATIENCE`].
    Waits(Instant),
    Serves,
}

/// How long the firmware's I2C server waits for a client.
pub(super) const PATIENCE: Duration = Duration::from_secs(5);

impl I2cSession {
    /// A new server starts.
    pub(super) fn begin(&mut self) {
        let state = ServerState::Waits(Instant::now());
        *self = Self { number: self.number + 1, state, has_listened: false };
    }

    /// Its port accepts connections.
    pub(super) fn listens(&mut self) {
        self.has_listened = true;
    }

    /// Whether a client need not wait for it: its port has accepted connections, or it has ended.
    pub(super) fn has_begun(self) -> bool {
        self.has_listened || !self.is_busy()
    }

    /// The server ends.
    pub(super) fn end(&mut self) {
        self.state = ServerState::Ended;
    }

    /// Until when it waits for a client, if it does.
    pub(super) fn waits_until(self) -> Option<Instant> {
        let ServerState::Waits(since) = self.state else { return None };
        Some(since + PATIENCE).filter(|end| *end > Instant::now())
    }

    /// Whether it waits for a client, or has one.
    pub(super) fn is_busy(self) -> bool {
        self.state == ServerState::Serves || self.waits_until().is_some()
    }
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
    /// The next register. The one after it becomes the next.
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
    /// The registers of a device. A missing device is plugged in.
    pub(super) fn device(&mut self, address: u8) -> &mut [u8; I2C_REGISTERS] {
        &mut self.devices.entry(address & ADDRESS_MAX).or_default().registers
    }

    /// Puts values into this register of a device and the following ones, if the device is there.
    pub(super) fn set(&mut self, address: u8, register: u8, values: &[u8]) {
        let Some(device) = self.devices.get_mut(&address) else { return };
        for (offset, value) in (0..=u8::MAX).zip(values) {
            device.registers[usize::from(register.wrapping_add(offset))] = *value;
        }
    }

    pub(super) fn remove(&mut self, address: u8) -> bool {
        self.devices.remove(&(address & ADDRESS_MAX)).is_some()
    }

    pub(super) fn addresses(&self) -> impl Iterator<Item = u8> + '_ {
        self.devices.keys().copied()
    }

    /// Counts a client. Returns whether the firmware would have accepted it.
    pub(super) fn client_came(&mut self) -> bool {
        self.connections += 1;
        self.connected = true;
        let is_expected = self.session.waits_until().is_some();
        self.session.state = ServerState::Serves;
        is_expected
    }

    /// The answer of a device; `None` when the device is missing, or has nothing to do.
    fn transfer(&mut self, address: u8, write: &[u8], read: u16) -> Option<Vec<u8>> {
        if write.is_empty() && read == 0 {
            return None;
        }
        Some(self.devices.get_mut(&address)?.transfer(write, read))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn registers_are_written_and_read_one_after_the_other() {
        let mut device = Device::default();
        assert!(device.transfer(&[254, 1, 2, 3], 0).is_empty());
        assert_eq!((device.registers[254], device.registers[255], device.registers[0]), (1, 2, 3));
        assert_eq!(device.transfer(&[255], 2), [2, 3]);
        device.registers[1] = 9;
        assert_eq!(device.transfer(&[], 1), [9]);
        assert_eq!(device.transfer(&[0], u16::MAX).len(), 65_535);
    }

    #[test]
    fn a_device_is_there_from_its_first_use_until_it_is_removed() {
        let mut bus = I2cBus::default();
        assert_eq!(bus.transfer(0x18, &[5], 1), None);
        bus.device(0x98)[5] = 7;
        assert_eq!(bus.transfer(0x18, &[5], 1), Some(vec![7]));
        assert_eq!(bus.addresses().collect::<Vec<_>>(), [0x18]);
        assert!(bus.remove(0x18) && !bus.remove(0x18));
        assert_eq!(bus.transfer(0x18, &[5], 1), None);
    }
}
