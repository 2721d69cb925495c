//! A queue between two threads, whose room is in bytes. Who puts something in never waits.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::Arc;

use crossbeam_channel::{unbounded, Receiver, RecvError, Sender};

/// What an entry takes besides itself and what it points to.
const ENTRY: usize = 32;

/// The end for those who put something in.
pub(crate) struct Put<T> {
    sender: Sender<Entry<T>>,
    used: Arc<AtomicUsize>,
    room: usize,
}

/// The end for the one who takes it out.
pub(crate) struct Take<T> {
    receiver: Receiver<Entry<T>>,
    used: Arc<AtomicUsize>,
}

struct Entry<T> {
    what: T,
    size: usize,
}

/// A queue with room for this number of bytes.
pub(crate) fn queue<T>(room: usize) -> (Put<T>, Take<T>) {
    let (sender, receiver) = unbounded();
    let used = Arc::new(AtomicUsize::new(0));
    (Put { sender, used: Arc::clone(&used), room }, Take { receiver, used })
}

impl<T> Put<T> {
    /// Puts in what points to this number of bytes; returns whether there was room for it. Nothing is put in when
    /// nobody takes it out any more.
    pub(crate) fn put(&self, what: T, bytes: usize) -> bool {
        self.put_below(what, bytes, self.room)
    }

    /// How many bytes there is room for in all.
    pub(crate) fn room(&self) -> usize {
        self.room
    }

    /// Puts something in as [`put`](Self::put) does, with less room.
    pub(crate) fn put_below(&self, what: T, bytes: usize, room: usize) -> bool {
        let size = bytes + size_of::<Entry<T>>() + ENTRY;
        let used = self.used.fetch_add(size, Ordering::Relaxed);
        let fits =
            used.saturating_add(size) <= room && self.sender.send(Entry { what, size }).is_ok();
        if !fits {
            self.used.fetch_sub(size, Ordering::Relaxed);
        }
        fits
    }
}

impl<T> Take<T> {
    /// Waits for the next one. The error says that no more come.
    pub(crate) fn wait(&self) -> Result<T, RecvError> {
        self.receiver.recv().map(|entry| self.out(entry))
    }

    /// The next one, if there is one.
    pub(crate) fn next(&self) -> Option<T> {
        self.receiver.try_recv().ok().map(|entry| self.out(entry))
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.receiver.is_empty()
    }

    fn out(&self, entry: Entry<T>) -> T {
        self.used.fetch_sub(entry.size, Ordering::Relaxed);
        entry.what
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_taken_out_makes_room_and_each_entry_takes_some() {
        let (put, take) = queue(1000);
        assert!(put.put(1, 600) && !put.put(2, 600) && put.put(3, 100));
        assert_eq!((take.next(), take.next(), take.next()), (Some(1), Some(3), None));
        assert!((0..1000).filter(|_| put.put(4, 0)).count() < 30);
        assert_eq!(take.wait(), Ok(4));
        assert!(put.put(5, 0) && !put.put(5, 0) && !take.is_empty());
        drop(take);
        assert!(!put.put(6, 0));
    }
}
