//! How a response is sent, and how faults change it.

use std::time::Duration;

use byteorder::{ByteOrder, LittleEndian};
use ft_transfer_area::wire::{CmprHeader, ResponseId, ID_LEN};

use crate::fault::FaultKind;
use crate::machine::journal::notice;

/// Where the fields that faults disturb are in the response to a compressed exchange.
mod field {
    use std::ops::Range;

    pub(crate) const EXTRA_SIZE: Range<usize> = 4..8;
    pub(crate) const CRC: Range<usize> = 8..12;
    pub(crate) const MASK: Range<usize> = 12..14;
}

/// The most bytes that [`FaultKind::Surplus`] sends.
const MAX_SURPLUS: usize = 64 * 1024;

/// What [`FaultKind::Surplus`] sends after a response.
const SURPLUS_BYTE: u8 = 0xA5;

/// How a response is sent.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Outgoing {
    /// The extra time to wait.
    pub(crate) delay: Duration,
    /// What is sent.
    pub(crate) bytes: Vec<u8>,
    /// Whether each byte is sent on its own.
    pub(crate) dribble: bool,
    /// Whether the connection is closed afterwards.
    pub(crate) close: bool,
}

impl Outgoing {
    /// A response that is sent without a change.
    pub(crate) fn undisturbed(bytes: Vec<u8>) -> Self {
        Self { bytes, ..Self::default() }
    }

    /// Disturbs the response with this fault, in addition to earlier ones.
    pub(crate) fn disturb(&mut self, kind: FaultKind, random: &mut Random) {
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
            FaultKind::WrongCrc => self.change_compressed(kind, |bytes| {
                bytes[field::CRC].iter_mut().for_each(|byte| *byte = !*byte);
            }),
            FaultKind::ExtraSize(size) => self.change_compressed(kind, |bytes| {
                LittleEndian::write_u32(&mut bytes[field::EXTRA_SIZE], size);
            }),
            FaultKind::Mask(mask) => self.change_compressed(kind, |bytes| {
                LittleEndian::write_u16(&mut bytes[field::MASK], mask);
            }),
            FaultKind::CutData => self.change_compressed(kind, cut_data),
        }
    }

    fn change_compressed(&mut self, kind: FaultKind, change: impl FnOnce(&mut Vec<u8>)) {
        if is_compressed(&self.bytes) {
            change(&mut self.bytes);
        } else {
            notice!(Warn, "the fault {kind:?} does not change a response without compressed data");
        }
    }

    /// What is sent, as the pieces that are sent on their own.
    pub(crate) fn pieces(&self) -> impl Iterator<Item = &[u8]> {
        let size = if self.dribble { 1 } else { self.bytes.len().max(1) };
        self.bytes.chunks(size)
    }
}

/// Whether the response, as other faults have changed it, still has compressed data.
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

    const HEADER: CmprHeader =
        CmprHeader { extra_size: 5, crc: 0x0102_0304, active_extensions: 0x81 };

    fn response() -> Vec<u8> {
        let mut out = Vec::new();
        HEADER.emit_response(&mut out);
        out.extend([1, 2, 3, 4, 5]);
        out
    }

    fn disturbed(kind: FaultKind) -> Outgoing {
        disturbed_bytes(response(), kind)
    }

    fn disturbed_bytes(bytes: Vec<u8>, kind: FaultKind) -> Outgoing {
        let mut outgoing = Outgoing::undisturbed(bytes);
        outgoing.disturb(kind, &mut Random::new(0));
        outgoing
    }

    fn header(outgoing: &Outgoing) -> CmprHeader {
        CmprHeader::parse_response(&outgoing.bytes[..CmprHeader::LEN]).unwrap()
    }

    #[test]
    fn faults_of_time_do_not_change_the_bytes() {
        let usual = Outgoing::undisturbed(response());
        let delay = Duration::from_secs(3);
        assert_eq!(disturbed(FaultKind::Delay(delay)), Outgoing { delay, ..usual.clone() });
        assert_eq!(disturbed(FaultKind::Dribble), Outgoing { dribble: true, ..usual });
        assert_eq!(disturbed(FaultKind::Silence), Outgoing::default());
    }

    #[test]
    fn only_a_dribbled_response_leaves_byte_by_byte() {
        assert!(disturbed(FaultKind::Dribble).pieces().eq(response().chunks(1)));
        assert!(Outgoing::undisturbed(response()).pieces().eq([&response()[..]]));
        assert_eq!(disturbed(FaultKind::Silence).pieces().count(), 0);
    }

    #[test]
    fn a_wrong_id_belongs_to_no_packet() {
        let outgoing = disturbed(FaultKind::WrongId);
        let id = LittleEndian::read_u32(&outgoing.bytes);
        assert_eq!(ResponseId::from_id(id), None);
        assert_eq!(outgoing.bytes[ID_LEN..], response()[ID_LEN..]);
    }

    #[test]
    fn a_wrong_crc_or_size_does_not_change_the_rest() {
        let outgoing = disturbed(FaultKind::WrongCrc);
        assert_eq!(header(&outgoing), CmprHeader { crc: !HEADER.crc, ..HEADER });
        assert_eq!(outgoing.bytes[16..], response()[16..]);
        let outgoing = disturbed(FaultKind::ExtraSize(4000));
        assert_eq!(header(&outgoing), CmprHeader { extra_size: 4000, ..HEADER });
        assert_eq!(outgoing.bytes[16..], response()[16..]);
    }

    #[test]
    fn a_wrong_mask_does_not_change_the_rest() {
        let outgoing = disturbed(FaultKind::Mask(0xFF00));
        assert_eq!(header(&outgoing), CmprHeader { active_extensions: 0xFF00, ..HEADER });
        assert_eq!(outgoing.bytes[14..], response()[14..]);
    }

    #[test]
    fn cut_data_is_announced_as_it_is_sent() {
        let outgoing = disturbed(FaultKind::CutData);
        assert_eq!(header(&outgoing), CmprHeader { extra_size: 2, ..HEADER });
        assert_eq!(outgoing.bytes[16..], [1, 2]);
        let outgoing = disturbed_bytes(response()[..17].to_vec(), FaultKind::CutData);
        assert_eq!(header(&outgoing), CmprHeader { extra_size: 0, ..HEADER });
        assert_eq!(outgoing.bytes.len(), CmprHeader::LEN);
    }

    #[test]
    fn surplus_bytes_follow_the_response() {
        let outgoing = disturbed(FaultKind::Surplus(3));
        assert_eq!(outgoing.bytes[..21], response());
        assert_eq!(outgoing.bytes[21..], [SURPLUS_BYTE; 3]);
        let outgoing = disturbed(FaultKind::Surplus(usize::MAX));
        assert_eq!(outgoing.bytes.len(), 21 + MAX_SURPLUS);
    }

    #[test]
    fn a_connection_closes_after_the_given_bytes() {
        for (after, sent) in [(0, 0), (7, 7), (21, 21), (1000, 21)] {
            let outgoing = disturbed(FaultKind::Close { after });
            assert!(outgoing.close);
            assert_eq!(outgoing.bytes, response()[..sent]);
        }
    }

    #[test]
    fn faults_of_compression_do_not_change_other_responses() {
        let mut response = Vec::new();
        ResponseId::StartOnline.emit(&mut response);
        let kinds =
            [FaultKind::WrongCrc, FaultKind::ExtraSize(9), FaultKind::Mask(9), FaultKind::CutData];
        for kind in kinds {
            let outgoing = disturbed_bytes(response.clone(), kind);
            assert_eq!(outgoing, Outgoing::undisturbed(response.clone()));
        }
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
