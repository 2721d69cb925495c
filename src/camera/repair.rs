//! Finds where a JPEG picture ends and mends what the camera leaves out.
//!
//! A scan says nowhere how long it is, and the garbage behind it may look like anything. So the
//! codes of the scan are read, without decoding them, until the picture is complete.

use std::borrow::Cow;

use super::bits::{fill_bytes, BitReader};
use super::huffman::{HuffmanTable, STANDARD_TABLES};
use crate::error::Error;

mod marker {
    pub(super) const SOI: u8 = 0xD8;
    pub(super) const EOI: u8 = 0xD9;
    pub(super) const SOF0: u8 = 0xC0;
    pub(super) const SOF1: u8 = 0xC1;
    pub(super) const SOF15: u8 = 0xCF;
    pub(super) const DHT: u8 = 0xC4;
    pub(super) const RST0: u8 = 0xD0;
    pub(super) const SOS: u8 = 0xDA;
    pub(super) const DRI: u8 = 0xDD;
}

/// Coefficients in a block.
const BLOCK: usize = 64;

/// The most pixels that a picture may have, and the longest side. A few bytes can describe a picture
/// that no memory holds, and the decoder counts in 16 bits.
const MAX_PIXELS: usize = 1 << 24;
const MAX_SIDE: usize = 1 << 14;

/// A picture, complete and nothing behind it.
pub(super) struct Repaired<'a> {
    pub(super) jpeg: Cow<'a, [u8]>,
    /// Whether its chroma is 4:2:2.
    pub(super) is_422: bool,
}

/// Finds the picture at the start of `data` and mends it.
pub(super) fn repair(data: &[u8]) -> Result<Repaired<'_>, Error> {
    let mut parser = Parser::new(data)?;
    parser.read_picture()?;
    let is_422 = parser.frame.as_ref().is_some_and(Frame::is_422);
    Ok(Repaired { jpeg: parser.mend(), is_422 })
}

fn bad(reason: &str) -> Error {
    Error::BadPicture { reason: reason.to_owned() }
}

/// What the frame header says.
struct Frame {
    width: usize,
    height: usize,
    components: Vec<Component>,
}

struct Component {
    id: u8,
    horizontal: usize,
    vertical: usize,
    /// Whether a scan has had it.
    complete: bool,
}

struct Parser<'a> {
    data: &'a [u8],
    position: usize,
    frame: Option<Frame>,
    /// DC tables, then AC tables.
    tables: [[Option<HuffmanTable>; 4]; 2],
    /// Whether the picture has no tables of its own.
    tables_missing: bool,
    restart_interval: usize,
    /// Where the first SOS marker lies.
    first_scan: usize,
}

/// A component's part in a scan: how many blocks it has in each unit, and its two tables.
type ScanPart<'a> = (usize, &'a HuffmanTable, &'a HuffmanTable);

impl<'a> Parser<'a> {
    fn new(data: &'a [u8]) -> Result<Self, Error> {
        if !data.starts_with(&[0xFF, marker::SOI]) {
            return Err(bad("it does not start as a JPEG picture"));
        }
        Ok(Self {
            data,
            position: 2,
            frame: None,
            tables: Default::default(),
            tables_missing: false,
            restart_interval: 0,
            first_scan: 0,
        })
    }

    /// Reads up to the end of the last scan.
    fn read_picture(&mut self) -> Result<(), Error> {
        loop {
            let start = self.position;
            let marker = self.read_marker()?;
            match marker {
                marker::EOI => return Err(bad("it ends before it is complete")),
                marker::DHT => {
                    let segment = self.read_segment()?;
                    self.read_tables(segment)?;
                }
                marker::DRI => {
                    let segment = self.read_segment()?;
                    let &[high, low] = segment else {
                        return Err(bad("its restart interval is unreadable"));
                    };
                    self.restart_interval = u16::from_be_bytes([high, low]).into();
                }
                marker::SOF0 | marker::SOF1 => {
                    let segment = self.read_segment()?;
                    self.frame = Some(read_frame(segment)?);
                }
                // The other kinds of frames, and what belongs to them.
                marker::SOF0..=marker::SOF15 => {
                    return Err(bad("it is not of the baseline kind"));
                }
                marker::SOS => {
                    if self.first_scan == 0 {
                        self.first_scan = start;
                    }
                    let segment = self.read_segment()?;
                    if self.read_scan(segment)? {
                        return Ok(());
                    }
                }
                _ => {
                    self.read_segment()?;
                }
            }
        }
    }

