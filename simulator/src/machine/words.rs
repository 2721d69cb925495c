//! How the simulated TXT maps the words of a compressed exchange to its values.

use ft_transfer_area::wire::{ExchangeData, ExchangeDataResponse, IrRemote};

use super::controller::Controller;

/// Words per controller in a command.
pub(crate) const COMMAND_WORDS: usize = 27;

/// Reads the outputs of one controller from its [`COMMAND_WORDS`].
pub(crate) fn outputs(words: &[u16]) -> ExchangeData {
    let mut words = words.iter().copied();
    let mut next = || words.next().unwrap_or_default();
    ExchangeData {
        duty: std::array::from_fn(|_| next() as i16),
        master: std::array::from_fn(|_| next() as i16),
        distance: std::array::from_fn(|_| next()),
        motor_command_id: std::array::from_fn(|_| next()),
        counter_reset_id: std::array::from_fn(|_| next()),
        sound_command_id: next(),
        sound_index: next(),
        sound_repeat: next(),
    }
}

/// Appends the words of one controller in a response: as many as its firmware sends.
pub(crate) fn push_report(controller: &Controller, count: usize, words: &mut Vec<u16>) {
    let end = words.len() + count;
    push_inputs(&controller.report(), words);
    words.extend(controller.later_words());
    words.truncate(end);
}

/// Appends the 50 words of one controller's inputs.
pub(crate) fn push_inputs(report: &ExchangeDataResponse, words: &mut Vec<u16>) {
    words.extend(report.uni.map(|value| value as u16));
    words.extend(report.counter_input.map(|value| value as u16));
    words.extend(report.counter.map(|value| value as u16));
    words.extend(report.counter_reset_id);
    words.extend(report.motor_command_id);
    words.push(report.sound_command_id);
    words.extend(report.ir.iter().flat_map(remote));
}

/// The words of one infrared remote.
fn remote(remote: &IrRemote) -> [u16; 5] {
    let axis = |value: i8| i16::from(value) as u16;
    let IrRemote { left_x, left_y, right_x, right_y, bits } = *remote;
    [axis(left_x), axis(left_y), axis(right_x), axis(right_y), u16::from(bits)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_output_has_its_place() {
        let words: [u16; COMMAND_WORDS] =
            std::array::from_fn(|index| 0xFFF0_u16.wrapping_add(index as u16));
        let outputs = outputs(&words);
        assert_eq!(outputs.duty, [-16, -15, -14, -13, -12, -11, -10, -9]);
        assert_eq!(outputs.master, [-8, -7, -6, -5]);
        assert_eq!(outputs.distance, [0xFFFC, 0xFFFD, 0xFFFE, 0xFFFF]);
    }

    #[test]
    fn every_command_has_its_place() {
        let words: [u16; COMMAND_WORDS] = std::array::from_fn(|index| index as u16);
        let outputs = outputs(&words);
        assert_eq!(outputs.motor_command_id, [16, 17, 18, 19]);
        assert_eq!(outputs.counter_reset_id, [20, 21, 22, 23]);
        let sound = [outputs.sound_command_id, outputs.sound_index, outputs.sound_repeat];
        assert_eq!(sound, [24, 25, 26]);
    }

    #[test]
    fn every_input_has_its_place() {
        let mut report = ExchangeDataResponse {
            uni: [0, 1, 2, 3, 4, 5, 6, -7],
            counter_input: [8, 9, 10, 11],
            counter: [12, 13, 14, -15],
            counter_reset_id: [16, 17, 18, 19],
            motor_command_id: [20, 21, 22, 23],
            sound_command_id: 24,
            ..Default::default()
        };
        report.ir[0] = IrRemote { left_x: 25, left_y: 26, right_x: 27, right_y: -28, bits: 0x8D };
        report.ir[4] = IrRemote { left_x: 45, left_y: 46, right_x: 47, right_y: -48, bits: 49 };
        let mut words = Vec::new();
        push_inputs(&report, &mut words);
        let mut expected: [u16; 50] = std::array::from_fn(|index| index as u16);
        expected[30..45].fill(0);
        for negative in [7, 15, 28, 48] {
            expected[negative] = (negative as u16).wrapping_neg();
        }
        expected[29] = 0x8D;
        assert_eq!(words, expected);
    }
}
