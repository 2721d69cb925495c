//! Compression of the exchanged words against the previous packet.
//!
//! Each word is sent as unchanged, as toggled between 0 and 1, or in full. The previous words are
//! kept by their position in the sequence; both sides start with zeros. Codes are written into bytes
//! from the lowest bit up; [`guide::protocol`](crate::guide::protocol) has the table.

use super::crc_of_words;
use crate::error::Error;

/// Codes of two bits; the value is written lowest bit first.
mod code {
    pub(super) const UNCHANGED: u32 = 0b00;
    pub(super) const RUN: u32 = 0b01;
    pub(super) const TOGGLE: u32 = 0b10;
    pub(super) const WORD: u32 = 0b11;
}

/// The steps in which a run's length is written: a number of bits, and the length that the value 0 in
/// them means. In all but the last step, the value with all bits set leads to the next step.
const RUN_STEPS: [(u32, usize); 4] = [(2, 2), (4, 5), (8, 20), (16, 275)];

/// The longest run that the kit writes with one code.
const LONGEST_RUN: usize = 4370;

/// Compresses words for the other side. Keeps those of its previous packet.
#[doc(alias = "CompressionBuffer")]
#[derive(Clone, Debug, Default)]
pub struct Compressor {
    previous: Vec<u16>,
}

impl Compressor {
    /// A compressor in the state after StartOnline: all previous words are 0.
    pub fn new() -> Self {
        Self::default()
    }

    /// Appends the compressed `words` to `out` and returns their checksum.
    ///
    /// Allocates only when there are more words than ever before, or when `out` has to grow.
    pub fn compress(&mut self, words: &[u16], out: &mut Vec<u8>) -> u32 {
        if self.previous.len() < words.len() {
            self.previous.resize(words.len(), 0);
        }
        let mut bits = BitWriter { out, pending: 0, count: 0 };
        let mut run = 0;
        for (previous, &word) in self.previous.iter_mut().zip(words) {
            if word == *previous {
                run += 1;
                continue;
            }
            bits.put_run(run);
            run = 0;
            if word == toggled(*previous) {
                bits.put(code::TOGGLE, 2);
            } else {
                bits.put(code::WORD, 2);
                bits.put(u32::from(word), 16);
            }
            *previous = word;
        }
        bits.put_run(run);
        bits.finish();
        crc_of_words(words)
    }
}

/// The word that the toggle code makes of the previous one.
fn toggled(previous: u16) -> u16 {
    u16::from(previous == 0)
}

struct BitWriter<'a> {
    out: &'a mut Vec<u8>,
    pending: u32,
    count: u32,
}

impl BitWriter<'_> {
    /// Writes the lowest `count` bits of `value`, at most 16.
    fn put(&mut self, value: u32, count: u32) {
        self.pending |= value << self.count;
        self.count += count;
        while self.count >= 8 {
            self.out.push(self.pending as u8);
            self.pending >>= 8;
            self.count -= 8;
        }
    }

    /// Writes a run of unchanged words.
    fn put_run(&mut self, mut run: usize) {
        while run > LONGEST_RUN {
            self.put_short_run(LONGEST_RUN);
            run -= LONGEST_RUN;
        }
        self.put_short_run(run);
    }

    fn put_short_run(&mut self, run: usize) {
        match run {
            0 => {}
            1 => self.put(code::UNCHANGED, 2),
            _ => {
                self.put(code::RUN, 2);
                for (bits, base) in RUN_STEPS {
                    let escape = (1 << bits) - 1;
                    // At most LONGEST_RUN, so the last step always holds it.
                    let number = (run - base) as u32;
                    if number < escape {
                        self.put(number, bits);
                        break;
                    }
                    self.put(escape, bits);
                }
            }
        }
    }

    fn finish(self) {
        if self.count > 0 {
            self.out.push(self.pending as u8);
        }
    }
}

/// Expands the words of the other side. Keeps those of its previous packet.
#[doc(alias = "ExpansionBuffer")]
#[derive(Clone, Debug, Default)]
pub struct Expander {
    previous: Vec<u16>,
    /// What is being expanded: `previous` must not change before the checksum is known.
    words: Vec<u16>,
}

impl Expander {
    /// An expander in the state after StartOnline: all previous words are 0.
    pub fn new() -> Self {
        Self::default()
    }