    /// The picture that was read, with what it lacks.
    fn mend(self) -> Cow<'a, [u8]> {
        let (data, end) = (self.data, self.position);
        let marker_at = end + fill_bytes(&data[end..]);
        let has_eoi = data.get(marker_at..marker_at + 2) == Some(&[0xFF, marker::EOI]);
        if has_eoi && !self.tables_missing {
            return Cow::Borrowed(&data[..marker_at + 2]);
        }
        let mut mended = Vec::with_capacity(end + STANDARD_TABLES.len() + 2);
        mended.extend_from_slice(&data[..self.first_scan]);
        if self.tables_missing {
            mended.extend_from_slice(&STANDARD_TABLES);
        }
        mended.extend_from_slice(&data[self.first_scan..end]);
        mended.extend_from_slice(&[0xFF, marker::EOI]);
        Cow::Owned(mended)
    }

    fn read_marker(&mut self) -> Result<u8, Error> {
        let at = self.position + fill_bytes(&self.data[self.position..]);
        match self.data.get(at..at + 2) {
            Some(&[0xFF, marker]) => {
                self.position = at + 2;
                Ok(marker)
            }
            Some(_) => Err(bad("there are bytes between its parts")),
            None => Err(bad("it ends before it is complete")),
        }
    }

    /// Reads a segment behind its marker and returns what follows its length.
    fn read_segment(&mut self) -> Result<&'a [u8], Error> {
        let rest = &self.data[self.position..];
        let length =
            rest.get(..2).map(|length| usize::from(u16::from_be_bytes([length[0], length[1]])));
        let segment = length.and_then(|length| rest.get(2..length));
        let segment = segment.ok_or_else(|| bad("it ends before it is complete"))?;
        self.position += 2 + segment.len();
        Ok(segment)
    }

    fn read_tables(&mut self, mut segment: &[u8]) -> Result<(), Error> {
        while let Some((&place, rest)) = segment.split_first() {
            let (class, number) = (usize::from(place >> 4), usize::from(place & 15));
            let (counts, rest) = rest.split_first_chunk::<16>().ok_or_else(bad_table)?;
            let count = counts.iter().map(|&count| usize::from(count)).sum();
            let (values, rest) = rest.split_at_checked(count).ok_or_else(bad_table)?;
            let table = HuffmanTable::new(counts, values).ok_or_else(bad_table)?;
            let slot = self.tables.get_mut(class).and_then(|tables| tables.get_mut(number));
            *slot.ok_or_else(bad_table)? = Some(table);
            segment = rest;
        }
        Ok(())
    }

    /// Reads a scan up to its last bit; tells whether the picture is complete.
    fn read_scan(&mut self, segment: &[u8]) -> Result<bool, Error> {
        if self.tables.iter().flatten().all(Option::is_none) {
            self.tables_missing = true;
            // Behind marker and length.
            self.read_tables(&STANDARD_TABLES[4..])?;
        }
        let Self { frame, tables, .. } = self;
        let frame = frame.as_mut().ok_or_else(|| bad("it has a scan before its size"))?;
        let (&count, rest) = segment.split_first().ok_or_else(bad_scan)?;
        let selectors = rest.get(..2 * usize::from(count)).ok_or_else(bad_scan)?;
        let mut parts = Vec::new();
        let mut units = 0;
        for selector in selectors.chunks_exact(2) {
            let (dc, ac) = (usize::from(selector[1] >> 4), usize::from(selector[1] & 15));
            let dc = tables[0].get(dc).and_then(Option::as_ref).ok_or_else(bad_table)?;
            let ac = tables[1].get(ac).and_then(Option::as_ref).ok_or_else(bad_table)?;
            let (blocks, units_of_part) = frame.part(selector[0], count)?;
            parts.push((blocks, dc, ac));
            units = units_of_part;
        }
        self.position = read_units(self.data, self.position, &parts, units, self.restart_interval)
            .ok_or_else(|| bad("its data is damaged or ends before it is complete"))?;
        Ok(frame.components.iter().all(|component| component.complete))
    }
}

