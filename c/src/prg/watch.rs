//! Who ends a program that does not end by itself: after a crash, when it hangs, and when it does not end although
//! it was asked to.

use std::io;
use std::sync::atomic::{AtomicBool, AtomicU32, AtomicU8, Ordering};
use std::sync::Arc;
use std::thread::{self, JoinHandle, Thread};
use std::time::Duration;

use ft_transfer_area::TransferAreaComHandler;

use super::{keyboard, signals, system, words, FAILED};
use crate::exit;
use crate::online::Online;
use crate::process::{self, write_error};

/// How often the program is looked at.
const LOOK: Duration = Duration::from_millis(2);
/// How many looks a call into the program may last. Looks are counted, and not time, so a program that is
/// stopped by a debugger does not hang.
const CALL_LOOKS: u32 = 250;
/// How many looks a program that is asked to end has for its call to return.
const END_LOOKS: u32 = 5;
/// How many looks the last exchange may last: it waits for the answer that is under way. Without it the connection closes, at
/// which outputs may stay on.
const LAST_EXCHANGE_LOOKS: u32 = (exit::ANSWER_LIMIT.as_millis() / LOOK.as_millis()) as u32;
/// How many looks it has to write what is left, when nothing moves.
const FLUSH_LOOKS: u32 = 250;

/// Whether a program is watched, and whether it has called `exit` then.
static WATCHES: AtomicBool = AtomicBool::new(false);
static EXITS: AtomicBool = AtomicBool::new(false);
/// Whether what it has written before is written.
static FLUSHED: AtomicBool = AtomicBool::new(false);

/// The program has called `exit`, or has ended well. What is to be done at its end runs in its thread, which
/// may be in the middle of a call, so the watcher does the rest.
extern "C" fn on_exit() {
    // Not in a child after `fork`, nor when the watcher is gone.
    let is_watched = !process::is_forked() && !exit::threads_are_gone();
    if is_watched && WATCHES.load(Ordering::Acquire) {
        EXITS.store(true, Ordering::Release);
        // It waits for threads that read or write just now.
        // SAFETY: a null pointer means all files.
        unsafe { libc::fflush(std::ptr::null_mut()) };
        FLUSHED.store(true, Ordering::Release);
        thread::sleep(Duration::from_secs(5));
    }
}

/// Where the program is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub(super) enum Place {
    Outside,
    Init,
    Tic,
    Callback,
}

impl Place {
    const ALL: [Self; 4] = [Self::Outside, Self::Init, Self::Tic, Self::Callback];

    fn name(self) -> &'static str {
        match self {
            Self::Outside => "the runtime",
            Self::Init => "PrgInit",
            Self::Tic => "PrgTic",
            Self::Callback => "a callback",
        }
    }
}

/// What the threads here and the program's share. It is not an allocation, so a program that writes beyond its own
/// allocations leaves it as it is.
static RUN: RunState = RunState::new();

struct RunState {
    place: AtomicU8,
    /// Counts calls into the program.
    calls: AtomicU32,
    /// The program has ended well; nobody is to be watched any more.
    over: AtomicBool,
    /// The transfer is to end, and has ended.
    end: AtomicBool,
    ended: AtomicBool,
}

impl RunState {
    const fn new() -> Self {
        Self {
            place: AtomicU8::new(Place::Outside as u8),
            calls: AtomicU32::new(0),
            over: AtomicBool::new(false),
            end: AtomicBool::new(false),
            ended: AtomicBool::new(false),
        }
    }

    /// Forgets an earlier program, whose threads have ended.
    fn reset(&self) {
        self.place.store(Place::Outside as u8, Ordering::Release);
        for flag in [&self.over, &self.end, &self.ended] {
            flag.store(false, Ordering::Release);
        }
    }

    fn place(&self) -> Place {
        Place::ALL[usize::from(self.place.load(Ordering::Acquire)) % Place::ALL.len()]
    }
}

