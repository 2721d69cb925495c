//! Recordings: written, read, drawn, replayed.

mod answering;
mod clock;
pub(crate) mod compare;
pub(crate) mod csv;
pub(crate) mod in_parts;
pub(crate) mod info;
pub(crate) mod on_demand;
pub(crate) mod output;
pub(crate) mod part;
pub(crate) mod plot;
pub(crate) mod record;
pub(crate) mod replay;
mod survey;
mod unusual;
mod whole;

use std::path::Path;

use anyhow::ensure;

/// What shows a recording must not take its place, under whichever name.
fn ensure_is_another(output: &Path, recording: &Path) -> anyhow::Result<()> {
    let is_same = same_file::is_same_file(output, recording).unwrap_or(false);
    ensure!(!is_same, "can't write {}: it is the recording", output.display());
    Ok(())
}
