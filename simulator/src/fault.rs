//! Faults that can be ordered.

use std::ops::RangeInclusive;
use std::time::Duration;

use crate::error::Error;

/// By how many ms a response may be delayed: up to an hour. During the delay no other client is
/// served.
pub(super) const DELAYS: RangeInclusive<i64> = 0..=3_600_000;

/// A fault that the simulated TXT makes when ordered.
///
/// Each strikes once in the life of the simulated TXT, except those for [each
/// exchange](FaultPlace::EachExchange). Of several faults for the same response, the first strikes
/// the first connection that gets to this response, the second the next one, and so on.
///
/// A fault can be written as text, `WHAT@WHERE`, as for the command `txt simulate`:
///
/// ```
/// use ft_transfer_area_simulator::{Fault, FaultKind};
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
#[non_exhaustive]
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

    /// An error when it delays a response for too long.
    pub(super) fn check(&self) -> Result<(), Error> {
        match self.kind {
            FaultKind::Delay(time) | FaultKind::Jitter(time) => {
                Error::check_millis("fault's delay in ms", time, DELAYS)
            }
            _ => Ok(()),
        }
    }
}

/// Which response of a connection a fault disturbs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum FaultPlace {
    /// The response with this number. Number 0 is usually the response to QueryStatus.
    Response(u64),
    /// The response to the exchange with this number, simple or compressed, from 0.
    Exchange(u64),
    /// The response to every exchange that no other fault strikes. Several of these strike together,
    /// in their order.
    EachExchange,
}

/// What happens to a response.
///
/// [`WrongCrc`](Self::WrongCrc), [`ExtraSize`](Self::ExtraSize), [`Mask`](Self::Mask) and
/// [`CutData`](Self::CutData) disturb a compressed exchange; they do not change other responses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum FaultKind {
    /// It is sent this much later, at most an hour.
    Delay(Duration),
    /// It is sent later by a random time up to this, at most an hour. The same
    /// [seed](super::SimulatedTxtBuilder::seed) gives the same times.
    Jitter(Duration),
    /// It is not sent; the connection stays open and the next command is answered.
    Silence,
    /// Each byte is sent on its own.
    Dribble,
    /// Its id is not the id of any response.
    WrongId,
    /// The announced checksum is not that of the words.
    WrongCrc,
    /// It announces this many bytes of compressed data, but the data stay the same.
    ExtraSize(u32),
    /// It announces these active extensions, but the data stay the same.
    Mask(u16),
    /// Only the first half of the compressed data, rounded down, is announced and sent; the
    /// checksum stays the same.
    CutData,
    /// It is followed by this many bytes that belong to no packet, at most 65536.
    Surplus(usize),
    /// The connection is closed before, within or after the response.
    Close {
        /// How many bytes of the response are sent before; with its length or more, all of it.
        after: usize,
    },
}
