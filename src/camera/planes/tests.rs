//! Pictures with flat blocks, for which every decoder must give the same samples.

use jpeg_decoder::{ColorTransform, Decoder};
use jpeg_encoder::{ColorType, Encoder, QuantizationTableType, SamplingFactor};

use super::super::bits::BitSink;
use super::super::yuv::decode_yuv422;
use super::*;

/// Blocks in a unit, across and down, for each component.
type Factors = [(usize, usize)];

fn segment(marker: u8, content: &[u8]) -> Vec<u8> {
    let length = u16::try_from(2 + content.len()).unwrap();
    [&[0xFF, marker][..], &length.to_be_bytes(), content].concat()
}

/// A number for the block of a component at this place.
fn level(component: usize, x: usize, y: usize) -> u8 {
    (component * 89 + x * 37 + y * 101 + x * y * 13) as u8
}

/// The samples of the picture with these blocks, in the order of YUV 4:2:2.
fn expected(width: usize, height: usize, factors: &Factors) -> Vec<u8> {
    let across = factors.iter().map(|factors| factors.0).max().unwrap();
    let down = factors.iter().map(|factors| factors.1).max().unwrap();
    let sample = |component: usize, x: usize, y: usize| {
        let Some((horizontal, vertical)) = factors.get(component) else { return 128 };
        level(component, x * horizontal / across / 8, y * vertical / down / 8)
    };
    let mut samples = Vec::new();
    for y in 0..height {
        for x in (0..width).step_by(2) {
            let right = (x + 1).min(width - 1);
            let chroma = |component: usize| {
                let [left, right] = [x, right].map(|x| u16::from(sample(component, x, y)));
                (left + right).div_ceil(2) as u8
            };
            samples.extend([sample(0, x, y), chroma(1), sample(0, right, y), chroma(2)]);
        }
    }
    samples
}

/// The picture as JPEG: each scan has the components of one list.
fn picture(
    (width, height): (usize, usize),
    factors: &Factors,
    restart_interval: u16,
    scans: &[&[usize]],
) -> Vec<u8> {
    let mut frame = vec![8];
    frame.extend((height as u16).to_be_bytes());
    frame.extend((width as u16).to_be_bytes());
    frame.push(factors.len() as u8);
    for (id, (horizontal, vertical)) in (0..).zip(factors) {
        frame.extend([id, (horizontal << 4 | vertical) as u8, 0]);
    }
    // One step of the first coefficient is one step of the samples.
    let mut picture = [0xFF, marker::SOI].to_vec();
    picture.extend(segment(0xDB, &[&[0][..], &[8; 64]].concat()));
    picture.extend(segment(marker::SOF0, &frame));
    // 4 bits say how many bits a difference has.
    let mut sizes = [0; 17];
    sizes[4] = 12;
    picture.extend(segment(marker::DHT, &[&sizes[..], &(0..12).collect::<Vec<u8>>()].concat()));
    // One bit ends each block.
    let mut ends = [0; 18];
    (ends[0], ends[1]) = (0x10, 1);
    picture.extend(segment(marker::DHT, &ends));
    picture.extend(segment(marker::DRI, &restart_interval.to_be_bytes()));
    for components in scans {
        let mut header = vec![components.len() as u8];
        header.extend(components.iter().flat_map(|&component| [component as u8, 0]));
        header.extend([0, 63, 0]);
        picture.extend(segment(marker::SOS, &header));
        picture.extend(scan((width, height), factors, restart_interval.into(), components));
    }
    picture.extend([0xFF, marker::EOI]);
    picture
}

