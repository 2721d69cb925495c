//! Programs that were downloaded to a ROBO TX: `PrgInit` once, then `PrgTic` every millisecond.
//!
//! One thread, the program's own, owns the program's areas and makes every call into the program: `PrgInit`,
//! `PrgTic`, callbacks. Between two calls it takes inputs in and puts outputs out.

mod callbacks;
mod display;
mod draw;
mod hooks;
#[cfg(unix)]
#[path = "keyboard_unix.rs"]
mod keyboard;
#[cfg(not(unix))]
#[path = "keyboard_windows.rs"]
mod keyboard;
mod pace;
mod peripherals;
mod run;
mod screen;
#[cfg(unix)]
#[path = "signals_unix.rs"]
mod signals;
#[cfg(not(unix))]
#[path = "signals_windows.rs"]
mod signals;
mod strings;
mod system;
mod terminal;
mod watch;
mod words;

use std::ffi::{c_int, c_void};

use crate::ffi::caught;
use crate::memory::Ta;
use crate::report;

/// `void PrgInit(TA *p_ta_array, int ta_count)`. A C++ program may throw, which ends it.
type PrgInit = unsafe extern "C-unwind" fn(*mut Ta, c_int);
/// `int PrgTic(TA *p_ta_array, int ta_count)`.
type PrgTic = unsafe extern "C-unwind" fn(*mut Ta, c_int) -> c_int;

/// The exit status of a program that did not end well.
const FAILED: c_int = 1;

/// Runs a program that was written to be downloaded: calls `init` once and then `tic` every millisecond, until
/// `tic` returns another value than 0x7FFF. `tx_main.c` calls it.
///
/// Returns the exit status: 0 when `tic` has returned 0. All outputs are off then, and what happened is on the
/// error output.
///
/// The controller is the one that the environment variable `FT_TXT_HOST` names, as `HOST`, `HOST:PORT` or
/// `auto`, which is also the default.
#[no_mangle]
pub(crate) extern "C" fn ft_tx_run(
    init: Option<unsafe extern "C-unwind" fn(*mut c_void, c_int)>,
    tic: Option<unsafe extern "C-unwind" fn(*mut c_void, c_int) -> c_int>,
) -> c_int {
    caught(FAILED, || {
        report::start();
        let (Some(init), Some(tic)) = (init, tic) else {
            words::say("a program needs both PrgInit and PrgTic");
            return FAILED;
        };
        // SAFETY: the same functions; `Ta` is what the program's header calls `TA`.
        let init = unsafe {
            std::mem::transmute::<unsafe extern "C-unwind" fn(*mut c_void, c_int), PrgInit>(init)
        };
        // SAFETY: as above.
        let tic = unsafe {
            std::mem::transmute::<unsafe extern "C-unwind" fn(*mut c_void, c_int) -> c_int, PrgTic>(
                tic,
            )
        };
        run::run(init, tic)
    })
}
