//! The clock on the wall beside a recording.

use std::time::{Duration, SystemTime};

use jiff::civil::Time;
use jiff::tz::TimeZone;
use jiff::{SignedDuration, Timestamp, Zoned};

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
        Self::in_zone(started, TimeZone::system())
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

    /// As "03:12:14", with the date from a day after the beginning on.
    pub(crate) fn of_day(&self, at: Duration) -> String {
        let form = if at < DAY { "%H:%M:%S" } else { "%Y-%m-%d %H:%M:%S" };
        self.zoned(at).strftime(form).to_string()
    }

    /// As "03:12:14", with this number of digits behind the seconds.
    pub(super) fn label(&self, at: Duration, digits: usize) -> String {
        let time = self.zoned(at);
        let seconds = time.strftime("%H:%M:%S").to_string();
        match digits {
            0 => seconds,
            _ => {
                let fraction = format!("{:09}", time.subsec_nanosecond());
                format!("{seconds}.{}", &fraction[..digits.min(9)])
            }
        }
    }

    /// When it is this time of day first, from then on.
    pub(super) fn next(&self, time: Time, from: Duration) -> Option<Duration> {
        let from = self.zoned(from);
        // Who types a time has seen it without fractions of seconds.
        let begin = from.timestamp().as_second();
        let days = [from.date(), from.date().tomorrow().ok()?];
        let times = days.into_iter().flat_map(|day| {
            let local = self.zone.to_ambiguous_timestamp(day.to_datetime(time));
            // Of the two that a night in autumn has.
            [local.compatible(), local.later()]
        });
        let next = times.flatten().find(|time| time.as_second() >= begin)?;
        let since = next.duration_since(self.started);
        Some(since.max(SignedDuration::ZERO).unsigned_abs())
    }
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
        let next = clock.next(time.parse().unwrap(), Duration::from_secs(from));
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
        // At 2:00 it is 3:00.
        let spring = clock("2025-03-29T23:00:00Z");
        assert_eq!(next(&spring, "03:30", 0), Some(2 * 3600 + 1800));
        assert_eq!(next(&spring, "02:30", 0), Some(2 * 3600 + 1800), "there is none");
    }
}
