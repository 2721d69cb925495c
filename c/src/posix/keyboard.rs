//! The keyboard, key by key.

use std::collections::VecDeque;
use std::ffi::{c_char, c_int, c_void};
use std::io::{self, Write};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::OnceLock;

use parking_lot::{Mutex, MutexGuard};

use super::keys;
use crate::exit;
use crate::ffi::{caught, text_of};

/// What `_getch` returns when there are no keys any more.
pub(super) const NO_KEYS: c_int = -1;
/// How often who waits for a key looks whether another thread has read one.
const LOOK_MS: c_int = 20;
/// How long the rest of a key's sequence may take.
const REST_OF_KEY_MS: c_int = 20;
pub(super) const ESCAPE: u8 = 27;
const INPUT: c_int = libc::STDIN_FILENO;
/// How much waits for a program that reads no keys; then the oldest ones are lost.
const MOST_KEYS: usize = 1024;

/// What was read and not yet taken.
static KEYS: Mutex<VecDeque<u8>> = Mutex::new(VecDeque::new());
/// How the terminal was before the first key.
static BEFORE: OnceLock<libc::termios> = OnceLock::new();

/// Whether the input is a terminal in which this program is in front. One in the background would be stopped for
/// using it.
pub(crate) fn is_in_front() -> bool {
    // SAFETY: plain questions to the system.
    unsafe { libc::isatty(INPUT) == 1 && libc::tcgetpgrp(INPUT) == libc::getpgrp() }
}

/// Lets keys through one by one, without showing them, until [`lines_again`]. Ctrl-C still ends the program. False when
/// the terminal is not the program's.
fn single_keys() -> bool {
    if !is_in_front() {
        return false;
    }
    // SAFETY: all bits 0 are such a struct, and it is there.
    let now = unsafe {
        let mut now: libc::termios = std::mem::zeroed();
        if libc::tcgetattr(INPUT, &mut now) != 0 {
            return false;
        }
        now
    };
    BEFORE.get_or_init(|| {
        exit::watch_signals();
        // SAFETY: the function stays; it is called when the program ends.
        unsafe { libc::atexit(lines_again) };
        now
    });
    let mut keys = now;
    keys.c_lflag &= !(libc::ICANON | libc::ECHO);
    // SAFETY: a struct that the system has filled.
    unsafe { libc::tcsetattr(INPUT, libc::TCSANOW, &keys) };
    true
}

/// Makes the terminal as it was, unless another program is in front, as a shell, which has made it as it likes.
/// Async-signal-safe.
pub(crate) extern "C" fn lines_again() {
    if let Some(before) = BEFORE.get().filter(|_| is_in_front()) {
        // SAFETY: a struct that the system has filled.
        unsafe { libc::tcsetattr(INPUT, libc::TCSANOW, before) };
    }
}

/// What was read.
#[derive(PartialEq)]
enum Read {
    Keys,
    Nothing,
    /// No more keys come.
    End,
}

/// The terminal, opened once more so that no read waits: another thread may take a key before it, or wait for one in the C
/// library. Any other input as it is.
fn terminal() -> c_int {
    static OPENED: OnceLock<c_int> = OnceLock::new();
    *OPENED.get_or_init(|| {
        let mut name = [0; 256];
        let flags = libc::O_RDONLY | libc::O_NONBLOCK | libc::O_NOCTTY | libc::O_CLOEXEC;
        // SAFETY: the name has room for so many bytes, and an end when it is opened.
        let opened = unsafe {
            match libc::ttyname_r(INPUT, name.as_mut_ptr(), name.len()) {
                0 => libc::open(name.as_ptr(), flags),
                _ => -1,
            }
        };
        if opened < 0 {
            INPUT
        } else {
            opened
        }
    })
}

/// Waits for this time until something comes, or the input has ended.
fn something_waits(wait_ms: c_int) -> bool {
    let mut input = libc::pollfd { fd: INPUT, events: libc::POLLIN, revents: 0 };
    // SAFETY: the struct is there.
    unsafe { libc::poll(&mut input, 1, wait_ms) == 1 }
}

