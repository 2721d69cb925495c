//! Commands with ids that the firmware can distinguish, so that none is reported as done before it is.
//!
//! Measured on the maker's firmware 4.7.0 under emulation:
//!
//! - Three bits count the commands of a motor or counter on their way to the I/O board. The eighth command after the
//!   last one that is done looks like that one, and is reported as done at once. Before it goes out, its outputs are sent
//!   once with another id, so that it is the ninth.
//! - Sounds play on after StopOnline, unless silence ends them.

use super::inputs::AreaReport;
use crate::transfer_area::{IZ_COUNTER, IZ_MOTOR, MAX_AREAS};
use crate::wire::ExchangeData;

/// How many commands the firmware can distinguish.
const COUNT: usize = 8;

/// The commands of all areas since StartOnline.
#[derive(Clone, Debug, Default)]
pub(super) struct Commands {
    areas: [AreaCommands; MAX_AREAS],
    /// Whether silence is sent where a sound may play.
    ends_sounds: bool,
    /// Whether the inputs tell which commands are silence.
    tells_silence: bool,
}

#[derive(Clone, Debug, Default)]
struct AreaCommands {
    motors: Sent<IZ_MOTOR>,
    resets: Sent<IZ_COUNTER>,
    sound: SentSound,
}

/// The ids of an area's commands of one kind. In nearly all cycles nothing about them changes.
#[derive(Clone, Debug)]
struct Sent<const N: usize> {
    /// The last one sent of each.
    newest: [u16; N],
    /// Which the controller has reported as done last, since then.
    reported: Option<[u16; N]>,
    all: [SentIds; N],
}

/// The last ids of a motor's or counter's commands.
#[derive(Clone, Copy, Debug, Default)]
struct SentIds {
    ids: [u16; COUNT],
    /// The place of the newest one.
    newest: usize,
    /// The place of the last one that is done.
    done: usize,
}

/// The last command for a sound.
#[derive(Clone, Copy, Debug, Default)]
struct SentSound {
    /// The program's id.
    id: u16,
    /// Whether the program has asked for silence.
    is_silence: bool,
    /// Whether silence was sent instead.
    is_ended: bool,
    /// Whether a sound was played, and no silence came after it.
    may_play: bool,
}

impl Commands {
    /// From now on silence is sent where a sound may play.
    pub(super) fn end_sounds(&mut self) {
        self.ends_sounds = true;
    }

    /// Whether the inputs tell which commands are silence.
    pub(super) fn tell_silence(&mut self, tells: bool) {
        self.tells_silence = tells;
    }

    /// Changes an area's outputs where the firmware would mistake them.
    pub(super) fn send(&mut self, index: usize, outputs: &mut ExchangeData) {
        let AreaCommands { motors, resets, sound } = &mut self.areas[index];
        motors.send(&mut outputs.motor_command_id);
        resets.send(&mut outputs.counter_reset_id);
        sound.send(outputs, self.ends_sounds);
    }

    /// Takes in what the areas' responses say, and corrects it.
    pub(super) fn receive<'a>(&mut self, report: impl Iterator<Item = Option<AreaReport<'a>>>) {
        for (commands, report) in self.areas.iter_mut().zip(report) {
            if let Some(report) = report {
                commands.receive(report, self.tells_silence);
            }
        }
    }
}

impl AreaCommands {
    fn receive(&mut self, AreaReport { data, silence }: AreaReport<'_>, tells_silence: bool) {
        let Self { motors, resets, sound } = self;
        motors.receive(data.motor_command_id);
        resets.receive(data.counter_reset_id);
        *silence = (tells_silence && sound.is_silence).then_some(sound.id);
        if sound.is_ended {
            // Whether the sound was done is known by the caller.
            data.sound_command_id = sound.id;
        }
    }
}

impl<const N: usize> Default for Sent<N> {
    fn default() -> Self {
        Self { newest: [0; N], reported: None, all: [SentIds::default(); N] }
    }
}

impl<const N: usize> Sent<N> {
    /// Replaces the program's ids by those to send.
    fn send(&mut self, ids: &mut [u16; N]) {
        if *ids != self.newest {
            for (sent, id) in self.all.iter_mut().zip(&mut *ids) {
                *id = sent.send(*id);
            }
            (self.newest, self.reported) = (*ids, None);
        }
    }

    /// The controller says that the commands of these ids were the last ones done.
    fn receive(&mut self, ids: [u16; N]) {
        if self.reported != Some(ids) {
            for (sent, id) in self.all.iter_mut().zip(ids) {
                sent.receive(id);
            }
            self.reported = Some(ids);
        }
    }
}

