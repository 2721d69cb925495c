//! The bytes of a file, of which only those are kept that are looked at.

use std::io::{self, Read};

/// How much is read at once, however long a record says that it is.
const PIECE: usize = 256 << 10;

/// How many bytes are kept behind: those at the end of a file tell whether it is whole.
const KEPT: usize = 8;

pub(crate) struct Source<R> {
    file: R,
    held: Vec<u8>,
    /// Which of the bytes held is the next one.
    next: usize,
    /// How many bytes were before those held.
    before: u64,
    at_end: bool,
}

impl<R: Read> Source<R> {
    pub(crate) fn of(file: R) -> Self {
        Self { file, held: Vec::new(), next: 0, before: 0, at_end: false }
    }

    pub(crate) fn file(&self) -> &R {
        &self.file
    }

    /// Where the next byte is in the file.
    pub(crate) fn at(&self) -> u64 {
        self.before + self.next as u64
    }

    /// The next bytes, as many as are there now.
    pub(crate) fn rest(&self) -> &[u8] {
        &self.held[self.next..]
    }

    /// The next bytes: at least so many, or all to the end of the file.
    pub(crate) fn ready(&mut self, count: usize) -> io::Result<&[u8]> {
        while !self.at_end && self.rest().len() < count {
            self.read_piece()?;
        }
        Ok(self.rest())
    }

    /// Goes on behind so many of the bytes that are there.
    pub(crate) fn skip(&mut self, count: usize) {
        self.next = (self.next + count).min(self.held.len());
    }

    /// Whether all of the file is read, up to the bytes that are there.
    pub(crate) fn is_at_end(&self) -> bool {
        self.at_end
    }

    /// Whether these are the last bytes, when all of them were read.
    pub(crate) fn has_ended_with(&self, bytes: &[u8]) -> bool {
        self.at_end && self.held.ends_with(bytes)
    }

    fn read_piece(&mut self) -> io::Result<()> {
        let done = self.next.saturating_sub(KEPT);
        self.held.drain(..done);
        self.next -= done;
        self.before += done as u64;
        let there = self.held.len();
        self.held.resize(there + PIECE, 0);
        let read = read_some(&mut self.file, &mut self.held[there..]);
        self.held.truncate(there + read.as_ref().copied().unwrap_or(0));
        self.at_end = read? == 0;
        Ok(())
    }
}

/// Reads at least a byte unless the file has ended.
fn read_some(file: &mut impl Read, buffer: &mut [u8]) -> io::Result<usize> {
    loop {
        match file.read(buffer) {
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            done => return done,
        }
    }
}
