//! From the camera's data to pictures.

use std::borrow::Cow;
use std::fs;

use ft_transfer_area::{CameraFrame, Error, Picture};

/// The files that hold the same picture.
const SAME_PICTURE: [&str; 5] = [
    "clean_320x240_422.jpg",
    "no_eoi_320x240_422.jpg",
    "no_eoi_garbage_320x240_422.jpg",
    "no_eoi_garbage_markers_320x240_422.jpg",
    "no_dht_no_eoi_320x240_422.jpg",
];
const RESTART_MARKERS: &str = "restart_markers_no_eoi_160x120_422.jpg";
const HALVED_TWICE: &str = "clean_320x240_420.jpg";
/// The same two kinds, small enough for a test of thousands of mistakes.
const SMALL_RESTART_MARKERS: &str = "restart_markers_no_eoi_48x32_422.jpg";
const SMALL_HALVED_TWICE: &str = "clean_48x32_420.jpg";

/// The maximum difference of a sample from that of an accurate decoder.
const TOLERANCE: u8 = 1;

fn file(name: &str) -> Vec<u8> {
    let path = format!("{}/camera/{name}", env!("CARGO_MANIFEST_DIR"));
    fs::read(&path).unwrap_or_else(|error| panic!("{path}: {error}"))
}

fn frame(data: Vec<u8>) -> CameraFrame {
    CameraFrame::new(data)
}

fn check_samples(name: &str, expected: &str) {
    let Picture { data, .. } = frame(file(name)).to_yuv422().unwrap();
    let expected = file(expected);
    assert_eq!(data.len(), expected.len(), "{name}");
    let worst = data.iter().zip(&expected).map(|(a, b)| a.abs_diff(*b)).max();
    assert!(worst <= Some(TOLERANCE), "{name}: a sample differs by {worst:?}");
}

#[test]
fn yuv_has_the_samples_of_the_jpeg() {
    for name in SAME_PICTURE {
        check_samples(name, "clean_320x240_422.yuyv");
    }
    check_samples(RESTART_MARKERS, "restart_markers_160x120_422.yuyv");
}

#[test]
fn all_forms_of_the_same_picture_decode_to_the_same_pixels() {
    let rgb = frame(file(SAME_PICTURE[0])).to_rgb().unwrap();
    assert_eq!((rgb.width, rgb.height, rgb.data.len()), (320, 240, 320 * 240 * 3));
    assert!(rgb.data.iter().any(|&sample| sample != rgb.data[0]), "the picture is empty");
    let yuv = frame(file(SAME_PICTURE[0])).to_yuv422().unwrap();
    for name in &SAME_PICTURE[1..] {
        assert_eq!(frame(file(name)).to_rgb().unwrap(), rgb, "{name}");
        assert_eq!(frame(file(name)).to_yuv422().unwrap(), yuv, "{name}");
    }
}

#[test]
fn other_samplings_decode_as_well() {
    let frame = frame(file(HALVED_TWICE));
    assert_eq!(frame.to_rgb().unwrap().data.len(), 320 * 240 * 3);
    let yuv = frame.to_yuv422().unwrap().data;
    // The same scene, so the samples are nearly those of the other files.
    let expected = file("clean_320x240_422.yuyv");
    assert_eq!(yuv.len(), expected.len());
    for (what, place, step) in [("luma", 0, 2), ("Cb", 1, 4), ("Cr", 3, 4)] {
        let of = |samples: &[u8]| samples.iter().skip(place).step_by(step).copied().collect();
        let (found, expected): (Vec<u8>, Vec<u8>) = (of(&yuv), of(&expected));
        let differences = found.iter().zip(&expected).map(|(a, b)| u64::from(a.abs_diff(*b)));
        let (difference, count) = (differences.sum::<u64>(), found.len() as u64);
        assert!(difference < 3 * count, "{what} differs by {difference} in {count} samples");
    }
}

#[test]
fn the_picture_is_cut_at_the_exact_place() {
    let clean = file(SAME_PICTURE[0]);
    for name in &SAME_PICTURE[..4] {
        assert_eq!(frame(file(name)).jpeg().unwrap(), clean, "{name}");
    }
    for garbage in [&[][..], &[0], &[0xFF], &[0xFF, 0], &[0xFF, 0xD0, 1], &[0x55; 1000]] {
        let mut data = clean[..clean.len() - 2].to_vec();
        data.extend(garbage);
        assert_eq!(frame(data).jpeg().unwrap(), clean, "garbage {garbage:?}");
    }
}