fn scan(
    (width, height): (usize, usize),
    factors: &Factors,
    restart_interval: usize,
    components: &[usize],
) -> Vec<u8> {
    let across = factors.iter().map(|factors| factors.0).max().unwrap();
    let down = factors.iter().map(|factors| factors.1).max().unwrap();
    let alone = components.len() == 1;
    let (units_across, units_down) = if alone {
        let (horizontal, vertical) = factors[components[0]];
        let samples = [(width * horizontal).div_ceil(across), (height * vertical).div_ceil(down)];
        (samples[0].div_ceil(8), samples[1].div_ceil(8))
    } else {
        (width.div_ceil(8 * across), height.div_ceil(8 * down))
    };
    let mut bits = BitWriter::default();
    let mut last = vec![128; factors.len()];
    for unit in 0..units_across * units_down {
        if restart_interval > 0 && unit > 0 && unit % restart_interval == 0 {
            bits.put_marker(marker::RST0 + (unit / restart_interval - 1) as u8 % 8);
            last.fill(128);
        }
        for &component in components {
            let (horizontal, vertical) = if alone { (1, 1) } else { factors[component] };
            for block in 0..horizontal * vertical {
                let x = unit % units_across * horizontal + block % horizontal;
                let y = unit / units_across * vertical + block / horizontal;
                let level = i32::from(level(component, x, y));
                let difference = level - last[component];
                last[component] = level;
                let size = i32::BITS - difference.abs().leading_zeros();
                bits.put(size.into(), 4);
                let value = if difference < 0 { difference + (1 << size) - 1 } else { difference };
                bits.put(value as u64, size);
                bits.put(0, 1);
            }
        }
    }
    bits.finish()
}

fn check(size: (usize, usize), factors: &Factors, interval: u16, scans: &[&[usize]]) {
    let decoded = decode_yuv422(&picture(size, factors, interval, scans)).unwrap();
    assert_eq!((usize::from(decoded.width), usize::from(decoded.height)), size);
    assert!(
        decoded.data == expected(size.0, size.1, factors),
        "{size:?} {factors:?} interval {interval} scans {scans:?}"
    );
}

#[test]
fn every_block_is_in_its_place_for_any_sampling_size_and_restart_interval() {
    let mut count = 0;
    for factors in [
        &[(1, 1)][..],
        &[(2, 2)],
        &[(1, 1), (1, 1), (1, 1)],
        &[(2, 1), (1, 1), (1, 1)],
        &[(1, 2), (1, 1), (1, 1)],
        &[(2, 2), (1, 1), (1, 1)],
        &[(2, 2), (1, 2), (1, 2)],
        &[(2, 2), (2, 1), (2, 1)],
        &[(4, 1), (1, 1), (1, 1)],
        &[(4, 2), (1, 1), (1, 1)],
        &[(2, 4), (1, 1), (1, 1)],
        &[(3, 1), (1, 1), (1, 1)],
        &[(1, 1), (2, 2), (2, 1)],
    ] {
        for size in [(64, 32), (1, 1), (7, 9), (17, 16), (33, 31), (49, 50), (100, 70)] {
            for interval in [0, 1, 2, 5, 1000] {
                let all: Vec<usize> = (0..factors.len()).collect();
                check(size, factors, interval, &[&all]);
                if let [_, _, _] = factors {
                    check(size, factors, interval, &[&[0], &[1], &[2]]);
                    check(size, factors, interval, &[&[1, 2], &[0]]);
                    count += 2;
                }
                count += 1;
            }
        }
    }
    assert_eq!(count, 7 * 5 * (2 + 11 * 3));
}

#[test]
fn a_restart_interval_with_too_many_blocks_for_a_header_is_an_error() {
    // 2048 x 2064 pixels are 128 x 129 units, each with 4 blocks of luma.
    let factors = [(2, 2), (1, 1), (1, 1)];
    let jpeg = |interval| picture((2048, 2064), &factors, interval, &[&[0, 1, 2]]);
    let error = decode_yuv422(&jpeg(16384)).unwrap_err();
    assert!(error.to_string().contains("restart interval"), "{error}");
    // The picture ends before the interval does.
    assert!(decode_yuv422(&jpeg(65535)).is_ok());
}

/// A picture with many details.
fn textured(width: usize, height: usize) -> Vec<u8> {
    let mut state = 1_u32;
    let mut noise = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 26) as usize
    };
    let pixels = (0..width * height).flat_map(|pixel| {
        let (x, y) = (pixel % width, pixel / width);
        [x * y / 9 + noise(), 3 * x + noise(), 2 * y + x / 2 + noise()]
    });
    pixels.map(|sample| sample as u8).collect()
}

