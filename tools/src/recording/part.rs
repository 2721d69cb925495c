//! Which part of a recording is meant.

use std::ops::Range;
use std::path::Path;
use std::time::Duration;

use anyhow::{bail, ensure, Context};
use ft_transfer_area_recorder::Recording;
use jiff::civil;
use jiff::fmt::strtime;
use jiff::tz::Offset;

use super::clock::{offset_text, Clock};
use super::survey::Survey;

/// How much is shown before and after a moment.
const AROUND: Duration = Duration::from_secs(10);

/// The options of a command.
#[derive(clap::Args)]
pub(crate) struct Part {
    /// Begin at this second of the recording, as in 12.5, or at this time of day, as in 03:12
    #[arg(long, value_name = "TIME", value_parser = time)]
    from: Option<Time>,
    /// End at this second, or at this time of day [default: its end]
    #[arg(long, value_name = "TIME", value_parser = time)]
    to: Option<Time>,
    /// From 10 s before this second or time of day to 10 s after it
    #[arg(long, value_name = "TIME", value_parser = time, conflicts_with_all = ["from", "to"])]
    around: Option<Time>,
    /// From 10 s before an unusual moment to 10 s after it, by its number in txt info
    #[arg(long, value_name = "NUMBER", conflicts_with_all = ["from", "to", "around"])]
    unusual: Option<usize>,
}

/// A time in a recording.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Time {
    Since(Duration),
    /// Of the clock on the wall, perhaps with the offset of one of two that a night has.
    OfDay(civil::Time, Option<Offset>),
}

fn time(text: &str) -> Result<Time, &'static str> {
    const EXPECTED: &str =
        "seconds are expected, 0 or more, such as 12.5, or a time of day, such as 03:12 or 03:12:30";
    let time = if text.contains(':') {
        let (text, offset) = text.split_at(text.find(['+', '-']).unwrap_or(text.len()));
        let is_time = text.chars().all(|one| one.is_ascii_digit() || ":.".contains(one));
        let hours = if text.find(':') == Some(1) { "0" } else { "" };
        let time = format!("{hours}{text}").parse().ok().filter(|_| is_time);
        let offset = Some(offset).filter(|offset| !offset.is_empty());
        match offset.map(|offset| strtime::parse("%:z", offset).ok().and_then(|all| all.offset())) {
            None => time.map(|time| Time::OfDay(time, None)),
            Some(offset) => time.zip(offset).map(|(time, offset)| Time::OfDay(time, Some(offset))),
        }
    } else {
        let seconds = text.parse().ok();
        seconds.and_then(|one| Duration::try_from_secs_f64(one).ok()).map(Time::Since)
    };
    time.ok_or(EXPECTED)
}

impl Part {
    /// Whether it is all of the recording.
    pub(super) fn is_all(&self) -> bool {
        self.from.or(self.to).or(self.around).is_none() && self.unusual.is_none()
    }

    /// From when to when it is. Only a part that needs to know what is in the recording has it read for that.
    pub(super) fn of(
        &self,
        recording: &mut Recording,
        path: &Path,
    ) -> anyhow::Result<Range<Duration>> {
        let of_day = |time: Option<Time>| matches!(time, Some(Time::OfDay(..)));
        let times = [self.from, self.to, self.around];
        if times.into_iter().any(of_day) || self.unusual.is_some() {
            let survey = Survey::of(recording, path)?;
            recording.rewind()?;
            return self.within(&survey);
        }
        self.within(&Survey::default())
    }

    /// From when to when it is in a recording that was surveyed.
    pub(super) fn within(&self, survey: &Survey) -> anyhow::Result<Range<Duration>> {
        let around = match (self.around, self.unusual) {
            (Some(time), _) => Some(find(time, Duration::ZERO, survey)?),
            (None, Some(number)) => Some(unusual(number, survey)?),
            (None, None) => None,
        };
        if let Some(at) = around {
            return Ok(at.saturating_sub(AROUND)..at.saturating_add(AROUND));
        }
        let from =
            self.from.map_or(Ok(Duration::ZERO), |time| find(time, Duration::ZERO, survey))?;
        let to = self.to.map_or(Ok(Duration::MAX), |time| find(time, from, survey))?;
        ensure!(from < to, "--from has to be before --to");
        Ok(from..to)
    }
}

/// When this unusual moment was.
fn unusual(number: usize, survey: &Survey) -> anyhow::Result<Duration> {
    let found = survey.unusual.iter().find(|moment| moment.number == number);
    found.map(|moment| moment.at).with_context(|| match survey.unusual.len() {
        0 => "nothing unusual is in the recording".to_owned(),
        count => format!("txt info lists unusual moments of the recording by 1 to {count}"),
    })
}

