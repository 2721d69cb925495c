//! A frame as the camera sends it: almost a JPEG file.

use jpeg_encoder::{Encoder, EncodingError, SamplingFactor};

use super::test_card::TestCard;

/// The quality of the picture, 1..=100.
const QUALITY: u8 = 85;

/// The end of a JPEG file, which a frame does not have.
const END_OF_IMAGE: [u8; 2] = [0xFF, 0xD9];

/// Second byte of the marker of a Huffman table.
const TABLE: u8 = 0xC4;

/// Second byte of the marker before the compressed data.
const START_OF_SCAN: u8 = 0xDA;

/// How many bytes follow the picture.
const GARBAGE_SIZE: usize = 40;

/// Garbage that looks like a frame header, a scan and a restart marker.
const FALSE_MARKERS: [[u8; 2]; 3] = [[0xFF, 0xC0], [0xFF, 0xDA], [0xFF, 0xD3]];

/// The bytes of the frame with this number, with Huffman tables or without.
///
/// It fails only if the encoder fails, which is not expected.
pub(super) fn frame(card: TestCard, number: u64, tables: bool) -> Result<Vec<u8>, EncodingError> {
    Ok(frame_of(&picture(card)?, number, tables))
}

/// The same of any picture, a JPEG file.
pub(super) fn frame_of(jpeg: &[u8], number: u64, tables: bool) -> Vec<u8> {
    let picture = jpeg.strip_suffix(&END_OF_IMAGE).unwrap_or(jpeg);
    let mut bytes = if tables { picture.to_vec() } else { without_tables(picture) };
    bytes.extend(garbage(number));
    bytes
}

/// A JPEG with baseline 4:2:2 and the standard's Huffman tables.
fn picture(card: TestCard) -> Result<Vec<u8>, EncodingError> {
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(&mut bytes, QUALITY);
    encoder.set_sampling_factor(SamplingFactor::F_2_1);
    encoder.encode_image(card)?;
    Ok(bytes)
}

/// Removes the Huffman tables. Data that can't be understood stay the same.
fn without_tables(jpeg: &[u8]) -> Vec<u8> {
    let (start, mut rest) = jpeg.split_at(jpeg.len().min(2));
    let mut kept = start.to_vec();
    while let Some((kind, segment, behind)) = split_segment(rest) {
        if kind == START_OF_SCAN {
            break;
        }
        if kind != TABLE {
            kept.extend_from_slice(segment);
        }
        rest = behind;
    }
    kept.extend_from_slice(rest);
    kept
}

/// The kind and the bytes of the first segment, and what follows it.
fn split_segment(bytes: &[u8]) -> Option<(u8, &[u8], &[u8])> {
    let [0xFF, kind, high, low, ..] = *bytes else { return None };
    // The size does not count the marker.
    let size = 2 + usize::from(u16::from_be_bytes([high, low]));
    let (segment, behind) = bytes.split_at_checked(size)?;
    Some((kind, segment, behind))
}

/// What follows the picture: noise, in every other frame with markers.
fn garbage(number: u64) -> [u8; GARBAGE_SIZE] {
    let mut state = number;
    let mut garbage = [0; GARBAGE_SIZE].map(|_: u8| {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        // The high bits are the most random ones. Only markers have FF, so that no end marker appears.
        ((state >> 56) as u8).min(0xFE)
    });
    if number % 2 == 1 {
        // From the first byte after the picture to the last byte.
        let first = (number / 2 % 13) as usize;
        for (index, marker) in FALSE_MARKERS.iter().enumerate() {
            let at = first + 13 * index;
            garbage[at..at + marker.len()].copy_from_slice(marker);
        }
    }
    garbage
}

#[cfg(test)]
mod tests {
    use super::super::annex_k;
    use super::*;

    /// Kinds and contents of the segments before the scan.
    fn segments(jpeg: &[u8]) -> Vec<(u8, &[u8])> {
        let mut segments = Vec::new();
        let mut rest = &jpeg[2..];
        while let Some((kind, segment, behind)) = split_segment(rest) {
            if kind == START_OF_SCAN {
                break;
            }
            segments.push((kind, &segment[4..]));
            rest = behind;
        }
        segments
    }

    fn contains(bytes: &[u8], marker: [u8; 2]) -> bool {
        bytes.windows(2).any(|pair| pair == marker)
    }

    #[test]
    fn the_tables_are_those_of_the_standard() {
        let jpeg = picture(TestCard::new(320, 240, 7)).unwrap();
        let segments = segments(&jpeg);
        let tables = segments.iter().filter(|(kind, _)| *kind == TABLE).map(|(_, table)| *table);
        assert!(tables.eq(annex_k::TABLES));
    }

    #[test]
    fn without_tables_everything_else_stays() {
        let card = || TestCard::new(64, 48, 7);
        let [with, without] = [true, false].map(|tables| frame(card(), 7, tables).unwrap());
        assert_eq!(with.len() - without.len(), 4 * 4 + 2 * (29 + 179));
        let mut expected = segments(&with);
        expected.retain(|(kind, _)| *kind != TABLE);
        assert_eq!(segments(&without), expected);
        let scan = with.len() - 500.min(with.len() / 2);
        assert!(without.ends_with(&with[scan..]));
    }

    #[test]
    fn data_that_are_not_a_jpeg_stay_the_same() {
        for bytes in [&[][..], &[0xFF], &[0xFF, 0xD8, 0xFF, 0xC4, 0, 9], &[1, 2, 3, 4, 5, 6]] {
            assert_eq!(without_tables(bytes), bytes);
        }
    }

    #[test]
    fn a_frame_is_baseline_with_chroma_halved_in_width_and_never_ends() {
        for number in 0..30 {
            let bytes = frame(TestCard::new(48, 32, number), number, true).unwrap();
            assert_eq!(bytes[..2], [0xFF, 0xD8]);
            assert!(!contains(&bytes, END_OF_IMAGE));
            let segments = segments(&bytes);
            let (_, header) = segments.iter().find(|(kind, _)| *kind == 0xC0).unwrap();
            // 8 bits, height, width, and each component's number, sampling and quantisation.
            let components = [0, 0x21, 0, 1, 0x11, 1, 2, 0x11, 1];
            assert_eq!(header[..6], [8, 0, 32, 0, 48, 3]);
            assert_eq!(header[6..], components);
        }
    }

    #[test]
    fn garbage_depends_on_the_number_and_has_markers_every_other_time() {
        for number in 0..100 {
            let garbage = garbage(number);
            assert_ne!(garbage, super::garbage(number + 1));
            for marker in FALSE_MARKERS {
                assert_eq!(contains(&garbage, marker), number % 2 == 1);
            }
            assert!(!contains(&garbage, END_OF_IMAGE));
        }
        assert_eq!(garbage(1)[..2], FALSE_MARKERS[0]);
        assert_eq!(garbage(25)[38..], FALSE_MARKERS[2]);
    }
}
