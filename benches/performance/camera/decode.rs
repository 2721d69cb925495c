//! What a program does with a frame: repair, decode, copy.

use std::hint::black_box;

use allocation_counter::{measure, AllocationInfo};
use anyhow::{ensure, Context, Result};
use ft_transfer_area::wire::CameraFrameHeader;
use ft_transfer_area::{fuzzing, CameraFrame, CameraOptions};
use jpeg_decoder::Decoder;
use zune_jpeg::zune_core::bytestream::ZCursor;
use zune_jpeg::JpegDecoder;

use super::peer::packet;
use crate::pictures::{Format, Motif};
use crate::report::{Report, Table};
use crate::rounds::{alternate, ratio, shown, Work};
use crate::stats::Sorted;

const FORMATS: [Format; 4] = [
    Format::new(Motif::TestCard, 320, 240),
    Format::new(Motif::TestCard, 640, 480),
    Format::new(Motif::Texture, 320, 240),
    Format::new(Motif::Texture, 640, 480),
];

/// The works with each picture, in their order.
const NAMES: [&str; 5] = ["jpeg", "to_rgb", "to_yuv422", "jpeg-decoder", "zune-jpeg"];

/// Repair and decoding beside other decoders, with the same pictures.
pub(crate) fn measure_decoders(report: &Report) -> Result<()> {
    let formats = report.some(&FORMATS);
    let mut works = Vec::new();
    for &format in formats {
        let frame = format.frame()?;
        check(&frame)?;
        works.extend(NAMES.map(|name| work(format, name, frame.clone())));
    }
    let times = alternate(report, "camera_decode", report.times(150, 2), &mut works)?;
    let mut table = Table::new([
        "picture",
        "`to_rgb`",
        "`to_yuv422`",
        "`jpeg` (repair)",
        "jpeg-decoder alone",
        "zune-jpeg alone",
        "jpeg-decoder of zune-jpeg",
        "our part of `to_rgb`, % of decoding",
    ]);
    for (format, times) in formats.iter().zip(times.chunks_exact(NAMES.len())) {
        let [repair, rgb, yuv, alone, zune] = times else { continue };
        let ours = rgb.iter().zip(alone).map(|(rgb, alone)| 100.0 * (rgb - alone) / alone);
        table.row([
            format.name(),
            shown(rgb),
            shown(yuv),
            shown(repair),
            shown(alone),
            shown(zune),
            ratio(alone, zune).with_spread(2),
            Sorted::of(ours).with_spread(1),
        ]);
    }
    report.table("camera_decode", &table)
}

/// Whether all of them decode it, and to nearly the same.
fn check(frame: &CameraFrame) -> Result<()> {
    let ours = frame.to_rgb()?.data;
    frame.to_yuv422()?;
    let theirs = decode_with_zune(&frame.jpeg()?).context("zune-jpeg refuses the picture")?;
    ensure!(ours.len() == theirs.len(), "the decoders disagree about the size");
    let difference: u64 =
        ours.iter().zip(&theirs).map(|(ours, theirs)| u64::from(ours.abs_diff(*theirs))).sum();
    ensure!(difference < 8 * ours.len() as u64, "the decoders disagree about the picture");
    Ok(())
}

fn work(format: Format, name: &str, frame: CameraFrame) -> Work {
    let repaired = frame.jpeg().map(|jpeg| jpeg.into_owned()).unwrap_or_default();
    let full = format!("{name}, {}", format.name());
    match name {
        "jpeg" => Work::new(full, move || black_box(&frame).jpeg().map(|jpeg| jpeg.len())),
        "to_rgb" => Work::new(full, move || black_box(&frame).to_rgb()),
        "to_yuv422" => Work::new(full, move || black_box(&frame).to_yuv422()),
        "jpeg-decoder" => {
            Work::new(full, move || Decoder::new(black_box(repaired.as_slice())).decode())
        }
        _ => Work::new(full, move || decode_with_zune(black_box(&repaired))),
    }
}

fn decode_with_zune(jpeg: &[u8]) -> Option<Vec<u8>> {
    JpegDecoder::new(ZCursor::new(jpeg)).decode().ok()
}

/// How many bytes are allocated for each byte of a frame. Where a byte is copied to, it needs a place.
pub(crate) fn measure_copies(report: &Report) -> Result<()> {
    let mut raw =
        report.raw("camera_copies", &["step", "allocations", "bytes", "bytes of frame"])?;
    let mut table = Table::new(["step", "bytes allocated per byte of the frame"]);
    let packet = packet(Format::new(Motif::Texture, 640, 480))?;
    let size = packet.len() - CameraFrameHeader::LEN;
    let [few, many] = [1, 101].map(|frames| receive(&packet, frames));
    let frame = CameraFrame::new(packet[CameraFrameHeader::LEN..].to_vec());
    let complete = CameraFrame::new(frame.jpeg()?.into_owned());
    let repair = |frame: &CameraFrame| measure(|| drop(black_box(frame.jpeg())));
    let steps = [
        (
            "from the socket to the program",
            (many.count_total - few.count_total) / 100,
            (many.bytes_total - few.bytes_total) / 100,
        ),
        ("`jpeg` of the camera's frame", repair(&frame).count_total, repair(&frame).bytes_total),
        (
            "`jpeg` of a frame that is complete",
            repair(&complete).count_total,
            repair(&complete).bytes_total,
        ),
    ];
    for (step, count, bytes) in steps {
        raw.write_record([step, &count.to_string(), &bytes.to_string(), &size.to_string()])?;
        table.row([step.to_owned(), format!("{:.2}", bytes as f64 / size as f64)]);
    }
    raw.flush()?;
    report.table("camera_copies", &table)
}

/// What is allocated to receive this number of frames, by the library's own code on a connection in memory.
fn receive(packet: &[u8], frames: usize) -> AllocationInfo {
    let (header, data) = packet.split_at(CameraFrameHeader::LEN);
    let pieces = [header, data].repeat(frames).into_iter().map(<[u8]>::to_vec).collect();
    measure(|| drop(black_box(fuzzing::read_frames(pieces, CameraOptions::default()))))
}
