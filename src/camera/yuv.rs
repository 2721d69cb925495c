//! Pictures as YUV 4:2:2, from the samples of each component.

use std::borrow::Cow;

use super::decode::Picture;
use super::planes::{decode_planes, Planes};
use crate::error::Error;

pub(super) fn decode_yuv422(data: &[u8]) -> Result<Picture, Error> {
    let Planes { width, height, planes } = decode_planes(data)?;
    let (pixels, pairs) = (usize::from(width), usize::from(width).div_ceil(2));
    // Grey is in the middle of both chroma axes.
    let grey = vec![128; pairs];
    let mut yuv = vec![0; 4 * pairs * usize::from(height)];
    for (y, row) in yuv.chunks_exact_mut(4 * pairs).enumerate() {
        let chroma = |index: usize| {
            planes.get(index).map_or(Cow::Borrowed(&grey[..]), |plane| plane.pairs(y, pixels))
        };
        let (luma, cb, cr) = (planes[0].pixels(y, pixels), chroma(1), chroma(2));
        let samples = luma.chunks(2).zip(cb.iter()).zip(cr.iter());
        for (out, ((luma, &cb), &cr)) in row.chunks_exact_mut(4).zip(samples) {
            out.copy_from_slice(&[luma[0], cb, luma[luma.len() - 1], cr]);
        }
    }
    Ok(Picture { width, height, data: yuv })
}
