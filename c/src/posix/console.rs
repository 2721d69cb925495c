//! The console: what a program sets of it becomes the control sequences of a terminal. Where the output is no terminal,
//! nothing is written for it.

use std::ffi::{c_char, c_int, c_void};
use std::sync::atomic::{AtomicBool, AtomicU16, Ordering};
use std::sync::Once;
use std::thread;
use std::time::Duration;

use super::keyboard;
use super::objects::Handle;
use super::text::wide_text_of;
use crate::ffi::{caught, text_of};

const TRUE: i32 = 1;
const FALSE: i32 = 0;
/// The handles of input, output and errors: none of [`super::objects`].
const HANDLES: [usize; 3] = [0x4000_0004, 0x4000_0008, 0x4000_000C];
/// White on black, with which a console begins.
const ORDINARY: u16 = 7;
/// All that there is of an input: a line with echo, Ctrl-C; of an output: lines that are broken, control sequences.
const MODE: u32 = 7;

static ATTRIBUTES: AtomicU16 = AtomicU16::new(ORDINARY);
static IS_HIDDEN: AtomicBool = AtomicBool::new(false);

/// The file of a handle; `None` for other handles.
pub(super) fn file_of(handle: Handle) -> Option<c_int> {
    HANDLES.iter().position(|known| *known == handle.addr()).map(|file| file as c_int)
}

fn is_terminal(file: c_int) -> bool {
    // SAFETY: a plain question to the system.
    unsafe { libc::isatty(file) == 1 }
}

/// Whether this handle is an output that is a terminal.
pub(super) fn is_screen(handle: Handle) -> bool {
    file_of(handle).is_some_and(|file| file != libc::STDIN_FILENO && is_terminal(file))
}

#[cfg_attr(target_os = "macos", allow(non_upper_case_globals, reason = "the C library's name"))]
extern "C" {
    #[cfg_attr(target_os = "macos", link_name = "__stdoutp")]
    static stdout: *mut libc::FILE;
}

/// Writes to the terminal behind all that the program has printed.
pub(super) fn send(bytes: &[u8]) {
    // Other files may be in use by a thread that waits for keys, so only this one is flushed.
    // SAFETY: the C library's, which is there until the end.
    unsafe { libc::fflush(stdout) };
    keyboard::show(bytes);
}

/// Writes a control sequence, if there is a terminal for it.
pub(super) fn control(sequence: &str) -> bool {
    let is_there = is_terminal(libc::STDOUT_FILENO);
    if is_there {
        send(sequence.as_bytes());
    }
    is_there
}

/// Has the terminal as it was when the program ends.
fn restore_at_end() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        crate::exit::watch_signals();
        // SAFETY: the function stays; it is called when the program ends.
        unsafe { libc::atexit(as_before) };
    });
}

/// Makes colours and cursor as they were. Async-signal-safe, and waits for nobody who reads the terminal.
pub(crate) extern "C" fn as_before() {
    let is_changed =
        ATTRIBUTES.load(Ordering::Acquire) != ORDINARY || IS_HIDDEN.load(Ordering::Acquire);
    if !is_changed {
        return;
    }
    const SEQUENCE: &[u8] = b"\x1b[0m\x1b[?25h";
    let mut output = libc::pollfd { fd: libc::STDOUT_FILENO, events: libc::POLLOUT, revents: 0 };
    // SAFETY: the struct and the bytes are there.
    unsafe {
        if libc::poll(&raw mut output, 1, 0) == 1 && output.revents == libc::POLLOUT {
            libc::write(libc::STDOUT_FILENO, SEQUENCE.as_ptr().cast(), SEQUENCE.len());
        }
    }
}

/// The sequence for the colours of Windows: three bits and a brighter one for text, and the same for what is behind it.
fn colours(attributes: u16) -> String {
    // Red and blue are the other way round.
    let colour = |bits: u16| (bits & 2) | (bits & 1) << 2 | (bits & 4) >> 2;
    let shown = |bits: u16, ordinary: u16, base: u16| match bits & 15 {
        bits if bits == ordinary => base + 9,
        bits if bits & 8 != 0 => base + 60 + colour(bits),
        bits => base + colour(bits),
    };
    let mut sequence =
        format!("\x1b[0;{};{}", shown(attributes, 7, 30), shown(attributes >> 4, 0, 40));
    if attributes & 0x8000 != 0 {
        sequence += ";4";
    }
    if attributes & 0x4000 != 0 {
        sequence += ";7";
    }
    sequence + "m"
}

/// Sets the colours of what is printed from now on.
pub(super) fn set_colours(attributes: u16) {
    restore_at_end();
    if control(&colours(attributes)) {
        ATTRIBUTES.store(attributes, Ordering::Release);
    }
}

/// Those that are set.
pub(super) fn attributes() -> u16 {
    ATTRIBUTES.load(Ordering::Acquire)
}

pub(super) fn is_cursor_hidden() -> bool {
    IS_HIDDEN.load(Ordering::Acquire)
}

/// Hides the cursor, or shows it; whether there is a terminal.
pub(super) fn hide_cursor(is_hidden: bool) -> bool {
    restore_at_end();
    let is_done = control(if is_hidden { "\x1b[?25l" } else { "\x1b[?25h" });
    if is_done {
        IS_HIDDEN.store(is_hidden, Ordering::Release);
    }
    is_done
}

/// Sets the title of the terminal's window.
pub(super) fn set_title(title: &str) {
    let title: String = title.chars().filter(|one| !one.is_control()).collect();
    control(&format!("\x1b]0;{title}\x07"));
}