#[test]
fn a_correct_picture_is_not_copied() {
    let clean = frame(file(SAME_PICTURE[0]));
    assert!(matches!(clean.jpeg().unwrap(), Cow::Borrowed(bytes) if bytes == clean.data));
    let mut behind = clean.clone();
    behind.data.extend(b"garbage behind the end");
    assert!(matches!(behind.jpeg().unwrap(), Cow::Borrowed(bytes) if bytes == clean.data));
}

#[test]
fn a_picture_without_tables_gets_the_standard_ones() {
    let repaired = frame(file("no_dht_no_eoi_320x240_422.jpg"));
    let jpeg = repaired.jpeg().unwrap();
    assert!(jpeg.ends_with(&[0xFF, 0xD9]));
    assert_eq!(jpeg.windows(2).filter(|bytes| *bytes == [0xFF, 0xC4]).count(), 1);
    // Mending it again changes nothing.
    let again = frame(jpeg.clone().into_owned());
    assert!(matches!(again.jpeg().unwrap(), Cow::Borrowed(bytes) if jpeg == bytes));
}

/// Decodes in every way; with any bytes, this must return.
fn decode(data: Vec<u8>) -> Result<(), Error> {
    let frame = frame(data);
    let results = [frame.jpeg().map(drop), frame.to_rgb().map(drop), frame.to_yuv422().map(drop)];
    for result in &results {
        assert!(matches!(result, Ok(()) | Err(Error::BadPicture { .. })), "{result:?}");
    }
    results.into_iter().collect()
}

#[test]
fn pictures_that_are_cut_off_err() {
    let mut count = 0;
    for (name, step) in SAME_PICTURE.map(|name| (name, 100)).into_iter().chain([
        (RESTART_MARKERS, 100),
        (HALVED_TWICE, 100),
        (SMALL_RESTART_MARKERS, 1),
        (SMALL_HALVED_TWICE, 1),
    ]) {
        let data = file(name);
        // Without the end marker and the tables that were added.
        let added = 2 + if name.contains("no_dht") { 420 } else { 0 };
        let whole = frame(data.clone()).jpeg().unwrap().len() - added;
        let lengths = (0..data.len()).step_by(step);
        for length in lengths.chain(whole.saturating_sub(10)..data.len().min(whole + 10)) {
            let result = decode(data[..length].to_vec());
            assert_eq!(result.is_ok(), length >= whole, "{name} cut after {length} bytes");
            count += 1;
        }
    }
    assert!(count > 2500, "only {count} cuts");
}

#[test]
fn pictures_with_a_flipped_byte_decode_or_err() {
    let mut decoded = 0;
    let mut count = 0;
    for (name, flips) in [(SMALL_RESTART_MARKERS, [0x01, 0xFF]), (SMALL_HALVED_TWICE, [0x80, 0xFF])]
    {
        let data = file(name);
        for position in 0..data.len() {
            for flip in flips {
                let mut data = data.clone();
                data[position] ^= flip;
                decoded += usize::from(decode(data).is_ok());
                count += 1;
            }
        }
    }
    assert!(count > 4000 && decoded > 100, "{decoded} of {count} decoded");
}

#[test]
fn random_bytes_behind_a_header_decode_or_err() {
    let data = file(SAME_PICTURE[0]);
    let scan = data.windows(2).position(|bytes| bytes == [0xFF, 0xDA]).unwrap();
    let mut state = 0x9E37_79B9_u32;
    for round in 0..5000 {
        // The whole header, or without its tables, or cut somewhere.
        let mut bytes =
            data[..if round % 3 == 0 { scan * round / 5000 } else { scan + 14 }].to_vec();
        for _ in 0..round % 2000 {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            bytes.push((state >> 24) as u8);
        }
        let _ = decode(bytes);
    }
}

#[test]
fn bytes_that_are_no_picture_err() {
    for data in [&b""[..], b"\xFF", b"\xFF\xD8", b"GIF89a", &[0; 100], &[0xFF; 100]] {
        let error = decode(data.to_vec()).unwrap_err();
        assert!(error.to_string().contains("not a usable picture"), "{error}");
    }
}
