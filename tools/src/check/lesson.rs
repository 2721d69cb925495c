//! The lessons of `docs/lessons`.

use std::sync::OnceLock;

use anyhow::Context;
use ft_transfer_area_simulator::world::World;

use super::lessons;
use super::stage::Stage;
use super::task;
use super::words::{Check, Language, Words};
use crate::panel::course::Both;

pub(super) struct Lesson {
    pub(super) number: u8,
    pub(super) name: &'static str,
    /// Its German name, which is that of the pupil's program.
    german: &'static str,
    pub(super) title: Words,
    /// Its document, in English and in German.
    pub(super) document: (&'static str, &'static str),
    /// What is made of it.
    task: OnceLock<Both>,
    /// Its world, as the text of a file.
    pub(super) world: &'static str,
    /// What a program has to do. The first thing that it does wrong ends the check.
    pub(super) check: fn(&mut Stage) -> Check,
}

macro_rules! lessons {
    ($($number:literal $module:ident $german:ident $en_name:literal $de_name:literal $en:literal $de:literal)+) => {
        pub(super) static LESSONS: [Lesson; [$($number),+].len()] = [$(Lesson {
            number: $number,
            name: stringify!($module),
            german: stringify!($german),
            title: Words::fixed($en, $de),
            document: (
                include_str!(concat!("../../../docs/lessons/en/", $en_name, ".md")),
                include_str!(concat!("../../../docs/lessons/de/", $de_name, ".md")),
            ),
            task: OnceLock::new(),
            world: include_str!(concat!("../../../docs/lessons/worlds/", $en_name, ".toml")),
            check: lessons::$module::check,
        }),+];
    };
}

lessons! {
    1 lamp lampe "01-lamp" "01-lampe" "a lamp" "eine Lampe"
    2 blink blinken "02-blink" "02-blinken" "blinking" "Blinken"
    3 motor motor "03-motor" "03-motor" "a motor in both directions" "ein Motor in beide Richtungen"
    4 end_switch endschalter "04-end-switch" "04-endschalter" "stop at the end switch" "am Endschalter anhalten"
    5 counter zaehler "05-counter" "05-zaehler" "count pulses" "Impulse zählen"
    6 distance strecke "06-distance" "06-strecke" "drive a distance" "eine Strecke fahren"
    7 thermostat thermostat "07-thermostat" "07-thermostat" "a thermostat" "ein Thermostat"
    8 traffic_light ampel "08-traffic-light" "08-ampel" "a traffic light" "eine Ampel"
    9 gate tor "09-gate" "09-tor" "a gate that stops at any time" "ein Tor, das jederzeit anhält"
    10 sorting sortierstrecke "10-sorting" "10-sortierstrecke" "a sorting line" "eine Sortierstrecke"
}

impl Lesson {
    /// Its task as a part of a page, which asks for it several times a second. It is made of the document once.
    pub(super) fn task(&self) -> &Both {
        let (en, de) = self.document;
        self.task.get_or_init(|| Both { en: task::html(en), de: task::html(de) })
    }

    /// The lesson with this number, or with this name in any language.
    pub(super) fn find(text: &str) -> Option<&'static Self> {
        let text = text.to_lowercase().replace('-', "_").replace('ä', "ae");
        let is_meant = |lesson: &&Self| {
            [lesson.name, lesson.german].contains(&&*text) || lesson.number.to_string() == text
        };
        LESSONS.iter().find(is_meant)
    }

    pub(super) fn name_in(&self, language: Language) -> &'static str {
        match language {
            Language::En => self.name,
            Language::De => self.german,
        }
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
