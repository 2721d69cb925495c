//! The inputs in the responses, and how they get into the areas.

use crate::firmware::FirmwareVersion;
use crate::transfer_area::{FishX1Transfer, IrInput, MAX_AREAS};
use crate::wire::{ExchangeDataResponse, IrRemote};

/// Since which firmware a compressed response has how many words per area, the oldest first.
pub(super) const RESPONSES: [(FirmwareVersion, usize); 2] = [
    (FirmwareVersion::OLDEST_SUPPORTED, ExchangeDataResponse::WORDS),
    (FirmwareVersion::WITH_MICROPHONE, ExchangeDataResponse::WORDS + 2),
];

impl FirmwareVersion {
    /// How many words of each controller a compressed response of this firmware has: 50 for inputs and finished
    /// commands, and from 4.2.4 on 2 more for the microphone.
    ///
    /// ```
    /// use ft_transfer_area::prelude::*;
    /// use ft_transfer_area::FirmwareVersion;
    ///
    /// assert_eq!(FirmwareVersion::new(4, 1, 6).response_words(), 50);
    /// assert_eq!(FirmwareVersion::new(4, 6, 6).response_words(), 52);
    /// ```
    pub fn response_words(self) -> usize {
        let newest = RESPONSES.iter().rev().find(|(since, _)| *since <= self);
        newest.unwrap_or(&RESPONSES[0]).1
    }
}

/// The inputs from the responses of one transfer so far.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Inputs {
    /// By area; `None` for an extension that has never taken part.
    areas: [Option<AreaInputs>; MAX_AREAS],
    /// Which extensions took part in the last response, bit 0 the first.
    alive: u16,
    /// By area, the id of the last command for a sound, if that was silence.
    silences: [Option<u16>; MAX_AREAS],
}

/// The inputs of one area in a response.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct AreaInputs {
    data: ExchangeDataResponse,
    /// Linear and logarithmic loudness; 0 in a response without them, so that none is left from a controller before.
    microphone: [u16; 2],
}

/// What a response says of an area.
pub(super) struct AreaReport<'a> {
    pub(super) data: &'a mut ExchangeDataResponse,
    /// The id of its last command for a sound, if that was silence.
    pub(super) silence: &'a mut Option<u16>,
}

impl Inputs {
    /// Which extensions took part in the last response: bit 0 the first, bit 7 the eighth.
    pub fn alive(&self) -> u16 {
        self.alive
    }

    /// The newest inputs of one area; `None` for an extension that has never taken part.
    pub(crate) fn area(&self, index: usize) -> Option<&ExchangeDataResponse> {
        self.areas.get(index)?.as_ref().map(|area| &area.data)
    }

    /// The same, to be changed before the program sees it.
    pub(crate) fn area_mut(&mut self, index: usize) -> Option<&mut ExchangeDataResponse> {
        self.areas.get_mut(index)?.as_mut().map(|area| &mut area.data)
    }

