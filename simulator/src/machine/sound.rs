//! The model of the loudspeaker.

/// How long a sound takes, in µs of machine time.
const LENGTH: u64 = 1_000_000;

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
    /// Machine time to its end in µs; `None` when it plays until it is replaced.
    left: Option<u64>,
}

impl Sound {
    /// Begins a command, in place of the playing one.
    pub(crate) fn begin(&mut self, id: u16, index: u16, repeat: u16) {
        if index == 0 {
            *self = Self { playing: None, finished_id: id };
            return;
        }
        let left = (repeat > 0).then(|| u64::from(repeat) * LENGTH);
        self.playing = Some(Playing { id, left });
    }

    /// Plays for this many µs more.
    pub(crate) fn play(&mut self, micros: u64) {
        let Some(Playing { id, left: Some(left) }) = &mut self.playing else { return };
        *left = left.saturating_sub(micros);
        if *left == 0 {
            self.finished_id = *id;
            self.playing = None;
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
    fn repeat_zero_plays_until_silence() {
        let mut sound = Sound::default();
        sound.begin(1, 5, 0);
        sound.play(u64::MAX);
        assert_eq!((sound.playing_id(), sound.finished_id()), (Some(1), 0));
        sound.begin(2, 0, 1);
        assert_eq!((sound.playing_id(), sound.finished_id()), (None, 2));
    }

    #[test]
    fn a_replaced_sound_is_never_done() {
        let mut sound = Sound::default();
        sound.begin(1, 5, 1);
        sound.begin(2, 6, 1);
        sound.play(LENGTH);
        assert_eq!(sound.finished_id(), 2);
    }
}
