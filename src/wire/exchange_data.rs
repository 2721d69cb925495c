//! ExchangeData: the master's outputs and inputs, not compressed.

use byteorder::{ByteOrder, LittleEndian};

use super::{check, push_values, push_words, CommandId, ResponseId};
use crate::error::Error;

/// The places of the command's fields.
mod field {
    use std::ops::Range;

    pub(super) const DUTY: Range<usize> = 4..20;
    pub(super) const MASTER: Range<usize> = 20..28;
    pub(super) const DISTANCE: Range<usize> = 28..36;
    pub(super) const MOTOR_COMMAND_ID: Range<usize> = 36..44;
    pub(super) const COUNTER_RESET_ID: Range<usize> = 44..52;
    pub(super) const SOUND: Range<usize> = 52..58;
}

/// The places of the response's fields.
mod response_field {
    use std::ops::Range;

    pub(super) const UNI: Range<usize> = 4..20;
    pub(super) const COUNTER_INPUT: Range<usize> = 20..28;
    pub(super) const COUNTER: Range<usize> = 28..36;
    pub(super) const COUNTER_RESET_ID: Range<usize> = 36..44;
    pub(super) const MOTOR_COMMAND_ID: Range<usize> = 44..52;
    pub(super) const SOUND_COMMAND_ID: Range<usize> = 52..54;
    pub(super) const IR: Range<usize> = 54..79;
}

/// The master's outputs.
///
/// Closed on purpose: the fields are those of the packet.
#[doc(alias = "ftIF2013Command_ExchangeData")]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ExchangeData {
    /// O1 to O8: 0..=512.
    #[doc(alias = "m_pwmOutputValues")]
    pub duty: [i16; 8],
    /// M1 to M4: the motor to follow, see [`OutputValues::master`](crate::transfer_area::OutputValues::master).
    #[doc(alias = "m_motor_master")]
    pub master: [i16; 4],
    /// M1 to M4: distance in pulses, or the error to inject. It is signed in the kit.
    #[doc(alias = "m_motor_distance")]
    pub distance: [u16; 4],
    /// M1 to M4: ids of the motor commands.
    pub motor_command_id: [u16; 4],
    /// C1 to C4: ids of the counter resets.
    #[doc(alias = "m_counter_reset_command_id")]
    pub counter_reset_id: [u16; 4],
    /// Id of the sound command.
    pub sound_command_id: u16,
    /// Number of the sound.
    pub sound_index: u16,
    /// How often the sound is played; 0 is forever.
    pub sound_repeat: u16,
}

impl ExchangeData {
    /// Size of the packet in bytes.
    pub const LEN: usize = 60;
    /// How many words it has in the compressed exchange.
    pub(crate) const WORDS: usize = 27;

    /// Reads the packet. Fails when id or size are wrong.
    pub fn parse(bytes: &[u8]) -> Result<Self, Error> {
        let kind = CommandId::ExchangeData;
        check(bytes, kind.name(), kind.id(), Self::LEN)?;
        let mut data = Self::default();
        let mut sound = [0; 3];
        LittleEndian::read_i16_into(&bytes[field::DUTY], &mut data.duty);
        LittleEndian::read_i16_into(&bytes[field::MASTER], &mut data.master);
        LittleEndian::read_u16_into(&bytes[field::DISTANCE], &mut data.distance);
        LittleEndian::read_u16_into(&bytes[field::MOTOR_COMMAND_ID], &mut data.motor_command_id);
        LittleEndian::read_u16_into(&bytes[field::COUNTER_RESET_ID], &mut data.counter_reset_id);
        LittleEndian::read_u16_into(&bytes[field::SOUND], &mut sound);
        [data.sound_command_id, data.sound_index, data.sound_repeat] = sound;
        Ok(data)
    }

    /// Appends the packet to `out`.
    pub fn emit(&self, out: &mut Vec<u8>) {
        CommandId::ExchangeData.emit(out);
        push_words(out, self.words());
        out.extend_from_slice(&[0; 2]);
    }

