//! Faults that can be ordered.

use std::ops::RangeInclusive;
use std::time::Duration;

use crate::error::Error;

/// How late a response may be made, in ms: up to an hour. While it is held back, nobody else is
/// served.
pub(super) const DELAYS: RangeInclusive<i64> = 0..=3_600_000;

/// A fault that the simulated TXT commits on order.
///
/// Each strikes once in the simulator's life, except those for [each
/// exchange](FaultPlace::EachExchange). Of several for the same response the first strikes on the
/// first connection that gets so far, the second on the next, and so on.
///
/// A fault can be written as text, `WHAT@WHERE`, which is how the program `simulated_txt` takes
/// it:
///
/// ```
/// use ft_transfer_area::simulator::{Fault, FaultKind};
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let fault: Fault = "close:5@response:3".parse()?;
/// assert_eq!(fault, Fault::at_response(3, FaultKind::Close { after: 5 }));
/// # Ok(())
/// # }
/// ```
///
/// | what | kind | | where | place |
/// |---|---|---|---|---|
/// | `delay:MS` | [`Delay`](FaultKind::Delay) | | `response:N` | [`Response`](FaultPlace::Response) |
/// | `jitter:MS` | [`Jitter`](FaultKind::Jitter) | | `exchange:N` | [`Exchange`](FaultPlace::Exchange) |
/// | `silence` | [`Silence`](FaultKind::Silence) | | `exchange:each` | [`EachExchange`](FaultPlace::EachExchange) |
/// | `dribble` | [`Dribble`](FaultKind::Dribble) | | | |
/// | `id` | [`WrongId`](FaultKind::WrongId) | | | |
/// | `crc` | [`WrongCrc`](FaultKind::WrongCrc) | | | |
/// | `size:BYTES` | [`ExtraSize`](FaultKind::ExtraSize) | | | |
/// | `mask:BITS` | [`Mask`](FaultKind::Mask) | | | |
/// | `cut` | [`CutData`](FaultKind::CutData) | | | |
/// | `surplus:BYTES` | [`Surplus`](FaultKind::Surplus) | | | |
/// | `close:BYTES` | [`Close`](FaultKind::Close) | | | |
///
/// Numbers are decimal, or hexadecimal with `0x` before them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fault {
    /// Which response is disturbed.
    pub place: FaultPlace,
    /// What happens to it.
    pub kind: FaultKind,
}

impl Fault {
    /// A fault of the response with this number on a connection, from 0.
    pub const fn at_response(response: u64, kind: FaultKind) -> Self {
        Self { place: FaultPlace::Response(response), kind }
    }

    /// A fault of the exchange with this number on a connection, from 0.
    pub const fn at_exchange(exchange: u64, kind: FaultKind) -> Self {
        Self { place: FaultPlace::Exchange(exchange), kind }
    }

    /// A fault of every exchange.
    pub const fn at_each_exchange(kind: FaultKind) -> Self {
        Self { place: FaultPlace::EachExchange, kind }
    }

    /// Errs when it delays a response for too long.
    pub(super) fn check(&self) -> Result<(), Error> {
        match self.kind {
            FaultKind::Delay(time) | FaultKind::Jitter(time) => {
                Error::check_range("fault's delay in ms", time.as_millis(), DELAYS)
            }
            _ => Ok(()),
        }
    }
}

/// Which response of a connection a fault disturbs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum FaultPlace {
    /// The response with this number, from 0, which usually is QueryStatus's.
    Response(u64),
    /// The response to the exchange with this number, simple or compressed, from 0.
    Exchange(u64),
    /// The response to every exchange, where no other fault strikes. Several of these strike
    /// together, in their order.
    EachExchange,
}

/// What happens to a response.
///
/// [`WrongCrc`](Self::WrongCrc), [`ExtraSize`](Self::ExtraSize), [`Mask`](Self::Mask) and
/// [`CutData`](Self::CutData) disturb a compressed exchange; any other response they leave as it
/// is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum FaultKind {
    /// It leaves this much later than it should, at most an hour.
    Delay(Duration),
    /// It leaves later by a random time of at most this, which is at most an hour. The same
    /// [seed](super::SimulatedTxtBuilder::seed) gives the same times.
    Jitter(Duration),
    /// It is not sent; the connection stays open and the next command is answered.
    Silence,
    /// Each byte is sent on its own.
    Dribble,
    /// Its id is not that of any response.
    WrongId,
    /// The announced checksum is not that of the words.
    WrongCrc,
    /// It announces this many bytes of compressed data, whatever follows.
    ExtraSize(u32),
    /// It announces these active extensions, whatever follows.
    Mask(u16),
    /// Only the first half of the compressed data, rounded down, is announced and sent; the
    /// checksum stays as it was.
    CutData,
    /// This many bytes follow that belong to no packet, at most 65536.
    Surplus(usize),
    /// The connection is closed within the response or around it.
    Close {
        /// How many bytes are sent before: 0 none, the response's length or more all of it.
        after: usize,
    },
}
