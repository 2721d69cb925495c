//! `SetConsoleCtrlHandler`: the program's functions for Ctrl-C and the end of the console. They run in threads of their
//! own, because a signal handler could not do what they do.

use std::ffi::c_int;
use std::process;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::Once;
use std::thread;
use std::time::{Duration, Instant};

use parking_lot::Mutex;

use crate::calling;
use crate::exit;
use crate::ffi::caught;
use crate::inside;

const TRUE: i32 = 1;
const FALSE: i32 = 0;

/// A program's function: it gets the event, and returns whether it has handled it.
type Handler = unsafe extern "C-unwind" fn(event: u32) -> i32;

/// The signals, and the events that they are.
const EVENTS: [(c_int, u32); 4] = [
    (libc::SIGINT, CTRL_C),
    (libc::SIGQUIT, CTRL_BREAK),
    (libc::SIGTERM, CLOSE),
    (libc::SIGHUP, CLOSE),
];
const CTRL_C: u32 = 0;
const CTRL_BREAK: u32 = 1;
const CLOSE: u32 = 2;
/// How often the thread looks for a signal.
const LOOK: Duration = Duration::from_millis(10);
/// How long the functions may take at the end of the console, as on Windows.
const CLOSE_LIMIT: Duration = Duration::from_secs(5);
/// How many events are told at once. The next ones are lost.
const MOST_ASKED: u32 = 16;
/// No program has more functions.
const MOST: usize = 64;

static HANDLERS: Mutex<Vec<Handler>> = Mutex::new(Vec::new());
static IGNORES_CTRL_C: AtomicBool = AtomicBool::new(false);
/// The process with the thread. A child after `fork` has this value, but not the thread.
static OWNER: AtomicU32 = AtomicU32::new(0);
/// The signals that have come, for the thread: a bit for each of [`EVENTS`]. A program may close every file that it finds,
/// so this is not written into one.
static CAME: AtomicU32 = AtomicU32::new(0);

/// How many events are being told.
static ASKED: AtomicU32 = AtomicU32::new(0);

/// Adds or removes a function of the program; without one, Ctrl-C is ignored from now on, or not.
#[no_mangle]
pub extern "C" fn SetConsoleCtrlHandler(handler: Option<Handler>, add: i32) -> i32 {
    caught(FALSE, || {
        if !is_begun() {
            return FALSE;
        }
        let Some(handler) = handler else {
            IGNORES_CTRL_C.store(add != 0, Ordering::Release);
            return TRUE;
        };
        let mut handlers = HANDLERS.lock();
        let found = handlers.iter().rposition(|known| *known as usize == handler as usize);
        match (add != 0, found) {
            (true, _) if handlers.len() < MOST => handlers.push(handler),
            (false, Some(at)) => _ = handlers.remove(at),
            (true, _) | (false, None) => return FALSE,
        }
        TRUE
    })
}

/// Takes up the signals when this is called first; whether that went well.
fn is_begun() -> bool {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        // The end with motors stopped, when no function handles an event.
        exit::watch_signals();
        let thread = thread::Builder::new().name("ft/control".into());
        if thread.spawn(handle).is_ok() {
            OWNER.store(process::id(), Ordering::Release);
            EVENTS.iter().for_each(|(signal, _)| exit::take_over(*signal, on_signal));
        }
    });
    OWNER.load(Ordering::Acquire) == process::id()
}

extern "C" fn on_signal(signal: c_int) {
    let is_ours = OWNER.load(Ordering::Acquire) == process::id();
    match EVENTS.iter().position(|(known, _)| *known == signal) {
        Some(number) if is_ours => _ = CAME.fetch_or(1 << number, Ordering::AcqRel),
        _ => exit::on_end(signal),
    }
}

/// The thread. Each event has another one, in which a function may wait. The end of the console is not put off by that
/// for ever.
fn handle() {
    let mut closes: Option<(c_int, Instant)> = None;
    loop {
        thread::sleep(LOOK);
        let came = CAME.swap(0, Ordering::AcqRel);
        for (number, (signal, event)) in EVENTS.into_iter().enumerate() {
            if came & 1 << number == 0 {
                continue;
            }
            if event == CLOSE {
                closes.get_or_insert((signal, Instant::now()));
            }
            let ask = move || {
                let goes_on = goes_on_after(event);
                ASKED.fetch_sub(1, Ordering::AcqRel);
                if !goes_on {
                    exit::on_end(signal);
                }
            };
            if ASKED.fetch_add(1, Ordering::AcqRel) >= MOST_ASKED {
                ASKED.fetch_sub(1, Ordering::AcqRel);
            } else if calling::spawn("ft/event", 0, ask).is_err() {
                exit::on_end(signal);
            }
        }
        if let Some((signal, _)) = closes.filter(|(_, since)| since.elapsed() >= CLOSE_LIMIT) {
            exit::on_end(signal);
        }
    }
}

/// Asks the program's functions, the last one first, and whether the program goes on.
fn goes_on_after(event: u32) -> bool {
    if event == CTRL_C && IGNORES_CTRL_C.load(Ordering::Acquire) {
        return true;
    }
    // They may add and remove some.
    let handlers = HANDLERS.lock().clone();
    let is_handled = handlers.iter().rev().any(|handler| {
        // SAFETY: the program has given these functions, and they are there until it removes them.
        inside::of_program(|| unsafe { handler(event) }) != 0
    });
    is_handled && event != CLOSE
}