/// When it is this time, from then on.
fn find(time: Time, from: Duration, survey: &Survey) -> anyhow::Result<Duration> {
    let (time, offset) = match time {
        Time::Since(time) => return Ok(time),
        Time::OfDay(time, offset) => (time, offset),
    };
    let (clock, end) = (&survey.clock, survey.length);
    let wanted = format!("{time}{}", offset.map(offset_text).unwrap_or_default());
    match clock.next(time, offset, from) {
        Some(at) if at <= end => {
            if let Some(choice) = choice(time, offset, at, clock) {
                eprintln!("{choice}");
            }
            Ok(at)
        }
        _ if from.is_zero() => bail!(
            "{wanted} is not in the recording, which lasts from {} to {}",
            clock.date(from),
            clock.date(end)
        ),
        _ => bail!(
            "{wanted} does not come after {} in the recording, which lasts to {}",
            clock.date(from),
            clock.date(end)
        ),
    }
}

/// What was taken, if there are two such times and nobody has said which.
fn choice(
    time: civil::Time,
    offset: Option<Offset>,
    at: Duration,
    clock: &Clock,
) -> Option<String> {
    let other = clock.other(at).filter(|_| offset.is_none())?;
    let taken = clock.date(at);
    Some(format!("{time} is there twice: {taken} is taken, the other one is {time}{other}"))
}

#[cfg(test)]
mod tests {
    use std::time::SystemTime;

    use jiff::tz::TimeZone;

    use super::*;

    fn part(options: &[(&str, &str)]) -> Part {
        let given = |name| {
            let option = options.iter().find(|(option, _)| *option == name);
            option.map(|(_, text)| time(text).unwrap())
        };
        Part { from: given("from"), to: given("to"), around: given("around"), unusual: None }
    }

    /// Of a night, from 20:00 to 6:00.
    fn seconds(options: &[(&str, &str)]) -> Result<(u64, u64), String> {
        let started = SystemTime::UNIX_EPOCH + Duration::from_secs(20 * 3600);
        let clock = Clock::in_zone(started, TimeZone::UTC);
        let survey = Survey { clock, length: Duration::from_secs(10 * 3600), ..Survey::default() };
        let found = part(options).within(&survey).map_err(|error| error.to_string())?;
        Ok((found.start.as_secs(), found.end.as_secs()))
    }

    #[test]
    fn a_part_is_given_by_seconds_or_by_times_of_day() {
        let hour = 3600;
        assert_eq!(seconds(&[]), Ok((0, u64::MAX)));
        assert_eq!(seconds(&[("from", "12.5"), ("to", "13")]), Ok((12, 13)));
        let night = [("from", "3:12"), ("to", "03:14:30")];
        assert_eq!(seconds(&night), Ok((7 * hour + 720, 7 * hour + 870)));
        assert_eq!(seconds(&[("around", "20:00:05")]), Ok((0, 15)));
        assert_eq!(seconds(&[("around", "100")]), Ok((90, 110)));
        assert_eq!(
            seconds(&[("from", "40000")]),
            Ok((40_000, u64::MAX)),
            "seconds are not checked"
        );
    }

    #[test]
    fn a_time_that_is_not_in_the_recording_is_told_with_its_length() {
        let night = "which lasts from 1970-01-01 20:00:00+00:00 to 1970-01-02 06:00:00+00:00";
        for wrong in ["from", "to", "around"] {
            let error = seconds(&[(wrong, "06:01")]).unwrap_err();
            assert_eq!(error, format!("06:01:00 is not in the recording, {night}"));
        }
        let error = seconds(&[("from", "05:00"), ("to", "04:00")]).unwrap_err();
        assert!(error.starts_with("04:00:00 does not come after 1970-01-02 05:00:00"), "{error}");
        assert_eq!(
            seconds(&[("from", "2"), ("to", "1")]).unwrap_err(),
            "--from has to be before --to"
        );
    }

    #[test]
    fn of_two_times_it_is_told_which_one_is_taken() {
        let zone = TimeZone::posix("CET-1CEST,M3.5.0,M10.5.0/3").unwrap();
        let started: jiff::Timestamp = "2025-10-25T22:00:00Z".parse().unwrap();
        let clock = Clock::in_zone(started.into(), zone);
        let (time, hours) =
            (civil::time(2, 30, 0, 0), |hours: u64| Duration::from_secs(3600 * hours + 1800));
        let choice = |offset, at| choice(time, offset, at, &clock);
        let told = "02:30:00 is there twice: 2025-10-26 02:30:00+02:00 is taken, the other one is 02:30:00+01:00";
        assert_eq!(choice(None, hours(2)).unwrap(), told);
        assert_eq!(choice(Some(Offset::constant(2)), hours(2)), None);
        assert_eq!(choice(None, hours(4)), None);
    }

    #[test]
    fn what_is_no_time_is_refused() {
        for wrong in [
            "",
            "x",
            "-1",
            "inf",
            "NaN",
            "24:00",
            "3:60",
            "1:2:3:4",
            "2025-01-01T03:12",
            ":",
            "3:12+",
            "3:12+x",
            "+01:00",
            "12.5+01:00",
        ] {
            assert!(time(wrong).is_err(), "{wrong}");
        }
        assert!(time("03:12:30.25").is_ok());
        let winter = Time::OfDay(civil::time(3, 12, 0, 0), Some(Offset::constant(1)));
        assert_eq!(time("3:12+01:00"), Ok(winter));
    }
}
