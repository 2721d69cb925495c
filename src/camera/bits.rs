//! The bits of a JPEG scan.

/// Takes the bits of a scan as they are read, and the markers between them.
pub(super) trait BitSink: Default {
    /// The next bits, as the lowest `count` of `bits`; at most 32.
    fn put(&mut self, bits: u64, count: u32);
    /// A restart marker, before which the last byte is filled up.
    fn put_marker(&mut self, marker: u8);
}

/// To find only the end of a scan.
impl BitSink for () {
    fn put(&mut self, _: u64, _: u32) {}
    fn put_marker(&mut self, _: u8) {}
}

/// Reads bits, highest first, and skips the zero byte after each 0xFF. Stops at a marker.
pub(super) struct BitReader<'a> {
    data: &'a [u8],
    /// The position after the last byte taken into `buffer`.
    position: usize,
    /// The unread bits are its lowest `count`.
    buffer: u64,
    count: u32,
}

impl<'a> BitReader<'a> {
    pub(super) fn new(data: &'a [u8], position: usize) -> Self {
        Self { data, position, buffer: 0, count: 0 }
    }

    /// The next `count` bits without reading them; `None` when there are fewer than 32.
    pub(super) fn peek(&mut self, count: u32) -> Option<usize> {
        if self.count < 32 {
            self.fill();
        }
        let below = self.count.checked_sub(32)? + 32 - count;
        Some((self.buffer >> below) as usize & ((1 << count) - 1))
    }

    /// The next 16 bits without reading them; ones after the end of the data.
    pub(super) fn peek16(&mut self) -> u32 {
        self.fill();
        if self.count >= 16 {
            (self.buffer >> (self.count - 16)) as u32 & 0xFFFF
        } else {
            let missing = 16 - self.count;
            let bits = self.buffer & ((1 << self.count) - 1);
            ((bits << missing) | ((1 << missing) - 1)) as u32
        }
    }

    /// Reads this number of bits, at most 32, into `sink`; `None` when there are fewer.
    pub(super) fn read(&mut self, count: u32, sink: &mut impl BitSink) -> Option<()> {
        if self.count < count {
            self.fill();
        }
        self.count = self.count.checked_sub(count)?;
        sink.put(self.buffer >> self.count & ((1 << count) - 1), count);
        Some(())
    }

    /// Reads up to the end of the current byte and returns the position of the next one.
    pub(super) fn align(&mut self) -> usize {
        for _ in 0..self.count / 8 {
            // Gives back the bytes that were taken too early, a zero byte together with its 0xFF.
            self.position -= 1;
            if self.data[self.position] == 0 && self.data[self.position - 1] == 0xFF {
                self.position -= 1;
            }
        }
        self.count = 0;
        self.position
    }

    /// Skips a marker, which must be at the next byte.
    pub(super) fn skip_marker(&mut self, marker: u8) -> Option<()> {
        let position = self.align();
        let marker_at = position + fill_bytes(&self.data[position..]);
        if self.data.get(marker_at..marker_at + 2)? != [0xFF, marker] {
            return None;
        }
        self.position = marker_at + 2;
        Some(())
    }

    /// Fills the buffer to at least 32 bits, or to the end of the data.
    fn fill(&mut self) {
        if self.count <= 32 {
            let next = self.data.get(self.position..).and_then(<[u8]>::first_chunk);
            if let Some(word) = next.map(|bytes| u32::from_be_bytes(*bytes)) {
                if !has_ones(word) {
                    self.position += 4;
                    self.buffer = self.buffer << 32 | u64::from(word);
                    self.count += 32;
                    return;
                }
            }
        }
        while self.count <= 48 {
            let Some(&byte) = self.data.get(self.position) else { return };
            if byte == 0xFF {
                if self.data.get(self.position + 1) != Some(&0) {
                    return;
                }
                self.position += 1;
            }
            self.position += 1;
            self.buffer = self.buffer << 8 | u64::from(byte);
            self.count += 8;
        }
    }
}

/// Whether a byte of it is 0xFF.
fn has_ones(word: u32) -> bool {
    // The lowest such byte borrows from nothing, so its highest bit stays.
    (!word).wrapping_sub(0x0101_0101) & word & 0x8080_8080 != 0
}

/// Writes bits, highest first, with a zero byte after each 0xFF.
#[derive(Default)]
pub(super) struct BitWriter {
    data: Vec<u8>,
    /// Its lowest `count` bits are not in `data` yet; fewer than 32 between two calls.
    buffer: u64,
    count: u32,
}

impl BitWriter {
    /// The written bytes, with the last one filled up.
    pub(super) fn finish(mut self) -> Vec<u8> {
        self.align();
        self.data
    }

    /// Fills up the current byte with ones, as encoders do.
    fn align(&mut self) {
        let missing = self.count.wrapping_neg() % 8;
        self.put((1 << missing) - 1, missing);
        let bytes = (self.buffer as u32).to_be_bytes();
        self.write(&bytes[4 - self.count as usize / 8..]);
        self.count = 0;
    }

    fn write(&mut self, bytes: &[u8]) {
        if !bytes.contains(&0xFF) {
            return self.data.extend_from_slice(bytes);
        }
        for &byte in bytes {
            self.data.push(byte);
            if byte == 0xFF {
                self.data.push(0);
            }
        }
    }
}

impl BitSink for BitWriter {
    fn put(&mut self, bits: u64, count: u32) {
        self.buffer = self.buffer << count | bits;
        self.count += count;
        if self.count >= 32 {
            self.count -= 32;
            let word = (self.buffer >> self.count) as u32;
            self.write(&word.to_be_bytes());
        }
    }

    fn put_marker(&mut self, marker: u8) {
        self.align();
        self.data.extend([0xFF, marker]);
    }
}

/// The number of fill bytes at the start: each 0xFF of a row of them, except the last.
pub(super) fn fill_bytes(data: &[u8]) -> usize {
    data.iter().take_while(|&&byte| byte == 0xFF).count().saturating_sub(1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_that_were_written_are_read_again() {
        let mut writer = BitWriter::default();
        let mut state = 1_u32;
        let mut pieces = Vec::new();
        for index in 0..10_000 {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let count = (state >> 24) % 17;
            // Many ones, so that many bytes are 0xFF.
            let ones = (1 << count) - 1;
            let bits = if index % 3 == 0 { u64::from(state >> 8) & ones } else { ones };
            pieces.push((bits, count));
            writer.put(bits, count);
        }
        writer.put_marker(0xD0);
        writer.put(0b101, 3);
        let data = writer.finish();
        assert!(data.windows(2).filter(|bytes| *bytes == [0xFF, 0]).count() > 100);

        /// Keeps the last bits.
        #[derive(Default)]
        struct Last(u64);
        impl BitSink for Last {
            fn put(&mut self, bits: u64, _: u32) {
                self.0 = bits;
            }
            fn put_marker(&mut self, _: u8) {}
        }
        let mut last = Last::default();
        let mut reader = BitReader::new(&data, 0);
        for (bits, count) in pieces {
            reader.read(count, &mut last).unwrap();
            assert_eq!(last.0, bits);
        }
        reader.skip_marker(0xD0).unwrap();
        // Filled up with ones.
        reader.read(8, &mut last).unwrap();
        assert_eq!(last.0, 0b1011_1111);
        assert_eq!(reader.read(1, &mut last), None);
    }
}
