//! Another client, ftrobopy, with the simulated TXT as a program. This crate's own handler runs the
//! same scenarios and must read the same.
//!
//! The world files in this folder say what is plugged in. Each client has a simulated TXT of its own,
//! so both begin with the same world. Without a pace a world moves one step per exchange. So all that
//! begins and ends with an exchange is compared number by number: inputs in every mode, and the counts
//! of commanded distances. Where a client waits for something, such as the pulses of a motor that turns
//! freely, the values depend on real time and are only checked to be in range. With a pace a world goes by
//! the clock, and the speed of a motor is compared with the client's own clock.
//!
//! It runs when `FTROBOPY_PYTHON` names a Python with `tests/system/interop/requirements.txt` installed, as
//! in `.ci/run`, and otherwise prints that it does not run.

mod ftrobopy;
mod inputs;
mod mistakes;
mod motors;
mod own;
mod page;
mod services;
mod sessions;
mod through_watch;

use ft_transfer_area::TransferMode;
use serde_json::Value;

use crate::program::Program;

/// Which kind of exchange is used.
#[derive(Clone, Copy)]
enum Exchange {
    /// With the master alone.
    Simple,
    /// With an extension.
    Compressed,
}

impl Exchange {
    /// Its name in the scripts.
    fn name(self) -> &'static str {
        match self {
            Self::Simple => "simple",
            Self::Compressed => "compressed",
        }
    }

    fn mode(self) -> TransferMode {
        match self {
            Self::Simple => TransferMode::Simple,
            Self::Compressed => TransferMode::Compressed,
        }
    }

    /// How many controllers take part.
    fn areas(self) -> usize {
        match self {
            Self::Simple => 1,
            Self::Compressed => 2,
        }
    }
}

/// A simulated TXT with one extension, the world of this file, and these other options.
fn start(world: &str, options: &[&str]) -> Program {
    let world = format!("{}/interop/{world}", env!("CARGO_MANIFEST_DIR"));
    let common = ["--extensions", "1", "--firmware", "4.6.6", "--world", &world];
    Program::start(&[&common, options].concat())
}

/// Checks that a client has read the expected values.
fn assert_alike(who: &str, read: &Value, expected: &Value) {
    assert!(read == expected, "{who} reads {read}\ninstead of {expected}");
}

/// Ends the program; returns its log, which has no warning of a client's mistake. Only a request to a
/// missing I2C device is allowed.
fn end_well(program: Program) -> String {
    let log = program.interrupt();
    let warned = log.lines().find(|line| line.contains("WARN") && !line.contains("no I2C device"));
    assert_eq!(warned, None, "{log}");
    log
}

/// In a class the warnings would scroll the links of all pupils away.
#[cfg_attr(not(unix), ignore = "Ctrl-C can't be sent to a single program there")]
#[test]
fn a_search_for_i2c_devices_is_one_warning() {
    let program = Program::start(&["--world", "default"]);
    let own = own::Own::begin(&program, Exchange::Simple);
    let mut i2c = own.handler.i2c().unwrap();
    let answer = (0x08..0x78).filter(|device| i2c.read(*device, 0, &mut [0]).is_ok());
    assert_eq!(answer.collect::<Vec<u8>>(), [0x18]);
    own.end();
    let log = program.interrupt();
    let warnings: Vec<_> = log.lines().filter(|line| line.contains("WARN")).collect();
    assert!(matches!(warnings[..], [one] if one.contains("0x08")), "{warnings:#?}");
}
