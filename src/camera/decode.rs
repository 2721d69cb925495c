//! Decodes whole JPEG pictures with `jpeg-decoder`.

use jpeg_decoder::{ColorTransform, Decoder, PixelFormat};

use crate::error::Error;

/// A decoded picture.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Picture {
    /// Width in pixels, which may differ from the frame's announced one.
    pub width: u16,
    /// Height in pixels.
    pub height: u16,
    /// The samples, in the order that the call which made the picture describes.
    pub data: Vec<u8>,
}

pub(super) fn decode_rgb(jpeg: &[u8]) -> Result<Picture, Error> {
    let (picture, format) = decode(jpeg, None)?;
    Ok(match format {
        PixelFormat::RGB24 => picture,
        _ => Picture { data: picture.data.iter().flat_map(|&y| [y; 3]).collect(), ..picture },
    })
}

/// `own_chroma` tells that the JPEG has one chroma sample for two pixels of a row.
pub(super) fn decode_yuv422(jpeg: &[u8], own_chroma: bool) -> Result<Picture, Error> {
    // "RGB" makes the decoder hand the planes through as they are.
    let (picture, format) = decode(jpeg, Some(ColorTransform::RGB))?;
    let width = usize::from(picture.width);
    let mut data = Vec::with_capacity(4 * width.div_ceil(2) * usize::from(picture.height));
    if format == PixelFormat::RGB24 {
        let halve = if own_chroma { undo_doubling } else { average_pairs };
        let mut chroma = [Vec::new(), Vec::new()];
        for row in picture.data.chunks_exact(3 * width) {
            for (plane, halved) in (1..).zip(&mut chroma) {
                halve(row, plane, halved);
            }
            let [cb, cr] = &chroma;
            for ((pixels, cb), cr) in row.chunks(6).zip(cb).zip(cr) {
                data.extend([pixels[0], *cb, pixels[pixels.len() - 3], *cr]);
            }
        }
    } else {
        // Grey is in the middle of both chroma axes.
        for row in picture.data.chunks_exact(width) {
            data.extend(row.chunks(2).flat_map(|y| [y[0], 128, y[y.len() - 1], 128]));
        }
    }
    Ok(Picture { data, ..picture })
}

/// Replaces what is in `halved` by the mean of each pair of a plane's samples.
fn average_pairs(row: &[u8], plane: usize, halved: &mut Vec<u8>) {
    halved.clear();
    halved.extend(row.chunks(6).map(|pixels| {
        let (left, right) = (pixels[plane], pixels[pixels.len() - 3 + plane]);
        (u16::from(left) + u16::from(right)).div_ceil(2) as u8
    }));
}

/// Replaces what is in `halved` by the samples of a plane before the decoder doubled them.
///
/// With c the JPEG's samples, the decoder makes of c\[i\] the two (3 c\[i\] + c\[i − 1\] + 2) / 4 and
/// (3 c\[i\] + c\[i + 1\] + 2) / 4, rounded down; at both edges c itself stays. So from the left edge
/// each sample leaves very few values for the next one.
fn undo_doubling(row: &[u8], plane: usize, halved: &mut Vec<u8>) {
    let doubled = |index: usize| row.get(3 * index + plane).map(|&sample| i32::from(sample));
    let count = (row.len() / 3).div_ceil(2);
    let possible = |left: i32, index: usize| {
        let between = doubled(2 * index - 1).unwrap_or_default();
        let behind = doubled(2 * index).unwrap_or_default();
        let by_between = 4 * between - 2 - 3 * left;
        let by_behind = 4 * behind - 2 - left;
        let least = by_between.max((by_behind + 2).div_euclid(3)).max(0);
        let most = (by_between + 3).min((by_behind + 3).div_euclid(3)).min(255);
        least..=most
    };
    halved.clear();
    let mut left = doubled(0).unwrap_or_default();
    halved.push(left as u8);
    for index in 1..count {
        let edge = if index + 1 == count { doubled(2 * index + 1) } else { None };
        left = edge.unwrap_or_else(|| {
            let mut candidates = possible(left, index);
            let first = (*candidates.start()).clamp(0, 255);
            if candidates.start() >= candidates.end() {
                return first;
            }
            let fits = |&c: &i32| index + 1 == count || !possible(c, index + 1).is_empty();
            candidates.find(fits).unwrap_or(first)
        });
        halved.push(left as u8);
    }
}

/// Decodes to RGB or one grey sample a pixel.
fn decode(jpeg: &[u8], transform: Option<ColorTransform>) -> Result<(Picture, PixelFormat), Error> {
    let mut decoder = Decoder::new(jpeg);
    if let Some(transform) = transform {
        decoder.set_color_transform(transform);
    }
    let bad = |reason: String| Error::BadPicture { reason };
    let data = decoder.decode().map_err(|error| bad(error.to_string()))?;
    let info = decoder.info().ok_or_else(|| bad("it has no size".to_owned()))?;
    match info.pixel_format {
        PixelFormat::RGB24 | PixelFormat::L8 => {}
        format => return Err(bad(format!("pixels of the kind {format:?} are not supported"))),
    }
    Ok((Picture { width: info.width, height: info.height, data }, info.pixel_format))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What the decoder makes of a row of chroma samples.
    fn double(samples: &[u8]) -> Vec<u8> {
        let at = |i: usize| u32::from(samples[i]);
        let last = samples.len() - 1;
        let mut doubled = Vec::new();
        for i in 0..samples.len() {
            let mix = |neighbour: usize| ((3 * at(i) + at(neighbour) + 2) / 4) as u8;
            doubled.push(if i == 0 { samples[0] } else { mix(i - 1) });
            doubled.push(if i == last { samples[last] } else { mix(i + 1) });
        }
        doubled
    }

    #[test]
    fn doubling_is_undone_to_one_step() {
        let mut state = 1_u32;
        for length in 1..200 {
            let samples: Vec<u8> = (0..length)
                .map(|_| {
                    state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                    (state >> 24) as u8
                })
                .collect();
            let doubled = double(&samples);
            for width in [doubled.len(), doubled.len() - 1] {
                let row: Vec<u8> = doubled[..width].iter().flat_map(|&s| [0, s, 0]).collect();
                let mut halved = Vec::new();
                undo_doubling(&row, 1, &mut halved);
                assert_eq!(halved.len(), samples.len());
                for (found, expected) in halved.iter().zip(&samples) {
                    assert!(found.abs_diff(*expected) <= 1, "{found} instead of {expected}");
                }
            }
        }
    }
}
