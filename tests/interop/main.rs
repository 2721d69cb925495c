//! Another client than this crate's: ftrobopy, against the simulated TXT as a program, and the
//! same scenarios by this crate's own handler, which must read the same.
//!
//! What is plugged in is in the world files beside this one. Each client has a program of its own,
//! so both find the same world. As a world goes by machine time, a step per exchange, whatever
//! begins and ends with an exchange is compared number by number: inputs in every mode, and the
//! counts of ordered distances. Where a client has to see something before it goes on, such as
//! the pulses of a motor that turns freely, the time it takes decides, so each is only checked to
//! be in range.
//!
//! It runs when `FTROBOPY_PYTHON` names a Python that has `tests/interop/requirements.txt`
//! installed, as `.ci/run` does, and says so when it does not run.
#![cfg(unix)]

#[path = "../program/mod.rs"]
mod program;

mod ftrobopy;
mod inputs;
mod mistakes;
mod motors;
mod own;
mod services;
mod sessions;

use ft_transfer_area::TransferMode;
use serde_json::Value;

use program::Program;

/// Which exchange is used.
#[derive(Clone, Copy)]
enum Exchange {
    /// With the master alone.
    Simple,
    /// With an extension.
    Compressed,
}

impl Exchange {
    /// What the scripts call it.
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

/// A simulated TXT with one extension, the world of this file, and these options besides.
fn start(world: &str, options: &[&str]) -> Program {
    let world = format!("{}/tests/interop/{world}", env!("CARGO_MANIFEST_DIR"));
    let common = ["--extensions", "1", "--firmware", "4.6.6", "--world", &world];
    Program::start(&[&common, options].concat())
}

/// Checks that what somebody read is as it should be.
fn assert_alike(who: &str, read: &Value, expected: &Value) {
    assert!(read == expected, "{who} reads {read}\ninstead of {expected}");
}

/// Ends the program; its log, which has nothing that a correct client does not do. That it may ask
/// for an I2C device that is not there is told.
fn end_well(program: Program) -> String {
    let log = program.interrupt();
    let warned = log.lines().find(|line| line.contains("WARN") && !line.contains("no I2C device"));
    assert_eq!(warned, None, "{log}");
    log
}
