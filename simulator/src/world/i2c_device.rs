//! I2C devices, as plain data.

use std::collections::BTreeMap;

/// An I2C device that is plugged in at the start: 256 registers of one byte.
///
/// ```
/// use ft_transfer_area_simulator::world::{I2cDevice, World};
///
/// let sensor = I2cDevice::new(0x18).with_registers(0x00, &[0xFA]).with_registers(0x02, &[0, 64]);
/// let world = World::new().with_i2c(sensor);
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
    pub fn with_registers(mut self, first: u8, values: &[u8]) -> Self {
        for (offset, value) in (0..=u8::MAX).zip(values) {
            self.registers.insert(first.wrapping_add(offset), *value);
        }
        self
    }
}
