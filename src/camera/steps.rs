//! The codes of a JPEG scan, read a few at a time.

use super::bits::{BitReader, BitSink};
use super::huffman::HuffmanTable;

/// How many bits are looked up. With more of them, preparing takes longer than is saved.
const BITS: u32 = 10;

const COUNT: usize = 1 << BITS;

/// What a code means: how many bits its value has, by how many coefficients it advances, and whether it is
/// the last one before a code of another table.
pub(super) type Meaning = (u8, u8, bool);

/// A few codes with the bits of their values. All of the codes are within the bits that are looked up.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Step {
    /// How many bits they have in all; 0 if the first code is longer than what is looked up, or wrong.
    bits: u8,
    /// By how many coefficients they advance; at most 16 for each bit.
    pub(super) advance: u8,
    /// Whether a code of another table follows.
    pub(super) is_last: bool,
}

/// The steps by the bits that come next.
pub(super) struct Steps(Box<[Step; COUNT]>);

impl Steps {
    /// For a table whose values mean this; `None` for those that are wrong.
    pub(super) fn new(table: &HuffmanTable, meaning: fn(u8) -> Option<Meaning>) -> Self {
        let codes = codes(table, meaning);
        let mut steps = Box::new([Step::default(); COUNT]);
        for (bits, step) in steps.iter_mut().enumerate() {
            while u32::from(step.bits) < BITS && !step.is_last {
                let (length, code) = codes[bits << step.bits & (COUNT - 1)];
                if code.bits == 0 || u32::from(step.bits + length) > BITS {
                    break;
                }
                step.bits += code.bits;
                step.advance += code.advance;
                step.is_last = code.is_last;
            }
        }
        Self(steps)
    }

    /// Reads codes that advance by less than `room` into `sink`; `None` when the next code has to be read
    /// by itself.
    pub(super) fn read(
        &self,
        bits: &mut BitReader<'_>,
        sink: &mut impl BitSink,
        room: usize,
    ) -> Option<Step> {
        let step = self.0[bits.peek(BITS)?];
        if step.bits == 0 || usize::from(step.advance) >= room {
            return None;
        }
        bits.read(step.bits.into(), sink)?;
        Some(step)
    }
}

/// The first code of each combination of bits: its length, and a step of it alone.
fn codes(table: &HuffmanTable, meaning: fn(u8) -> Option<Meaning>) -> [(u8, Step); COUNT] {
    let mut codes = [(0, Step::default()); COUNT];
    let mut bits = 0;
    // In the order of the bits, the codes are in the order of their lengths.
    while bits < COUNT {
        let Some((length, value)) = table.find((bits as u32) << (16 - BITS)) else { break };
        if length > BITS {
            break;
        }
        let next = bits + (1 << (BITS - length));
        if let Some((size, advance, is_last)) = meaning(value) {
            let length = length as u8;
            codes[bits..next].fill((length, Step { bits: length + size, advance, is_last }));
        }
        bits = next;
    }
    codes
}
