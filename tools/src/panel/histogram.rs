//! How long the cycles take.

use std::time::Instant;

/// One bin for each millisecond, the last one for all longer cycles.
const BINS: usize = 31;

/// How many cycles took how many milliseconds, to the nearest one, since the connection began.
#[derive(Debug, Default)]
pub(super) struct Histogram {
    bins: [u64; BINS],
    /// The last response and when it arrived.
    last: Option<(u64, Instant)>,
}

impl Histogram {
    /// Counts the time from the response before this one. One that was not seen leaves two times out.
    pub(super) fn count(&mut self, cycle: u64, arrived: Instant) {
        if let Some((_, before)) = self.last.filter(|(last, _)| last + 1 == cycle) {
            let ms = arrived.saturating_duration_since(before).as_secs_f64() * 1000.0;
            self.bins[(ms.round() as usize).min(BINS - 1)] += 1;
        }
        self.last = Some((cycle, arrived));
    }

    /// The next response comes on another connection.
    pub(super) fn interrupt(&mut self) {
        self.last = None;
    }

    pub(super) fn bins(&self) -> &[u64] {
        &self.bins
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn only_the_time_between_two_responses_in_a_row_counts() {
        let (begin, mut histogram) = (Instant::now(), Histogram::default());
        let mut count = |cycle, ms| histogram.count(cycle, begin + Duration::from_millis(ms));
        count(1, 0);
        count(2, 10);
        count(3, 20);
        count(5, 40);
        count(6, 500);
        histogram.interrupt();
        histogram.count(7, begin + Duration::from_millis(510));
        let mut expected = [0; BINS];
        (expected[10], expected[BINS - 1]) = (2, 1);
        assert_eq!(histogram.bins(), expected);
    }
}
