//! Pictures made by hand: the only code of their tables is one zero bit, each block has two codes, and
//! all data bytes are 0. The bytes after the picture are 0, too, so that only counting finds its end.

use super::super::decode::decode_rgb;
use super::super::yuv::decode_yuv422;
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

/// A scan of these components with this total number of blocks.
fn scan(ids: &[u8], blocks: usize) -> Vec<u8> {
    let mut content = vec![ids.len() as u8];
    content.extend(ids.iter().flat_map(|&id| [id, 0]));
    content.extend([0, 63, 0]);
    let mut scan = segment(marker::SOS, &content);
    scan.resize(scan.len() + (2 * blocks).div_ceil(8), 0);
    scan
}

/// Checks that a picture without an end marker is cut at its end, with any bytes after it.
fn check_end(picture: &[u8]) {
    for garbage in [&[][..], &[0], &[0; 50], &[0xFF], &[0xFF, 0xD0], &[0x55, 0xFF, 0xD9]] {
        let repaired = repair(&[picture, garbage].concat()).map(|repaired| repaired.to_vec());
        assert_eq!(repaired, Ok([picture, &EOI].concat()), "garbage {garbage:?}");
    }
}

fn reason(picture: &[u8]) -> String {
    match repair(picture) {
        Err(Error::BadPicture { reason }) => reason,
        Err(error) => panic!("{error:?}"),
        Ok(_) => panic!("it was repaired"),
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
fn restart_markers_must_be_in_order() {
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
    // 300 units, with a marker after 256 of them.
    let mut picture = [header(2400, 8, &[(1, 1)]), interval, scan(&[1], 256)].concat();
    picture.extend([0xFF, 0xD0]);
    picture.resize(picture.len() + 2 * 44 / 8, 0);
    check_end(&picture);
}

#[test]
fn fill_bytes_belong_to_the_marker_after_them() {
    let picture = [header(8, 8, &[(1, 1)]), scan(&[1], 1)].concat();
    let filled = [&picture[..], &[0xFF, 0xFF, 0xFF, 0xD9]].concat();
    let repaired = repair(&[&filled[..], &[7; 9]].concat()).unwrap().into_owned();
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
    let repaired = repair(&picture).unwrap().into_owned();
    assert_eq!(repaired, [&picture[..at], &STANDARD_TABLES, &picture[at..]].concat());
    assert!(decode_rgb(&repaired).is_ok());
}

#[test]
fn grey_pictures_are_grey() {
    let picture = [header(9, 9, &[(1, 1)]), scan(&[1], 4)].concat();
    let jpeg = repair(&picture).unwrap().into_owned();
    assert_eq!(decode_rgb(&jpeg).unwrap().data, [128; 9 * 9 * 3]);
    // A row of odd width ends with its last pixel twice.
    assert_eq!(decode_yuv422(&jpeg).unwrap().data, [128; 10 * 9 * 2]);
}

#[test]
fn pictures_of_two_or_four_components_have_no_yuv() {
    for factors in [&[(1, 1); 2][..], &[(1, 1); 4]] {
        let ids: Vec<u8> = (1..).take(factors.len()).collect();
        let picture = [header(8, 8, factors), scan(&ids, factors.len())].concat();
        assert!(repair(&picture).is_ok());
        let error = decode_yuv422(&picture).unwrap_err().to_string();
        assert!(error.contains("components"), "{error}");
    }
}

#[test]
fn a_picture_that_is_not_baseline_is_an_error() {
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
fn codes_that_decoders_read_differently_are_an_error() {
    let with_value = |value: u8| {
        let ac = segment(marker::DHT, &[&[0x10][..], &ONE_CODE, &[value]].concat());
        let mut picture = [header(8, 8, &[(1, 1)]), ac, scan(&[1], 1)].concat();
        picture.resize(picture.len() + 20, 0);
        repair(&picture).is_ok()
    };
    // 63 coefficients of one bit; runs that end with the block: 7 x (8 + 1) coefficients.
    assert!(with_value(0x01) && with_value(0x81));
    // Runs beyond the block, with a value after them and without.
    assert!(!with_value(0xF1) && !with_value(0xF0));
    // Ends of several blocks, which only pictures of another kind have.
    assert!(!with_value(0x10) && !with_value(0xE0));
}

#[test]
fn headers_that_do_not_fit_the_picture_are_an_error() {
    let ok = [header(8, 8, &[(1, 1), (1, 1)]), scan(&[1, 2], 2)].concat();
    assert!(repair(&ok).is_ok());

    let out_of_order = [header(8, 8, &[(1, 1), (1, 1)]), scan(&[2, 1], 2)].concat();
    assert!(reason(&out_of_order).contains("header of its data"));

    // 10 blocks in a unit are the most.
    let blocks = |vertical| {
        repair(&[header(8, 8, &[(2, 4), (1, vertical)]), scan(&[1, 2], 20)].concat()).is_ok()
    };
    assert!(blocks(2) && !blocks(3));

    let frame = |rest: &[u8]| {
        let components = [&[8, 0, 8, 0, 8, 1, 1, 0x11, 0][..], rest].concat();
        segment(marker::SOF0, &components)
    };
    let long_frame = [&[0xFF, marker::SOI][..], &frame(&[0]), &frame(&[])].concat();
    assert!(reason(&long_frame).contains("size"));
    let two_frames = [&[0xFF, marker::SOI][..], &frame(&[]), &frame(&[])].concat();
    assert!(reason(&two_frames).contains("two sizes"));

    let tables = header(8, 8, &[(1, 1)]);
    let scan_of = |header: &[u8]| [&tables, &segment(marker::SOS, header), &[0; 9][..]].concat();
    assert!(repair(&scan_of(&[1, 1, 0, 0, 63, 0])).is_ok());
    for header in [&[0, 0, 63, 0][..], &[1, 1, 0, 0, 63], &[1, 1, 0, 0, 63, 0, 0], &[1, 1, 0]] {
        assert!(reason(&scan_of(header)).contains("header of its data"), "{header:?}");
    }
}

#[test]
fn a_picture_that_is_too_large_is_an_error_before_it_is_decoded() {
    for (width, height) in [(65535, 65535), (8, 65535), (32768, 8), (16384, 16384)] {
        let picture = [header(width, height, &[(1, 1)]), scan(&[1], 1 << 20)].concat();
        assert!(reason(&picture).contains("large"), "{width} x {height}");
    }
    let size = 4096 / 8 * 4096 / 8;
    check_end(&[header(4096, 4096, &[(1, 1)]), scan(&[1], size)].concat());
}
