//! Sounds.

use super::{next_id, InvalidCall};
use crate::transfer_area::FishX1Transfer;

/// The index for no sound: it stops the sound that is playing.
pub const SILENCE: u16 = 0;

/// The numbers of sound files have two digits.
const SOUND_MAX: i64 = 99;

/// Declares the sounds in the order of their numbers, from 1, each with the name of its file.
macro_rules! sounds {
    ($($sound:ident $name:literal)+) => {
        /// The sounds that a TXT is delivered with, by the names of their files.
        ///
        /// The files are in `/opt/knobloch/SoundFiles` on the controller and can be replaced. Source:
        /// appendix A of the kit's document.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        #[repr(u16)]
        #[non_exhaustive]
        pub enum Sound {
            $(#[doc = $name] $sound),+
        }

        impl Sound {
            /// All of them, in the order of their numbers: the first has number 1.
            pub const ALL: &'static [Self] = &[$(Self::$sound),+];

            /// The name of its file, without number and extension.
            pub const fn name(self) -> &'static str {
                match self {
                    $(Self::$sound => $name),+
                }
            }
        }
    };
}

sounds! {
    Airplane "Airplane"
    Alarm "Alarm"
    Bell "Bell"
    Braking "Braking"
    CarHornLong "Car-horn-long"
    CarHornShort "Car-horn-short"
    CracklingWood "Crackling-wood"
    Excavator "Excavator"
    Fantasy1 "Fantasy-1"
    Fantasy2 "Fantasy-2"
    Fantasy3 "Fantasy-3"
    Fantasy4 "Fantasy-4"
    Farm "Farm"
    FireDepartment "Fire-department"
    FireNoises "Fire-noises"
    Formula1 "Formula1"
    Helicopter "Helicopter"
    Hydraulic "Hydraulic"
    MotorSound "Motor-sound"
    MotorStarting "Motor-starting"
    PropellerAirplane "Propeller-airplane"
    RollerCoaster "Roller-coaster"
    ShipsHorn "Ships-horn"
    Tractor "Tractor"
    Truck "Truck"
    Augenzwinkern "Augenzwinkern"
    Fahrgeraeusch "Fahrgeraeusch"
    KopfHeben "Kopf_heben"
    KopfNeigen "Kopf_neigen"
}

impl Sound {
    /// Its number, 1..=29: what [`sound_index`](crate::transfer_area::TxtOutputs::sound_index) holds.
    pub const fn index(self) -> u16 {
        self as u16 + 1
    }
}

/// Its number, 1..=29.
impl From<Sound> for u16 {
    fn from(sound: Sound) -> Self {
        sound.index()
    }
}

/// Its number, 1..=29, as [`set_sound`](FishX1Transfer::set_sound) takes it.
impl From<Sound> for i64 {
    fn from(sound: Sound) -> Self {
        sound.index().into()
    }
}

impl FishX1Transfer {
    /// Plays a sound `repeat` times. It replaces the sound that is playing. The kit's manual says that `repeat` 0 is
    /// without end; the maker's firmware 4.7.0 (measured under emulation, as all that follows) plays the sound once.
    ///
    /// `sound` is a [`Sound`], or the number of a file as any integer: 1 to 29 as delivered, and up to
    /// 99 for files that somebody has put onto the controller. [`SILENCE`] stops the sound that is
    /// playing. [`is_sound_ready`](Self::is_sound_ready) is `true` when the sound is done. A sound that begins while
    /// another one plays is reported as done at once, and one without a file never.
    ///
    /// ```
    /// use ft_transfer_area::tx::{Sound, SILENCE};
    /// use ft_transfer_area::FishX1Transfer;
    ///
    /// # fn main() -> Result<(), ft_transfer_area::Error> {
    /// let mut area = FishX1Transfer::default();
    /// area.set_sound(Sound::Bell, 2)?;
    /// assert_eq!((area.txt_outputs.sound_index, area.txt_outputs.sound_repeat), (3, 2));
    /// area.set_sound(1, 2)?; // Sound::Airplane
    /// area.set_sound(SILENCE, 1)?;
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// # Errors
    ///
    /// [`InvalidCall::OutOfRange`] for a number below 0 or with more than two digits.
    #[doc(alias = "SetSound")]
    pub fn set_sound(&mut self, sound: impl TryInto<i64>, repeat: u16) -> Result<(), InvalidCall> {
        // What does not fit is out of range in any case.
        let index = sound.try_into().unwrap_or(i64::MAX);
        InvalidCall::check_range("sound's index", index, 0..=SOUND_MAX)?;
        self.txt_outputs.sound_index = index as u16;
        self.txt_outputs.sound_repeat = repeat;
        self.raise_sound_cmd_id();
        Ok(())
    }