/// Reads what has come, waiting for at most this time.
fn read_keys(keys: &mut VecDeque<u8>, wait_ms: c_int) -> Read {
    if !something_waits(wait_ms) {
        return Read::Nothing;
    }
    let mut bytes = [0; 64];
    // SAFETY: the bytes are there.
    let count = unsafe { libc::read(terminal(), bytes.as_mut_ptr().cast(), bytes.len()) };
    let count = match usize::try_from(count) {
        Ok(0) => return Read::End,
        Ok(count) => count,
        Err(_) => match io::Error::last_os_error().kind() {
            io::ErrorKind::Interrupted | io::ErrorKind::WouldBlock => return Read::Nothing,
            _ => return Read::End,
        },
    };
    keys::note(&bytes[..count]);
    keys.extend(&bytes[..count]);
    keys.drain(..keys.len().saturating_sub(MOST_KEYS));
    Read::Keys
}

/// Reads what a terminal has, for those who ask whether a key is down.
pub(super) fn read_terminal() {
    let mut keys = KEYS.lock();
    if single_keys() {
        while read_keys(&mut keys, 0) == Read::Keys {}
    }
}

/// Forgets what was not read.
pub(super) fn forget() {
    let mut keys = KEYS.lock();
    keys.clear();
    // SAFETY: a call without pointers.
    unsafe { libc::tcflush(INPUT, libc::TCIFLUSH) };
}

/// The second code of a key without a character, after 224.
fn code_of(sequence: &[u8]) -> Option<u8> {
    Some(match sequence {
        b"[A" | b"OA" => 72,
        b"[B" | b"OB" => 80,
        b"[C" | b"OC" => 77,
        b"[D" | b"OD" => 75,
        b"[H" | b"OH" | b"[1~" => 71,
        b"[F" | b"OF" | b"[4~" => 79,
        b"[2~" => 82,
        b"[3~" => 83,
        b"[5~" => 73,
        b"[6~" => 81,
        _ => return None,
    })
}

/// The code of what follows an escape character, and how many bytes it has.
pub(super) fn code_at(bytes: &[u8]) -> Option<(u8, usize)> {
    (2..=3).find_map(|length| Some((code_of(bytes.get(..length)?)?, length)))
}

/// Takes a key from what was read, with the codes of Windows.
fn take(keys: &mut VecDeque<u8>) -> Option<c_int> {
    let key = keys.pop_front()?;
    if key == ESCAPE {
        if let Some((code, length)) = code_at(keys.make_contiguous()) {
            keys.drain(..length);
            keys.push_front(code);
            return Some(224);
        }
    }
    Some(
        match key {
            b'\n' => b'\r',
            127 => 8,
            other => other,
        }
        .into(),
    )
}

fn key_waits() -> bool {
    let mut keys = KEYS.lock();
    if keys.is_empty() {
        // It stays so until a key is taken, so that no key is shown between two questions.
        single_keys();
        read_keys(&mut keys, 0);
    }
    !keys.is_empty()
}

pub(super) fn next_key() -> c_int {
    /// How many threads wait for a key.
    static WAITING: AtomicUsize = AtomicUsize::new(0);
    let mut keys = KEYS.lock();
    WAITING.fetch_add(1, Ordering::SeqCst);
    if keys.is_empty() {
        single_keys();
        while keys.is_empty() && read_keys(&mut keys, 0) == Read::Nothing {
            // Another thread may ask meanwhile whether a key is down, and read this one.
            MutexGuard::unlocked(&mut keys, || something_waits(LOOK_MS));
        }
    }
    if keys.len() == 1 && keys[0] == ESCAPE {
        read_keys(&mut keys, REST_OF_KEY_MS);
    }
    if WAITING.fetch_sub(1, Ordering::SeqCst) == 1 {
        lines_again();
    }
    take(&mut keys).unwrap_or(NO_KEYS)
}

