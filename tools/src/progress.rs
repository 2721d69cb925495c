//! A line that shows how far a command is, written by a thread of its own: a terminal that is paused (Ctrl-S) holds up
//! neither the command nor its end.

use std::thread;
use std::time::Duration;

use crossbeam_channel::{bounded, Receiver, Sender};
use indicatif::ProgressBar;

/// How long the end of the command waits until the line is removed.
const LAST: Duration = Duration::from_millis(500);

pub(crate) struct Progress<T> {
    newest: Option<Sender<T>>,
    ended: Receiver<()>,
}

impl<T: Send + 'static> Progress<T> {
    /// Shows this bar until it is dropped. Without a thread for it nothing is shown.
    pub(crate) fn start(bar: ProgressBar, set: impl Fn(&ProgressBar, T) + Send + 'static) -> Self {
        let (newest, next) = bounded(1);
        let (end, ended) = bounded::<()>(0);
        let show = move || {
            // Dropped when the line is removed.
            let _end = end;
            bar.tick();
            next.iter().for_each(|what| {
                set(&bar, what);
                bar.tick();
            });
            bar.finish_and_clear();
        };
        let _ = thread::Builder::new().name("progress".to_owned()).spawn(show);
        Self { newest: Some(newest), ended }
    }

    /// Shows what is reached now, unless the last one still waits for the terminal.
    pub(crate) fn show(&self, what: T) {
        if let Some(newest) = &self.newest {
            let _ = newest.try_send(what);
        }
    }
}

impl<T> Drop for Progress<T> {
    fn drop(&mut self) {
        self.newest = None;
        let _ = self.ended.recv_timeout(LAST);
    }
}
