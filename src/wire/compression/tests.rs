//! The compression against the definition, written bit by bit.

use super::*;

/// Random numbers, the same in each run.
struct Random(u64);

impl Random {
    /// A number less than `limit`.
    fn below(&mut self, limit: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        (self.0 >> 33) as usize % limit
    }

    fn word(&mut self) -> u16 {
        self.below(0x1_0000) as u16
    }
}

/// A sequence of bits, each 0 or 1, and how many of them have been read.
#[derive(Default)]
struct Bits(Vec<u8>, usize);

impl Bits {
    fn of(data: &[u8]) -> Self {
        Self(data.iter().flat_map(|byte| (0..8).map(move |bit| byte >> bit & 1)).collect(), 0)
    }

    /// Appends a number, its lowest bit first.
    fn push(&mut self, number: usize, count: usize) {
        self.0.extend((0..count).map(|bit| (number >> bit & 1) as u8));
    }

    fn push_run(&mut self, run: usize) {
        match run {
            0 => {}
            1 => self.0.extend([0, 0]),
            2..=4 => {
                self.0.extend([1, 0]);
                self.push(run - 2, 2);
            }
            5..=19 => {
                self.0.extend([1, 0, 1, 1]);
                self.push(run - 5, 4);
            }
            20..=274 => {
                self.0.extend([1, 0, 1, 1, 1, 1, 1, 1]);
                self.push(run - 20, 8);
            }
            275..=4370 => {
                self.0.extend([1, 0, 1, 1, 1, 1, 1, 1]);
                self.0.extend([1; 8]);
                self.push(run - 275, 16);
            }
            _ => {
                self.push_run(4370);
                self.push_run(run - 4370);
            }
        }
    }

    /// Reads a number, its lowest bit first; `None` when there are fewer bits.
    fn next(&mut self, count: usize) -> Option<usize> {
        let bits = self.0.get(self.1..self.1 + count)?;
        self.1 += count;
        Some(bits.iter().rev().fold(0, |number, &bit| number << 1 | usize::from(bit)))
    }

    fn next_run(&mut self) -> Option<usize> {
        let mut number = self.next(2)?;
        if number < 3 {
            return Some(2 + number);
        }
        number = self.next(4)?;
        if number < 15 {
            return Some(5 + number);
        }
        number = self.next(8)?;
        if number < 255 {
            return Some(20 + number);
        }
        Some(275 + self.next(16)?)
    }

    /// Reads a code, and appends what it makes of the previous words from here on.
    fn next_words(&mut self, before: &[u16], words: &mut Vec<u16>) -> Option<()> {
        match (self.next(1)?, self.next(1)?) {
            (0, 0) => words.push(before[0]),
            (1, 0) => {
                let run = self.next_run()?.min(before.len());
                words.extend_from_slice(&before[..run]);
            }
            (0, _) => words.push(if before[0] == 0 { 1 } else { 0 }),
            _ => words.push(self.next(16)? as u16),
        }
        Some(())
    }

    fn bytes(&self) -> Vec<u8> {
        let byte = |bits: &[u8]| bits.iter().rev().fold(0, |byte, bit| byte << 1 | bit);
        self.0.chunks(8).map(byte).collect()
    }
}

/// What a compressor with these previous words must write.
fn compressed(previous: &[u16], words: &[u16]) -> Vec<u8> {
    let mut bits = Bits::default();
    let mut run = 0;
    for (&before, &word) in previous.iter().zip(words) {
        if word == before {
            run += 1;
            continue;
        }
        bits.push_run(run);
        run = 0;
        match (before, word) {
            (0, 1) | (1.., 0) => bits.0.extend([0, 1]),
            _ => {
                bits.0.extend([1, 1]);
                bits.push(word.into(), 16);
            }
        }
    }
    bits.push_run(run);
    bits.bytes()
}