/// Encodes samples, all components with the same quantization.
fn encode(
    samples: &[u8],
    (width, height): (usize, usize),
    color: ColorType,
    change: impl Fn(&mut Encoder<&mut Vec<u8>>),
) -> Vec<u8> {
    let mut jpeg = Vec::new();
    let mut encoder = Encoder::new(&mut jpeg, 80);
    encoder.set_quantization_tables(QuantizationTableType::Flat, QuantizationTableType::Flat);
    change(&mut encoder);
    encoder.encode(samples, width as u16, height as u16, color).unwrap();
    jpeg
}

#[test]
fn chroma_has_exactly_the_samples_of_a_grey_picture_of_it() {
    for size @ (width, height) in [(64, 48), (62, 48), (32, 30)] {
        // Both pixels of a pair have the same chroma, so halving it changes nothing.
        let halved = textured(width / 2, height);
        let plane = |index: usize| halved.iter().skip(index).step_by(3).copied();
        let pixels = textured(width, height);
        let doubled: Vec<u8> = pixels
            .chunks_exact(3)
            .enumerate()
            .flat_map(|(pixel, samples)| {
                let pair = &halved[3 * (pixel / 2)..];
                [samples[0], pair[1], pair[2]]
            })
            .collect();
        for (interval, optimized) in [(0, false), (1, false), (3, false), (0, true)] {
            let jpeg = encode(&doubled, size, ColorType::Ycbcr, |encoder| {
                encoder.set_sampling_factor(SamplingFactor::F_2_1);
                encoder.set_restart_interval(interval);
                encoder.set_optimized_huffman_tables(optimized);
            });
            let yuv = decode_yuv422(&jpeg).unwrap().data;
            for (place, samples) in [(1, plane(1)), (3, plane(2))] {
                let samples: Vec<u8> = samples.collect();
                let grey = encode(&samples, (width / 2, height), ColorType::Luma, |_| {});
                let grey = Decoder::new(grey.as_slice()).decode().unwrap();
                let found: Vec<u8> = yuv.iter().skip(place).step_by(4).copied().collect();
                assert!(found == grey, "{size:?} place {place} interval {interval}");
            }
        }
    }
}

#[test]
fn luma_is_the_same_as_in_the_whole_picture_in_any_sampling() {
    let size @ (width, height) = (70, 51);
    for sampling in [
        SamplingFactor::F_1_1,
        SamplingFactor::F_2_1,
        SamplingFactor::F_1_2,
        SamplingFactor::F_2_2,
        SamplingFactor::F_4_1,
        SamplingFactor::F_4_2,
        SamplingFactor::F_1_4,
        SamplingFactor::F_2_4,
    ] {
        for interval in [0, 4] {
            let jpeg = encode(&textured(width, height), size, ColorType::Ycbcr, |encoder| {
                encoder.set_sampling_factor(sampling);
                encoder.set_restart_interval(interval);
            });
            // "RGB" returns the components unchanged; the largest one is not scaled.
            let mut decoder = Decoder::new(jpeg.as_slice());
            decoder.set_color_transform(ColorTransform::RGB);
            let whole = decoder.decode().unwrap();
            let yuv = decode_yuv422(&jpeg).unwrap().data;
            assert!(yuv.iter().step_by(2).eq(whole.iter().step_by(3)), "{sampling:?} {interval}");
            if sampling == SamplingFactor::F_1_1 {
                let mean = |pair: &[u8], plane: usize| {
                    (u16::from(pair[plane]) + u16::from(pair[3 + plane])).div_ceil(2) as u8
                };
                let chroma = whole.chunks_exact(6).flat_map(|pair| [mean(pair, 1), mean(pair, 2)]);
                assert!(chroma.eq(yuv.iter().skip(1).step_by(2).copied()), "{interval}");
            }
        }
    }
}
