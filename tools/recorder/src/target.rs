//! The file into which a recording goes now.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::Instant;

use mcap::McapResult;

use crate::file;
use crate::parts::{Files, Parts};
use crate::under_way::UnderWay;
use crate::writer::{Losses, Writer};

/// The file that is being written, and those before it.
pub(crate) struct Target {
    pub(crate) writer: Writer,
    newest: PathBuf,
    files: Option<Files>,
}

impl Target {
    /// The first file. A single one takes the place of an earlier one. It may begin within a transfer, at a time
    /// before now.
    pub(crate) fn create(
        path: PathBuf,
        parts: Option<Parts>,
        within: Option<(Instant, UnderWay)>,
    ) -> McapResult<Self> {
        // A file that was there before stays.
        Writer::check_clock()?;
        let mut files = parts.map(|parts| Files::beside(&path, parts)).transpose()?;
        let (newest, file) = match &mut files {
            Some(files) => files.make()?,
            None => {
                let file = file::create(&path)?;
                (path, file)
            }
        };
        let begun = match within {
            Some((since, under_way)) => Writer::within(file, since, &under_way, Losses::default()),
            None => Writer::new(file),
        };
        // A single file was perhaps there before.
        let writer = begun.inspect_err(|_| files.iter().for_each(|_| discard(&newest)))?;
        Ok(Self { writer, newest, files })
    }

    pub(crate) fn newest(&self) -> &Path {
        &self.newest
    }

    /// Nobody waits for it any more. A single file was perhaps there before.
    pub(crate) fn discard(self) {
        self.files.iter().for_each(|_| discard(&self.newest));
    }

    /// Whether it is to go on in a new file.
    pub(crate) fn is_full(&self) -> bool {
        self.files.as_ref().is_some_and(|files| files.is_full(self.writer.bytes()))
    }

    /// Goes on in a new file. What comes next is of this time, and so much was lost before.
    pub(crate) fn begin_part(&mut self, at: Instant, lost: Losses) -> McapResult<()> {
        let Some(files) = &mut self.files else { return Ok(()) };
        let (path, file) = files.make()?;
        let next = self.writer.next_part(file, at, lost).inspect_err(|_| discard(&path))?;
        let full = std::mem::replace(&mut self.newest, path);
        let bytes = std::mem::replace(&mut self.writer, next).finish()?;
        files.done(full, bytes);
        self.delete_oldest();
        Ok(())
    }

    /// Deletes what is not kept.
    pub(crate) fn delete_oldest(&mut self) {
        if let Some(files) = &mut self.files {
            files.delete_oldest(self.writer.bytes());
        }
    }
}

/// Removes a new file without a beginning, as on a full disk: nothing of it can be read.
fn discard(file: &Path) {
    // The first error says more.
    let _ = fs::remove_file(file);
}
