//! Huffman tables of JPEG: just enough to find the blocks of a scan.

use super::bits::{BitReader, BitSink};

/// The four tables of the JPEG standard's Annex K, as one DHT segment.
///
/// Many cameras leave their tables out and use these.
pub(super) const STANDARD_TABLES: [u8; 420] = {
    let mut segment = [0; 420];
    let header = [0xFF, 0xC4, 0x01, 0xA2];
    let mut at = put(&mut segment, 0, &header);
    at = put(&mut segment, at, &[0x00]);
    at = put(&mut segment, at, &[0, 1, 5, 1, 1, 1, 1, 1, 1, 0, 0, 0, 0, 0, 0, 0]);
    at = put(&mut segment, at, &[0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11]);
    at = put(&mut segment, at, &[0x10]);
    at = put(&mut segment, at, &[0, 2, 1, 3, 3, 2, 4, 3, 5, 5, 4, 4, 0, 0, 1, 0x7D]);
    at = put(&mut segment, at, &LUMINANCE_AC);
    at = put(&mut segment, at, &[0x01]);
    at = put(&mut segment, at, &[0, 3, 1, 1, 1, 1, 1, 1, 1, 1, 1, 0, 0, 0, 0, 0]);
    at = put(&mut segment, at, &[0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11]);
    at = put(&mut segment, at, &[0x11]);
    at = put(&mut segment, at, &[0, 2, 1, 2, 4, 4, 3, 4, 7, 5, 4, 4, 0, 1, 2, 0x77]);
    at = put(&mut segment, at, &CHROMINANCE_AC);
    assert!(at == segment.len());
    segment
};

/// Values of table K.5: run and size for luminance.
const LUMINANCE_AC: [u8; 162] = hex(b"0102030004110512213141061351610722711432\
      8191A1082342B1C11552D1F02433627282090A16\
      1718191A25262728292A3435363738393A434445\
      464748494A535455565758595A63646566676869\
      6A737475767778797A838485868788898A929394\
      95969798999AA2A3A4A5A6A7A8A9AAB2B3B4B5B6\
      B7B8B9BAC2C3C4C5C6C7C8C9CAD2D3D4D5D6D7D8\
      D9DAE1E2E3E4E5E6E7E8E9EAF1F2F3F4F5F6F7F8\
      F9FA");

/// Values of table K.6: run and size for chrominance.
const CHROMINANCE_AC: [u8; 162] = hex(b"0001020311040521310612415107617113223281\
      08144291A1B1C109233352F0156272D10A162434\
      E125F11718191A262728292A35363738393A4344\
      45464748494A535455565758595A636465666768\
      696A737475767778797A82838485868788898A92\
      939495969798999AA2A3A4A5A6A7A8A9AAB2B3B4\
      B5B6B7B8B9BAC2C3C4C5C6C7C8C9CAD2D3D4D5D6\
      D7D8D9DAE2E3E4E5E6E7E8E9EAF2F3F4F5F6F7F8\
      F9FA");

/// Copies `bytes` into `out` at `at` and returns where they end.
const fn put(out: &mut [u8], at: usize, bytes: &[u8]) -> usize {
    let mut i = 0;
    while i < bytes.len() {
        out[at + i] = bytes[i];
        i += 1;
    }
    at + i
}

/// Reads hexadecimal digits.
const fn hex<const N: usize>(digits: &[u8]) -> [u8; N] {
    assert!(digits.len() == 2 * N);
    let mut bytes = [0; N];
    let mut i = 0;
    while i < digits.len() {
        let digit = digits[i];
        let value = if digit.is_ascii_digit() { digit - b'0' } else { digit - b'A' + 10 };
        bytes[i / 2] = bytes[i / 2] << 4 | value;
        i += 1;
    }
    bytes
}

/// A Huffman table: for each length of a code, the first code that is too large, aligned to 16 bits,
/// and what to add to a code's number to get the index of its value.
#[derive(Clone, Debug)]
pub(super) struct HuffmanTable {
    /// For 1 to 16 bits.
    limits: [u32; 16],
    offsets: [i32; 16],
    values: Vec<u8>,
}

impl HuffmanTable {
    /// A table with these counts of codes by length and these values; `None` when they do not fit each
    /// other.
    pub(super) fn new(counts: &[u8; 16], values: &[u8]) -> Option<Self> {
        let mut limits = [0; 16];
        let mut offsets = [0; 16];
        let mut code = 0_u32;
        let mut place = 0_i32;
        for (length, &count) in (1..).zip(counts) {
            offsets[length - 1] = place - code as i32;
            code += u32::from(count);
            place += i32::from(count);
            if code > 1 << length {
                return None;
            }
            limits[length - 1] = code << (16 - length);
            code <<= 1;
        }
        (place as usize == values.len()).then(|| Self { limits, offsets, values: values.to_vec() })
    }

    /// Reads a code into `sink` and returns its value; `None` when the code is wrong, or the data ends.
    pub(super) fn read(&self, bits: &mut BitReader<'_>, sink: &mut impl BitSink) -> Option<u8> {
        let (length, value) = self.find(bits.peek16())?;
        bits.read(length, sink)?;
        Some(value)
    }

    /// The length and the value of the code at the start of these 16 bits.
    pub(super) fn find(&self, bits: u32) -> Option<(u32, u8)> {
        let length = 1 + self.limits.iter().position(|&limit| bits < limit)?;
        let number = (bits >> (16 - length)) as i32;
        let value = self.values.get((number + self.offsets[length - 1]) as usize)?;
        Some((length as u32, *value))
    }
}
