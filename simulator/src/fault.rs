//! Faults that can be injected.

use std::fmt;
use std::ops::RangeInclusive;
use std::str::FromStr;
use std::time::Duration;

use crate::error::Error;

/// By how many ms a response may be delayed: up to an hour. During the delay no other client is
/// served.
pub(super) const DELAYS: RangeInclusive<i64> = 0..=3_600_000;

/// A fault that is injected into the responses of the simulated TXT.
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
            FaultKind::Silence
            | FaultKind::Dribble
            | FaultKind::WrongId
            | FaultKind::WrongCrc
            | FaultKind::ExtraSize(_)
            | FaultKind::Mask(_)
            | FaultKind::CutData
            | FaultKind::Surplus(_)
            | FaultKind::Close { .. } => Ok(()),
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

/// Why a text is not a [`Fault`]: one sentence that says what was given and what was expected.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ParseFaultError(String);

impl fmt::Display for ParseFaultError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for ParseFaultError {}

impl FromStr for Fault {
    type Err = ParseFaultError;

    /// Reads `WHAT@WHERE`; the table is at [`Fault`].
    fn from_str(text: &str) -> Result<Self, ParseFaultError> {
        let (what, place) = text.split_once('@').ok_or_else(|| {
            error(format!(
                "{text:?} is not a fault: WHAT@WHERE is expected, such as crc@exchange:100"
            ))
        })?;
        Ok(Self { place: parse_place(place)?, kind: parse_kind(what)? })
    }
}

fn error(sentence: String) -> ParseFaultError {
    ParseFaultError(sentence)
}

fn parse_place(text: &str) -> Result<FaultPlace, ParseFaultError> {
    match text.split_once(':') {
        Some(("exchange", "each")) => Ok(FaultPlace::EachExchange),
        Some(("exchange", number)) => Ok(FaultPlace::Exchange(parse_number(text, number)?)),
        Some(("response", number)) => Ok(FaultPlace::Response(parse_number(text, number)?)),
        _ => Err(error(format!(
            "a fault can't strike at {text:?}: response:N, exchange:N or exchange:each is expected"
        ))),
    }
}

fn parse_kind(text: &str) -> Result<FaultKind, ParseFaultError> {
    let kind = match text {
        "silence" => FaultKind::Silence,
        "dribble" => FaultKind::Dribble,
        "id" => FaultKind::WrongId,
        "crc" => FaultKind::WrongCrc,
        "cut" => FaultKind::CutData,
        _ => parse_kind_with_number(text)?,
    };
    Ok(kind)
}

fn parse_kind_with_number(text: &str) -> Result<FaultKind, ParseFaultError> {
    let (name, number) = text.split_once(':').unwrap_or((text, ""));
    let kind = match name {
        "delay" => FaultKind::Delay(parse_delay(text, number)?),
        "jitter" => FaultKind::Jitter(parse_delay(text, number)?),
        "size" => FaultKind::ExtraSize(parse_number(text, number)?),
        "mask" => FaultKind::Mask(parse_number(text, number)?),
        "surplus" => FaultKind::Surplus(parse_number(text, number)?),
        "close" => FaultKind::Close { after: parse_number(text, number)? },
        _ => {
            return Err(error(format!(
                "there is no fault {text:?}: delay:MS, jitter:MS, silence, dribble, id, crc, \
                 size:BYTES, mask:BITS, cut, surplus:BYTES or close:BYTES is expected"
            )))
        }
    };
    Ok(kind)
}

fn parse_delay(whole: &str, number: &str) -> Result<Duration, ParseFaultError> {
    let millis: u64 = parse_number(whole, number)?;
    match i64::try_from(millis) {
        Ok(delay) if DELAYS.contains(&delay) => Ok(Duration::from_millis(millis)),
        _ => Err(error(format!(
            "{whole:?} is too long: {} to {} ms are expected",
            DELAYS.start(),
            DELAYS.end()
        ))),
    }
}

/// A decimal number, or a hexadecimal one after `0x`, as part of the whole text.
fn parse_number<T: TryFrom<u64>>(whole: &str, number: &str) -> Result<T, ParseFaultError> {
    // from_str_radix accepts a sign, which is not a digit.
    let digits = |digits: &str, radix| match digits.starts_with('+') {
        true => None,
        false => u64::from_str_radix(digits, radix).ok(),
    };
    let value = match number.strip_prefix("0x") {
        Some(hexadecimal) => digits(hexadecimal, 16),
        None => digits(number, 10),
    };
    value.and_then(|value| T::try_from(value).ok()).ok_or_else(|| {
        error(format!(
            "{number:?} in {whole:?} is not a number that fits there, such as 20 or 0x14"
        ))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<Fault, ParseFaultError> {
        text.parse()
    }

    #[test]
    fn every_kind_and_place_has_a_text() {
        let ms = Duration::from_millis;
        for (text, fault) in [
            ("delay:20@exchange:3", Fault::at_exchange(3, FaultKind::Delay(ms(20)))),
            ("delay:3600000@exchange:3", Fault::at_exchange(3, FaultKind::Delay(ms(3_600_000)))),
            ("jitter:7@exchange:each", Fault::at_each_exchange(FaultKind::Jitter(ms(7)))),
            ("silence@response:0", Fault::at_response(0, FaultKind::Silence)),
            ("dribble@response:1", Fault::at_response(1, FaultKind::Dribble)),
            ("id@response:2", Fault::at_response(2, FaultKind::WrongId)),
            ("crc@exchange:100", Fault::at_exchange(100, FaultKind::WrongCrc)),
            ("size:0xFFFFFFFF@exchange:0", Fault::at_exchange(0, FaultKind::ExtraSize(u32::MAX))),
            ("mask:0x0003@exchange:1", Fault::at_exchange(1, FaultKind::Mask(3))),
            ("cut@exchange:1", Fault::at_exchange(1, FaultKind::CutData)),
            ("surplus:5@response:3", Fault::at_response(3, FaultKind::Surplus(5))),
            ("close:5@response:3", Fault::at_response(3, FaultKind::Close { after: 5 })),
        ] {
            assert_eq!(parse(text), Ok(fault), "{text}");
        }
    }

    #[test]
    fn another_text_is_refused_in_a_sentence_that_helps() {
        for (text, part) in [
            ("", "WHAT@WHERE is expected"),
            ("crc", "WHAT@WHERE is expected"),
            ("crc@", "can't strike at \"\""),
            ("crc@cycle:3", "exchange:each is expected"),
            ("crc@exchange:", "\"\" in \"exchange:\" is not a number"),
            ("crc@exchange:-1", "\"-1\" in \"exchange:-1\" is not a number"),
            ("crc@exchange:+1", "\"+1\" in \"exchange:+1\" is not a number"),
            ("crc:1@exchange:1", "there is no fault \"crc:1\""),
            ("delay@exchange:1", "\"\" in \"delay\" is not a number"),
            ("mask:65536@exchange:1", "\"65536\" in \"mask:65536\" is not a number that fits"),
            ("delay:3600001@exchange:1", "\"delay:3600001\" is too long: 0 to 3600000 ms"),
            ("jitter:0xFFFFFFFFFFFFFFFF@exchange:each", "is too long: 0 to 3600000 ms"),
            ("fire@exchange:1", "there is no fault \"fire\": delay:MS"),
        ] {
            let message = parse(text).unwrap_err().to_string();
            assert!(message.contains(part), "{text}: {message}");
        }
    }
}
