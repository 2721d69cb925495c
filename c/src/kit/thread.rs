//! The thread of kit 4.6.6, which exchanges the program's areas while the program uses them.
#![allow(unreachable_pub, reason = "the linker exports it")]

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::Arc;
use std::thread::{self, JoinHandle};

use ft_transfer_area::TransferMode;
use parking_lot::Mutex;

use super::handler::Kit;
use crate::report;
use crate::session::TIME_TO_ANSWER;

/// A handler with its thread, if the program has started it.
pub struct Threaded {
    kit: Arc<Kit>,
    exchanges: Mutex<Option<Exchanges>>,
}

struct Exchanges {
    should_end: Arc<AtomicBool>,
    thread: JoinHandle<()>,
}

impl Threaded {
    pub(super) fn new(kit: Kit) -> Self {
        Self { kit: Arc::new(kit), exchanges: Mutex::new(None) }
    }

    pub(super) fn kit(&self) -> &Kit {
        &self.kit
    }

    /// Begins the transfer and the thread; false when it runs already. An error was reported.
    pub(super) fn start(&self, mode: TransferMode) -> Result<bool, ()> {
        let mut exchanges = self.exchanges.lock();
        if exchanges.as_ref().is_some_and(Exchanges::run) {
            return Ok(false);
        }
        if let Some(ended) = exchanges.take() {
            ended.end();
        }
        if !self.kit.report(self.kit.begin()) {
            return Err(());
        }
        let should_end = Arc::new(AtomicBool::new(false));
        let (kit, ends) = (Arc::clone(&self.kit), Arc::clone(&should_end));
        let thread = thread::Builder::new().name("ft/session".into());
        let run = move || {
            #[cfg(unix)]
            let _stack = crate::exit::Stack::give();
            exchange(&kit, mode, &ends);
        };
        let thread = thread.spawn(run).map_err(|error| {
            // The transfer is of no use without it.
            let _ = self.kit.end();
            report::failure(error);
        })?;
        *exchanges = Some(Exchanges { should_end, thread });
        Ok(true)
    }

    /// Ends both; false when there was no thread.
    pub(super) fn stop(&self) -> bool {
        self.exchanges.lock().take().map(Exchanges::end).is_some()
    }

    pub(super) fn runs(&self) -> bool {
        self.exchanges.lock().as_ref().is_some_and(Exchanges::run)
    }
}

impl Drop for Threaded {
    fn drop(&mut self) {
        self.stop();
    }
}

impl Exchanges {
    fn run(&self) -> bool {
        !self.thread.is_finished()
    }

    fn end(self) {
        self.should_end.store(true, Ordering::Release);
        if self.thread.join().is_err() {
            report::failure("the thread of a transfer area panicked");
        }
    }
}

/// Exchanges until the program ends it, or the connection is lost.
fn exchange(kit: &Kit, mode: TransferMode, should_end: &AtomicBool) {
    while !should_end.load(Ordering::Acquire) && kit.report(kit.transfer(mode)) {
        // The program answers in the same cycle, and other calls get their turn.
        thread::sleep(TIME_TO_ANSWER);
    }
    // A connection that is lost has ended already.
    let _ = kit.end();
}
