//! The I2C port. What is written to a device is only the number of a register to read from.

use std::time::Duration;

use ft_transfer_area::wire::I2cRequestHeader;

use super::{Check, Found};
use crate::print::seconds;
use crate::seen;
use crate::selftest::bench::{Bench, Holds};
use crate::selftest::i2c::{request, I2c, I2cAnswer};
use crate::selftest::line::{Heard, Line};
use crate::selftest::outcome::{Outcome, Trouble};
use crate::selftest::session::Session;

pub(super) const CHECKS: &[Check] = &[
    Check::new("i2c", "The I2C port accepts a connection right after StartOnline.", connects),
    // First, because the sounds before it were such a pause.
    Check::new(
        "i2c-pause",
        "Requests for nothing keep the connection open for longer than 5 s.",
        pause,
    ),
    Check::new(
        "i2c-nothing",
        "A request that neither writes nor reads is answered by the id and 8 bytes 0.",
        nothing,
    ),
    Check::new(
        "i2c-missing-device",
        "A missing device is answered at once by the id and 8 bytes 0.",
        missing_device,
    ),
    Check::new(
        "i2c-long-read",
        "A device's 300 and 1024 bytes are read, and no more than 1024.",
        long_read,
    ),
    Check::new(
        "i2c-second-connection",
        "A second I2C connection gets no answer.",
        second_connection,
    ),
    Check::new(
        "i2c-long-write",
        "A request to write 1025 bytes closes the connection.",
        long_write,
    ),
    Check::new(
        "i2c-wrong-length",
        "A request with another number of bytes than is to be written closes the connection.",
        wrong_length,
    ),
    Check::new(
        "i2c-once",
        "When the I2C connection is closed, others are refused until the next StartOnline.",
        once,
    ),
    Check::new("i2c-silence", "Silence closes the I2C connection after 5 s.", silence),
    Check::new(
        "i2c-late",
        "More than 5 s after StartOnline, the I2C port refuses a connection.",
        late,
    ),
];

/// Where devices of fischertechnik and others are: some have registers, and a read changes nothing in them.
const DEVICES: [u8; 6] = [0x18, 0x10, 0x68, 0x76, 0x77, 0x39];
/// Where no common device is.
const MISSING: [u8; 3] = [0x0B, 0x2B, 0x5B];
/// What comes for no device.
const FAILED: [u8; 12] = [0x87, 0xFD, 0x0D, 0x90, 0, 0, 0, 0, 0, 0, 0, 0];

fn connects(bench: &mut Bench) -> Found {
    let is_there = bench.online()?.i2c.is_some();
    Ok(Outcome::same_if(is_there, if is_there { "" } else { "it refuses" }))
}

fn nothing(bench: &mut Bench) -> Found {
    let i2c = bench.online()?.i2c()?;
    Ok(failed(&i2c.transact(0, &[], 0)?))
}

fn missing_device(bench: &mut Bench) -> Found {
    let i2c = bench.online()?.i2c()?;
    for device in MISSING {
        let begin = std::time::Instant::now();
        let answer = i2c.transact(device, &[], 1)?;
        if matches!(answer, I2cAnswer::Failed(_)) {
            return Ok(failed(&answer).with_time("ms", begin.elapsed()));
        }
    }
    Err(Trouble::NotTried("each address that was tried has a device"))
}

fn failed(answer: &I2cAnswer) -> Outcome {
    match answer {
        I2cAnswer::Failed(bytes) if *bytes == FAILED => Outcome::same_if(true, ""),
        I2cAnswer::Failed(bytes) => Outcome::differs(format!("{bytes:02x?}")),
        I2cAnswer::Read(bytes) => Outcome::differs(format!("success, with {} bytes", bytes.len())),
    }
}

fn long_read(bench: &mut Bench) -> Found {
    let session = bench.online()?;
    let i2c = session.i2c()?;
    let mut device = None;
    for address in DEVICES {
        if matches!(i2c.transact(address, &[0], 1)?, I2cAnswer::Read(_)) {
            device = Some(address);
            break;
        }
    }
    let Some(device) = device else {
        return Err(Trouble::NotTried("no known I2C device answers"));
    };
    let mut lengths = Vec::new();
    for wanted in [300, 1024, 1025] {
        // The main connection must not be silent meanwhile.
        session.exchange()?;
        let i2c = session.i2c()?;
        lengths.push(match i2c.transact(device, &[0], wanted)? {
            I2cAnswer::Read(bytes) => bytes.len(),
            I2cAnswer::Failed(_) => 0,
        });
    }
    let seen = format!("{lengths:?} bytes from device 0x{device:02x}");
    Ok(Outcome::same_if(lengths == [300, 1024, 1024], seen).with("device", device))
}

