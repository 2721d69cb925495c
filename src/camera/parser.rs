//! Reads a JPEG picture up to its last bit, without decoding it.
//!
//! A scan does not contain its length, and the garbage after it may look like anything. So the
//! codes of the scan are read until the picture is complete.

use super::bits::{fill_bytes, BitReader, BitSink};
use super::header::{bad, bad_scan, Frame, Grid};
use super::huffman::{HuffmanTable, STANDARD_TABLES};
use super::steps::{Meaning, Steps};
use crate::error::Error;

pub(super) mod marker {
    pub(in super::super) const SOI: u8 = 0xD8;
    pub(in super::super) const EOI: u8 = 0xD9;
    pub(in super::super) const SOF0: u8 = 0xC0;
    pub(in super::super) const SOF1: u8 = 0xC1;
    pub(in super::super) const SOF15: u8 = 0xCF;
    pub(in super::super) const DHT: u8 = 0xC4;
    pub(in super::super) const RST0: u8 = 0xD0;
    pub(in super::super) const SOS: u8 = 0xDA;
    pub(in super::super) const DRI: u8 = 0xDD;
}

/// Coefficients in a block.
const BLOCK: usize = 64;

/// The most blocks in a unit of several components.
const MAX_BLOCKS_IN_UNIT: usize = 10;

/// Reads a picture. The bits of each component of a scan go into their own `S`.
pub(super) struct Parser<'a, S> {
    pub(super) data: &'a [u8],
    pub(super) position: usize,
    pub(super) frame: Option<Frame>,
    /// The segments so far, with their markers, except those of the frame, the scans and restart
    /// intervals.
    pub(super) segments: Vec<&'a [u8]>,
    /// How many of the segments are before the frame header.
    pub(super) segments_before_frame: usize,
    pub(super) scans: Vec<Scan<S>>,
    /// DC tables, then AC tables.
    tables: [[Option<HuffmanTable>; 4]; 2],
    /// Whether the picture has no tables of its own.
    pub(super) tables_missing: bool,
    restart_interval: usize,
    /// The position of the first SOS marker.
    pub(super) first_scan: usize,
}

/// A scan that was read.
pub(super) struct Scan<S> {
    /// How many of the segments are before it.
    pub(super) segments: usize,
    /// In units; 0 for none.
    pub(super) restart_interval: usize,
    /// The bytes after the components in its header.
    pub(super) selection: [u8; 3],
    pub(super) parts: Vec<Part<S>>,
}

/// One component of a scan.
pub(super) struct Part<S> {
    /// Its index in the frame.
    pub(super) component: usize,
    /// The numbers of its tables, as in the header of the scan.
    pub(super) tables: u8,
    pub(super) grid: Grid,
    pub(super) bits: S,
}

impl<'a, S: BitSink> Parser<'a, S> {
    /// Reads the picture at the start of `data`, up to the end of the last scan.
    pub(super) fn read(data: &'a [u8]) -> Result<Self, Error> {
        if !data.starts_with(&[0xFF, marker::SOI]) {
            return Err(bad("it does not start as a JPEG picture"));
        }
        let mut parser = Self {
            data,
            position: 2,
            frame: None,
            segments: Vec::new(),
            segments_before_frame: 0,
            scans: Vec::new(),
            tables: Default::default(),
            tables_missing: false,
            restart_interval: 0,
            first_scan: 0,
        };
        parser.read_picture()?;
        Ok(parser)
    }

