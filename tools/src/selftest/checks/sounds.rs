//! Sounds. They are short, and each one has ended when its check has.

use std::ops::Range;
use std::time::Duration;

use ft_transfer_area::transfer_area::Config;
use ft_transfer_area::wire::CommandId;

use super::{Check, Found};
use crate::print::seconds;
use crate::selftest::bench::{Bench, Holds};
use crate::selftest::outcome::{Outcome, Trouble};
use crate::selftest::session::{command, packet, Session};

pub(super) const CHECKS: &[Check] = &[
    // First, because the session of the others is long enough for the check of an I2C pause.
    Check::new(
        "sound-after-stop-online",
        "A sound plays on after StopOnline and the next StartOnline, until index 0 ends it.",
        after_stop_online,
    ),
    Check::new("sound", "The id of a sound is reported as done when the sound has ended.", once),
    Check::new("sound-repeat-0", "Repeat 0 plays a sound once, like 1.", repeat_0),
    Check::new("sound-repeat-2", "Repeat 2 plays a sound twice.", repeat_2),
    Check::new(
        "sound-while-playing",
        "A sound that begins while another one plays is reported as done at once, but not each time.",
        while_playing,
    ),
    Check::new("sound-ended", "Index 0 ends a sound, and is reported as done at once.", ended),
    Check::new(
        "sound-0-in-silence",
        "Index 0 is not reported as done when nothing plays.",
        in_silence,
    ),
    Check::new(
        "sound-without-file",
        "An index that has no sound is not reported as done.",
        without_file,
    ),
];

/// A short sound, and a longer one.
const SHORT: u16 = 6;
const LONGER: u16 = 24;
/// No controller has so many.
const MISSING: u16 = 99;

/// A short sound is over by then.
const OVER: Duration = Duration::from_secs(4);
/// After this time an id is not reported as done any more.
const NEVER: Duration = Duration::from_millis(800);
/// This number of exchanges is at once.
const AT_ONCE: usize = 3;

/// Sends a sound command, and waits for its id.
fn play(
    session: &mut Session,
    index: u16,
    repeat: u16,
    limit: Duration,
) -> Result<Option<(Duration, usize)>, Trouble> {
    begin(session, index, repeat);
    let id = session.outputs.sound_command_id;
    let back = session.until(limit, |inputs| inputs.sound_id() == id)?;
    session.is_playing &= back.is_none();
    Ok(back)
}

/// Sends a sound command with the next exchange.
fn begin(session: &mut Session, index: u16, repeat: u16) {
    session.outputs.sound_command_id = session.outputs.sound_command_id.wrapping_add(1);
    session.outputs.sound_index = index;
    session.outputs.sound_repeat = repeat;
    session.is_playing = true;
}

/// Ends what plays.
fn be_silent(session: &mut Session) -> Result<(), Trouble> {
    begin(session, 0, 0);
    session.exchanges(AT_ONCE)?;
    session.is_playing = false;
    Ok(())
}

fn once(bench: &mut Bench) -> Found {
    let session = bench.online()?;
    let Some((time, _)) = play(session, SHORT, 1, OVER)? else {
        be_silent(session)?;
        return Ok(Outcome::differs("it is not reported as done"));
    };
    // It has a length, which is known for the maker's file only.
    let is_same = time > Duration::from_millis(100);
    bench.sound = Some(time);
    Ok(Outcome::same_if(is_same, seconds(time)).with_time("ms", time))
}

fn repeat_0(bench: &mut Bench) -> Found {
    compare_with_once(bench, 0, 0.5..1.6)
}

fn repeat_2(bench: &mut Bench) -> Found {
    compare_with_once(bench, 2, 1.6..3.0)
}

/// Plays a sound once, then with this repeat: how many times as long that may take.
fn compare_with_once(bench: &mut Bench, repeat: u16, times: Range<f64>) -> Found {
    let once = bench.sound;
    let once = once.ok_or(Trouble::NotTried("a sound that plays once is not reported as done"))?;
    let session = bench.online()?;
    let Some((time, _)) = play(session, SHORT, repeat, OVER)? else {
        be_silent(session)?;
        return Ok(Outcome::differs(format!("it plays for more than {}", seconds(OVER))));
    };
    let ratio = time.as_secs_f64() / once.as_secs_f64();
    let is_same = times.contains(&ratio);
    let seen = format!("{}; once is {}", seconds(time), seconds(once));
    Ok(Outcome::same_if(is_same, seen).with_time("ms", time).with_time("once_ms", once))
}

fn while_playing(bench: &mut Bench) -> Found {
    const TRIES: usize = 4;

    let session = bench.online()?;
    let mut at_once = 0;
    for _ in 0..TRIES {
        begin(session, LONGER, 2);
        session.exchanges(10)?;
        let back = play(session, SHORT, 1, OVER)?;
        at_once += usize::from(back.is_some_and(|(_, count)| count <= AT_ONCE));
        be_silent(session)?;
    }
    let seen = format!("{at_once} of {TRIES} at once");
    Ok(Outcome::same_if(at_once > 0, seen).with("at_once", at_once))
}

fn ended(bench: &mut Bench) -> Found {
    let session = bench.online()?;
    begin(session, LONGER, 2);
    session.exchanges(10)?;
    let back = play(session, 0, 0, OVER)?;
    be_silent(session)?;
    Ok(came_back_at_once(back))
}

fn came_back_at_once(back: Option<(Duration, usize)>) -> Outcome {
    match back {
        Some((_, count)) if count <= AT_ONCE => {
            Outcome::same_if(true, format!("with answer {count}")).with("answers", count)
        }
        Some((time, _)) => Outcome::differs(format!("after {}", seconds(time))),
        None => Outcome::differs(format!("not within {}", seconds(OVER))),
    }
}

fn in_silence(bench: &mut Bench) -> Found {
    never_back(bench, 0)
}

fn without_file(bench: &mut Bench) -> Found {
    never_back(bench, MISSING)
}

fn never_back(bench: &mut Bench, index: u16) -> Found {
    let session = bench.online()?;
    let back = play(session, index, 1, NEVER)?;
    session.is_playing = false;
    Ok(match back {
        None => Outcome::same_if(true, format!("not within {}", seconds(NEVER))),
        Some((time, _)) => Outcome::differs(format!("back after {}", seconds(time))),
    })
}

fn after_stop_online(bench: &mut Bench) -> Found {
    let session = bench.online()?;
    begin(session, LONGER, 9);
    session.exchanges(AT_ONCE)?;
    session.i2c = None;
    command(&mut session.main, CommandId::StopOnline, &packet(CommandId::StopOnline))?;
    bench.drop_session();
    let session = bench.begin(Holds::I2c)?;
    session.configure(1, Config::default())?;
    // Its id is reported as done only when there is a sound to end.
    let back = play(session, 0, 0, NEVER)?;
    Ok(match back {
        Some(_) => came_back_at_once(back),
        None => Outcome::differs("it has ended"),
    })
}
