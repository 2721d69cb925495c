//! What only a turning motor shows: M1, with its encoder at C1. C1 is never reset before a close, because its value
//! in the next session is the measurement.

use std::time::{Duration, Instant};

use ft_transfer_area::transfer_area::Config;
use ft_transfer_area::wire::CommandId;

use super::ends::with_wrong_checksum;
use super::{Check, Found, Needs};
use crate::print::seconds;
use crate::selftest::bench::{Bench, Holds};
use crate::selftest::outcome::{Outcome, Trouble};
use crate::selftest::session::{command, packet, Session};

pub(super) const CHECKS: &[Check] = &[
    Check::new("m1-turns", "M1 turns with the duty 512, and C1 counts its pulses.", turns)
        .needs(Needs::Motors),
    Check::new(
        "m1-distance",
        "At duty 512, a distance of 100 pulses is reported as done, and M1 stops near it (assumed).",
        distance_at_512,
    )
    .needs(Needs::Motors),
    Check::new(
        "m1-distance-half-duty",
        "At duty 256, a distance of 100 pulses is reported as done, and M1 stops near it (assumed).",
        distance_at_256,
    )
    .needs(Needs::Motors),
    Check::new(
        "counter-reset",
        "Each other id resets C1, also one that is 8 further, and is reported when that is done.",
        counter_reset,
    )
    .needs(Needs::Motors),
    Check::new(
        "m1-in-silence",
        "M1 goes on turning while the program is silent (assumed).",
        in_silence,
    )
    .needs(Needs::Motors),
    Check::new(
        "m1-after-a-close",
        "M1 goes on turning after a close, until the next StartOnline (assumed).",
        after_a_close,
    )
    .needs(Needs::Motors),
    Check::new(
        "m1-after-a-wrong-checksum",
        "M1 goes on turning after a wrong checksum, until the next StartOnline (assumed).",
        after_a_wrong_checksum,
    )
    .needs(Needs::Motors),
    Check::new(
        "m1-after-silence",
        "M1 goes on turning after 5 s of silence have closed the connection (assumed).",
        after_silence,
    )
    .needs(Needs::Motors),
    Check::new(
        "m1-after-stop-online",
        "M1 goes on turning after StopOnline without an exchange of zeros (assumed).",
        after_stop_online,
    )
    .needs(Needs::Motors),
];

const FULL: i16 = 512;
const PULSES: u16 = 100;
/// M1 has its full speed after this time, and stands after it.
const SETTLED: Duration = Duration::from_millis(500);
/// How long no program is connected while M1 may go on.
const AWAY: Duration = Duration::from_secs(2);

/// A session in which M1 may turn.
fn drive(bench: &mut Bench) -> Result<&mut Session, Trouble> {
    let session = bench.begin(Holds::I2c)?;
    session.configure(1, Config::default())?;
    session.exchanges(10)?;
    session.obeys_button = true;
    session.exchange()?;
    Ok(session)
}

/// Exchanges for this time.
fn go_on(session: &mut Session, time: Duration) -> Result<(), Trouble> {
    session.until(time, |_| false).map(drop)
}

/// Sets M1's duty and waits until its speed has settled.
fn set(session: &mut Session, duty: i16) -> Result<(), Trouble> {
    session.outputs.duty[0] = duty;
    go_on(session, SETTLED)
}

fn turns(bench: &mut Bench) -> Found {
    let session = drive(bench)?;
    set(session, FULL)?;
    let (begin, before) = (Instant::now(), session.inputs.c1());
    go_on(session, SETTLED)?;
    let speed = pulses(before, session) / begin.elapsed().as_secs_f64();
    let before = session.inputs.c1();
    set(session, 0)?;
    let run_down = pulses(before, session);
    if speed < 10.0 {
        return Ok(Outcome::differs("C1 does not count"));
    }
    bench.speed = Some(speed);
    let seen = format!("{speed:.0} pulses in a second, {run_down} more after duty 0");
    Ok(Outcome::same_if(true, seen).with("pulses_per_second", speed).with("run_down", run_down))
}

/// How many pulses have come since C1 was `before`.
fn pulses(before: i16, session: &Session) -> f64 {
    f64::from(session.inputs.c1().wrapping_sub(before))
}

/// M1's speed, for a check that needs it.
fn speed(bench: &Bench) -> Result<f64, Trouble> {
    bench.speed.ok_or(Trouble::NotTried("M1 does not turn, or its encoder is not at C1"))
}

fn distance_at_512(bench: &mut Bench) -> Found {
    distance(bench, FULL)
}

