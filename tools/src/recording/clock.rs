//! The clock on the wall beside a recording.

use std::time::{Duration, SystemTime};

use jiff::civil::Time;
use jiff::tz::{AmbiguousOffset, Offset, TimeZone};
use jiff::{SignedDuration, Timestamp, Zoned};
use serde::Serialize;

use crate::zone;

const DAY: Duration = Duration::from_secs(24 * 3600);

/// Dates and times of day of a recording. Times are those since its beginning.
#[derive(Clone, Debug)]
pub(crate) struct Clock {
    started: Timestamp,
    zone: TimeZone,
}

impl Default for Clock {
    fn default() -> Self {
        Self::in_zone(SystemTime::UNIX_EPOCH, TimeZone::UTC)
    }
}

impl Clock {
    /// In the time zone of this computer.
    pub(crate) fn of(started: SystemTime) -> Self {
        zone::warn_if_not_read();
        Self::in_zone(started, zone::of_system())
    }

    pub(super) fn in_zone(started: SystemTime, zone: TimeZone) -> Self {
        Self { started: Timestamp::try_from(started).unwrap_or_default(), zone }
    }

    /// The beginning, in milliseconds since 1970.
    pub(super) fn started(&self) -> i64 {
        self.started.as_millisecond()
    }

    /// The time zone as a browser knows it, such as "Europe/Berlin"; not every zone has such a name.
    pub(super) fn zone(&self) -> Option<&str> {
        self.zone.iana_name()
    }

    fn zoned(&self, at: Duration) -> Zoned {
        let time = self.started.checked_add(at).unwrap_or(Timestamp::MAX);
        time.to_zoned(self.zone.clone())
    }

    /// As "2025-03-30 03:12:14+02:00": an offset tells the two hours apart that a night in autumn has twice.
    pub(crate) fn date(&self, at: Duration) -> String {
        self.zoned(at).strftime("%Y-%m-%d %H:%M:%S%:z").to_string()
    }

    /// The same with milliseconds.
    pub(super) fn precise(&self, at: Duration) -> String {
        self.zoned(at).strftime("%Y-%m-%d %H:%M:%S%.3f%:z").to_string()
    }

    /// As "03:12:14", with the date from a day after the beginning on, and with the offset in an hour that is there
    /// twice.
    pub(crate) fn of_day(&self, at: Duration) -> String {
        let form = if at < DAY { "%H:%M:%S" } else { "%Y-%m-%d %H:%M:%S" };
        let time = self.zoned(at);
        time.strftime(form).to_string() + &self.offset_if_twice(&time)
    }

    /// As "03:12:14", with this number of digits behind the seconds, and with the offset in an hour that is there twice.
    pub(super) fn label(&self, at: Duration, digits: usize) -> String {
        let time = self.zoned(at);
        let mut label = time.strftime("%H:%M:%S").to_string();
        if digits > 0 {
            let fraction = format!("{:09}", time.subsec_nanosecond());
            label = format!("{label}.{}", &fraction[..digits.min(9)]);
        }
        label + &self.offset_if_twice(&time)
    }

    /// The offsets of the two that have the same date and time of day; `None` where only one has them.
    fn offsets(&self, time: &Zoned) -> Option<[Offset; 2]> {
        match self.zone.to_ambiguous_timestamp(time.datetime()).offset() {
            AmbiguousOffset::Fold { before, after } => Some([before, after]),
            AmbiguousOffset::Gap { .. } | AmbiguousOffset::Unambiguous { .. } => None,
        }
    }

    fn offset_if_twice(&self, time: &Zoned) -> String {
        self.offsets(time).map_or(String::new(), |_| offset_text(time.offset()))
    }

    /// The offset of the other one that has the same date and time of day.
    pub(super) fn other(&self, at: Duration) -> Option<String> {
        let time = self.zoned(at);
        let offsets = self.offsets(&time)?;
        offsets.into_iter().find(|offset| *offset != time.offset()).map(offset_text)
    }

    /// The times until then that have the same date and time of day as others.
    pub(super) fn twice(&self, end: Duration) -> Vec<Twice> {
        let end_at = self.zoned(end).timestamp();
        let begin =
            self.started.checked_sub(SignedDuration::from_hours(24)).unwrap_or(self.started);
        let changes = self.zone.following(begin).map(|change| change.timestamp());
        // The one after the end may be that of the hour before it.
        let until = end_at.checked_add(SignedDuration::from_hours(24)).unwrap_or(end_at);
        let changes = changes.take_while(|change| *change <= until);
        let twice = changes.filter_map(|change| {
            let after = self.zone.to_offset(change);
            let second_before = change.checked_sub(SignedDuration::from_secs(1)).ok()?;
            let before = self.zone.to_offset(second_before);
            let length = f64::from(before.seconds() - after.seconds());
            let at = change.duration_since(self.started).as_secs_f64();
            let offsets = [before, after].map(offset_text);
            (length > 0.0).then_some(Twice { from: at - length, at, to: at + length, offsets })
        });
        twice.filter(|twice| twice.from <= end.as_secs_f64() && twice.to > 0.0).collect()
    }

