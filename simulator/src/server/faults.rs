//! The injected faults, when each strikes, and random numbers for them.

use std::time::Duration;

use crate::fault::{Fault, FaultKind, FaultPlace};
use crate::server::outgoing::Outgoing;

/// The faults that may still strike.
#[derive(Debug)]
pub(crate) struct Faults {
    injected: Vec<Fault>,
    random: Random,
}

/// Where a connection is: how many responses and exchanges there were before this response.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Position {
    pub(crate) responses: u64,
    pub(crate) exchanges: u64,
    /// Whether this response is one to an exchange.
    pub(crate) is_exchange: bool,
}

impl Faults {
    pub(crate) fn new(injected: Vec<Fault>, seed: u64) -> Self {
        Self { injected, random: Random::new(seed) }
    }

    /// How the response at this place is sent, and whether a fault struck. `kinds` are those that strike now,
    /// before the injected ones.
    pub(crate) fn disturb(
        &mut self,
        response: Vec<u8>,
        at: Position,
        mut kinds: Vec<FaultKind>,
    ) -> (Outgoing, bool) {
        let mut outgoing = Outgoing::undisturbed(response);
        kinds.extend(self.take(at));
        for &kind in &kinds {
            log::info!("a fault is injected: {kind:?}");
            outgoing.disturb(kind, &mut self.random);
        }
        (outgoing, !kinds.is_empty())
    }

    /// The faults for this response. A fault that strikes once is removed.
    fn take(&mut self, at: Position) -> Vec<FaultKind> {
        let strikes = |fault: &Fault| match fault.place {
            FaultPlace::Response(number) => number == at.responses,
            FaultPlace::Exchange(number) => at.is_exchange && number == at.exchanges,
            FaultPlace::EachExchange => false,
        };
        if let Some(index) = self.injected.iter().position(strikes) {
            return vec![self.injected.remove(index).kind];
        }
        let each = |fault: &&Fault| at.is_exchange && fault.place == FaultPlace::EachExchange;
        self.injected.iter().filter(each).map(|fault| fault.kind).collect()
    }
}

/// A generator of random numbers that follow from the seed: SplitMix64, by Steele, Lea and Flood.
/// It is small, has no bad seeds, and nothing here needs a better one.
#[derive(Clone, Debug)]
pub(crate) struct Random {
    state: u64,
}

impl Random {
    pub(crate) fn new(seed: u64) -> Self {
        Self { state: seed }
    }

    /// The next number.
    pub(crate) fn next(&mut self) -> u64 {
        self.state = self.state.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mixed = (self.state ^ self.state >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let mixed = (mixed ^ mixed >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
        mixed ^ mixed >> 31
    }

    /// A time in whole µs, at most the limit.
    pub(crate) fn up_to(&mut self, limit: Duration) -> Duration {
        let micros = u64::try_from(limit.as_micros()).unwrap_or(u64::MAX);
        // The upper half of the product is evenly spread over 0..=micros.
        let scaled = u128::from(self.next()) * (u128::from(micros) + 1);
        Duration::from_micros((scaled >> 64) as u64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ft_transfer_area::wire::CmprHeader;

    fn response() -> Vec<u8> {
        let mut out = Vec::new();
        CmprHeader::default().emit_response(&mut out);
        out
    }

    #[test]
    fn faults_at_each_exchange_strike_together() {
        let kinds = [
            FaultKind::Dribble,
            FaultKind::Delay(Duration::from_millis(2)),
            FaultKind::Close { after: 5 },
            // Too few bytes are left for these.
            FaultKind::WrongCrc,
            FaultKind::CutData,
            FaultKind::Delay(Duration::from_millis(3)),
        ];
        let injected = kinds.map(|kind| Fault { place: FaultPlace::EachExchange, kind });
        let mut faults = Faults::new(injected.to_vec(), 0);
        let at = Position { is_exchange: true, ..Position::default() };
        for _ in 0..2 {
            let (outgoing, struck) = faults.disturb(response(), at, Vec::new());
            let bytes = response()[..5].to_vec();
            let delay = Duration::from_millis(5);
            assert_eq!(outgoing, Outgoing { delay, bytes, dribble: true, close: true });
            assert!(struck);
        }
    }

    #[test]
    fn jitter_follows_from_the_seed() {
        let limit = Duration::from_millis(20);
        let delays = |seed| {
            let jitter = Fault::at_each_exchange(FaultKind::Jitter(limit));
            let mut faults = Faults::new(vec![jitter], seed);
            let at = Position { is_exchange: true, ..Position::default() };
            [(); 50].map(|()| faults.disturb(response(), at, Vec::new()).0.delay)
        };
        assert_eq!(delays(1), delays(1));
        assert_ne!(delays(1), delays(2));
        assert!(delays(1).iter().all(|delay| *delay <= limit));
        assert!(delays(1).iter().any(|delay| *delay > limit / 2));
    }

    #[test]
    fn a_fault_strikes_at_its_place_and_once() {
        let injected = vec![
            Fault::at_each_exchange(FaultKind::Dribble),
            Fault::at_response(2, FaultKind::WrongId),
            Fault::at_exchange(1, FaultKind::WrongCrc),
        ];
        let mut faults = Faults::new(injected, 0);
        let mut take = |responses, exchanges, is_exchange| {
            faults.take(Position { responses, exchanges, is_exchange })
        };
        assert_eq!(take(1, 1, false), []);
        assert_eq!(take(2, 0, true), [FaultKind::WrongId]);
        assert_eq!(take(2, 0, true), [FaultKind::Dribble]);
        assert_eq!(take(3, 1, true), [FaultKind::WrongCrc]);
        assert_eq!(take(3, 1, true), [FaultKind::Dribble]);
    }

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