impl SentIds {
    /// The id to send for the program's.
    fn send(&mut self, id: u16) -> u16 {
        let last = self.ids[self.newest];
        if id == last {
            return id;
        }
        self.newest = (self.newest + 1) % COUNT;
        let looks_done = self.newest == self.done;
        let others = [id ^ 0x8000, id ^ 0x4000];
        let sent = match others.into_iter().find(|other| *other != last) {
            Some(other) if looks_done => other,
            _ => id,
        };
        self.ids[self.newest] = sent;
        sent
    }

    /// The controller says that the command of this id was the last one done.
    fn receive(&mut self, id: u16) {
        let newest_first = (0..COUNT).map(|age| (self.newest + COUNT - age) % COUNT);
        if let Some(place) = newest_first.into_iter().find(|place| self.ids[*place] == id) {
            self.done = place;
        }
    }
}

impl SentSound {
    fn send(&mut self, outputs: &mut ExchangeData, ends: bool) {
        let is_new = outputs.sound_command_id != self.id;
        self.id = outputs.sound_command_id;
        if is_new {
            self.may_play = outputs.sound_index != 0;
        }
        self.is_silence = outputs.sound_index == 0;
        self.is_ended = ends && self.may_play;
        if self.is_ended {
            outputs.sound_command_id = self.id.wrapping_add(1);
            (outputs.sound_index, outputs.sound_repeat) = (0, 0);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::ExchangeDataResponse;

    /// The controller says this about the area with this index.
    fn receive(commands: &mut Commands, index: usize, data: &mut ExchangeDataResponse) {
        commands.areas[index].receive(AreaReport { data, silence: &mut None }, true);
    }

    /// What is sent for these ids of a motor, one exchange each, when the controller reports this one.
    fn sent(ids: impl IntoIterator<Item = u16>, commands: &mut Commands, done: u16) -> Vec<u16> {
        let exchange = |id| {
            let mut outputs =
                ExchangeData { motor_command_id: [0, id, 0, 0], ..ExchangeData::default() };
            commands.send(1, &mut outputs);
            let mut report = ExchangeDataResponse {
                motor_command_id: [0, done, 0, 0],
                ..ExchangeDataResponse::default()
            };
            receive(commands, 1, &mut report);
            outputs.motor_command_id[1]
        };
        ids.into_iter().map(exchange).collect()
    }

    #[test]
    fn the_eighth_command_after_the_last_one_done_goes_out_as_the_ninth() {
        let mut commands = Commands::default();
        assert_eq!(sent(1..=7, &mut commands, 0), [1, 2, 3, 4, 5, 6, 7]);
        assert_eq!(sent([8, 8, 8], &mut commands, 0x8008), [0x8008, 8, 8]);
        // The firmware can tell the seven after it apart.
        assert_eq!(sent(9..=14, &mut commands, 0x8008), [9, 10, 11, 12, 13, 14]);
        assert_eq!(sent([15, 15], &mut commands, 0x8008), [0x800F, 15]);
    }

    #[test]
    fn commands_that_are_done_in_time_go_out_as_they_are() {
        let mut commands = Commands::default();
        for first in (1..100).step_by(7) {
            let ids: Vec<u16> = (first..first + 7).collect();
            assert_eq!(sent(ids.clone(), &mut commands, first), ids);
        }
        // Also when an id is used again.
        assert_eq!(sent([300, 301, 300, 301, 300], &mut commands, 300), [300, 301, 300, 301, 300]);
    }

    #[test]
    fn the_id_that_is_sent_before_differs_from_the_last_one() {
        let mut commands = Commands::default();
        sent([1, 2, 3, 4, 5, 6, 0x8007], &mut commands, 0);
        assert_eq!(sent([7, 7], &mut commands, 0), [0x4007, 7]);
    }

    /// What is sent for a sound, and which id the program gets when the controller reports the id `done`.
    fn sound(commands: &mut Commands, id: u16, index: u16, done: u16) -> ((u16, u16), u16) {
        let mut outputs = ExchangeData {
            sound_command_id: id,
            sound_index: index,
            sound_repeat: 1,
            ..ExchangeData::default()
        };
        commands.send(0, &mut outputs);
        let mut report =
            ExchangeDataResponse { sound_command_id: done, ..ExchangeDataResponse::default() };
        receive(commands, 0, &mut report);
        ((outputs.sound_command_id, outputs.sound_index), report.sound_command_id)
    }

    #[test]
    fn sounds_are_ended_where_one_may_play() {
        let mut commands = Commands::default();
        sound(&mut commands, 1, 3, 1);
        commands.end_sounds();
        assert_eq!(sound(&mut commands, 1, 0, 2), ((2, 0), 1));
        let mut silent = Commands::default();
        sound(&mut silent, 1, 3, 1);
        sound(&mut silent, 2, 0, 1);
        silent.end_sounds();
        assert_eq!(sound(&mut silent, 2, 0, 1), ((2, 0), 1));
    }
}
