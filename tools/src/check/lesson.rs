//! The lessons of `docs/lessons`.

use anyhow::Context;
use ft_transfer_area_simulator::world::World;

use super::lessons;
use super::stage::Stage;
use super::words::{Check, Words};

pub(super) struct Lesson {
    pub(super) number: u8,
    pub(super) name: &'static str,
    pub(super) title: Words,
    /// Its world, as the text of a file.
    pub(super) world: &'static str,
    /// What a program has to do. The first thing that it does wrong ends the check.
    pub(super) check: fn(&mut Stage) -> Check,
}

macro_rules! lessons {
    ($($number:literal $module:ident $world:literal $en:literal $de:literal)+) => {
        pub(super) static LESSONS: &[Lesson] = &[$(Lesson {
            number: $number,
            name: stringify!($module),
            title: Words::fixed($en, $de),
            world: include_str!(concat!("../../../docs/lessons/worlds/", $world)),
            check: lessons::$module::check,
        }),+];
    };
}

lessons! {
    1 lamp "01-lamp.toml" "a lamp" "eine Lampe"
    2 blink "02-blink.toml" "blinking" "blinken"
    3 motor "03-motor.toml" "a motor in both directions" "ein Motor in beide Richtungen"
    4 end_switch "04-end-switch.toml" "stop at the end switch" "am Endschalter anhalten"
    5 counter "05-counter.toml" "count pulses" "Impulse zählen"
    6 distance "06-distance.toml" "drive a distance" "eine Strecke fahren"
    7 thermostat "07-thermostat.toml" "a thermostat" "ein Thermostat"
    8 traffic_light "08-traffic-light.toml" "a traffic light" "eine Ampel"
    9 gate "09-gate.toml" "a gate that stops at any time" "ein Tor, das jederzeit anhält"
    10 sorting "10-sorting.toml" "a sorting line" "eine Sortierstrecke"
}

impl Lesson {
    /// The lesson with this number or name.
    pub(super) fn find(text: &str) -> Option<&'static Self> {
        let is_meant = |lesson: &&Self| lesson.name == text || lesson.number.to_string() == text;
        LESSONS.iter().find(is_meant)
    }

    /// The lesson whose world has this name.
    pub(super) fn of_world(name: &str) -> Option<&'static Self> {
        LESSONS.iter().find(|lesson| lesson.world_name() == name)
    }

    /// The name of its world for `--world`.
    pub(super) fn world_name(&self) -> String {
        format!("lesson{}", self.number)
    }

    pub(super) fn read_world(&self) -> anyhow::Result<World> {
        World::from_toml(self.world).with_context(|| self.world_name())
    }

    pub(super) fn next(&self) -> Option<&'static Self> {
        LESSONS.iter().find(|lesson| lesson.number == self.number + 1)
    }
}
