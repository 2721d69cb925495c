//! I2C devices, as plain data.

use std::collections::BTreeMap;

use toml::de::DeValue;

use super::mistake::{at, expect, Checked};
use super::read::{list, whole, Keys, Read};
use crate::i2c::ADDRESS_MAX;

pub(super) const DEVICE: &str = "expected a device, as in { address = 0x18 }";
const REGISTERS: &str = "expected a list, as in registers = [{ register = 2, values = [0, 64] }]";
const BYTES: &str = "expected a list of bytes, as in values = [0, 64]";

/// An I2C device that is plugged in at the start: 256 registers of one byte.
///
/// ```
/// use ft_transfer_area_simulator::world::{I2cDevice, World};
///
/// let sensor = I2cDevice::new(0x18).registers(0x00, &[0xFA]).registers(0x02, &[0, 64]);
/// let world = World::new().i2c(sensor);
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct I2cDevice {
    /// Its address, 0..=127. Each device has a different one.
    pub address: u8,
    /// The values of its registers. All other registers are 0.
    pub registers: BTreeMap<u8, u8>,
}

impl I2cDevice {
    /// A device at this address, 0..=127, with all registers 0.
    pub fn new(address: u8) -> Self {
        Self { address, registers: BTreeMap::new() }
    }

    /// Sets this register and the following ones to these values. After register 255 comes 0.
    pub fn registers(mut self, first: u8, values: &[u8]) -> Self {
        for (offset, value) in (0..=u8::MAX).zip(values) {
            self.registers.insert(first.wrapping_add(offset), *value);
        }
        self
    }

    pub(super) fn read(value: &DeValue<'_>) -> Read<Self> {
        let keys = Keys::of(value, DEVICE, &["address", "registers"])?;
        let address = keys.required("address", address())?;
        let written = keys.or("registers", Vec::new(), list(REGISTERS, registers))?;
        Ok(written.into_iter().fold(Self::new(address), |device, (register, values)| {
            device.registers(register, &values)
        }))
    }

    pub(super) fn check(&self) -> Checked {
        let address = self.address;
        let reason = || format!("expected 0 to {ADDRESS_MAX:#04x}, not {address:#04x}");
        at("address", expect(address <= ADDRESS_MAX, reason))
    }
}

/// Checks that each device has an address of its own.
pub(super) fn check_addresses(devices: &[I2cDevice]) -> Checked {
    for (number, device) in devices.iter().enumerate() {
        let taken = devices.iter().take(number).any(|other| other.address == device.address);
        at(number, expect(!taken, || format!("there are two devices at {:#04x}", device.address)))?;
    }
    Ok(())
}

/// A register, and values for it and the following ones.
fn registers(value: &DeValue<'_>) -> Read<(u8, Vec<u8>)> {
    register_keys(&Keys::of(value, DEVICE, &["register", "values"])?)
}

pub(super) fn register_keys(keys: &Keys<'_, '_>) -> Read<(u8, Vec<u8>)> {
    Ok((keys.required("register", byte())?, keys.required("values", list(BYTES, byte()))?))
}

/// An I2C address of 7 bits.
pub(super) fn address() -> impl Fn(&DeValue<'_>) -> Read<u8> {
    whole(0..=ADDRESS_MAX.into())
}

fn byte() -> impl Fn(&DeValue<'_>) -> Read<u8> {
    whole(0..=u8::MAX.into())
}
