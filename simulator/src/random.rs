//! The random numbers of a simulated TXT.

use std::time::Duration;

/// A generator of random numbers that follow from the seed: SplitMix64, by Steele, Lea and Flood.
/// It is small, has no bad seeds, and nothing here needs a better one.
#[derive(Clone, Debug)]
pub(super) struct Random {
    state: u64,
}

impl Random {
    pub(super) fn new(seed: u64) -> Self {
        Self { state: seed }
    }

    /// The next number.
    pub(super) fn next(&mut self) -> u64 {
        self.state = self.state.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mixed = (self.state ^ self.state >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let mixed = (mixed ^ mixed >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
        mixed ^ mixed >> 31
    }

    /// A time in whole µs, at most the limit.
    pub(super) fn up_to(&mut self, limit: Duration) -> Duration {
        let micros = u64::try_from(limit.as_micros()).unwrap_or(u64::MAX);
        // The upper half of the product is evenly spread over 0..=micros.
        let scaled = u128::from(self.next()) * (u128::from(micros) + 1);
        Duration::from_micros((scaled >> 64) as u64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_numbers_are_those_of_the_published_generator() {
        let mut random = Random::new(1_234_567);
        let numbers = [(); 3].map(|()| random.next());
        let published =
            [6_457_827_717_110_365_317, 3_203_168_211_198_807_973, 9_817_491_932_198_370_423];
        assert_eq!(numbers, published);
    }

    #[test]
    fn a_time_is_within_its_limit_and_reaches_both_ends() {
        let mut random = Random::new(0);
        let limit = Duration::from_micros(3);
        let times = [(); 100].map(|()| random.up_to(limit));
        assert!(times.iter().all(|time| *time <= limit));
        assert!(times.contains(&limit) && times.contains(&Duration::ZERO));
        assert_eq!(random.up_to(Duration::ZERO), Duration::ZERO);
    }
}