    /// Plays the sound that is set in the area, or plays it again.
    ///
    /// Raises the [`sound_cmd_id`](crate::transfer_area::TxtOutputs::sound_cmd_id) by one, and after
    /// 65535 to 0; if that is the id last reported as done, by one more.
    pub fn raise_sound_cmd_id(&mut self) {
        self.txt_outputs.sound_cmd_id =
            next_id(self.txt_outputs.sound_cmd_id, self.txt_inputs.sound_cmd_id);
    }

    /// Whether the last sound command is done. Also `true` when there was none. See [`set_sound`](Self::set_sound) for
    /// what the firmware reports.
    #[doc(alias = "IsSoundReady")]
    #[must_use]
    pub fn is_sound_ready(&self) -> bool {
        self.txt_inputs.sound_cmd_id == self.txt_outputs.sound_cmd_id
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sounds_have_the_numbers_of_their_files() {
        let numbers: Vec<u16> = Sound::ALL.iter().map(|sound| sound.index()).collect();
        assert_eq!(numbers, (1..=29).collect::<Vec<u16>>());
        // Some sounds of the appendix.
        for (file, sound) in [
            ("01_Airplane.wav", Sound::Airplane),
            ("03_Bell.wav", Sound::Bell),
            ("14_Fire-department.wav", Sound::FireDepartment),
            ("16_Formula1.wav", Sound::Formula1),
            ("23_Ships-horn.wav", Sound::ShipsHorn),
            ("29_Kopf_neigen.wav", Sound::KopfNeigen),
        ] {
            assert_eq!(format!("{:02}_{}.wav", sound.index(), sound.name()), file);
        }
    }

    #[test]
    fn a_sound_is_done_when_its_own_id_comes_back() {
        let mut area = FishX1Transfer::default();
        assert!(area.is_sound_ready());
        area.txt_inputs.sound_cmd_id = 1;
        area.set_sound(Sound::Alarm, 0).unwrap();
        assert_eq!((area.txt_outputs.sound_cmd_id, area.is_sound_ready()), (2, false));
        area.txt_inputs.sound_cmd_id = 2;
        assert!(area.is_sound_ready());
    }

    #[test]
    fn a_sound_is_a_number_of_any_type_or_a_name() {
        let mut area = FishX1Transfer::default();
        let mut index_after = |result: fn(&mut FishX1Transfer) -> Result<(), InvalidCall>| {
            result(&mut area).unwrap();
            area.txt_outputs.sound_index
        };
        assert_eq!(index_after(|area| area.set_sound(7, 1)), 7);
        assert_eq!(index_after(|area| area.set_sound(8_u16, 1)), 8);
        assert_eq!(index_after(|area| area.set_sound(9_usize, 1)), 9);
        assert_eq!(index_after(|area| area.set_sound(Sound::Bell, 1)), 3);
    }

    #[test]
    fn a_number_that_no_file_can_have_is_refused_and_changes_nothing() {
        let mut area = FishX1Transfer::default();
        area.set_sound(99, 1).unwrap();
        let before = area;
        for index in [100, -1, 65_536 + 1, i32::MAX] {
            let error = area.set_sound(index, 1).unwrap_err();
            let given = index.into();
            let expected =
                InvalidCall::OutOfRange { what: "sound's index", given, least: 0, most: 99 };
            assert_eq!(error, expected);
        }
        assert!(area.set_sound(u64::MAX, 1).is_err());
        assert_eq!(area, before);
    }
}
