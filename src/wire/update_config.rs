//! UpdateConfig: the configuration of a controller.

use byteorder::{ByteOrder, LittleEndian};

use super::{check, push_values, CommandId};
use crate::error::Error;
use crate::transfer_area::{Config, CounterConfig, UniConfig};

mod field {
    use std::ops::{Range, RangeFrom};

    pub(super) const CONFIG_ID: Range<usize> = 4..6;
    pub(super) const EXTENSION_ID: Range<usize> = 6..8;
    pub(super) const PGM_STATE_REQ: usize = 8;
    pub(super) const OLD_FT_TRANSFER: usize = 9;
    pub(super) const DUMMY: Range<usize> = 10..12;
    pub(super) const MOTOR: Range<usize> = 12..16;
    pub(super) const UNI: Range<usize> = 16..48;
    pub(super) const CNT: Range<usize> = 48..64;
    pub(super) const MOTOR_CONFIG: RangeFrom<usize> = 64..;
}

/// The command that sends one controller's configuration.
///
/// Closed on purpose: the fields are those of the packet.
#[doc(alias = "ftIF2013Command_UpdateConfig")]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct UpdateConfig {
    /// Id of the configuration. The controller ignores the command when the id has not changed.
    pub config_id: i16,
    /// 0 for the master, 1 for the first extension, and so on.
    pub extension_id: i16,
    /// The configuration.
    pub config: Config,
}

impl UpdateConfig {
    /// Size of the packet in bytes.
    pub const LEN: usize = 96;

    /// Reads the packet. Fails when id or size are wrong.
    pub fn parse(bytes: &[u8]) -> Result<Self, Error> {
        let kind = CommandId::UpdateConfig;
        check(bytes, kind.name(), kind.id(), Self::LEN)?;
        let mut config = Config {
            pgm_state_req: bytes[field::PGM_STATE_REQ],
            old_ft_transfer: bytes[field::OLD_FT_TRANSFER],
            ..Config::default()
        };
        config.dummy.copy_from_slice(&bytes[field::DUMMY]);
        config.motor.copy_from_slice(&bytes[field::MOTOR]);
        for (input, bytes) in config.uni.iter_mut().zip(bytes[field::UNI].chunks_exact(4)) {
            *input = UniConfig { mode: bytes[0], digital: bytes[1], dummy: [bytes[2], bytes[3]] };
        }
        for (counter, bytes) in config.cnt.iter_mut().zip(bytes[field::CNT].chunks_exact(4)) {
            *counter = CounterConfig { mode: bytes[0], dummy: [bytes[1], bytes[2], bytes[3]] };
        }
        let settings = config.motor_config.iter_mut();
        for (settings, bytes) in settings.zip(bytes[field::MOTOR_CONFIG].chunks_exact(8)) {
            LittleEndian::read_i16_into(bytes, settings);
        }
        Ok(Self {
            config_id: LittleEndian::read_i16(&bytes[field::CONFIG_ID]),
            extension_id: LittleEndian::read_i16(&bytes[field::EXTENSION_ID]),
            config,
        })
    }

    /// Appends the packet to `out`.
    pub fn emit(&self, out: &mut Vec<u8>) {
        let config = &self.config;
        CommandId::UpdateConfig.emit(out);
        push_values(out, [self.config_id, self.extension_id]);
        out.extend_from_slice(&[config.pgm_state_req, config.old_ft_transfer]);
        out.extend_from_slice(&config.dummy);
        out.extend_from_slice(&config.motor[..]);
        for input in &config.uni {
            out.extend_from_slice(&[input.mode, input.digital, input.dummy[0], input.dummy[1]]);
        }
        for counter in &config.cnt {
            out.push(counter.mode);
            out.extend_from_slice(&counter.dummy);
        }
        push_values(out, config.motor_config.iter().flatten().copied());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::transfer_area::{CounterMode, InputMode};

    #[test]
    fn every_field_has_its_place() {
        let mut update =
            UpdateConfig { config_id: 0x0102, extension_id: 3, config: Config::default() };
        *update.config.motor = [1, 0, 1, 0];
        update.config.uni[1] = UniConfig::analog(InputMode::Ultrasonic);
        update.config.cnt[3] = CounterConfig::new(CounterMode::Inverted);
        update.config.motor_config[3][3] = -2;
        let mut out = Vec::new();
        update.emit(&mut out);
        assert_eq!(out.len(), UpdateConfig::LEN);
        assert_eq!(out[..12], [0x7E, 0xF2, 0x0E, 0x06, 2, 1, 3, 0, 0, 0, 0, 0]);
        assert_eq!(out[12..24], [1, 0, 1, 0, 1, 1, 0, 0, 3, 0, 0, 0]);
        assert_eq!(out[56..64], [1, 0, 0, 0, 0, 0, 0, 0]);
        assert_eq!(out[92..], [0, 0, 0xFE, 0xFF]);
        assert_eq!(UpdateConfig::parse(&out), Ok(update));
    }
}
