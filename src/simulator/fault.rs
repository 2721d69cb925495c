//! Ordered faults, and how they disturb the bytes of a response.

use std::time::Duration;

use byteorder::{ByteOrder, LittleEndian};

use super::random::Random;
use crate::wire::{CmprHeader, ResponseId, ID_LEN};

/// Where the fields that faults disturb lie in a compressed exchange's response.
mod field {
    use std::ops::Range;

    pub(super) const EXTRA_SIZE: Range<usize> = 4..8;
    pub(super) const CRC: Range<usize> = 8..12;
    pub(super) const MASK: Range<usize> = 12..14;
}

/// The most bytes that [`FaultKind::Surplus`] sends.
const MAX_SURPLUS: usize = 64 * 1024;

/// What [`FaultKind::Surplus`] sends behind a response.
const SURPLUS_BYTE: u8 = 0xA5;

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

/// How a response leaves.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Delivery {
    /// The time to wait beyond the usual.
    pub(super) delay: Duration,
    /// What is sent.
    pub(super) bytes: Vec<u8>,
    /// Whether each byte is sent on its own.
    pub(super) dribble: bool,
    /// Whether the connection is closed afterwards.
    pub(super) close: bool,
}

impl Delivery {
    /// A response that leaves as it is.
    pub(super) fn undisturbed(bytes: Vec<u8>) -> Self {
        Self { bytes, ..Self::default() }
    }

    /// Disturbs the response by this fault, in addition to those before.
    fn disturb(&mut self, kind: FaultKind, random: &mut Random) {
        let bytes = &mut self.bytes;
        match kind {
            FaultKind::Jitter(limit) => self.delay = self.delay.saturating_add(random.up_to(limit)),
            FaultKind::Delay(delay) => self.delay = self.delay.saturating_add(delay),
            FaultKind::Dribble => self.dribble = true,
            FaultKind::Close { after } => {
                bytes.truncate(after);
                self.close = true;
            }
            FaultKind::Silence => bytes.clear(),
            FaultKind::WrongId => bytes.iter_mut().take(ID_LEN).for_each(|byte| *byte = !*byte),
            FaultKind::Surplus(count) => {
                bytes.resize(bytes.len() + count.min(MAX_SURPLUS), SURPLUS_BYTE);
            }
            _ if !is_compressed(bytes) => {
                log::warn!("the fault {kind:?} leaves a response without compressed data alone");
            }
            FaultKind::WrongCrc => {
                bytes[field::CRC].iter_mut().for_each(|byte| *byte = !*byte);
            }
            FaultKind::ExtraSize(size) => {
                LittleEndian::write_u32(&mut bytes[field::EXTRA_SIZE], size);
            }
            FaultKind::Mask(mask) => LittleEndian::write_u16(&mut bytes[field::MASK], mask),
            FaultKind::CutData => cut_data(bytes),
        }
    }

    /// What is sent, by the pieces that are sent on their own.
    pub(super) fn pieces(&self) -> impl Iterator<Item = &[u8]> {
        let size = if self.dribble { 1 } else { self.bytes.len().max(1) };
        self.bytes.chunks(size)
    }
}

/// Whether the response, as far as other faults have left it, is one with compressed data.
fn is_compressed(response: &[u8]) -> bool {
    response.len() >= CmprHeader::LEN && ResponseId::ExchangeDataCmpr.check(response).is_ok()
}

