//! The file of a recording, and how MCAP is written into it.

use std::cell::{Cell, RefCell};
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::rc::Rc;

use mcap::{Compression, WriteOptions};

use crate::format::PROFILE;

/// The file, for several writers one after the other.
#[derive(Clone)]
pub(crate) struct Output(Rc<Shared>);

struct Shared {
    file: RefCell<BufWriter<File>>,
    /// Whether what is written is left out.
    is_muted: Cell<bool>,
    written: Cell<u64>,
}

impl Output {
    pub(crate) fn new(file: File) -> Self {
        let file = RefCell::new(BufWriter::new(file));
        Self(Rc::new(Shared { file, is_muted: Cell::new(false), written: Cell::new(0) }))
    }

    /// How many bytes were written.
    pub(crate) fn written(&self) -> u64 {
        self.0.written.get()
    }

    /// Leaves out what is written meanwhile: the head that a writer begins with.
    pub(crate) fn muted<T>(&self, write: impl FnOnce(Self) -> T) -> T {
        self.0.is_muted.set(true);
        let written = write(self.clone());
        self.0.is_muted.set(false);
        written
    }
}

impl Write for Output {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if self.0.is_muted.get() {
            return Ok(bytes.len());
        }
        let written = self.0.file.borrow_mut().write(bytes)?;
        self.0.written.set(self.0.written.get() + written as u64);
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.0.file.borrow_mut().flush()
    }
}

/// A file with an index.
pub(crate) fn options() -> WriteOptions {
    // Without seeking, so that each chunk gets into the file as a whole or not at all.
    WriteOptions::new()
        .profile(PROFILE)
        .library(concat!(env!("CARGO_PKG_NAME"), " ", env!("CARGO_PKG_VERSION")))
        .compression(Some(Compression::Lz4))
        // A new one begins only between two cycles.
        .chunk_size(None)
        .disable_seeking(true)
}

/// The rest of a file that gets no index. Nor can it have a checksum of all data: this writer has not seen all of them.
pub(crate) fn without_index() -> WriteOptions {
    options()
        .emit_summary_records(false)
        .emit_summary_offsets(false)
        .emit_message_indexes(false)
        .calculate_data_section_crc(false)
}