/// Waits for any key; without a terminal for a line, of which nothing more is read. Returns at once at the end of
/// the input.
pub(super) fn wait_for_any() {
    // SAFETY: a plain question to the system.
    if unsafe { libc::isatty(INPUT) } == 1 || !KEYS.lock().is_empty() {
        // The first part of a key without a character.
        if next_key() == 224 {
            next_key();
        }
        return;
    }
    let mut byte = 0_u8;
    loop {
        // SAFETY: the byte is there.
        match unsafe { libc::read(INPUT, (&raw mut byte).cast(), 1) } {
            1 if byte != b'\n' => {}
            -1 if io::Error::last_os_error().kind() == io::ErrorKind::Interrupted => {}
            _ => return,
        }
    }
}

pub(super) fn show(bytes: &[u8]) {
    let mut output = io::stdout();
    // A program does not learn that its terminal is gone.
    let _ = output.write_all(bytes).and_then(|()| output.flush());
}

/// Whether a key waits.
#[no_mangle]
pub extern "C" fn _kbhit() -> c_int {
    caught(0, || key_waits().into())
}

/// Whether a key waits.
#[no_mangle]
pub extern "C" fn kbhit() -> c_int {
    _kbhit()
}

/// How many characters of keys wait.
///
/// # Safety
///
/// `count` is null or points to an integer that this call alone uses.
#[no_mangle]
pub unsafe extern "C" fn GetNumberOfConsoleInputEvents(
    _input: *mut c_void,
    count: *mut u32,
) -> c_int {
    caught(0, || {
        key_waits();
        if !count.is_null() {
            // At most MOST_KEYS. SAFETY: as the caller promises.
            unsafe { *count = KEYS.lock().len() as u32 };
        }
        (!count.is_null()).into()
    })
}

/// The next key.
#[no_mangle]
pub extern "C" fn _getch() -> c_int {
    caught(NO_KEYS, next_key)
}

/// The next key.
#[no_mangle]
pub extern "C" fn getch() -> c_int {
    _getch()
}

/// The next key, which is shown.
#[no_mangle]
pub extern "C" fn _getche() -> c_int {
    let key = _getch();
    if key != NO_KEYS {
        _putch(key);
    }
    key
}

/// The next key, which is shown.
#[no_mangle]
pub extern "C" fn getche() -> c_int {
    _getche()
}

/// Shows a character and returns it.
#[no_mangle]
pub extern "C" fn _putch(character: c_int) -> c_int {
    caught(NO_KEYS, || {
        show(&[character as u8]);
        character
    })
}

/// Shows a character and returns it.
#[no_mangle]
pub extern "C" fn putch(character: c_int) -> c_int {
    _putch(character)
}

/// Shows a text; 0 when that went well.
///
/// # Safety
///
/// `text` is null or a text that ends with 0 and does not change during the call.
#[no_mangle]
pub unsafe extern "C" fn _cputs(text: *const c_char) -> c_int {
    caught(NO_KEYS, || {
        // SAFETY: as the caller promises.
        let Some(text) = (unsafe { text_of(text) }) else { return NO_KEYS };
        show(text.as_bytes());
        0
    })
}

/// As [`_cputs`].
///
/// # Safety
///
/// As for [`_cputs`].
#[no_mangle]
pub unsafe extern "C" fn cputs(text: *const c_char) -> c_int {
    // SAFETY: as the caller promises.
    unsafe { _cputs(text) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn taken(bytes: &[u8]) -> Vec<c_int> {
        let mut keys: VecDeque<u8> = bytes.iter().copied().collect();
        std::iter::from_fn(|| take(&mut keys)).collect()
    }

    #[test]
    fn keys_are_told_as_windows_tells_them() {
        assert_eq!(taken(b"q\n\x7f"), [b'q'.into(), 13, 8]);
        assert_eq!(taken(b"\x1b[A\x1bOB"), [224, 72, 224, 80]);
        assert_eq!(taken(b"\x1b[3~x"), [224, 83, b'x'.into()]);
        assert_eq!(taken(b"\x1b"), [27]);
    }
}