/// Watches the program from other threads, while it lives. They were made before they are needed, and the one
/// that ends the process does not allocate: the program may have crashed while holding the allocator lock.
pub(super) struct Watch {
    ender: JoinHandle<()>,
    watcher: JoinHandle<()>,
}

impl Watch {
    pub(super) fn new(
        handler: Arc<TransferAreaComHandler>,
        online: Arc<Online>,
    ) -> io::Result<Self> {
        words::program_name();
        RUN.reset();
        let ender = thread::Builder::new().name("ender".into()).spawn(move || {
            while !RUN.end.load(Ordering::Acquire) {
                if RUN.over.load(Ordering::Acquire) {
                    return;
                }
                thread::park();
            }
            // What went wrong with the end matters no more after what made it necessary.
            if handler.end_transfer().is_ok() {
                online.end();
            }
            RUN.ended.store(true, Ordering::Release);
        })?;
        let to_wake = ender.thread().clone();
        let watcher =
            thread::Builder::new().name("watcher".into()).spawn(move || watch(&to_wake))?;
        if !WATCHES.swap(true, Ordering::AcqRel) {
            exit::at_exit(on_exit);
        }
        Ok(Self { ender, watcher })
    }

    /// Makes a call into the program.
    pub(super) fn call<R>(&self, place: Place, call: impl FnOnce() -> R) -> R {
        RUN.calls.fetch_add(1, Ordering::Relaxed);
        RUN.place.store(place as u8, Ordering::Release);
        let result = call();
        #[cfg(unix)]
        if process::is_forked() {
            process::end_forked();
        }
        RUN.place.store(Place::Outside as u8, Ordering::Release);
        result
    }

    /// Watches no more.
    pub(super) fn end(self) {
        WATCHES.store(false, Ordering::Release);
        RUN.over.store(true, Ordering::Release);
        self.ender.thread().unpark();
        for thread in [self.ender, self.watcher] {
            // They do not panic.
            let _ = thread.join();
        }
    }
}

/// The watcher's thread.
fn watch(ender: &Thread) {
    signals::watch_from_here();
    let (mut call, mut looks, mut end_looks) = (0, 0, 0);
    while !RUN.over.load(Ordering::Acquire) {
        thread::sleep(LOOK);
        if let Some(crash) = signals::crash() {
            end(ender, &["crashed in ", RUN.place().name(), " with ", crash]);
        }
        let place = RUN.place();
        if EXITS.load(Ordering::Acquire) {
            end(ender, &["exit was called in ", place.name()]);
        }
        let now = RUN.calls.load(Ordering::Relaxed);
        looks = if place == Place::Outside || now != call { 0 } else { looks + 1 };
        call = now;
        if looks > CALL_LOOKS {
            end(ender, &[place.name(), " has not returned for half a second"]);
        }
        if let Some(reason) = system::stop_reason() {
            end_looks += 1;
            if end_looks > END_LOOKS && looks > END_LOOKS {
                let name = signals::end_name(reason);
                end(ender, &["ended by ", name, ", while ", place.name(), " had not returned"]);
            }
        }
    }
}

/// Ends the transfer and the process, with a sentence of these parts. Does not allocate.
fn end(ender: &Thread, what: &[&str]) -> ! {
    RUN.end.store(true, Ordering::Release);
    ender.unpark();
    for _ in 0..LAST_EXCHANGE_LOOKS {
        if RUN.ended.load(Ordering::Acquire) {
            break;
        }
        thread::sleep(LOOK);
    }
    let mut looks = 0;
    while EXITS.load(Ordering::Acquire) && !FLUSHED.load(Ordering::Acquire) && looks < FLUSH_LOOKS {
        thread::sleep(LOOK);
        looks += 1;
    }
    keyboard::restore();
    let outputs = if RUN.ended.load(Ordering::Acquire) {
        "; all outputs are off\n"
    } else {
        "; no last exchange: the outputs of a TXT may stay on\n"
    };
    write_error(words::program_name());
    write_error(": ");
    what.iter().for_each(|part| write_error(part));
    write_error(outputs);
    signals::exit(FAILED)
}