    /// The words, in the order of both exchanges.
    pub(crate) fn words(&self) -> [u16; Self::WORDS] {
        let mut words = [0; Self::WORDS];
        words[..8].copy_from_slice(&self.duty.map(|duty| duty as u16));
        words[8..12].copy_from_slice(&self.master.map(|master| master as u16));
        words[12..16].copy_from_slice(&self.distance);
        words[16..20].copy_from_slice(&self.motor_command_id);
        words[20..24].copy_from_slice(&self.counter_reset_id);
        words[24..].copy_from_slice(&[self.sound_command_id, self.sound_index, self.sound_repeat]);
        words
    }
}

/// What one infrared remote sends.
///
/// Closed on purpose: the fields are those of the packet.
#[doc(alias = "IR")]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct IrRemote {
    /// Left joystick, left to right: −15..=15.
    #[doc(alias = "m_ir_leftX")]
    pub left_x: i8,
    /// Left joystick, backwards to forward: −15..=15.
    #[doc(alias = "m_ir_leftY")]
    pub left_y: i8,
    /// Right joystick, left to right: −15..=15.
    #[doc(alias = "m_ir_rightX")]
    pub right_x: i8,
    /// Right joystick, backwards to forward: −15..=15.
    #[doc(alias = "m_ir_rightY")]
    pub right_y: i8,
    /// Bit 0 the ON button, 1 the OFF button, 2 and 3 the DIP switches 1 and 2.
    #[doc(alias = "m_ir_bits")]
    pub bits: u8,
}

/// The master's inputs.
///
/// Closed on purpose: the fields are those of the packet.
#[doc(alias = "ftIF2013Response_ExchangeData")]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ExchangeDataResponse {
    /// I1 to I8, in the unit of the configured mode.
    #[doc(alias = "m_universalInputs")]
    pub uni: [i16; 8],
    /// C1 to C4: the level, 0 or 1.
    pub counter_input: [i16; 4],
    /// C1 to C4: pulses since the last reset.
    #[doc(alias = "m_counter_value")]
    pub counter: [i16; 4],
    /// C1 to C4: id of the last counter reset that is done.
    #[doc(alias = "m_counter_command_id")]
    pub counter_reset_id: [u16; 4],
    /// M1 to M4: id of the last motor command that is done.
    pub motor_command_id: [u16; 4],
    /// Id of the last sound command that is done.
    pub sound_command_id: u16,
    /// The infrared remotes: first any remote, then those with the four switch settings.
    pub ir: [IrRemote; 5],
}

impl ExchangeDataResponse {
    /// Size of the packet in bytes.
    pub const LEN: usize = 80;
    /// How many words it has in the compressed exchange.
    pub(crate) const WORDS: usize = 50;

    /// The inputs in these words of the compressed exchange.
    pub(crate) fn from_words(words: &[u16; Self::WORDS]) -> Self {
        use std::array::from_fn;

        Self {
            uni: from_fn(|i| words[i] as i16),
            counter_input: from_fn(|i| words[8 + i] as i16),
            counter: from_fn(|i| words[12 + i] as i16),
            counter_reset_id: from_fn(|i| words[16 + i]),
            motor_command_id: from_fn(|i| words[20 + i]),
            sound_command_id: words[24],
            ir: from_fn(|i| {
                let axis = |axis| words[25 + 5 * i + axis] as i8;
                IrRemote {
                    left_x: axis(0),
                    left_y: axis(1),
                    right_x: axis(2),
                    right_y: axis(3),
                    bits: words[29 + 5 * i] as u8,
                }
            }),
        }
    }

