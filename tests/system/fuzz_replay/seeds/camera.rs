//! Seeds of the camera's connection and its pictures.

use std::time::Duration;

use ft_transfer_area::wire::CameraFrameHeader;
use ft_transfer_area::{CameraOptions, TransferAreaComHandler};
use ft_transfer_area_simulator::SimulatedTxt;
use jpeg_encoder::{ColorType, Encoder, SamplingFactor};

use super::{write, Input};

/// A frame as it comes over the camera's connection.
pub(super) fn frame(jpeg: &[u8]) -> Vec<u8> {
    let mut out = Vec::new();
    CameraFrameHeader {
        frames_ready: 1,
        width: 32,
        height: 24,
        size_raw: 32 * 24 * 2,
        size_compressed: jpeg.len() as i32,
    }
    .emit(&mut out);
    out.extend_from_slice(jpeg);
    out
}

/// A small picture with some content.
fn picture(
    colours: ColorType,
    [width, height]: [u16; 2],
    change: impl FnOnce(&mut Encoder<&mut Vec<u8>>),
) -> Vec<u8> {
    let mut jpeg = Vec::new();
    let mut encoder = Encoder::new(&mut jpeg, 60);
    change(&mut encoder);
    let channels = match colours {
        ColorType::Luma => 1,
        ColorType::Cmyk => 4,
        _ => 3,
    };
    let size = usize::from(width) * usize::from(height) * channels;
    let samples: Vec<u8> = (0..size).map(|i| (i * (i + 2) / 7 % 251) as u8).collect();
    encoder.encode(&samples, width, height, colours).unwrap();
    jpeg
}

pub(super) fn write_all() {
    let sampled =
        |factor| move |encoder: &mut Encoder<&mut Vec<u8>>| encoder.set_sampling_factor(factor);
    let mut pictures = vec![
        ("422", picture(ColorType::Rgb, [32, 24], sampled(SamplingFactor::F_2_1))),
        ("422_odd", picture(ColorType::Rgb, [17, 9], sampled(SamplingFactor::F_2_1))),
        ("420", picture(ColorType::Rgb, [32, 24], sampled(SamplingFactor::F_2_2))),
        ("444", picture(ColorType::Rgb, [16, 16], sampled(SamplingFactor::F_1_1))),
        ("411", picture(ColorType::Rgb, [32, 8], sampled(SamplingFactor::F_4_1))),
        ("grey", picture(ColorType::Luma, [16, 16], |_| {})),
        ("cmyk", picture(ColorType::Cmyk, [16, 16], |_| {})),
        ("progressive", picture(ColorType::Rgb, [16, 16], |encoder| encoder.set_progressive(true))),
        (
            "own_tables",
            picture(ColorType::Rgb, [32, 24], |encoder| encoder.set_optimized_huffman_tables(true)),
        ),
        (
            "restart_markers",
            picture(ColorType::Rgb, [64, 48], |encoder| {
                encoder.set_sampling_factor(SamplingFactor::F_2_1);
                encoder.set_restart_interval(2);
            }),
        ),
    ];
    for (tables, names) in
        [(true, ["camera_0", "camera_1"]), (false, ["no_tables_0", "no_tables_1"])]
    {
        pictures.extend(names.into_iter().zip(simulated(tables)));
    }
    let cut = pictures[0].1.len() / 2;
    pictures.push(("cut", pictures[0].1[..cut].to_vec()));
    pictures.push(("one_byte", vec![0xFF]));
    for (name, jpeg) in &pictures {
        write("repair", name, jpeg);
        write("decode", name, jpeg);
    }

    let frames: Vec<u8> = pictures
        .iter()
        .filter(|(_, jpeg)| jpeg.len() < 1000)
        .flat_map(|(_, jpeg)| frame(jpeg))
        .collect();
    for (name, first, size) in
        [("one", 3, 3), ("empty", 3, 0), ("negative", 3, -1), ("large", 2000, 2001)]
    {
        let mut second = frame(&[1, 2, 3]);
        second[16..20].copy_from_slice(&i32::to_le_bytes(size));
        let mut input = Input::default();
        input.int(1, 3);
        for piece in frame(&vec![7; first]).chunks(300).chain([&second[..]]) {
            input.take(piece, 300);
        }
        write("camera_stream", name, input.0);
    }
    for (name, size) in [("large_pieces", 300), ("small_pieces", 7)] {
        let mut input = Input::default();
        input.int(0, 3);
        for piece in frames[..frames.len().min(6 * size + 900)].chunks(size) {
            input.take(piece, 300);
        }
        write("camera_stream", name, input.0);
    }
}

/// The first two frames of the simulated camera, the second with markers after the picture.
fn simulated(tables: bool) -> Vec<Vec<u8>> {
    let txt = SimulatedTxt::builder()
        .camera_tables(tables)
        .camera_start_up(Duration::ZERO)
        .start()
        .unwrap();
    let handler = TransferAreaComHandler::builder(txt.address()).build().unwrap();
    handler.begin_transfer().unwrap();
    let options = CameraOptions::default().size(32, 24);
    let frames = handler.start_camera(options).unwrap();
    frames.iter().take(2).map(|frame| frame.data).collect()
}
