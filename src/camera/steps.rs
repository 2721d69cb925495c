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

#[cfg(test)]
mod tests {
    use super::super::bits::BitWriter;
    use super::super::huffman::STANDARD_TABLES;
    use super::super::parser::{ac_meaning, dc_meaning};
    use super::*;

    /// What was read.
    #[derive(Debug, Default, PartialEq)]
    struct Taken {
        bits: u128,
        count: u32,
    }

    impl BitSink for Taken {
        fn put(&mut self, bits: u64, count: u32) {
            self.bits = self.bits << count | u128::from(bits);
            self.count += count;
        }
        fn put_marker(&mut self, _: u8) {}
    }

    /// Numbers without an order, the same ones each time.
    struct Numbers(u32);

    impl Numbers {
        /// The next one, less than `end`.
        fn below(&mut self, end: u32) -> u32 {
            self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            ((u64::from(self.0) * u64::from(end)) >> 32) as u32
        }

        /// A table with these counts of codes. Half of the values are small, so that several codes fit into a step.
        fn table(&mut self, counts: &[u8; 16]) -> HuffmanTable {
            let count = counts.iter().map(|&count| u32::from(count)).sum();
            let mask = if self.below(2) == 0 { 0xF1 } else { 0xFF };
            let values: Vec<u8> = (0..count).map(|_| self.below(256) as u8 & mask).collect();
            HuffmanTable::new(counts, &values).unwrap()
        }

        /// Counts of codes that fit each other; the more at the shorter lengths, the fewer longer ones there are.
        fn counts(&mut self) -> [u8; 16] {
            let part = 1 + self.below(4);
            let mut free = 1;
            std::array::from_fn(|_| {
                free *= 2;
                let count = self.below(free / part + 2).min(free).min(255);
                free -= count;
                count as u8
            })
        }

        /// A scan that begins with these bits, and goes on long enough for the longest code and value.
        fn scan(&mut self, bits: usize) -> Vec<u8> {
            let mut scan = BitWriter::default();
            scan.put(bits as u64, BITS);
            for _ in 0..6 {
                scan.put(self.below(1 << 16).into(), 16);
            }
            scan.finish()
        }
    }

    fn standard_tables() -> Vec<HuffmanTable> {
        let mut tables = Vec::new();
        // After marker and length, and before each table its place.
        let mut rest = &STANDARD_TABLES[4..];
        while let Some((counts, values)) = rest.get(1..).and_then(<[u8]>::split_first_chunk) {
            let count = counts.iter().map(|&count| usize::from(count)).sum();
            tables.push(HuffmanTable::new(counts, &values[..count]).unwrap());
            rest = &values[count..];
        }
        tables
    }

    /// What a step has to be.
    #[derive(Debug, Default, PartialEq)]
    struct Expected {
        taken: Taken,
        codes: usize,
        advance: usize,
        is_last: bool,
    }

    /// Reads one code after the other, as long as each is within the bits that are looked up.
    fn code_by_code(
        table: &HuffmanTable,
        meaning: fn(u8) -> Option<Meaning>,
        scan: &[u8],
    ) -> Expected {
        let mut all = Expected::default();
        let mut bits = BitReader::new(scan, 0);
        while !all.is_last {
            let mut next = Taken::default();
            let Some(value) = table.read(&mut bits, &mut next) else { break };
            let Some((size, advance, is_last)) = meaning(value) else { break };
            if all.taken.count + next.count > BITS {
                break;
            }
            bits.read(size.into(), &mut next).unwrap();
            all.taken.put(next.bits as u64, next.count);
            all.codes += 1;
            all.advance += usize::from(advance);
            all.is_last = is_last;
        }
        all
    }

    /// Compares all steps of a table with its codes; returns how many steps have several codes.
    fn compare(table: &HuffmanTable, numbers: &mut Numbers) -> usize {
        let mut several = 0;
        for meaning in [dc_meaning, ac_meaning] {
            let steps = Steps::new(table, meaning);
            for first in 0..COUNT {
                let scan = numbers.scan(first);
                let expected = code_by_code(table, meaning, &scan);
                let read = |room| {
                    let mut bits = BitReader::new(&scan, 0);
                    let mut taken = Taken::default();
                    let step = steps.read(&mut bits, &mut taken, room);
                    (step.map(|step| (step.advance.into(), step.is_last)), taken)
                };
                let nothing = (None, Taken::default());
                assert_eq!(read(expected.advance), nothing, "{first:010b} without room: {table:?}");
                let Expected { taken, codes, advance, is_last } = expected;
                let whole = if codes == 0 { nothing } else { (Some((advance, is_last)), taken) };
                assert_eq!(read(advance + 1), whole, "{first:010b}: {table:?}");
                several += usize::from(codes > 1);
            }
        }
        several
    }

    #[test]
    fn steps_of_the_standard_tables_are_their_codes() {
        let tables = standard_tables();
        assert_eq!(tables.len(), 4);
        let several: Vec<usize> =
            tables.iter().map(|table| compare(table, &mut Numbers(1))).collect();
        assert!(several[1] > COUNT / 2 && several[3] > COUNT / 2, "{several:?}");
    }

    #[test]
    fn steps_of_any_tables_are_their_codes() {
        let mut numbers = Numbers(2);
        let mut several = 0;
        for _ in 0..100 {
            let counts = numbers.counts();
            let table = numbers.table(&counts);
            several += compare(&table, &mut numbers);
        }
        assert!(several > 10 * COUNT, "{several}");
    }

    #[test]
    fn steps_of_codes_of_all_lengths_are_their_codes() {
        let mut numbers = Numbers(3);
        // None at all, one of each length, and then with no combination of bits left over.
        let mut full = [1; 16];
        full[15] = 2;
        let mut tables = vec![[0; 16], [1; 16], full];
        // As many as there can be of one length alone.
        tables.extend((0..16).map(|length| {
            let mut counts = [0; 16];
            counts[length] = (2 << length).min(255) as u8;
            counts
        }));
        for counts in tables {
            let table = numbers.table(&counts);
            compare(&table, &mut numbers);
        }
    }

    #[test]
    fn near_the_end_of_the_data_nothing_is_read_in_steps() {
        let steps = Steps::new(&standard_tables()[1], ac_meaning);
        let scan = [0; 8];
        for size in 0..=scan.len() {
            let mut taken = Taken::default();
            let step = steps.read(&mut BitReader::new(&scan[..size], 0), &mut taken, 64);
            assert_eq!(step.is_some(), size >= 4, "{size} bytes");
            assert_eq!(taken.count > 0, size >= 4, "{size} bytes");
        }
    }
}
