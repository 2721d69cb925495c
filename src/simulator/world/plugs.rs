//! The sockets of a controller.

use std::fmt;

use serde::Deserialize;

/// A universal input.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Deserialize)]
#[allow(missing_docs, reason = "the names are those on the controller")]
pub enum Input {
    I1,
    I2,
    I3,
    I4,
    I5,
    I6,
    I7,
    I8,
}

/// A motor output. Its encoder is plugged into the counter with the same number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Deserialize)]
#[allow(missing_docs, reason = "the names are those on the controller")]
pub enum MotorOutput {
    M1,
    M2,
    M3,
    M4,
}

/// A single output. O1 and O2 are the sockets of M1, O3 and O4 those of M2, and so on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Deserialize)]
#[allow(missing_docs, reason = "the names are those on the controller")]
pub enum Output {
    O1,
    O2,
    O3,
    O4,
    O5,
    O6,
    O7,
    O8,
}

impl Input {
    /// All of them, in order.
    pub const ALL: [Self; 8] =
        [Self::I1, Self::I2, Self::I3, Self::I4, Self::I5, Self::I6, Self::I7, Self::I8];

    /// Where its value is in [`Controller::uni`](crate::simulator::Controller::uni), 0..=7.
    pub fn index(self) -> usize {
        self as usize
    }
}

impl MotorOutput {
    /// All of them, in order.
    pub const ALL: [Self; 4] = [Self::M1, Self::M2, Self::M3, Self::M4];

    /// Where its counter is in [`Controller::counter`](crate::simulator::Controller::counter),
    /// 0..=3.
    pub fn index(self) -> usize {
        self as usize
    }
}

impl Output {
    /// Where its duty is in [`ExchangeData::duty`](crate::wire::ExchangeData::duty), 0..=7.
    pub fn index(self) -> usize {
        self as usize
    }

    /// The motor output that has this socket too.
    pub fn motor(self) -> MotorOutput {
        MotorOutput::ALL[self.index() / 2]
    }
}

impl fmt::Display for Input {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Debug::fmt(self, f)
    }
}

impl fmt::Display for MotorOutput {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Debug::fmt(self, f)
    }
}

impl fmt::Display for Output {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Debug::fmt(self, f)
    }
}