/// Input, output or errors.
#[no_mangle]
pub extern "C" fn GetStdHandle(which: u32) -> Handle {
    let file = (which as i32).checked_neg().and_then(|number| usize::try_from(number - 10).ok());
    let handle = file.and_then(|file| HANDLES.get(file)).copied();
    std::ptr::without_provenance_mut(handle.unwrap_or(usize::MAX))
}

/// Sets the colours.
#[no_mangle]
pub extern "C" fn SetConsoleTextAttribute(output: Handle, attributes: u16) -> i32 {
    caught(FALSE, || {
        let is_screen = is_screen(output);
        if is_screen {
            set_colours(attributes);
        }
        is_screen.into()
    })
}

/// Sets the title.
///
/// # Safety
///
/// `title` is null or a text that ends with 0 and does not change during the call.
#[no_mangle]
pub unsafe extern "C" fn SetConsoleTitleA(title: *const c_char) -> i32 {
    caught(FALSE, || {
        // SAFETY: as the caller promises.
        let Some(title) = (unsafe { text_of(title) }) else { return FALSE };
        set_title(&title);
        TRUE
    })
}

/// Sets the title.
///
/// # Safety
///
/// As for [`SetConsoleTitleA`].
#[no_mangle]
pub unsafe extern "C" fn SetConsoleTitleW(title: *const libc::wchar_t) -> i32 {
    caught(FALSE, || {
        // SAFETY: as the caller promises.
        let Some(title) = (unsafe { wide_text_of(title) }) else { return FALSE };
        set_title(&title);
        TRUE
    })
}

/// # Safety
///
/// `to` is null or a place that this call alone uses.
pub(super) unsafe fn give_count(to: *mut u32, count: u32) {
    if !to.is_null() {
        // SAFETY: as the caller promises.
        unsafe { to.write(count) };
    }
}

/// Shows a text, also where there is no terminal.
///
/// # Safety
///
/// `text` is null or has `length` bytes that do not change during the call; `written` is null or a place that this call
/// alone uses.
#[no_mangle]
pub unsafe extern "C" fn WriteConsoleA(
    output: Handle,
    text: *const c_void,
    length: u32,
    written: *mut u32,
    _: *mut c_void,
) -> i32 {
    caught(FALSE, || {
        if text.is_null() || file_of(output).is_none_or(|file| file == libc::STDIN_FILENO) {
            return FALSE;
        }
        // SAFETY: as the caller promises.
        let text = unsafe { std::slice::from_raw_parts(text.cast::<u8>(), length as usize) };
        send(text);
        // SAFETY: as the caller promises.
        unsafe { give_count(written, length) };
        TRUE
    })
}

/// Forgets keys that nobody has read.
#[no_mangle]
pub extern "C" fn FlushConsoleInputBuffer(input: Handle) -> i32 {
    caught(FALSE, || {
        let is_input =
            file_of(input) == Some(libc::STDIN_FILENO) && is_terminal(libc::STDIN_FILENO);
        if is_input {
            keyboard::forget();
        }
        is_input.into()
    })
}

/// The settings with which a console begins.
///
/// # Safety
///
/// `mode` is null or a place that this call alone uses.
#[no_mangle]
pub unsafe extern "C" fn GetConsoleMode(console: Handle, mode: *mut u32) -> i32 {
    let is_known = file_of(console).is_some_and(is_terminal) && !mode.is_null();
    if is_known {
        // SAFETY: as the caller promises.
        unsafe { mode.write(MODE) };
    }
    is_known.into()
}

/// Changes nothing.
#[no_mangle]
pub extern "C" fn SetConsoleMode(console: Handle, _: u32) -> i32 {
    file_of(console).is_some_and(is_terminal).into()
}

/// UTF-8.
#[no_mangle]
pub extern "C" fn GetConsoleOutputCP() -> u32 {
    65001
}

/// UTF-8.
#[no_mangle]
pub extern "C" fn GetConsoleCP() -> u32 {
    65001
}

/// Changes nothing.
#[no_mangle]
pub extern "C" fn SetConsoleOutputCP(_: u32) -> i32 {
    TRUE
}

/// Changes nothing.
#[no_mangle]
pub extern "C" fn SetConsoleCP(_: u32) -> i32 {
    TRUE
}

/// Rings the terminal's bell, and waits as long as the tone would last.
#[no_mangle]
pub extern "C" fn Beep(_: u32, milliseconds: u32) -> i32 {
    caught(FALSE, || {
        control("\x07");
        thread::sleep(Duration::from_millis(milliseconds.into()));
        TRUE
    })
}

/// Rings the terminal's bell.
#[no_mangle]
pub extern "C" fn MessageBeep(_: u32) -> i32 {
    caught(FALSE, || {
        control("\x07");
        TRUE
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_are_those_of_windows() {
        assert_eq!(colours(ORDINARY), "\x1b[0;39;49m");
        // Bright red; blue on yellow; underlined.
        assert_eq!(colours(0xC), "\x1b[0;91;49m");
        assert_eq!(colours(0x61), "\x1b[0;34;43m");
        assert_eq!(colours(0x8002), "\x1b[0;32;49;4m");
    }

    #[test]
    fn there_are_three_handles() {
        let file = |which: i32| file_of(GetStdHandle(which as u32));
        assert_eq!(
            [-10, -11, -12, -13, -9, 0].map(file),
            [Some(0), Some(1), Some(2), None, None, None]
        );
        assert_eq!(file_of(std::ptr::null_mut()), None);
    }
}
