//! Finds the end of a JPEG picture and adds what the camera leaves out.

use std::borrow::Cow;

use super::bits::fill_bytes;
use super::huffman::STANDARD_TABLES;
use super::parser::{marker, Parser};
use crate::error::Error;

/// Repairs the picture at the start of `data`: makes it complete, with nothing after it.
pub(super) fn repair(data: &[u8]) -> Result<Cow<'_, [u8]>, Error> {
    let Parser { position: end, tables_missing, first_scan, .. } = Parser::<()>::read(data)?;
    let marker_at = end + fill_bytes(&data[end..]);
    let has_eoi = data.get(marker_at..marker_at + 2) == Some(&[0xFF, marker::EOI]);
    if has_eoi && !tables_missing {
        return Ok(Cow::Borrowed(&data[..marker_at + 2]));
    }
    let mut repaired = Vec::with_capacity(end + STANDARD_TABLES.len() + 2);
    repaired.extend_from_slice(&data[..first_scan]);
    if tables_missing {
        repaired.extend_from_slice(&STANDARD_TABLES);
    }
    repaired.extend_from_slice(&data[first_scan..end]);
    repaired.extend_from_slice(&[0xFF, marker::EOI]);
    Ok(Cow::Owned(repaired))
}

#[cfg(test)]
mod tests;
