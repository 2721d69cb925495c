//! Decodes the components of a JPEG picture one by one, so that each gives its own samples.
//!
//! A decoder of whole pictures scales all components to the same size with a filter of its choice.
//! So the bits of each component are copied unchanged into a grey picture of its own, which needs no
//! filter.

use std::borrow::Cow;

use super::bits::BitWriter;
use super::decode::decode;
use super::header::{bad, Frame, Grid};
use super::parser::{marker, Parser, Part, Scan};
use crate::error::Error;

/// Samples on a side of a block.
const SIDE: usize = 8;

/// The samples of one component.
pub(super) struct Plane {
    samples: Vec<u8>,
    /// Samples in a row.
    stride: usize,
    /// How many pixels a sample covers, across and down.
    across: usize,
    down: usize,
}

impl Plane {
    /// A sample for each pixel of a row.
    pub(super) fn pixels(&self, y: usize, width: usize) -> Cow<'_, [u8]> {
        let row = self.row(y);
        if self.across == 1 {
            return Cow::Borrowed(&row[..width]);
        }
        let covered = row.iter().flat_map(|&sample| std::iter::repeat_n(sample, self.across));
        Cow::Owned(covered.take(width).collect())
    }

    /// A sample for each pair of pixels of a row: their mean. A row of odd width ends with its last
    /// pixel twice.
    pub(super) fn pairs(&self, y: usize, width: usize) -> Cow<'_, [u8]> {
        if self.across == 2 {
            return Cow::Borrowed(&self.row(y)[..width.div_ceil(2)]);
        }
        let mean = |pair: &[u8]| {
            let (left, right) = (u16::from(pair[0]), u16::from(pair[pair.len() - 1]));
            (left + right).div_ceil(2) as u8
        };
        Cow::Owned(self.pixels(y, width).chunks(2).map(mean).collect())
    }

    /// The samples that cover a row of pixels, and those that fill the last block.
    fn row(&self, y: usize) -> &[u8] {
        &self.samples[y / self.down * self.stride..][..self.stride]
    }
}

/// The planes of a picture.
pub(super) struct Planes {
    pub(super) width: u16,
    pub(super) height: u16,
    /// Luma, or luma and both of chroma.
    pub(super) planes: Vec<Plane>,
}

/// Decodes the components of the picture at the start of `data`. The parts that cameras leave out may be
/// missing.
pub(super) fn decode_planes(data: &[u8]) -> Result<Planes, Error> {
    let Parser { frame, segments, segments_before_frame, scans, .. } =
        Parser::<BitWriter>::read(data)?;
    let frame = frame.ok_or_else(|| bad("it has no size"))?;
    if ![1, 3].contains(&frame.components.len()) {
        return Err(bad(&format!("{} components are not supported", frame.components.len())));
    }
    let (horizontal, vertical) = frame.largest_factors();
    let mut planes: Vec<Option<Plane>> = frame.components.iter().map(|_| None).collect();
    for Scan { segments: count, restart_interval, selection, parts } in scans {
        let (before, behind) = segments[..count].split_at(segments_before_frame);
        for Part { component: index, tables, grid, bits } in parts {
            let component = &frame.components[index];
            if horizontal % component.horizontal != 0 || vertical % component.vertical != 0 {
                return Err(bad("its components' sizes are not supported"));
            }
            let header = grey_frame(&frame, component.quantization_table, grid);
            let interval = grey_interval(restart_interval, grid)?;
            let scan = [[0xFF, marker::SOS, 0, 8, 1, 1, tables].as_slice(), &selection].concat();
            let jpeg = [
                &[0xFF, marker::SOI],
                before.concat().as_slice(),
                &header,
                &behind.concat(),
                &interval,
                &scan,
                &bits.finish(),
                &[0xFF, marker::EOI],
            ]
            .concat();
            let samples = decode(&jpeg)?.0.data;
            planes[index] = Some(Plane {
                samples: if grid.vertical == 1 { samples } else { arrange(&samples, grid) },
                stride: SIDE * grid.blocks_across(),
                across: horizontal / component.horizontal,
                down: vertical / component.vertical,
            });
        }
    }
    // Sides have at most 14 bits.
    let (width, height) = (frame.width as u16, frame.height as u16);
    Ok(Planes { width, height, planes: planes.into_iter().flatten().collect() })
}

/// A frame header for whole blocks of one component, which is number 1.
fn grey_frame(frame: &Frame, quantization_table: u8, grid: Grid) -> Vec<u8> {
    let mut segment = vec![0xFF, frame.marker, 0, 11, 8];
    for blocks in [grid.blocks_down(), grid.blocks_across()] {
        // A side has at most 14 bits, and is rounded up to a multiple of at most 32 samples.
        segment.extend(((SIDE * blocks) as u16).to_be_bytes());
    }
    segment.extend([1, 1, 0x11, quantization_table]);
    segment
}

/// The restart interval, which is in blocks for a grey picture.
fn grey_interval(units: usize, grid: Grid) -> Result<Vec<u8>, Error> {
    let blocks = if units < grid.units() { units * grid.blocks_in_unit() } else { 0 };
    let blocks = u16::try_from(blocks).map_err(|_| bad("its restart interval is too long"))?;
    let [high, low] = blocks.to_be_bytes();
    Ok(vec![0xFF, marker::DRI, 0, 4, high, low])
}

/// Moves the blocks from their order in the scan to their places in the component.
fn arrange(samples: &[u8], grid: Grid) -> Vec<u8> {
    let across = grid.blocks_across();
    let stride = SIDE * across;
    let mut arranged = vec![0; samples.len()];
    // A row of units.
    let band = SIDE * stride * grid.vertical;
    for (from, to) in samples.chunks_exact(band).zip(arranged.chunks_exact_mut(band)) {
        for block in 0..across * grid.vertical {
            let (unit, place) = (block / grid.blocks_in_unit(), block % grid.blocks_in_unit());
            let x = unit * grid.horizontal + place % grid.horizontal;
            let y = place / grid.horizontal;
            let start = |x: usize, y: usize, line: usize| (SIDE * y + line) * stride + SIDE * x;
            for line in 0..SIDE {
                let source = start(block % across, block / across, line);
                let target = start(x, y, line);
                to[target..target + SIDE].copy_from_slice(&from[source..source + SIDE]);
            }
        }
    }
    arranged
}

#[cfg(test)]
mod tests;
