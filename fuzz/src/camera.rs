//! The camera's connection and its pictures.

use std::borrow::Cow;

use arbitrary::{Result, Unstructured};
use ft_transfer_area::fuzzing::read_frames;
use ft_transfer_area::wire::{CameraFrameHeader, CAMERA_FRAME_ACKNOWLEDGE};
use ft_transfer_area::{CameraFrame, CameraOptions, Error};

use super::take;

/// The most bytes of a frame. Both larger and smaller frames are sent.
const MAX_FRAME_SIZE: usize = 2000;

/// Sends the bytes like a camera server, in pieces and with signals between them, then closes the
/// connection. The received frames must be those in the bytes.
pub fn camera_stream(data: &[u8]) {
    // The input ends when there are no more bytes.
    let _ = stream(&mut Unstructured::new(data));
}

fn stream(input: &mut Unstructured) -> Result<()> {
    let channel_frames = input.int_in_range(1..=4)?;
    let mut pieces = Vec::new();
    while !input.is_empty() {
        pieces.push(take(input, 300)?.to_vec());
    }
    let bytes = pieces.concat();
    let options =
        CameraOptions::default().channel_frames(channel_frames).max_frame_size(MAX_FRAME_SIZE);
    let (frames, error, acknowledges) = read_frames(pieces, options);

    let (expected, expected_error) = expected_frames(&bytes);
    // The channel keeps the newest frames.
    let dropped = expected.len().saturating_sub(channel_frames);
    assert_eq!(frames.len(), expected.len() - dropped);
    for (index, frame) in frames.iter().enumerate() {
        let (header, data) = &expected[dropped + index];
        assert_eq!(frame.sequence, (dropped + index) as u64);
        assert_eq!(frame.data, *data);
        assert_eq!(frame.width, u16::try_from(header.width).unwrap_or(0));
        assert_eq!(frame.height, u16::try_from(header.height).unwrap_or(0));
        assert_eq!(frame.size_raw, u32::try_from(header.size_raw).unwrap_or(0));
        assert_eq!(frame.frames_ready, u32::try_from(header.frames_ready).unwrap_or(0));
    }
    match (&error, &expected_error) {
        (
            Error::ConnectionClosed { received, .. },
            Error::ConnectionClosed { received: expected, .. },
        ) => assert_eq!(received, expected),
        _ => assert_eq!(error, expected_error),
    }
    assert_eq!(acknowledges, CAMERA_FRAME_ACKNOWLEDGE.repeat(expected.len()));
    Ok(())
}

/// The frames at the start of these bytes, and the error for the bytes after them.
fn expected_frames(mut bytes: &[u8]) -> (Vec<(CameraFrameHeader, Vec<u8>)>, Error) {
    let mut frames = Vec::new();
    let closed = |received| Error::ConnectionClosed { command: "", received };
    loop {
        let Some((header, behind)) = bytes.split_at_checked(CameraFrameHeader::LEN) else {
            return (frames, closed(bytes.len()));
        };
        let header = match CameraFrameHeader::parse(header) {
            Ok(header) => header,
            Err(error) => return (frames, error),
        };
        let announced = header.size_compressed;
        if !(1..=MAX_FRAME_SIZE as i32).contains(&announced) {
            return (frames, Error::FrameSize { announced, limit: MAX_FRAME_SIZE });
        }
        let Some((data, rest)) = behind.split_at_checked(announced as usize) else {
            return (frames, closed(bytes.len()));
        };
        frames.push((header, data.to_vec()));
        bytes = rest;
    }
}

fn frame(data: &[u8]) -> CameraFrame {
    CameraFrame::new(data.to_vec())
}

/// Repairs a picture. The result is whole, and repairing it again changes nothing.
pub fn repair(data: &[u8]) {
    let camera_frame = frame(data);
    match camera_frame.jpeg() {
        Ok(jpeg) => {
            assert!(jpeg.starts_with(&[0xFF, 0xD8]) && jpeg.ends_with(&[0xFF, 0xD9]));
            let again = frame(&jpeg);
            let again = again.jpeg().expect("it was repaired");
            assert!(matches!(again, Cow::Borrowed(_)), "it was copied");
            assert_eq!(again, jpeg);
        }
        Err(Error::BadPicture { reason }) => assert!(!reason.is_empty()),
        Err(error) => panic!("{error}"),
    }
}

/// Decodes a picture in both ways.
pub fn decode(data: &[u8]) {
    let frame = frame(data);
    let is_repaired = frame.jpeg().is_ok();
    match (frame.to_rgb(), frame.to_yuv422()) {
        (Ok(rgb), Ok(yuv)) => {
            assert!(is_repaired);
            assert_eq!((rgb.width, rgb.height), (yuv.width, yuv.height));
            let (width, height) = (usize::from(rgb.width), usize::from(rgb.height));
            assert_eq!(rgb.data.len(), 3 * width * height);
            assert_eq!(yuv.data.len(), 4 * width.div_ceil(2) * height);
        }
        (Err(Error::BadPicture { .. }), Err(Error::BadPicture { .. })) => {}
        // One way must not accept a picture that the other way refuses.
        (rgb, yuv) => panic!("{:?} {:?}", rgb.err(), yuv.err()),
    }
}