    /// When it is this time of day first, from then on, or with this offset.
    pub(super) fn next(
        &self,
        time: Time,
        offset: Option<Offset>,
        from: Duration,
    ) -> Option<Duration> {
        let from = self.zoned(from);
        // Who types a time has seen it without fractions of seconds.
        let begin = from.timestamp().as_second();
        let days = [from.date(), from.date().tomorrow().ok()?];
        let times = days.into_iter().flat_map(|day| {
            let local = self.zone.to_ambiguous_timestamp(day.to_datetime(time));
            // Of the two that a night in autumn has.
            [local.compatible(), local.later()]
        });
        let is_meant =
            |time: &Timestamp| offset.is_none_or(|offset| self.zone.to_offset(*time) == offset);
        let mut times = times.flatten().filter(is_meant);
        let next = times.find(|time| time.as_second() >= begin)?;
        let since = next.duration_since(self.started);
        Some(since.max(SignedDuration::ZERO).unsigned_abs())
    }
}

/// As "+02:00".
pub(super) fn offset_text(offset: Offset) -> String {
    Timestamp::UNIX_EPOCH.to_zoned(TimeZone::fixed(offset)).strftime("%:z").to_string()
}

/// Two stretches of a recording with the same times of day, in seconds: up to a change of the clock, and from then on.
#[derive(Debug, PartialEq, Serialize)]
pub(super) struct Twice {
    from: f64,
    at: f64,
    to: f64,
    offsets: [String; 2],
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A clock of central Europe, and a recording that begins then.
    fn clock(started: &str) -> Clock {
        let zone = TimeZone::posix("CET-1CEST,M3.5.0,M10.5.0/3").unwrap();
        let started: Timestamp = started.parse().unwrap();
        Clock::in_zone(started.into(), zone)
    }

    fn next(clock: &Clock, time: &str, from: u64) -> Option<u64> {
        let next = clock.next(time.parse().unwrap(), None, Duration::from_secs(from));
        next.map(|next| next.as_secs())
    }

    #[test]
    fn times_are_those_of_the_time_zone_with_its_offset() {
        let clock = clock("2025-07-01T20:03:14.25Z");
        assert_eq!(clock.date(Duration::ZERO), "2025-07-01 22:03:14+02:00");
        let millis = Duration::from_millis(2 * 3_600_000 + 1500);
        assert_eq!(clock.precise(millis), "2025-07-02 00:03:15.750+02:00");
        assert_eq!(clock.of_day(millis), "00:03:15");
        assert_eq!(clock.of_day(DAY + millis), "2025-07-03 00:03:15");
        assert_eq!([0, 2].map(|digits| clock.label(millis, digits)), ["00:03:15", "00:03:15.75"]);
    }

    #[test]
    fn a_time_of_day_is_the_next_one_also_after_midnight() {
        let clock = clock("2025-07-01T20:03:14.25Z");
        assert_eq!(next(&clock, "22:03:14", 0), Some(0), "the beginning as it is shown");
        assert_eq!(next(&clock, "22:04:14", 0), Some(59));
        assert_eq!(next(&clock, "03:12", 0), Some(5 * 3600 + 8 * 60 + 45));
        assert_eq!(next(&clock, "22:03:13", 0), Some(24 * 3600 - 2));
        assert_eq!(next(&clock, "22:04:14", 3600), Some(24 * 3600 + 59));
    }

    #[test]
    fn a_night_in_which_the_clock_is_changed_has_all_times() {
        // At 3:00 in summer time it is 2:00 again.
        let autumn = clock("2025-10-25T22:00:00Z");
        assert_eq!(next(&autumn, "02:30", 0), Some(2 * 3600 + 1800));
        assert_eq!(next(&autumn, "02:30", 3 * 3600), Some(3 * 3600 + 1800), "the second one");
        assert_eq!(next(&autumn, "03:30", 0), Some(4 * 3600 + 1800));
        let second =
            autumn.next("02:30".parse().unwrap(), Some(Offset::constant(1)), Duration::ZERO);
        assert_eq!(second, Some(Duration::from_secs(3 * 3600 + 1800)));
        // At 2:00 it is 3:00.
        let spring = clock("2025-03-29T23:00:00Z");
        assert_eq!(next(&spring, "03:30", 0), Some(2 * 3600 + 1800));
        assert_eq!(next(&spring, "02:30", 0), Some(2 * 3600 + 1800), "there is none");
    }

    #[test]
    fn in_an_hour_that_is_there_twice_times_have_an_offset() {
        let autumn = clock("2025-10-25T22:00:00Z");
        let minutes = |minutes: u64| Duration::from_secs(60 * minutes);
        let labels = [119, 120, 179, 180, 239, 240].map(|at| autumn.label(minutes(at), 0));
        let [summer, winter] = ["02:59:00+02:00", "02:00:00+01:00"];
        let first = "02:00:00+02:00";
        assert_eq!(labels, ["01:59:00", first, summer, winter, "02:59:00+01:00", "03:00:00"]);
        assert_eq!(autumn.of_day(minutes(150)), "02:30:00+02:00");
        assert_eq!(autumn.label(minutes(210), 1), "02:30:00.0+01:00");
        assert_eq!(autumn.other(minutes(150)).unwrap(), "+01:00");
        assert_eq!(autumn.other(minutes(210)).unwrap(), "+02:00");
        assert_eq!(autumn.other(minutes(240)), None);
        let offsets = ["+02:00", "+01:00"].map(str::to_owned);
        let twice = Twice { from: 7200.0, at: 10_800.0, to: 14_400.0, offsets };
        assert_eq!(autumn.twice(minutes(130)), [twice]);
        assert_eq!(autumn.twice(minutes(119)), []);
        // In spring no time is there twice.
        assert_eq!(clock("2025-03-29T23:00:00Z").twice(minutes(600)), []);
    }
}