fn i2c_line(bench: &Bench) -> Result<Option<Line>, Trouble> {
    bench.connect(seen::Line::I2c)
}

fn second_connection(bench: &mut Bench) -> Found {
    bench.online()?.i2c()?;
    let Some(mut second) = i2c_line(bench)? else { return Ok(Outcome::differs("it is refused")) };
    second.send(&request(0, &[], 0))?;
    Ok(match second.hear(1, Duration::from_millis(300))? {
        Heard::Silence => Outcome::same_if(true, ""),
        Heard::Closed => Outcome::differs("it is closed"),
        Heard::Bytes(_) => Outcome::differs("it is answered"),
    })
}

fn pause(bench: &mut Bench) -> Found {
    const LONG: Duration = Duration::from_secs(6);

    let session = bench.online()?;
    session.i2c()?;
    let is_kept = |session: &Session| session.i2c.as_ref().is_some_and(|i2c| i2c.kept >= LONG);
    while !is_kept(session) {
        session.exchange()?;
    }
    let i2c = session.i2c()?;
    i2c.transact(0, &[], 0)?;
    Ok(Outcome::same_if(true, format!("{} and more", seconds(LONG))))
}

fn long_write(bench: &mut Bench) -> Found {
    closes_on(bench, &request(MISSING[0], &[0; 1025], 0))
}

fn wrong_length(bench: &mut Bench) -> Found {
    let header = I2cRequestHeader { data_len: 2, device: MISSING[0], write_len: 1, read_len: 1 };
    let mut request = Vec::new();
    header.emit(&mut request);
    request.extend([0; 2]);
    closes_on(bench, &request)
}

/// The controller is expected to close the I2C connection after this request.
fn closes_on(bench: &mut Bench, request: &[u8]) -> Found {
    let session = bench.begin(Holds::I2c)?;
    let I2c { line, .. } = session.i2c()?;
    line.send(request)?;
    let outcome = super::commands::closes(line)?;
    session.i2c = None;
    bench.end()?;
    Ok(outcome)
}

fn once(bench: &mut Bench) -> Found {
    let session = bench.begin(Holds::I2c)?;
    session.i2c()?.transact(0, &[], 0)?;
    session.i2c = None;
    session.exchanges(5)?;
    let again = i2c_line(bench)?.is_some();
    bench.end()?;
    Ok(refused(again))
}

fn refused(is_accepted: bool) -> Outcome {
    Outcome::same_if(!is_accepted, if is_accepted { "it accepts another one" } else { "" })
}

fn silence(bench: &mut Bench) -> Found {
    const LIMIT: Duration = Duration::from_secs(8);

    let session = bench.begin(Holds::I2c)?;
    session.i2c()?.is_kept = false;
    let mut closed = None;
    while closed.is_none() && session.began.elapsed() < LIMIT {
        session.exchange()?;
        if session.i2c()?.is_closed_within(Duration::from_millis(1))? {
            closed = Some(session.began.elapsed());
        }
    }
    session.i2c = None;
    bench.end()?;
    Ok(closes_after_5_s(closed, LIMIT))
}

/// The firmware looks for silence from time to time.
pub(super) fn closes_after_5_s(closed: Option<Duration>, limit: Duration) -> Outcome {
    match closed {
        Some(time) => {
            let is_same = (4.8..6.5).contains(&time.as_secs_f64());
            Outcome::same_if(is_same, format!("after {}", seconds(time))).with_time("ms", time)
        }
        None => Outcome::differs(format!("it is open after {}", seconds(limit))),
    }
}

fn late(bench: &mut Bench) -> Found {
    bench.needs_i2c()?;
    let session = bench.begin(Holds::Nothing)?;
    while session.began.elapsed() < Duration::from_millis(5_600) {
        session.exchange()?;
    }
    let late = i2c_line(bench)?.is_some();
    bench.end()?;
    Ok(refused(late))
}
