//! How long cycles usually take.

use std::time::Duration;

/// A cycle that is not longer is never unusual: a busy computer makes such pauses.
const LONG: Duration = Duration::from_millis(50);

/// A long cycle takes more than so many times as long as usual.
const TIMES: u32 = 3;

/// The cycles until now, by their time in milliseconds. The last one has all longer ones, too.
#[derive(Debug)]
pub(super) struct Pace([u32; 256]);

impl Default for Pace {
    fn default() -> Self {
        Self([0; 256])
    }
}

impl Pace {
    /// Takes a cycle in. If it took much longer than usual: how many milliseconds are usual until now.
    pub(super) fn longer_than_usual(&mut self, time: Duration) -> Option<u64> {
        let is_longer = |usual: &u64| time > TIMES * Duration::from_millis(*usual);
        let usual = (time > LONG).then(|| self.median()).flatten().filter(is_longer);
        let millis = (time.as_micros() + 500) / 1000;
        let place = usize::try_from(millis).map_or(255, |millis| millis.min(255));
        self.0[place] = self.0[place].saturating_add(1);
        usual
    }

    fn median(&self) -> Option<u64> {
        let count: u64 = self.0.iter().copied().map(u64::from).sum();
        let mut rest = count / 2;
        (0..).zip(self.0).filter(|(_, cycles)| *cycles > 0).find_map(|(millis, cycles)| {
            let found = rest < u64::from(cycles);
            rest = rest.saturating_sub(cycles.into());
            found.then_some(millis)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_cycle_takes_more_than_three_times_the_median_and_50_ms() {
        let mut pace = Pace::default();
        let mut look = |millis| pace.longer_than_usual(Duration::from_millis(millis));
        assert_eq!(look(60), None, "nothing is usual yet");
        (0..10).for_each(|_| assert_eq!(look(10), None));
        assert_eq!((look(50), look(51), look(10_000)), (None, Some(10), Some(10)));
        (0..20).for_each(|_| assert_eq!(look(20), None));
        assert_eq!((look(60), look(61)), (None, Some(20)));
    }
}
