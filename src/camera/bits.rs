//! The bits of a JPEG scan.

/// Reads bits, highest first, and leaves out the zero byte behind each 0xFF. Stops at a marker.
pub(super) struct BitReader<'a> {
    data: &'a [u8],
    /// Behind the last byte taken into `buffer`.
    position: usize,
    /// The unread bits are its lowest `count`.
    buffer: u64,
    count: u32,
}

impl<'a> BitReader<'a> {
    pub(super) fn new(data: &'a [u8], position: usize) -> Self {
        Self { data, position, buffer: 0, count: 0 }
    }

    /// The next 16 bits without reading them; ones where the data ends.
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

    /// Reads so many bits, at most 16; `None` when there are not so many.
    pub(super) fn skip(&mut self, count: u32) -> Option<()> {
        if self.count < count {
            self.fill();
        }
        self.count = self.count.checked_sub(count)?;
        Some(())
    }

    /// Reads up to the end of the present byte and returns where the next one lies.
    pub(super) fn align(&mut self) -> usize {
        for _ in 0..self.count / 8 {
            // What was taken in too much is given back, a zero byte with its 0xFF.
            self.position -= 1;
            if self.data[self.position] == 0 && self.data[self.position - 1] == 0xFF {
                self.position -= 1;
            }
        }
        self.count = 0;
        self.position
    }

    /// Goes on behind a marker, which must lie at the next byte.
    pub(super) fn skip_marker(&mut self, marker: u8) -> Option<()> {
        let position = self.align();
        let marker_at = position + fill_bytes(&self.data[position..]);
        if self.data.get(marker_at..marker_at + 2)? != [0xFF, marker] {
            return None;
        }
        self.position = marker_at + 2;
        Some(())
    }

    /// Takes in bytes until there are 16 bits at least, or no more.
    fn fill(&mut self) {
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

/// How many bytes at the start only fill up: each 0xFF before the last of a row of them.
pub(super) fn fill_bytes(data: &[u8]) -> usize {
    data.iter().take_while(|&&byte| byte == 0xFF).count().saturating_sub(1)
}