/// What an expander with these previous words must read; how many words there are before the data ends
/// early.
fn expanded(previous: &[u16], data: &[u8]) -> Result<Vec<u16>, usize> {
    let mut bits = Bits::of(data);
    let mut words = Vec::new();
    while words.len() < previous.len() {
        let done = words.len();
        let before = &previous[done..];
        if bits.next_words(before, &mut words).is_none() {
            return Err(done);
        }
    }
    Ok(words)
}

/// Words like those of areas: spans that are unchanged, that toggle, or that change to anything.
fn change(words: &mut [u16], random: &mut Random) {
    let most = [1, 3, 30, 300][random.below(4)];
    let mut rest = words;
    while !rest.is_empty() {
        let span = (1 + random.below(most)).min(rest.len());
        let (now, later) = rest.split_at_mut(span);
        match random.below(4) {
            0 => {}
            1 => now.iter_mut().for_each(|word| *word = u16::from(*word == 0)),
            2 => now.iter_mut().for_each(|word| *word = random.word()),
            _ => now.iter_mut().for_each(|word| *word = random.below(3) as u16),
        }
        rest = later;
    }
}

#[test]
fn words_of_all_kinds_are_compressed_and_expanded_as_defined() {
    let mut random = Random(1);
    for round in 0..800 {
        let mut compressor = Compressor::new();
        let mut expander = Expander::new();
        let mut state = vec![0; 9 * 52];
        for _ in 0..4 {
            // 1 to 9 areas of each size, or any number of words.
            let count = match round % 4 {
                0 => 27 * (1 + random.below(9)),
                1 => 50 * (1 + random.below(9)),
                2 => 52 * (1 + random.below(9)),
                _ => 1 + random.below(80),
            };
            let previous = state[..count].to_vec();
            let words = &mut state[..count];
            change(words, &mut random);

            let mut data = vec![0xAA];
            let crc = compressor.compress(words, &mut data);
            assert_eq!(data.remove(0), 0xAA, "it is appended");
            assert_eq!(data, compressed(&previous, words));
            for part in [&data[..random.below(data.len())], &data[..data.len() - 1]] {
                let found = expanded(&previous, part).unwrap_err();
                let error = Error::DataEndsEarly { expected: count, found };
                assert_eq!(expander.expand(part, count, crc), Err(error));
            }
            assert_eq!(expander.expand(&data, count, crc).unwrap(), words);
        }
    }
}

#[test]
fn runs_of_all_lengths_are_compressed_and_expanded_as_defined() {
    for run in (0..600).chain(4360..4380).chain(8735..8745) {
        let mut words = vec![0; run + 2];
        words[0] = 7;
        words[run + 1] = 8;
        let mut data = Vec::new();
        let crc = Compressor::new().compress(&words, &mut data);
        assert_eq!(data, compressed(&vec![0; run + 2], &words), "run of {run}");
        assert_eq!(Expander::new().expand(&data, run + 2, crc).unwrap(), words);
    }
}

#[test]
fn random_bytes_are_expanded_as_defined() {
    let mut random = Random(2);
    for _ in 0..20_000 {
        let previous: Vec<u16> = (0..random.below(200)).map(|_| random.word()).collect();
        let mut data: Vec<u8> = (0..random.below(50)).map(|_| random.word() as u8).collect();
        // More runs than there are in random bytes.
        if random.below(2) == 0 {
            data.iter_mut().for_each(|byte| *byte |= 0b1101);
        }
        let mut expander = Expander { previous: previous.clone(), words: Vec::new() };
        let expected = expanded(&previous, &data);
        let crc = expected.as_ref().map_or(0, |words| crc_of_words(words));
        let result = expander.expand(&data, previous.len(), crc);
        match expected {
            Ok(words) => assert_eq!(result.unwrap(), words),
            Err(found) => {
                let error = Error::DataEndsEarly { expected: previous.len(), found };
                assert_eq!(result, Err(error));
                assert_eq!(expander.previous, previous, "an error changes nothing");
            }
        }
    }
}

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
