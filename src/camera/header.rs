//! The frame header of a JPEG picture: its size, its components and the order of their blocks.

use crate::error::Error;

/// The most pixels that a picture may have, and its longest side. A few bytes can describe a picture
/// that does not fit into any memory, and the decoder counts in 16 bits.
const MAX_PIXELS: usize = 1 << 24;
const MAX_SIDE: usize = 1 << 14;

pub(super) fn bad(reason: &str) -> Error {
    Error::BadPicture { reason: reason.to_owned() }
}

pub(super) fn bad_scan() -> Error {
    bad("the header of its data is unreadable")
}

/// The content of the frame header.
pub(super) struct Frame {
    pub(super) marker: u8,
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) components: Vec<Component>,
}

pub(super) struct Component {
    id: u8,
    pub(super) horizontal: usize,
    pub(super) vertical: usize,
    pub(super) quantization_table: u8,
    /// Whether it was in a scan.
    pub(super) complete: bool,
}

/// The order of a component's blocks in a scan: unit by unit, and row by row in each unit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Grid {
    /// Blocks in a unit.
    pub(super) horizontal: usize,
    pub(super) vertical: usize,
    /// Units in the scan.
    pub(super) across: usize,
    pub(super) down: usize,
}

impl Frame {
    /// Reads the segment after `marker`.
    pub(super) fn parse(marker: u8, segment: &[u8]) -> Result<Self, Error> {
        let unreadable = || bad("its size is unreadable");
        let (&[precision, h1, h0, w1, w0, count], components) =
            segment.split_first_chunk().ok_or_else(unreadable)?;
        if components.len() != 3 * usize::from(count) {
            return Err(unreadable());
        }
        let components: Vec<Component> = components
            .chunks_exact(3)
            .map(|bytes| Component {
                id: bytes[0],
                horizontal: usize::from(bytes[1] >> 4),
                vertical: usize::from(bytes[1] & 15),
                quantization_table: bytes[2],
                complete: false,
            })
            .collect();
        let (width, height) = (u16::from_be_bytes([w1, w0]), u16::from_be_bytes([h1, h0]));
        let has_samples = |component: &Component| {
            (1..=4).contains(&component.horizontal) && (1..=4).contains(&component.vertical)
        };
        if precision != 8
            || width == 0
            || height == 0
            || components.is_empty()
            || !components.iter().all(has_samples)
        {
            return Err(unreadable());
        }
        let (width, height) = (usize::from(width), usize::from(height));
        if width.max(height) > MAX_SIDE || width * height > MAX_PIXELS {
            return Err(bad("it is implausibly large"));
        }
        Ok(Self { marker, width, height, components })
    }

    /// The largest factors of all components, across and down.
    pub(super) fn largest_factors(&self) -> (usize, usize) {
        let largest =
            |factor: fn(&Component) -> usize| self.components.iter().map(factor).max().unwrap_or(1);
        (largest(|component| component.horizontal), largest(|component| component.vertical))
    }

    /// Marks this component as being in a scan, alone or with others. Returns the component's index in
    /// the frame and the order of its blocks in the scan.
    pub(super) fn take(&mut self, id: u8, alone: bool) -> Result<(usize, Grid), Error> {
        let (horizontal, vertical) = self.largest_factors();
        let (width, height) = (self.width, self.height);
        let found = self.components.iter().position(|component| component.id == id);
        let index = found.ok_or_else(bad_scan)?;
        let component = &mut self.components[index];
        if component.complete {
            return Err(bad_scan());
        }
        component.complete = true;
        let grid = if alone {
            // A scan of one component has only the blocks that its samples need.
            Grid {
                horizontal: 1,
                vertical: 1,
                across: (width * component.horizontal).div_ceil(horizontal).div_ceil(8),
                down: (height * component.vertical).div_ceil(vertical).div_ceil(8),
            }
        } else {
            Grid {
                horizontal: component.horizontal,
                vertical: component.vertical,
                across: width.div_ceil(8 * horizontal),
                down: height.div_ceil(8 * vertical),
            }
        };
        Ok((index, grid))
    }
}

impl Grid {
    pub(super) fn units(&self) -> usize {
        self.across * self.down
    }

    pub(super) fn blocks_in_unit(&self) -> usize {
        self.horizontal * self.vertical
    }

    /// Blocks in a row of the whole component.
    pub(super) fn blocks_across(&self) -> usize {
        self.across * self.horizontal
    }

    /// Blocks in a column of the whole component.
    pub(super) fn blocks_down(&self) -> usize {
        self.down * self.vertical
    }
}