    /// Expands `count` words from `data`, checks them against `crc` and returns them.
    ///
    /// After an error the expander is as it was before. Bits after the last word are ignored.
    /// Allocates only when there are more words than ever before.
    ///
    /// # Errors
    ///
    /// [`Error::DataEndsEarly`] when `data` has fewer words, [`Error::WrongCrc`] when the checksum is
    /// wrong.
    pub fn expand(&mut self, data: &[u8], count: usize, crc: u32) -> Result<&[u16], Error> {
        if self.previous.len() < count {
            self.previous.resize(count, 0);
        }
        self.words.clear();
        let mut bits = BitReader { data, position: 0 };
        while self.words.len() < count {
            let done = self.words.len();
            let previous = &self.previous[done..count];
            match bits.next_code(previous[0]) {
                // The checksum is enough to find a run that is too long.
                Some(Code::Run(run)) => {
                    self.words.extend_from_slice(&previous[..run.min(previous.len())]);
                }
                Some(Code::Word(word)) => self.words.push(word),
                None => return Err(Error::DataEndsEarly { expected: count, found: done }),
            }
        }
        let computed = crc_of_words(&self.words);
        if computed != crc {
            return Err(Error::WrongCrc { announced: crc, computed });
        }
        self.previous[..count].copy_from_slice(&self.words);
        Ok(&self.previous[..count])
    }
}

enum Code {
    /// This number of unchanged words.
    Run(usize),
    /// This word.
    Word(u16),
}

struct BitReader<'a> {
    data: &'a [u8],
    /// In bits.
    position: usize,
}

impl BitReader<'_> {
    /// Reads `count` bits, at most 16; `None` when there are fewer.
    fn take(&mut self, count: u32) -> Option<u32> {
        let byte = self.position / 8;
        let shift = self.position % 8;
        let end = (shift + count as usize).div_ceil(8);
        let bytes = self.data.get(byte..byte + end)?;
        let value = bytes.iter().rev().fold(0, |value, &byte| value << 8 | u32::from(byte));
        self.position += count as usize;
        Some(value >> shift & ((1 << count) - 1))
    }

    fn next_code(&mut self, previous: u16) -> Option<Code> {
        Some(match self.take(2)? {
            code::UNCHANGED => Code::Run(1),
            code::RUN => Code::Run(self.take_run()?),
            code::TOGGLE => Code::Word(toggled(previous)),
            _ => Code::Word(self.take(16)? as u16),
        })
    }

    fn take_run(&mut self) -> Option<usize> {
        let [steps @ .., (last_bits, last_base)] = RUN_STEPS;
        for (bits, base) in steps {
            let number = self.take(bits)?;
            if number != (1 << bits) - 1 {
                return Some(base + number as usize);
            }
        }
        Some(last_base + self.take(last_bits)? as usize)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn compress(words: &[u16]) -> (Vec<u8>, u32) {
        let mut data = Vec::new();
        let crc = Compressor::new().compress(words, &mut data);
        (data, crc)
    }

    #[test]
    fn a_word_an_unchanged_one_and_a_word() {
        let (data, crc) = compress(&[4660, 0, 43981]);
        assert_eq!(data, [0xD3, 0x48, 0x70, 0xF3, 0x2A]);
        assert_eq!(crc, 0x2CE3_04E0);
    }

    #[test]
    fn a_run_longer_than_4370_is_split_there() {
        // 01 11 1111 11111111 and 16 bits for 4370 = 275 + 4095, then 00 for the last word.
        let (data, _) = compress(&[0; 4371]);
        assert_eq!(data, [0xFD, 0xFF, 0xFF, 0x0F, 0x00]);
        let (data, crc) = compress(&[0; 9000]);
        assert_eq!(Expander::new().expand(&data, 9000, crc).unwrap(), [0; 9000]);
    }

    #[test]
    fn words_beyond_a_shorter_packet_keep_their_place() {
        let mut compressor = Compressor::new();
        let mut expander = Expander::new();
        for words in [&[7, 8, 9][..], &[1], &[1, 8, 9]] {
            let mut data = Vec::new();
            let crc = compressor.compress(words, &mut data);
            assert_eq!(expander.expand(&data, words.len(), crc).unwrap(), words);
        }
        let mut data = Vec::new();
        compressor.compress(&[1, 8, 9], &mut data);
        assert_eq!(data.len(), 1, "one run of three");
    }

    #[test]
    fn an_error_leaves_the_expander_as_it_was() {
        let mut expander = Expander::new();
        let (data, crc) = compress(&[5, 6, 7]);
        assert_eq!(
            expander.expand(&data[..4], 3, crc),
            Err(Error::DataEndsEarly { expected: 3, found: 1 })
        );
        assert_eq!(
            expander.expand(&data, 3, crc ^ 1),
            Err(Error::WrongCrc { announced: crc ^ 1, computed: crc })
        );
        let (unchanged, crc) = compress(&[0; 3]);
        assert_eq!(expander.expand(&unchanged, 3, crc).unwrap(), [0; 3]);
    }

    #[test]
    fn random_bytes_expand_or_err() {
        let mut state = 0x2545_F491_u32;
        let mut data = [0; 64];
        for round in 0..10_000 {
            for byte in &mut data {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                *byte = (state >> 24) as u8;
            }
            let mut expander = Expander::new();
            let result = expander.expand(&data[..round % 65], round % 470, 0);
            assert!(matches!(result, Err(Error::DataEndsEarly { .. } | Error::WrongCrc { .. })));
        }
    }
}
