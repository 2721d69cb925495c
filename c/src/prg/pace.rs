//! When the next tic is due.

use std::time::{Duration, Instant};

/// The time from one call of `PrgTic` to the next.
pub(super) const TIC: Duration = Duration::from_millis(1);

/// How late a tic may be to be made up. If it is later, the machine was busy for a long time or was suspended,
/// and a program that caught up with minutes of tics would not see its inputs meanwhile.
const MOST_LATE: Duration = Duration::from_millis(100);

/// A time table with a tic every millisecond. Tics that come late do not move those after them.
#[derive(Debug)]
pub(super) struct Pace {
    begun: Instant,
    due: Instant,
    tics: u64,
    made_up: u64,
    skipped: u64,
}

impl Pace {
    /// A table that begins now.
    pub(super) fn new(now: Instant) -> Self {
        Self { begun: now, due: now, tics: 0, made_up: 0, skipped: 0 }
    }

    /// When the next tic is due. A time that is over means: now.
    pub(super) fn next(&mut self, now: Instant) -> Instant {
        self.tics += 1;
        self.due += TIC;
        let late = now.saturating_duration_since(self.due);
        if late > MOST_LATE {
            let skipped = u32::try_from(late.as_millis()).unwrap_or(u32::MAX);
            self.skipped += u64::from(skipped);
            self.due += TIC * skipped;
        } else if late >= TIC {
            self.made_up += 1;
        }
        self.due
    }

    /// What became of the table, for people.
    pub(super) fn summary(&self, now: Instant) -> String {
        let Self { tics, made_up, skipped, .. } = self;
        let seconds = now.saturating_duration_since(self.begun).as_secs_f64();
        let mut text = format!("{tics} tics in {seconds:.3} s");
        if *made_up > 0 {
            text += &format!(", {made_up} of them made up after a delay");
        }
        if *skipped > 0 {
            text += &format!(", {skipped} skipped");
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: Duration = Duration::from_millis(1);

    #[test]
    fn a_late_tic_does_not_move_those_after_it() {
        let begun = Instant::now();
        let mut pace = Pace::new(begun);
        assert_eq!(pace.next(begun), begun + MS);
        let late = begun + 5 * MS;
        for made_up in 2..=5 {
            assert_eq!(pace.next(late), begun + made_up * MS, "at once, one after the other");
        }
        assert_eq!(pace.next(late), begun + 6 * MS, "on time again");
        assert_eq!((pace.made_up, pace.skipped), (3, 0));
    }

    #[test]
    fn after_a_long_delay_tics_are_skipped_and_counted() {
        let begun = Instant::now();
        let mut pace = Pace::new(begun);
        pace.next(begun);
        let late = begun + 5000 * MS;
        assert!(pace.next(late) <= late);
        assert!(pace.next(late) > late);
        assert_eq!(pace.tics + pace.skipped, 5001);
        assert_eq!(pace.summary(late), "3 tics in 5.000 s, 4998 skipped");
    }
}
