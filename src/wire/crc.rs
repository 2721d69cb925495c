//! The checksum of the compressed exchange.

use std::sync::LazyLock;

use crc32fast::Hasher;

/// A new hasher asks what the processor can do, a clone knows it.
static HASHER: LazyLock<Hasher> = LazyLock::new(Hasher::new);

/// The checksum of words before compression: CRC-32/MPEG-2, each word's high byte first.
///
/// The polynomial is 0x04C11DB7, the initial value is 0xFFFFFFFF, and nothing is reflected or inverted.
/// It is computed with the reflected CRC-32: every byte and the result are reflected.
///
/// ```
/// use ft_transfer_area::wire::crc_of_words;
///
/// assert_eq!(crc_of_words(&[0; 27]), 0x4049_3A53);
/// assert_eq!(crc_of_words(&[0; 52]), 0x0BBF_0714);
/// ```
#[doc(alias = "GetCrc")]
pub fn crc_of_words(words: &[u16]) -> u32 {
    // Hashing in pieces keeps the buffer on the stack and lets crc32fast work on many bytes.
    const PIECE: usize = 128;
    let mut hasher = HASHER.clone();
    let mut bytes = [[0; 2]; PIECE];
    for piece in words.chunks(PIECE) {
        for (pair, word) in bytes.iter_mut().zip(piece) {
            *pair = word.reverse_bits().to_le_bytes();
        }
        hasher.update(bytes[..piece.len()].as_flattened());
    }
    (!hasher.finalize()).reverse_bits()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The definition, bit by bit.
    fn defined(words: &[u16]) -> u32 {
        let mut register = 0xFFFF_FFFF_u32;
        for byte in words.iter().flat_map(|word| word.to_be_bytes()) {
            register ^= u32::from(byte) << 24;
            for _ in 0..8 {
                let carry = register & 0x8000_0000 != 0;
                register = (register << 1) ^ if carry { 0x04C1_1DB7 } else { 0 };
            }
        }
        register
    }

    #[test]
    fn the_high_byte_of_a_word_comes_first() {
        assert_eq!(crc_of_words(&[0x3132, 0x3334]), defined(&[0x3132, 0x3334]));
        assert_ne!(crc_of_words(&[0x3132, 0x3334]), crc_of_words(&[0x3231, 0x3433]));
    }

    #[test]
    fn any_number_of_words_has_the_checksum_of_the_definition() {
        let words: Vec<u16> = (0..600_u16).map(|i| i.wrapping_mul(40_503)).collect();
        for count in 0..words.len() {
            assert_eq!(crc_of_words(&words[..count]), defined(&words[..count]), "{count} words");
        }
    }

    #[test]
    fn no_words_leave_the_initial_value() {
        assert_eq!(crc_of_words(&[]), 0xFFFF_FFFF);
    }
}