impl Frame {
    /// Whether there is one chroma sample for two pixels of a row.
    fn is_422(&self) -> bool {
        let [luma, chroma @ ..] = self.components.as_slice() else { return false };
        chroma.len() == 2
            && chroma.iter().all(|chroma| {
                luma.horizontal == 2 * chroma.horizontal && luma.vertical == chroma.vertical
            })
    }

    /// How many blocks a component has in each unit of a scan of so many components, and how many
    /// units the scan has.
    fn part(&mut self, id: u8, count: u8) -> Result<(usize, usize), Error> {
        let most = |size: fn(&Component) -> usize| self.components.iter().map(size).max();
        let horizontal = most(|component| component.horizontal).ok_or_else(bad_scan)?;
        let vertical = most(|component| component.vertical).ok_or_else(bad_scan)?;
        let (width, height) = (self.width, self.height);
        let component = self.components.iter_mut().find(|component| component.id == id);
        let component = component.filter(|component| !component.complete).ok_or_else(bad_scan)?;
        component.complete = true;
        if count == 1 {
            // A scan of one component has just the blocks that its samples need.
            let across = (width * component.horizontal).div_ceil(horizontal).div_ceil(8);
            let down = (height * component.vertical).div_ceil(vertical).div_ceil(8);
            return Ok((1, across * down));
        }
        let units = width.div_ceil(8 * horizontal) * height.div_ceil(8 * vertical);
        Ok((component.horizontal * component.vertical, units))
    }
}

fn bad_table() -> Error {
    bad("its Huffman tables are unreadable")
}

fn bad_scan() -> Error {
    bad("the header of its data is unreadable")
}

fn read_frame(segment: &[u8]) -> Result<Frame, Error> {
    let unreadable = || bad("its size is unreadable");
    let (&[precision, h1, h0, w1, w0, count], rest) =
        segment.split_first_chunk().ok_or_else(unreadable)?;
    let components = rest.get(..3 * usize::from(count)).ok_or_else(unreadable)?;
    let components: Vec<Component> = components
        .chunks_exact(3)
        .map(|bytes| Component {
            id: bytes[0],
            horizontal: usize::from(bytes[1] >> 4),
            vertical: usize::from(bytes[1] & 15),
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
    Ok(Frame { width, height, components })
}

/// Reads all codes of a scan and returns where it ends; `None` when it does not go on as it
/// should.
fn read_units(
    data: &[u8],
    position: usize,
    parts: &[ScanPart<'_>],
    units: usize,
    restart_interval: usize,
) -> Option<usize> {
    let mut bits = BitReader::new(data, position);
    let mut restarts = (0..8).cycle();
    for unit in 0..units {
        if restart_interval > 0 && unit > 0 && unit % restart_interval == 0 {
            bits.skip_marker(marker::RST0 + restarts.next()?)?;
        }
        for (blocks, dc, ac) in parts {
            for _ in 0..*blocks {
                read_block(&mut bits, dc, ac)?;
            }
        }
    }
    Some(bits.align())
}

fn read_block(bits: &mut BitReader<'_>, dc: &HuffmanTable, ac: &HuffmanTable) -> Option<()> {
    let size = dc.read(bits)?;
    if size > 11 {
        return None;
    }
    bits.skip(size.into())?;
    let mut index = 1;
    while index < BLOCK {
        let code = ac.read(bits)?;
        let (run, size) = (usize::from(code >> 4), code & 15);
        match (run, size) {
            (15, 0) => index += 16,
            (_, 0) => return Some(()),
            _ => {
                index += run + 1;
                bits.skip(size.into())?;
            }
        }
    }
    // Decoders put up with a run that goes beyond the block.
    Some(())
}

#[cfg(test)]
mod tests;
