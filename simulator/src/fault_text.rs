//! Faults as text.

use std::fmt;
use std::str::FromStr;
use std::time::Duration;

use crate::fault::{Fault, FaultKind, FaultPlace, DELAYS};

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
            error(format!("{text:?} is no fault: WHAT@WHERE is expected, such as crc@exchange:100"))
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
        error(format!("{number:?} in {whole:?} is no number that fits there, such as 20 or 0x14"))
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
            ("crc@exchange:", "\"\" in \"exchange:\" is no number"),
            ("crc@exchange:-1", "\"-1\" in \"exchange:-1\" is no number"),
            ("crc@exchange:+1", "\"+1\" in \"exchange:+1\" is no number"),
            ("crc:1@exchange:1", "there is no fault \"crc:1\""),
            ("delay@exchange:1", "\"\" in \"delay\" is no number"),
            ("mask:65536@exchange:1", "\"65536\" in \"mask:65536\" is no number that fits"),
            ("delay:3600001@exchange:1", "\"delay:3600001\" is too long: 0 to 3600000 ms"),
            ("jitter:0xFFFFFFFFFFFFFFFF@exchange:each", "is too long: 0 to 3600000 ms"),
            ("fire@exchange:1", "there is no fault \"fire\": delay:MS"),
        ] {
            let message = parse(text).unwrap_err().to_string();
            assert!(message.contains(part), "{text}: {message}");
        }
    }
}
