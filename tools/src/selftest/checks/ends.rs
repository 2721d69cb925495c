//! What ends online mode, and who else is served.

use std::time::{Duration, Instant};

use ft_transfer_area::wire::{CommandId, QueryStatusResponse};

use super::i2c::closes_after_5_s;
use super::{Check, Found};
use crate::seen;
use crate::selftest::bench::{Bench, Holds};
use crate::selftest::line::{Heard, LIMIT};
use crate::selftest::outcome::Outcome;
use crate::selftest::session::packet;

pub(super) const CHECKS: &[Check] = &[
    Check::new(
        "second-client",
        "A second client connects, and is answered when the first one has ended.",
        second_client,
    ),
    Check::new(
        "wrong-checksum",
        "A compressed exchange with a wrong checksum closes the connection.",
        wrong_checksum,
    ),
    Check::new("silence", "Silence closes the main connection after 5 s.", silence),
];

fn second_client(bench: &mut Bench) -> Found {
    bench.online()?.exchange()?;
    let Some(mut second) = bench.connect(seen::Line::Main)? else {
        return Ok(Outcome::differs("it is refused"));
    };
    second.send(&packet(CommandId::QueryStatus))?;
    bench.online()?.exchanges(30)?;
    match second.hear(1, Duration::from_millis(50))? {
        Heard::Silence => {}
        Heard::Closed => return Ok(Outcome::differs("it is closed at once")),
        Heard::Bytes(_) => return Ok(Outcome::differs("it is answered at once")),
    }
    bench.end()?;
    Ok(match second.hear(QueryStatusResponse::LEN, LIMIT)? {
        Heard::Bytes(_) => Outcome::same_if(true, ""),
        Heard::Closed => Outcome::differs("it is closed in the end"),
        Heard::Silence => Outcome::differs("it is never answered"),
    })
}

/// A compressed exchange that says another checksum.
pub(super) fn with_wrong_checksum(mut request: Vec<u8>) -> Vec<u8> {
    request[8] ^= 1;
    request
}

fn wrong_checksum(bench: &mut Bench) -> Found {
    let session = bench.online()?;
    session.exchange()?;
    let extensions = session.inputs.extensions;
    let request = with_wrong_checksum(session.request(extensions));
    session.main.send(&request)?;
    let outcome = super::commands::closes(&mut session.main)?;
    bench.drop_session();
    Ok(outcome)
}

fn silence(bench: &mut Bench) -> Found {
    const SILENCE: Duration = Duration::from_secs(8);

    let session = bench.begin(Holds::I2c)?;
    session.exchange()?;
    let begin = Instant::now();
    let closed = match session.main.hear(1, SILENCE)? {
        Heard::Closed => Some(begin.elapsed()),
        _ => None,
    };
    bench.drop_session();
    Ok(closes_after_5_s(closed, SILENCE))
}
