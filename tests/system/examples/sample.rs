//! The table of the samples.

use super::checks;

/// A sample, and what it prints.
pub(crate) struct Sample {
    pub(crate) name: &'static str,
    /// Some of the lines that it prints, in this order.
    pub(crate) shows: &'static [&'static str],
    /// Whether it runs until Ctrl-C when it has an address.
    pub(crate) endless: bool,
    pub(crate) check: fn(&[String]),
}

pub(crate) const SAMPLES: [Sample; 12] = [
    Sample { name: "c_program", shows: &[], endless: false, check: checks::gate },
    Sample { name: "camera", shows: &[], endless: false, check: checks::pictures },
    Sample { name: "extended_motor_control", shows: &[], endless: false, check: checks::distances },
    Sample {
        name: "extension",
        shows: &[
            "master: I1 open   , M1 off       extension: I1 open   , M1 off",
            "master: I1 pressed, M1 off       extension: I1 open   , M1 runs",
            "master: I1 pressed, M1 runs      extension: I1 pressed, M1 runs",
            "master: I1 open   , M1 runs      extension: I1 pressed, M1 off",
        ],
        endless: true,
        check: checks::extension,
    },
    Sample { name: "i2c", shows: &["x ", "x ", "x "], endless: true, check: checks::sensor },
    Sample {
        name: "infrared_remote",
        shows: &[
            "left  15, right  15   ON    M1  512, M2  512",
            "left  15, right   5   ON    M1  512, M2  170",
            "left  -8, right  -8   ON    M1 -273, M2 -273",
            "left  -8, right  -8   OFF   M1    0, M2    0",
        ],
        endless: true,
        check: checks::remote,
    },
    Sample {
        name: "motor_on_off_switch",
        shows: &[
            "pressed  40 cm   runs",
            "pressed  25 cm   runs",
            "open     40 cm   off",
            "open     25 cm   off",
            "pressed  40 cm   runs",
            "pressed  25 cm   runs",
            "open     40 cm   off",
            "open     25 cm   off",
        ],
        endless: true,
        check: checks::switches,
    },
    Sample { name: "slide_on_events", shows: &[], endless: false, check: checks::slide },
    Sample {
        name: "sorting_line",
        shows: &[
            "  It is White.",
            "  It is Red.",
            "  It is Blue.",
            "  It is in the storage at I8.",
        ],
        endless: true,
        check: checks::discs,
    },
    Sample { name: "sound_and_lamps", shows: &[], endless: false, check: checks::lamps_and_sounds },
    Sample {
        name: "warehouse",
        shows: &["fetching A1", "A1 is outside", "A1 is back", "1 of 1 orders, 0 stops"],
        endless: false,
        check: |_| {},
    },
    Sample {
        name: "wifi",
        shows: &["M3 runs 50 pulses there.", "M3 runs 250 pulses back.", "  done after"],
        endless: true,
        check: checks::ways,
    },
];

/// The shipped world with less time between its workpieces.
pub(crate) fn quick_sorting_line() -> String {
    let world = include_str!("../../../simulator/worlds/sorting_line.toml");
    let quick = world.replace("{ at = 14,", "{ at = 8,").replace("{ at = 26,", "{ at = 14,");
    assert_ne!(quick, world);
    quick
}