fn distance_at_256(bench: &mut Bench) -> Found {
    distance(bench, FULL / 2)
}

fn distance(bench: &mut Bench, duty: i16) -> Found {
    speed(bench)?;
    let session = drive(bench)?;
    session.outputs.duty[0] = duty;
    session.outputs.distance[0] = PULSES;
    session.outputs.motor_command_id[0] = 1;
    let back = session.until(Duration::from_secs(5), |inputs| inputs.m1_id() == 1)?;
    let at_id = session.inputs.c1();
    // M1 still has its duty: the controller stops it.
    go_on(session, SETTLED)?;
    let in_the_end = session.inputs.c1();
    set(session, 0)?;
    let Some((time, _)) = back else {
        return Ok(Outcome::differs(format!("the id is not back after 5 s, at pulse {at_id}")));
    };
    let is_same = (95..150).contains(&in_the_end);
    let seen = format!("id back after {} at pulse {at_id}, stands at {in_the_end}", seconds(time));
    let outcome = Outcome::same_if(is_same, seen).with_time("id_back_ms", time);
    Ok(outcome.with("pulse_at_id", at_id).with("pulse_in_the_end", in_the_end))
}

fn counter_reset(bench: &mut Bench) -> Found {
    speed(bench)?;
    let session = drive(bench)?;
    let mut is_same = true;
    let mut seen = Vec::new();
    for id in [8, 9] {
        set(session, FULL)?;
        set(session, 0)?;
        let before = session.inputs.c1();
        session.outputs.counter_reset_id[0] = id;
        let back = session.until(Duration::from_secs(1), |inputs| inputs.c1_reset_id() == id)?;
        let after = session.inputs.c1();
        is_same &= back.is_some() && before != 0 && after == 0;
        let done = if back.is_some() { "back" } else { "not back" };
        seen.push(format!("id {id} is {done}, C1 was {before} and is {after}"));
    }
    Ok(Outcome::same_if(is_same, seen.join("; ")))
}

fn in_silence(bench: &mut Bench) -> Found {
    let speed = speed(bench)?;
    let session = drive(bench)?;
    set(session, FULL)?;
    let (begin, before) = (Instant::now(), session.inputs.c1());
    session.main.hear(1, Duration::from_secs(3))?;
    session.outputs.duty[0] = 0;
    // Its answer has the pulses until now.
    session.exchange()?;
    let outcome = turned(pulses(before, session) / speed, begin.elapsed());
    set(session, 0)?;
    Ok(outcome)
}

/// M1 has turned for this number of seconds while no program was connected.
fn turned(seconds: f64, of: Duration) -> Outcome {
    let of = of.as_secs_f64();
    let went_on = seconds > 0.85 * of;
    let seen = if went_on {
        format!("M1 turned all the {of:.1} s")
    } else {
        format!("M1 stopped after {seconds:.2} s")
    };
    Outcome::same_if(went_on, seen).with("turned_s", seconds).with("of_s", of)
}

fn after_a_close(bench: &mut Bench) -> Found {
    after(bench, |_| Ok(()))
}

fn after_a_wrong_checksum(bench: &mut Bench) -> Found {
    after(bench, |session| {
        let request = with_wrong_checksum(session.request(session.inputs.extensions));
        session.main.send(&request)?;
        session.main.hear(1, Duration::from_secs(1)).map(drop)
    })
}

fn after_silence(bench: &mut Bench) -> Found {
    after(bench, |session| session.main.hear(1, Duration::from_secs(8)).map(drop))
}

fn after_stop_online(bench: &mut Bench) -> Found {
    after(bench, |session| {
        session.i2c = None;
        let request = packet(CommandId::StopOnline);
        command(&mut session.main, CommandId::StopOnline, &request).map(drop)
    })
}

/// Lets M1 turn, ends the session this way, and measures at the beginning of the next one how long M1 went on.
fn after(bench: &mut Bench, end: fn(&mut Session) -> Result<(), Trouble>) -> Found {
    let speed = speed(bench)?;
    let session = drive(bench)?;
    set(session, FULL)?;
    let (begin, before) = (Instant::now(), session.inputs.c1());
    end(session)?;
    bench.drop_session();
    bench.pause(AWAY)?;
    let away = begin.elapsed();
    let session = bench.begin(Holds::I2c)?;
    session.exchange()?;
    let after = session.inputs.c1();
    if after < before {
        let why = format!("StartOnline has reset C1: it was {before}, and is {after}");
        return Ok(Outcome::not_tried(why));
    }
    Ok(turned(pulses(before, session) / speed, away))
}
