//! Ordered faults, and which of them strikes when.

use std::time::Duration;

use super::delivery::Delivery;
use super::random::Random;

/// A fault that the simulated TXT commits on order.
///
/// Each strikes once in the simulator's life, except those for [each
/// exchange](FaultPlace::EachExchange). Of several for the same response the first strikes on the
/// first connection that gets so far, the second on the next, and so on.
///
/// A fault can be written as text, `WHAT@WHERE`, which is how the program `simulated_txt` takes
/// it:
///
/// ```
/// use ft_transfer_area::simulator::{Fault, FaultKind};
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let fault: Fault = "close:5@response:3".parse()?;
/// assert_eq!(fault, Fault::at_response(3, FaultKind::Close { after: 5 }));
/// # Ok(())
/// # }
/// ```
///
/// | what | kind | | where | place |
/// |---|---|---|---|---|
/// | `delay:MS` | [`Delay`](FaultKind::Delay) | | `response:N` | [`Response`](FaultPlace::Response) |
/// | `jitter:MS` | [`Jitter`](FaultKind::Jitter) | | `exchange:N` | [`Exchange`](FaultPlace::Exchange) |
/// | `silence` | [`Silence`](FaultKind::Silence) | | `exchange:each` | [`EachExchange`](FaultPlace::EachExchange) |
/// | `dribble` | [`Dribble`](FaultKind::Dribble) | | | |
/// | `id` | [`WrongId`](FaultKind::WrongId) | | | |
/// | `crc` | [`WrongCrc`](FaultKind::WrongCrc) | | | |
/// | `size:BYTES` | [`ExtraSize`](FaultKind::ExtraSize) | | | |
/// | `mask:BITS` | [`Mask`](FaultKind::Mask) | | | |
/// | `cut` | [`CutData`](FaultKind::CutData) | | | |
/// | `surplus:BYTES` | [`Surplus`](FaultKind::Surplus) | | | |
/// | `close:BYTES` | [`Close`](FaultKind::Close) | | | |
///
/// Numbers are decimal, or hexadecimal with `0x` before them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fault {
    /// Which response is disturbed.
    pub place: FaultPlace,
    /// What happens to it.
    pub kind: FaultKind,
}

impl Fault {
    /// A fault of the response with this number on a connection, from 0.
    pub const fn at_response(response: u64, kind: FaultKind) -> Self {
        Self { place: FaultPlace::Response(response), kind }
    }

    /// A fault of the exchange with this number on a connection, from 0.
    pub const fn at_exchange(exchange: u64, kind: FaultKind) -> Self {
        Self { place: FaultPlace::Exchange(exchange), kind }
    }

    /// A fault of every exchange.
    pub const fn at_each_exchange(kind: FaultKind) -> Self {
        Self { place: FaultPlace::EachExchange, kind }
    }
}

/// Which response of a connection a fault disturbs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum FaultPlace {
    /// The response with this number, from 0, which usually is QueryStatus's.
    Response(u64),
    /// The response to the exchange with this number, simple or compressed, from 0.
    Exchange(u64),
    /// The response to every exchange, where no other fault strikes. Several of these strike
    /// together, in their order.
    EachExchange,
}

/// What happens to a response.
///
/// [`WrongCrc`](Self::WrongCrc), [`ExtraSize`](Self::ExtraSize), [`Mask`](Self::Mask) and
/// [`CutData`](Self::CutData) disturb a compressed exchange; any other response they leave as it
/// is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum FaultKind {
    /// It leaves so much later than it should.
    Delay(Duration),
    /// It leaves later by a random time, at most so much. The same
    /// [seed](super::SimulatedTxtBuilder::seed) gives the same times.
    Jitter(Duration),
    /// It is not sent; the connection stays open and the next command is answered.
    Silence,
    /// Each byte is sent on its own.
    Dribble,
    /// Its id is not that of any response.
    WrongId,
    /// The announced checksum is not that of the words.
    WrongCrc,
    /// It announces so many bytes of compressed data, whatever follows.
    ExtraSize(u32),
    /// It announces these active extensions, whatever follows.
    Mask(u16),
    /// Only the first half of the compressed data, rounded down, is announced and sent; the
    /// checksum stays as it was.
    CutData,
    /// So many bytes follow that belong to no packet, at most 65536.
    Surplus(usize),
    /// The connection is closed within the response or around it.
    Close {
        /// How many bytes are sent before: 0 none, the response's length or more all of it.
        after: usize,
    },
}