    /// What a response says of each area, to be changed before the program sees it.
    pub(super) fn reports_mut(&mut self) -> impl Iterator<Item = Option<AreaReport<'_>>> {
        let silences = self.silences.iter_mut();
        self.areas.iter_mut().zip(silences).map(|(area, silence)| {
            area.as_mut().map(|area| AreaReport { data: &mut area.data, silence })
        })
    }

    /// Reports silence as done: the maker's firmware 4.7.0 (measured under emulation) never does that while nothing
    /// plays.
    pub(crate) fn finish_silence(&mut self) {
        for (area, silence) in self.areas.iter_mut().zip(self.silences) {
            if let (Some(area), Some(id)) = (area, silence) {
                area.data.sound_command_id = id;
            }
        }
    }

    /// Writes the newest inputs of each controller that has ever taken part into its area, and which
    /// extensions are connected into `io_slave_alive` of the first area.
    ///
    /// When a response newly reports a counter reset or motor command as done, and its id is the one in
    /// the area's output part, the area's
    /// [`cnt_resetted`](crate::transfer_area::InputValues::cnt_resetted) or
    /// [`motor_ex_reached`](crate::transfer_area::InputValues::motor_ex_reached) becomes 1. To apply the
    /// same inputs again changes nothing: flags that the program has cleared stay cleared.
    pub fn apply(&self, areas: &mut [FishX1Transfer]) {
        for (area, inputs) in areas.iter_mut().zip(&self.areas) {
            if let Some(inputs) = inputs {
                inputs.apply(area);
            }
        }
        if let Some(master) = areas.first_mut() {
            apply_alive(self.alive, master);
        }
    }

    /// Takes in a response of the simple exchange.
    pub(crate) fn take_simple(&mut self, data: ExchangeDataResponse) {
        self.areas[0] = Some(AreaInputs { data, microphone: [0; 2] });
    }

    /// Takes in a compressed response: `words_per_area` words for the master and each active extension.
    pub(crate) fn take_compressed(
        &mut self,
        active_extensions: u16,
        words: &[u16],
        words_per_area: usize,
    ) {
        self.alive = active_extensions;
        let takes_part = |area: &usize| *area == 0 || active_extensions & 1 << (area - 1) != 0;
        let indices = (0..=u16::BITS as usize).filter(takes_part);
        for (words, index) in words.chunks_exact(words_per_area).zip(indices) {
            // The mask has bits for more extensions than there can be areas.
            if let Some(area) = self.areas.get_mut(index) {
                *area = AreaInputs::from_words(words);
            }
        }
    }
}

/// Writes which extensions are connected, bit 0 the first, into the master's area.
fn apply_alive(alive: u16, master: &mut FishX1Transfer) {
    for (extension, is_alive) in master.state.io_slave_alive.iter_mut().enumerate() {
        *is_alive = u8::from(alive & 1 << extension != 0);
    }
}

impl AreaInputs {
    /// Reads one area's part of a compressed response, 50 or 52 words.
    fn from_words(words: &[u16]) -> Option<Self> {
        let (data, rest) = words.split_first_chunk()?;
        let data = ExchangeDataResponse::from_words(data);
        Some(Self { data, microphone: rest.first_chunk().copied().unwrap_or_default() })
    }

    fn apply(&self, area: &mut FishX1Transfer) {
        let input = &mut area.input;
        *input.uni = self.data.uni;
        *input.cnt_in = self.data.counter_input;
        *input.counter = self.data.counter;
        let resets = (&mut *input.cnt_reset_cmd_id, &mut *input.cnt_resetted);
        note_done(resets, self.data.counter_reset_id, &area.output.cnt_reset_cmd_id);
        let motors = (&mut *input.motor_ex_cmd_id, &mut *input.motor_ex_reached);
        note_done(motors, self.data.motor_command_id, &area.output.motor_ex_cmd_id);
        area.txt_inputs.sound_cmd_id = self.data.sound_command_id;
        for (input, &remote) in area.txt_inputs.ir_input.iter_mut().zip(&self.data.ir) {
            *input = ir_input(remote);
        }
        [area.txt_inputs2.mic_lin, area.txt_inputs2.mic_log] = self.microphone;
    }
}

/// Remembers the ids of the last commands that are done, and sets the flag of each new one that was `asked` for.
fn note_done<const N: usize>(
    (remembered, flags): (&mut [u16; N], &mut [u16; N]),
    done: [u16; N],
    asked: &[u16; N],
) {
    // Nearly always.
    if *remembered == done {
        return;
    }
    for i in 0..N {
        if remembered[i] != done[i] && asked[i] == done[i] {
            flags[i] = 1;
        }
    }
    *remembered = done;
}