/// Cuts the compressed data of a response to its first half.
fn cut_data(response: &mut Vec<u8>) {
    let half = (response.len() - CmprHeader::LEN) / 2;
    response.truncate(CmprHeader::LEN + half);
    // Compressed data is a few hundred bytes.
    LittleEndian::write_u32(&mut response[field::EXTRA_SIZE], half as u32);
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEADER: CmprHeader =
        CmprHeader { extra_size: 5, crc: 0x0102_0304, active_extensions: 0x81 };

    fn response() -> Vec<u8> {
        let mut out = Vec::new();
        HEADER.emit_response(&mut out);
        out.extend([1, 2, 3, 4, 5]);
        out
    }

    fn disturbed(kind: FaultKind) -> Delivery {
        disturbed_bytes(response(), kind)
    }

    fn disturbed_bytes(bytes: Vec<u8>, kind: FaultKind) -> Delivery {
        let mut delivery = Delivery::undisturbed(bytes);
        delivery.disturb(kind, &mut Random::new(0));
        delivery
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

    fn header(delivery: &Delivery) -> CmprHeader {
        CmprHeader::parse_response(&delivery.bytes[..CmprHeader::LEN]).unwrap()
    }

    #[test]
    fn faults_of_time_leave_the_bytes_alone() {
        let usual = Delivery::undisturbed(response());
        let delay = Duration::from_secs(3);
        assert_eq!(disturbed(FaultKind::Delay(delay)), Delivery { delay, ..usual.clone() });
        assert_eq!(disturbed(FaultKind::Dribble), Delivery { dribble: true, ..usual });
        assert_eq!(disturbed(FaultKind::Silence), Delivery::default());
    }

    #[test]
    fn only_a_dribbled_response_leaves_byte_by_byte() {
        assert!(disturbed(FaultKind::Dribble).pieces().eq(response().chunks(1)));
        assert!(Delivery::undisturbed(response()).pieces().eq([&response()[..]]));
        assert_eq!(disturbed(FaultKind::Silence).pieces().count(), 0);
    }

    #[test]
    fn a_wrong_id_is_no_packets() {
        let delivery = disturbed(FaultKind::WrongId);
        let id = LittleEndian::read_u32(&delivery.bytes);
        assert_eq!(ResponseId::from_id(id), None);
        assert_eq!(delivery.bytes[ID_LEN..], response()[ID_LEN..]);
    }

    #[test]
    fn a_wrong_crc_or_size_leaves_the_rest_alone() {
        let delivery = disturbed(FaultKind::WrongCrc);
        assert_eq!(header(&delivery), CmprHeader { crc: !HEADER.crc, ..HEADER });
        assert_eq!(delivery.bytes[16..], response()[16..]);
        let delivery = disturbed(FaultKind::ExtraSize(4000));
        assert_eq!(header(&delivery), CmprHeader { extra_size: 4000, ..HEADER });
        assert_eq!(delivery.bytes[16..], response()[16..]);
    }

    #[test]
    fn a_wrong_mask_leaves_the_rest_alone() {
        let delivery = disturbed(FaultKind::Mask(0xFF00));
        assert_eq!(header(&delivery), CmprHeader { active_extensions: 0xFF00, ..HEADER });
        assert_eq!(delivery.bytes[14..], response()[14..]);
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

    #[test]
    fn cut_data_is_announced_as_it_is_sent() {
        let delivery = disturbed(FaultKind::CutData);
        assert_eq!(header(&delivery), CmprHeader { extra_size: 2, ..HEADER });
        assert_eq!(delivery.bytes[16..], [1, 2]);
        let delivery = disturbed_bytes(response()[..17].to_vec(), FaultKind::CutData);
        assert_eq!(header(&delivery), CmprHeader { extra_size: 0, ..HEADER });
        assert_eq!(delivery.bytes.len(), CmprHeader::LEN);
    }

    #[test]
    fn surplus_bytes_follow_the_response() {
        let delivery = disturbed(FaultKind::Surplus(3));
        assert_eq!(delivery.bytes[..21], response());
        assert_eq!(delivery.bytes[21..], [SURPLUS_BYTE; 3]);
        let delivery = disturbed(FaultKind::Surplus(usize::MAX));
        assert_eq!(delivery.bytes.len(), 21 + MAX_SURPLUS);
    }

    #[test]
    fn a_connection_closes_after_so_many_bytes() {
        for (after, sent) in [(0, 0), (7, 7), (21, 21), (1000, 21)] {
            let delivery = disturbed(FaultKind::Close { after });
            assert!(delivery.close);
            assert_eq!(delivery.bytes, response()[..sent]);
        }
    }

    #[test]
    fn faults_of_compression_leave_other_responses_alone() {
        let mut response = Vec::new();
        ResponseId::StartOnline.emit(&mut response);
        let kinds =
            [FaultKind::WrongCrc, FaultKind::ExtraSize(9), FaultKind::Mask(9), FaultKind::CutData];
        for kind in kinds {
            let delivery = disturbed_bytes(response.clone(), kind);
            assert_eq!(delivery, Delivery::undisturbed(response.clone()));
        }
    }
}
