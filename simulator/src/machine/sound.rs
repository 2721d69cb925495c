//! The model of the loudspeaker.

/// How long the files of a controller with firmware 4.7.0 take in ms, from index 1 on.
const LENGTHS: [u16; 29] = [
    4387, 498, 954, 1888, 901, 397, 7751, 2180, 2784, 2439, // 1 to 10
    756, 2000, 8000, 1558, 6001, 8660, 1318, 2363, 1004, 6675, // 11 to 20
    2001, 3245, 2064, 505, 1000, 757, 2059, 875, 864, // 21 to 29
];

/// How long the file with this index takes, in µs of machine time; `None` if there is none.
fn length(index: u16) -> Option<u64> {
    let place = usize::from(index).checked_sub(1)?;
    LENGTHS.get(place).map(|millis| u64::from(*millis) * 1000)
}

/// The loudspeaker and its command.
#[derive(Clone, Debug, Default)]
pub(crate) struct Sound {
    playing: Option<Playing>,
    /// Id of the last command that is done.
    finished_id: u16,
}

#[derive(Clone, Copy, Debug)]
struct Playing {
    id: u16,
    /// Machine time to its end in µs.
    left: u64,
}

impl Sound {
    /// Begins a command, in place of the playing one. Then it is done at once, although it only begins. The id of a
    /// command that has nothing to end or to play is never reported as done.
    pub(crate) fn begin(&mut self, id: u16, index: u16, repeat: u16) {
        if self.playing.take().is_some() {
            self.finished_id = id;
        }
        // Repeat 0 plays it once, too.
        let playing = |length| Playing { id, left: u64::from(repeat.max(1)) * length };
        self.playing = length(index).map(playing);
    }

    /// Plays for this many µs more.
    pub(crate) fn play(&mut self, micros: u64) {
        let Some(Playing { id, left }) = &mut self.playing else { return };
        *left = left.saturating_sub(micros);
        if *left == 0 {
            self.finished_id = *id;
            self.playing = None;
        }
    }

    /// Forgets which commands there were. What plays goes on.
    pub(crate) fn forget_ids(&mut self) {
        self.finished_id = 0;
        if let Some(playing) = &mut self.playing {
            playing.id = 0;
        }
    }

    /// Id of the last command that is done.
    pub(crate) fn finished_id(&self) -> u16 {
        self.finished_id
    }

    /// Id of the playing command.
    pub(crate) fn playing_id(&self) -> Option<u16> {
        self.playing.map(|playing| playing.id)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sound_is_done_after_the_length_of_its_file_for_each_repeat() {
        let mut sound = Sound::default();
        sound.begin(3, 29, 2);
        sound.play(2 * 864_000 - 1);
        assert_eq!((sound.playing_id(), sound.finished_id()), (Some(3), 0));
        sound.play(1);
        assert_eq!((sound.playing_id(), sound.finished_id()), (None, 3));
    }

    #[test]
    fn repeat_zero_plays_once() {
        for (repeat, index, length) in [(0, 1, 4_387_000), (1, 2, 498_000)] {
            let mut sound = Sound::default();
            sound.begin(1, index, repeat);
            sound.play(length - 1);
            assert_eq!((sound.playing_id(), sound.finished_id()), (Some(1), 0));
            sound.play(1);
            assert_eq!((sound.playing_id(), sound.finished_id()), (None, 1));
        }
    }

    #[test]
    fn what_ends_or_replaces_a_sound_is_done_at_once() {
        let mut sound = Sound::default();
        sound.begin(1, 5, 9);
        sound.begin(2, 6, 2);
        assert_eq!((sound.playing_id(), sound.finished_id()), (Some(2), 2));
        sound.begin(3, 0, 1);
        assert_eq!((sound.playing_id(), sound.finished_id()), (None, 3));
    }

    #[test]
    fn silence_without_a_sound_and_a_missing_file_are_never_done() {
        let mut sound = Sound::default();
        sound.begin(1, 0, 1);
        sound.begin(2, 30, 1);
        sound.play(u64::MAX);
        assert_eq!((sound.playing_id(), sound.finished_id()), (None, 0));
    }
}