/// The ordered faults that may still strike.
#[derive(Debug)]
pub(super) struct Faults {
    ordered: Vec<Fault>,
    random: Random,
}

/// Where a connection is: how many responses and exchanges there were before this response.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Position {
    pub(super) responses: u64,
    pub(super) exchanges: u64,
    /// Whether this response is one to an exchange.
    pub(super) is_exchange: bool,
}

impl Faults {
    pub(super) fn new(ordered: Vec<Fault>, seed: u64) -> Self {
        Self { ordered, random: Random::new(seed) }
    }

    /// How the response at this place leaves, and whether a fault struck.
    pub(super) fn deliver(&mut self, response: Vec<u8>, at: Position) -> (Delivery, bool) {
        let mut delivery = Delivery::undisturbed(response);
        let kinds = self.take(at);
        for &kind in &kinds {
            log::info!("a response is disturbed, as was ordered: {kind:?}");
            delivery.disturb(kind, &mut self.random);
        }
        (delivery, !kinds.is_empty())
    }

    /// The faults for this response. One that strikes once has struck then.
    fn take(&mut self, at: Position) -> Vec<FaultKind> {
        let strikes = |fault: &Fault| match fault.place {
            FaultPlace::Response(number) => number == at.responses,
            FaultPlace::Exchange(number) => at.is_exchange && number == at.exchanges,
            FaultPlace::EachExchange => false,
        };
        if let Some(index) = self.ordered.iter().position(strikes) {
            return vec![self.ordered.remove(index).kind];
        }
        let each = |fault: &&Fault| at.is_exchange && fault.place == FaultPlace::EachExchange;
        self.ordered.iter().filter(each).map(|fault| fault.kind).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::CmprHeader;

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
            // There is too little left for these.
            FaultKind::WrongCrc,
            FaultKind::CutData,
            FaultKind::Delay(Duration::from_millis(3)),
        ];
        let ordered = kinds.map(|kind| Fault { place: FaultPlace::EachExchange, kind });
        let mut faults = Faults::new(ordered.to_vec(), 0);
        let at = Position { is_exchange: true, ..Position::default() };
        for _ in 0..2 {
            let (delivery, struck) = faults.deliver(response(), at);
            let bytes = response()[..5].to_vec();
            let delay = Duration::from_millis(5);
            assert_eq!(delivery, Delivery { delay, bytes, dribble: true, close: true });
            assert!(struck);
        }
    }

    #[test]
    fn jitter_is_the_seeds() {
        let limit = Duration::from_millis(20);
        let delays = |seed| {
            let jitter = Fault::at_each_exchange(FaultKind::Jitter(limit));
            let mut faults = Faults::new(vec![jitter], seed);
            let at = Position { is_exchange: true, ..Position::default() };
            [(); 50].map(|()| faults.deliver(response(), at).0.delay)
        };
        assert_eq!(delays(1), delays(1));
        assert_ne!(delays(1), delays(2));
        assert!(delays(1).iter().all(|delay| *delay <= limit));
        assert!(delays(1).iter().any(|delay| *delay > limit / 2));
    }

    #[test]
    fn a_fault_strikes_at_its_place_and_once() {
        let ordered = vec![
            Fault::at_each_exchange(FaultKind::Dribble),
            Fault::at_response(2, FaultKind::WrongId),
            Fault::at_exchange(1, FaultKind::WrongCrc),
        ];
        let mut faults = Faults::new(ordered, 0);
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
