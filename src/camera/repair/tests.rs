//! Pictures made by hand: with tables whose only code is one zero bit, each block is two of them, and
//! all data bytes are 0. What follows the picture is 0 too, so that only counting finds its end.

use super::super::decode::{decode_rgb, decode_yuv422};
use super::*;

const EOI: [u8; 2] = [0xFF, 0xD9];

/// A segment: marker, length, content.
fn segment(marker: u8, content: &[u8]) -> Vec<u8> {
    let length = u16::try_from(2 + content.len()).unwrap();
    [&[0xFF, marker][..], &length.to_be_bytes(), content].concat()
}

/// A table with these counts of codes, whose values are all 0.
fn table(place: u8, counts: [u8; 16]) -> Vec<u8> {
    let count = counts.iter().map(|&count| usize::from(count)).sum();
    segment(marker::DHT, &[&[place][..], &counts, &vec![0; count]].concat())
}

const ONE_CODE: [u8; 16] = [1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0];

/// Everything before the first scan of a picture whose components have these factors.
fn header(width: u16, height: u16, factors: &[(u8, u8)]) -> Vec<u8> {
    let mut frame = vec![8];
    frame.extend(height.to_be_bytes());
    frame.extend(width.to_be_bytes());
    frame.push(factors.len() as u8);
    for (id, (horizontal, vertical)) in (1..).zip(factors) {
        frame.extend([id, horizontal << 4 | vertical, 0]);
    }
    [
        vec![0xFF, marker::SOI],
        segment(0xDB, &[&[0][..], &[1; 64]].concat()),
        segment(marker::SOF0, &frame),
        table(0x00, ONE_CODE),
        table(0x10, ONE_CODE),
    ]
    .concat()
}

/// A scan of these components with so many blocks in all.
fn scan(ids: &[u8], blocks: usize) -> Vec<u8> {
    let mut content = vec![ids.len() as u8];
    content.extend(ids.iter().flat_map(|&id| [id, 0]));
    content.extend([0, 63, 0]);
    let mut scan = segment(marker::SOS, &content);
    scan.resize(scan.len() + (2 * blocks).div_ceil(8), 0);
    scan
}

/// Checks that a picture without its end is cut at its end, whatever follows.
fn check_end(picture: &[u8]) {
    for garbage in [&[][..], &[0], &[0; 50], &[0xFF], &[0xFF, 0xD0], &[0x55, 0xFF, 0xD9]] {
        let repaired = repair(&[picture, garbage].concat()).map(|repaired| repaired.jpeg.to_vec());
        assert_eq!(repaired, Ok([picture, &EOI].concat()), "garbage {garbage:?}");
    }
}

fn reason(picture: &[u8]) -> String {
    match repair(picture) {
        Err(Error::BadPicture { reason }) => reason,
        Err(error) => panic!("{error:?}"),
        Ok(_) => panic!("it was mended"),
    }
}

#[test]
fn interleaved_components_have_blocks_up_to_the_next_whole_unit() {
    for (factors, blocks) in [
        // 17 x 9 pixels are 3 x 2 units of 8 x 8, 2 x 2 of 16 x 8, 2 x 1 of 16 x 16.
        (&[(1, 1), (1, 1), (1, 1)][..], 6 * 3),
        (&[(2, 1), (1, 1), (1, 1)], 4 * 4),
        (&[(2, 2), (1, 1), (1, 1)], 2 * 6),
        (&[(4, 1), (1, 1), (1, 1)], 2 * 6),
    ] {
        check_end(&[header(17, 9, factors), scan(&[1, 2, 3], blocks)].concat());
    }
}

#[test]
fn a_component_alone_has_the_blocks_that_its_samples_need() {
    // Of 17 x 9 pixels at 2x2, luma has 3 x 2 blocks; chroma has 9 x 5 samples in 2 x 1 blocks.
    let start = header(17, 9, &[(2, 2), (1, 1), (1, 1)]);
    check_end(&[start, scan(&[1], 6), scan(&[2], 2), scan(&[3], 2)].concat());
    check_end(&[header(9, 9, &[(1, 1)]), scan(&[1], 4)].concat());
}

#[test]
fn restart_markers_come_in_their_order() {
    let interval = segment(marker::DRI, &[0, 2]);
    // 3 x 2 units: two, two, two, with the bits of each filled up to a byte.
    let with = |first: u8, second: u8| {
        let mut picture = [header(24, 16, &[(1, 1)]), interval.clone(), scan(&[1], 2)].concat();
        picture.extend([0xFF, first, 0, 0xFF, second, 0]);
        picture
    };
    check_end(&with(0xD0, 0xD1));
    assert!(reason(&with(0xD1, 0xD0)).contains("damaged"));
    assert!(reason(&with(0xD0, 0xD2)).contains("damaged"));
}