    fn read_picture(&mut self) -> Result<(), Error> {
        loop {
            let start = self.position;
            let marker = self.read_marker()?;
            if marker == marker::EOI {
                return Err(bad("it ends before it is complete"));
            }
            let segment = self.read_segment()?;
            match marker {
                marker::DRI => {
                    let &[high, low] = segment else {
                        return Err(bad("its restart interval is unreadable"));
                    };
                    self.restart_interval = u16::from_be_bytes([high, low]).into();
                }
                marker::SOF0 | marker::SOF1 => {
                    if self.frame.is_some() {
                        return Err(bad("it has two sizes"));
                    }
                    self.frame = Some(Frame::parse(marker, segment)?);
                    self.segments_before_frame = self.segments.len();
                }
                marker::SOS => {
                    if self.first_scan == 0 {
                        self.first_scan = start;
                    }
                    if self.read_scan(segment)? {
                        return Ok(());
                    }
                }
                // The other kinds of frames, and their segments.
                marker::SOF0..=marker::SOF15 if marker != marker::DHT => {
                    return Err(bad("it is not of the baseline kind"));
                }
                _ => {
                    if marker == marker::DHT {
                        self.read_tables(segment)?;
                    }
                    self.segments.push(&self.data[start..self.position]);
                }
            }
        }
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

    /// Reads a segment after its marker and returns its content after the length.
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

    /// Reads a scan up to its last bit; returns whether the picture is complete.
    fn read_scan(&mut self, segment: &[u8]) -> Result<bool, Error> {
        if self.tables.iter().flatten().all(Option::is_none) {
            self.tables_missing = true;
            // After marker and length.
            self.read_tables(&STANDARD_TABLES[4..])?;
            self.segments.push(&STANDARD_TABLES);
        }
        let frame = self.frame.as_mut().ok_or_else(|| bad("it has a scan before its size"))?;
        let (&count, rest) = segment.split_first().ok_or_else(bad_scan)?;
        let (selectors, selection) = rest.split_last_chunk::<3>().ok_or_else(bad_scan)?;
        if count == 0 || selectors.len() != 2 * usize::from(count) {
            return Err(bad_scan());
        }
        let mut parts: Vec<Part<S>> = Vec::new();
        for selector in selectors.chunks_exact(2) {
            let (component, grid) = frame.take(selector[0], count == 1)?;
            if parts.last().is_some_and(|last| last.component > component) {
                return Err(bad_scan());
            }
            parts.push(Part { component, tables: selector[1], grid, bits: S::default() });
        }
        let blocks: usize = parts.iter().map(|part| part.grid.blocks_in_unit()).sum();
        if count > 1 && blocks > MAX_BLOCKS_IN_UNIT {
            return Err(bad_scan());
        }
        let end = read_units(
            BitReader::new(self.data, self.position),
            &self.tables,
            &mut parts,
            self.restart_interval,
        )?;
        self.position =
            end.ok_or_else(|| bad("its data is damaged or ends before it is complete"))?;
        self.scans.push(Scan {
            segments: self.segments.len(),
            restart_interval: self.restart_interval,
            selection: *selection,
            parts,
        });
        Ok(frame.components.iter().all(|component| component.complete))
    }
}

pub(super) fn bad_table() -> Error {
    bad("its Huffman tables are unreadable")
}

/// Reads all codes of a scan and returns where it ends; `None` when a code is wrong.
fn read_units<S: BitSink>(
    mut bits: BitReader<'_>,
    tables: &[[Option<HuffmanTable>; 4]; 2],
    parts: &mut [Part<S>],
    restart_interval: usize,
) -> Result<Option<usize>, Error> {
    let units = parts.first().map_or(0, |part| part.grid.units());
    let table = |class: usize, number: u8| {
        tables[class].get(usize::from(number)).and_then(Option::as_ref).ok_or_else(bad_table)
    };
    let mut readers = Vec::new();
    for Part { tables, grid, bits, .. } in parts {
        let dc = Codes::new(table(0, *tables >> 4)?, dc_meaning);
        let ac = Codes::new(table(1, *tables & 15)?, ac_meaning);
        readers.push((grid.blocks_in_unit(), dc, ac, bits));
    }
    let mut restarts = (0..8).cycle();
    let mut read = || {
        for unit in 0..units {
            if restart_interval > 0 && unit > 0 && unit % restart_interval == 0 {
                let marker = marker::RST0 + restarts.next()?;
                bits.skip_marker(marker)?;
                for (.., sink) in &mut readers {
                    sink.put_marker(marker);
                }
            }
            for (blocks, dc, ac, sink) in &mut readers {
                for _ in 0..*blocks {
                    read_block(&mut bits, dc, ac, *sink)?;
                }
            }
        }
        Some(bits.align())
    };
    Ok(read())
}

/// The codes of a table, and what their values mean.
struct Codes<'a> {
    table: &'a HuffmanTable,
    meaning: fn(u8) -> Option<Meaning>,
    steps: Steps,
}

impl<'a> Codes<'a> {
    fn new(table: &'a HuffmanTable, meaning: fn(u8) -> Option<Meaning>) -> Self {
        Self { table, meaning, steps: Steps::new(table, meaning) }
    }

    /// Reads a code and its value into `sink`; returns by how much it advances, and whether it is the last.
    fn read(&self, bits: &mut BitReader<'_>, sink: &mut impl BitSink) -> Option<(usize, bool)> {
        let (size, advance, is_last) = (self.meaning)(self.table.read(bits, sink)?)?;
        bits.read(size.into(), sink)?;
        Some((advance.into(), is_last))
    }
}

/// The first coefficient of a block, after which the other table is used.
pub(super) fn dc_meaning(size: u8) -> Option<Meaning> {
    (size <= 11).then_some((size, 0, true))
}

/// The other coefficients: a run of zeros and the size of the value after it.
pub(super) fn ac_meaning(code: u8) -> Option<Meaning> {
    match (code >> 4, code & 15) {
        (0, 0) => Some((0, 0, true)),
        (15, 0) => Some((0, 16, false)),
        // Decoders do not agree on where the next code begins.
        (_, 0) => None,
        (run, size) => Some((size, run + 1, false)),
    }
}

fn read_block(
    bits: &mut BitReader<'_>,
    dc: &Codes<'_>,
    ac: &Codes<'_>,
    sink: &mut impl BitSink,
) -> Option<()> {
    if dc.steps.read(bits, sink, 1).is_none() {
        dc.read(bits, sink)?;
    }
    let mut index = 1;
    while index < BLOCK {
        let (advance, is_last) = match ac.steps.read(bits, sink, BLOCK - index) {
            Some(step) => (step.advance.into(), step.is_last),
            None => ac.read(bits, sink)?,
        };
        if is_last {
            return Some(());
        }
        index += advance;
    }
    // Nor do they agree after a run that goes beyond the block.
    (index == BLOCK).then_some(())
}
