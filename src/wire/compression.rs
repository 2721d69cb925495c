//! Compression of the exchanged words against the previous packet.
//!
//! Each word is sent as unchanged, as toggled between 0 and 1, or in full. The previous words are
//! kept by their position in the sequence; both sides start with zeros. Codes are written into bytes
//! from the lowest bit up; [`guide::protocol`](crate::guide::protocol) has the table.

use std::mem;

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
        let previous = &mut self.previous[..words.len()];
        let mut bits = BitWriter { out, pending: 0, count: 0 };
        let mut done = 0;
        while done < words.len() {
            let (before, word) = (previous[done], words[done]);
            if word == before {
                let run = equal_at_start(&previous[done..], &words[done..]);
                bits.put_run(run);
                done += run;
                continue;
            }
            if word == toggled(before) {
                bits.put(code::TOGGLE, 2);
            } else {
                bits.put(code::WORD | u32::from(word) << 2, 18);
            }
            previous[done] = word;
            done += 1;
        }
        bits.finish();
        crc_of_words(words)
    }
}

/// How many words at the start of both are equal.
fn equal_at_start(left: &[u16], right: &[u16]) -> usize {
    const BLOCK: usize = 8;
    let blocks = left.chunks_exact(BLOCK).zip(right.chunks_exact(BLOCK));
    let done = BLOCK * blocks.take_while(|(left, right)| left == right).count();
    let words = left[done..].iter().zip(&right[done..]);
    done + words.take_while(|(left, right)| left == right).count()
}

/// The word that the toggle code makes of the previous one.
fn toggled(previous: u16) -> u16 {
    u16::from(previous == 0)
}

/// Writes bits, and gives away eight bytes at a time.
struct BitWriter<'a> {
    out: &'a mut Vec<u8>,
    pending: u64,
    /// How many bits of `pending` count, less than 64.
    count: u32,
}

impl BitWriter<'_> {
    /// Writes the lowest `count` bits of `value`, at most 32. Its other bits are 0.
    fn put(&mut self, value: u32, count: u32) {
        let value = u64::from(value);
        self.pending |= value << self.count;
        let sum = self.count + count;
        if sum >= 64 {
            self.out.extend_from_slice(&self.pending.to_le_bytes());
            // What had no room.
            self.pending = value >> (64 - self.count);
        }
        self.count = sum % 64;
    }

    /// Writes a run of unchanged words.
    fn put_run(&mut self, mut run: usize) {
        while run > 0 {
            let part = run.min(LONGEST_RUN);
            let (value, count) = run_code(part);
            self.put(value, count);
            run -= part;
        }
    }

    fn finish(self) {
        let bytes = self.pending.to_le_bytes();
        self.out.extend_from_slice(&bytes[..self.count.div_ceil(8) as usize]);
    }
}

/// The code for a run of at least one unchanged word and at most [`LONGEST_RUN`], and its number of bits.
fn run_code(run: usize) -> (u32, u32) {
    if run == 1 {
        return (code::UNCHANGED, 2);
    }
    let mut value = code::RUN;
    let mut count = 2;
    for (bits, base) in RUN_STEPS {
        let escape = (1 << bits) - 1;
        let number = (run - base).min(escape);
        value |= (number as u32) << count;
        count += bits;
        if number < escape {
            break;
        }
    }
    (value, count)
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
        // Unchanged words stay as they are here.
        self.words.clear();
        self.words.extend_from_slice(&self.previous[..count]);
        let words = &mut self.words[..];
        let mut bits = BitReader { data, pending: 0, count: 0 };
        let mut done = 0;
        while done < words.len() {
            match bits.next_code() {
                // The checksum is enough to find a run that is too long.
                Some(Code::Run(run)) => done += run,
                Some(Code::Toggle) => {
                    words[done] = toggled(words[done]);
                    done += 1;
                }
                Some(Code::Word(word)) => {
                    words[done] = word;
                    done += 1;
                }
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
    /// The word that [`toggled`] makes of the previous one.
    Toggle,
    /// This word.
    Word(u16),
}

/// Reads bits, and takes in four bytes at a time.
struct BitReader<'a> {
    /// What is not yet in `pending`.
    data: &'a [u8],
    pending: u64,
    /// How many bits of `pending` count.
    count: u32,
}

impl BitReader<'_> {
    /// Reads the next code; `None` when the data ends before it does.
    fn next_code(&mut self) -> Option<Code> {
        // The longest code has 32 bits.
        if self.count < 32 {
            self.load();
        }
        Some(match self.take(2)? {
            code::UNCHANGED => Code::Run(1),
            code::RUN => Code::Run(self.take_run()?),
            code::TOGGLE => Code::Toggle,
            _ => Code::Word(self.take(16)? as u16),
        })
    }

    /// Makes `pending` 32 bits longer, or by what there is.
    fn load(&mut self) {
        let mut append = |bits: u32, count| {
            self.pending |= u64::from(bits) << self.count;
            self.count += count;
        };
        if let Some((bytes, rest)) = self.data.split_first_chunk() {
            append(u32::from_le_bytes(*bytes), 32);
            self.data = rest;
        } else {
            mem::take(&mut self.data).iter().for_each(|&byte| append(byte.into(), 8));
        }
    }

    /// Takes `count` of the pending bits, at most 16; `None` when there are fewer.
    fn take(&mut self, count: u32) -> Option<u32> {
        self.count = self.count.checked_sub(count)?;
        let value = self.pending as u32 & ((1 << count) - 1);
        self.pending >>= count;
        Some(value)
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
mod tests;