#[test]
fn a_restart_interval_has_two_bytes() {
    let interval = segment(marker::DRI, &[1, 0]);
    // 300 units, with a marker behind 256 of them.
    let mut picture = [header(2400, 8, &[(1, 1)]), interval, scan(&[1], 256)].concat();
    picture.extend([0xFF, 0xD0]);
    picture.resize(picture.len() + 2 * 44 / 8, 0);
    check_end(&picture);
}

#[test]
fn fill_bytes_belong_to_the_marker_behind_them() {
    let picture = [header(8, 8, &[(1, 1)]), scan(&[1], 1)].concat();
    let filled = [&picture[..], &[0xFF, 0xFF, 0xFF, 0xD9]].concat();
    let repaired = repair(&[&filled[..], &[7; 9]].concat()).unwrap().jpeg.into_owned();
    assert_eq!(repaired, filled);
}

#[test]
fn a_picture_with_an_end_but_without_tables_gets_them() {
    let with_tables = [header(8, 8, &[(1, 1)]), scan(&[1], 1)].concat();
    let tables = table(0x00, ONE_CODE).len() + table(0x10, ONE_CODE).len();
    let at = header(8, 8, &[(1, 1)]).len() - tables;
    // In the standard tables the codes are 00 and 1010.
    let mut scan = scan(&[1], 1);
    *scan.last_mut().unwrap() = 0b0010_1011;
    let picture = [&with_tables[..at], &scan, &EOI].concat();
    let repaired = repair(&picture).unwrap().jpeg.into_owned();
    assert_eq!(repaired, [&picture[..at], &STANDARD_TABLES, &picture[at..]].concat());
    assert!(decode_rgb(&repaired).is_ok());
}

#[test]
fn grey_pictures_are_grey() {
    let picture = [header(9, 9, &[(1, 1)]), scan(&[1], 4)].concat();
    let jpeg = repair(&picture).unwrap().jpeg.into_owned();
    assert_eq!(decode_rgb(&jpeg).unwrap().data, [128; 9 * 9 * 3]);
    // A row of odd width ends with its last pixel twice.
    assert_eq!(decode_yuv422(&jpeg, false).unwrap().data, [128; 10 * 9 * 2]);
}

#[test]
fn half_of_the_chroma_in_a_row_is_4_2_2_in_whatever_factors() {
    for (factors, expected) in [
        (&[(2, 1), (1, 1), (1, 1)][..], true),
        (&[(2, 2), (1, 2), (1, 2)], true),
        (&[(2, 2), (1, 1), (1, 1)], false),
        (&[(1, 1), (1, 1), (1, 1)], false),
        (&[(1, 1)], false),
    ] {
        let ids: Vec<u8> = (1..).take(factors.len()).collect();
        let picture = [header(16, 16, factors), scan(&ids, 12)].concat();
        assert_eq!(repair(&picture).unwrap().is_422, expected, "{factors:?}");
    }
}

#[test]
fn what_is_no_baseline_picture_errs() {
    let good = [header(8, 8, &[(1, 1)]), scan(&[1], 1)].concat();
    let frame_at = good.windows(2).position(|bytes| bytes == [0xFF, marker::SOF0]).unwrap();
    let mut progressive = good.clone();
    progressive[frame_at + 1] = 0xC2;
    assert!(reason(&progressive).contains("baseline"));

    let twice = [header(8, 8, &[(1, 1), (1, 1)]), scan(&[1], 1), scan(&[1], 1)].concat();
    assert!(reason(&twice).contains("header of its data"));

    let mut too_many = ONE_CODE;
    too_many[0] = 3;
    let tables = [header(8, 8, &[(1, 1)]), table(0x00, too_many), scan(&[1], 1)].concat();
    assert!(reason(&tables).contains("tables"));

    let mut early = header(8, 8, &[(1, 1)]);
    early.extend(EOI);
    assert!(reason(&early).contains("ends before"));
}

#[test]
fn a_picture_that_no_memory_holds_errs_before_it_is_decoded() {
    for (width, height) in [(65535, 65535), (8, 65535), (32768, 8), (16384, 16384)] {
        let picture = [header(width, height, &[(1, 1)]), scan(&[1], 1 << 20)].concat();
        assert!(reason(&picture).contains("large"), "{width} x {height}");
    }
    let size = 4096 / 8 * 4096 / 8;
    check_end(&[header(4096, 4096, &[(1, 1)]), scan(&[1], size)].concat());
}