/// A remote as the transfer area has it: with both halves of each axis after its value.
fn ir_input(remote: IrRemote) -> IrInput {
    // Most remotes are at rest.
    if remote == IrRemote::default() {
        return IrInput::default();
    }
    let axis = |value: i8| {
        let value = i16::from(value);
        (value, (-value).max(0) as u16, value.max(0) as u16)
    };
    let bit = |index: u8| u16::from(remote.bits >> index & 1);
    let (joy_left_x, joy_left_x_to_left, joy_left_x_to_right) = axis(remote.left_x);
    let (joy_left_y, joy_left_y_to_backwards, joy_left_y_to_forward) = axis(remote.left_y);
    let (joy_right_x, joy_right_x_to_left, joy_right_x_to_right) = axis(remote.right_x);
    let (joy_right_y, joy_right_y_to_backwards, joy_right_y_to_forward) = axis(remote.right_y);
    IrInput {
        joy_left_x,
        joy_left_x_to_left,
        joy_left_x_to_right,
        joy_left_y,
        joy_left_y_to_forward,
        joy_left_y_to_backwards,
        joy_right_x,
        joy_right_x_to_left,
        joy_right_x_to_right,
        joy_right_y,
        joy_right_y_to_forward,
        joy_right_y_to_backwards,
        button_on: bit(0),
        button_off: bit(1),
        dip_switch_1: bit(2),
        dip_switch_2: bit(3),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Applies a response that reports the first counter reset and motor command as done.
    fn apply(area: &mut FishX1Transfer, counter_reset_id: u16, motor_command_id: u16) {
        let mut inputs = Inputs::default();
        inputs.take_simple(ExchangeDataResponse {
            counter_reset_id: [counter_reset_id, 0, 0, 0],
            motor_command_id: [motor_command_id, 0, 0, 0],
            ..ExchangeDataResponse::default()
        });
        inputs.apply(std::slice::from_mut(area));
    }

    fn flags(area: &FishX1Transfer) -> (u16, u16) {
        (area.input.cnt_resetted[0], area.input.motor_ex_reached[0])
    }

    #[test]
    fn flags_are_set_once_by_the_id_that_was_asked_for() {
        let mut area = FishX1Transfer::default();
        area.output.cnt_reset_cmd_id[0] = 2;
        area.output.motor_ex_cmd_id[0] = 3;
        apply(&mut area, 0, 0);
        assert_eq!(flags(&area), (0, 0), "nothing is done yet");
        apply(&mut area, 1, 2);
        assert_eq!(flags(&area), (0, 0), "older commands are done");
        assert_eq!((area.input.cnt_reset_cmd_id[0], area.input.motor_ex_cmd_id[0]), (1, 2));
        apply(&mut area, 2, 3);
        assert_eq!(flags(&area), (1, 1));
        area.input.cnt_resetted[0] = 0;
        area.input.motor_ex_reached[0] = 0;
        apply(&mut area, 2, 3);
        assert_eq!(flags(&area), (0, 0), "the program has cleared them");
    }

    #[test]
    fn words_go_to_the_areas_that_the_mask_names() {
        let words: Vec<u16> = [10, 20, 30].iter().flat_map(|&word| [word; 50]).collect();
        let mut inputs = Inputs::default();
        // Extensions 2 and 8.
        inputs.take_compressed(0b1000_0010, &words, 50);
        let mut areas = [FishX1Transfer::default(); MAX_AREAS];
        inputs.apply(&mut areas);
        let uni: Vec<i16> = areas.iter().map(|area| area.input.uni[7]).collect();
        assert_eq!(uni, [10, 0, 20, 0, 0, 0, 0, 0, 30]);
        assert_eq!(areas[0].state.io_slave_alive, [0, 1, 0, 0, 0, 0, 0, 1]);
        assert_eq!(areas[2].txt_inputs.ir_input[4].joy_left_x, 20);
        // The area of an extension that is gone keeps its last inputs.
        inputs.take_compressed(0, &words[..50], 50);
        inputs.apply(&mut areas);
        assert_eq!(areas[2].input.uni[7], 20);
        assert_eq!(areas[0].state.io_slave_alive, [0; 8]);
    }

    #[test]
    fn a_mask_beyond_extension_8_is_read_past() {
        let mut inputs = Inputs::default();
        inputs.take_compressed(u16::MAX, &[1; 17 * 52], 52);
        let mut areas = [FishX1Transfer::default(); MAX_AREAS];
        inputs.apply(&mut areas);
        assert!(areas.iter().all(|area| area.txt_inputs2.mic_log == 1));
    }
}
