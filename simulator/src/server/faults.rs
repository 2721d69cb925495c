//! The injected faults, and when each strikes.

use crate::fault::{Fault, FaultKind, FaultPlace};
use crate::machine::journal::notice;
use crate::server::outgoing::{Outgoing, Random};

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
            notice!(Info, "a fault is injected: {kind:?}");
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

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use ft_transfer_area::wire::CmprHeader;

    use super::*;

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
}