    /// Reads the packet. Fails when id or size are wrong.
    pub fn parse(bytes: &[u8]) -> Result<Self, Error> {
        use response_field as field;

        let kind = ResponseId::ExchangeData;
        check(bytes, kind.name(), kind.id(), Self::LEN)?;
        let mut data = Self::default();
        LittleEndian::read_i16_into(&bytes[field::UNI], &mut data.uni);
        LittleEndian::read_i16_into(&bytes[field::COUNTER_INPUT], &mut data.counter_input);
        LittleEndian::read_i16_into(&bytes[field::COUNTER], &mut data.counter);
        LittleEndian::read_u16_into(&bytes[field::COUNTER_RESET_ID], &mut data.counter_reset_id);
        LittleEndian::read_u16_into(&bytes[field::MOTOR_COMMAND_ID], &mut data.motor_command_id);
        data.sound_command_id = LittleEndian::read_u16(&bytes[field::SOUND_COMMAND_ID]);
        for (remote, bytes) in data.ir.iter_mut().zip(bytes[field::IR].chunks_exact(5)) {
            *remote = IrRemote {
                left_x: bytes[0] as i8,
                left_y: bytes[1] as i8,
                right_x: bytes[2] as i8,
                right_y: bytes[3] as i8,
                bits: bytes[4],
            };
        }
        Ok(data)
    }

    /// Appends the packet to `out`.
    pub fn emit(&self, out: &mut Vec<u8>) {
        ResponseId::ExchangeData.emit(out);
        push_values(out, self.uni);
        push_values(out, self.counter_input);
        push_values(out, self.counter);
        push_words(out, self.counter_reset_id);
        push_words(out, self.motor_command_id);
        push_words(out, [self.sound_command_id]);
        for remote in &self.ir {
            let axes = [remote.left_x, remote.left_y, remote.right_x, remote.right_y];
            out.extend(axes.map(|axis| axis as u8));
            out.push(remote.bits);
        }
        out.push(0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_output_has_its_place() {
        let data = ExchangeData {
            duty: [512, 0, 0, 0, 0, 0, 0, 1],
            master: [6, 0, 0, 0],
            distance: [0xFFFE, 0, 0, 0],
            motor_command_id: [3, 0, 0, 0],
            counter_reset_id: [0, 0, 0, 4],
            sound_command_id: 5,
            sound_index: 29,
            sound_repeat: 7,
        };
        let mut out = Vec::new();
        data.emit(&mut out);
        assert_eq!(out.len(), ExchangeData::LEN);
        assert_eq!(out[..6], [0xBA, 0x97, 0x35, 0xCC, 0, 2]);
        assert_eq!(out[18..22], [1, 0, 6, 0]);
        assert_eq!(out[28..30], [0xFE, 0xFF]);
        assert_eq!(out[36], 3);
        assert_eq!(out[50..], [4, 0, 5, 0, 29, 0, 7, 0, 0, 0]);
        assert_eq!(ExchangeData::parse(&out), Ok(data));
    }

    #[test]
    fn every_input_has_its_place() {
        let remote = IrRemote { left_x: -1, left_y: 2, right_x: -15, right_y: 15, bits: 9 };
        let mut data = ExchangeDataResponse {
            uni: [1, 0, 0, 0, 0, 0, 0, 4096],
            counter_input: [1, 0, 0, 0],
            counter: [-1, 0, 0, 0],
            counter_reset_id: [2, 0, 0, 0],
            motor_command_id: [3, 0, 0, 0],
            sound_command_id: 4,
            ..Default::default()
        };
        data.ir[4] = remote;
        let mut out = Vec::new();
        data.emit(&mut out);
        assert_eq!(out.len(), ExchangeDataResponse::LEN);
        assert_eq!(out[..6], [0x41, 0xAC, 0xEF, 0x4E, 1, 0]);
        assert_eq!(out[18..22], [0, 16, 1, 0]);
        assert_eq!(out[28..30], [0xFF, 0xFF]);
        assert_eq!((out[36], out[44], out[52]), (2, 3, 4));
        assert_eq!(out[74..], [0xFF, 2, 0xF1, 15, 9, 0]);
        assert_eq!(ExchangeDataResponse::parse(&out), Ok(data));
    }

    #[test]
    fn another_packets_bytes_are_an_error() {
        let mut out = Vec::new();
        ExchangeData::default().emit(&mut out);
        assert!(matches!(ExchangeDataResponse::parse(&out), Err(Error::WrongId { .. })));
        out.pop();
        assert!(matches!(ExchangeData::parse(&out), Err(Error::WrongSize { found: 59, .. })));
    }
}
