//! The model of the loudspeaker.

/// How long a sound takes, in µs of machine time.
const LENGTH: u64 = 1_000_000;

/// The highest index for which the controller has a file.
const LAST: u16 = 29;

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
        if (1..=LAST).contains(&index) {
            // 0 plays it once, too.
            self.playing = Some(Playing { id, left: u64::from(repeat.max(1)) * LENGTH });
        }
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
    fn a_sound_is_done_after_a_second_per_repeat() {
        let mut sound = Sound::default();
        sound.begin(3, 29, 2);
        sound.play(2 * LENGTH - 1);
        assert_eq!((sound.playing_id(), sound.finished_id()), (Some(3), 0));
        sound.play(1);
        assert_eq!((sound.playing_id(), sound.finished_id()), (None, 3));
    }

    #[test]
    fn repeat_zero_plays_once() {
        let mut sound = Sound::default();
        sound.begin(1, 5, 0);
        sound.play(LENGTH);
        assert_eq!((sound.playing_id(), sound.finished_id()), (None, 1));
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
