//! Whether a key is down. A terminal sends characters, and does not tell when a key goes up.

use std::ffi::c_int;
use std::time::{Duration, Instant};

use parking_lot::Mutex;

use super::keyboard;
use crate::ffi::caught;

/// How long a key counts as down after each of its characters: longer than a terminal's repetition takes, and short,
/// because a motor may turn meanwhile.
const DOWN: Duration = Duration::from_millis(150);
const IS_DOWN: i16 = i16::MIN;
const WAS_PRESSED: i16 = 1;

/// A key that was pressed.
#[derive(Clone, Copy)]
struct Press {
    /// Its last character.
    at: Instant,
    /// Whether the program has asked since then.
    is_told: bool,
}

/// By the numbers of Windows.
static PRESSES: Mutex<[Option<Press>; 256]> = Mutex::new([None; 256]);

/// The keys whose characters these are.
fn keys_of(bytes: &[u8]) -> Vec<u8> {
    let mut keys = Vec::new();
    let mut rest = bytes;
    while let [first, others @ ..] = rest {
        let sequence = (*first == keyboard::ESCAPE).then(|| keyboard::code_at(others)).flatten();
        if let Some((code, length)) = sequence {
            keys.extend(key_of_code(code));
            rest = &others[length..];
        } else {
            keys.extend(key_of_character(*first));
            rest = others;
        }
    }
    keys
}

/// The key of a code that `_getch` returns behind 224.
fn key_of_code(code: u8) -> Option<u8> {
    Some(match code {
        71 => 0x24,
        72 => 0x26,
        73 => 0x21,
        75 => 0x25,
        77 => 0x27,
        79 => 0x23,
        80 => 0x28,
        81 => 0x22,
        82 => 0x2D,
        83 => 0x2E,
        _ => return None,
    })
}

fn key_of_character(character: u8) -> Option<u8> {
    Some(match character {
        b'a'..=b'z' | b'A'..=b'Z' | b'0'..=b'9' => character.to_ascii_uppercase(),
        b' ' | b'\t' | b'\r' | keyboard::ESCAPE => character,
        b'\n' => b'\r',
        8 | 127 => 8,
        b'+' => 0xBB,
        b',' => 0xBC,
        b'-' => 0xBD,
        b'.' => 0xBE,
        _ => return None,
    })
}

/// Notes what was read from a terminal.
pub(super) fn note(bytes: &[u8]) {
    let at = Instant::now();
    let mut presses = PRESSES.lock();
    for key in keys_of(bytes) {
        presses[usize::from(key)] = Some(Press { at, is_told: false });
    }
}

/// What is known of a key now. A press is told at least once, however late the question comes.
fn state(press: &mut Press, now: Instant) -> i16 {
    let is_new = !press.is_told;
    press.is_told = true;
    let is_down = is_new || now.saturating_duration_since(press.at) < DOWN;
    (if is_down { IS_DOWN } else { 0 }) | (if is_new { WAS_PRESSED } else { 0 })
}

/// Whether a key is down, and whether it was pressed since this was asked last.
#[no_mangle]
pub extern "C" fn GetAsyncKeyState(key: c_int) -> i16 {
    caught(0, || {
        keyboard::read_terminal();
        let mut presses = PRESSES.lock();
        let press = usize::try_from(key).ok().and_then(|key| presses.get_mut(key)?.as_mut());
        press.map_or(0, |press| state(press, Instant::now()))
    })
}

/// As [`GetAsyncKeyState`].
#[no_mangle]
pub extern "C" fn GetKeyState(key: c_int) -> i16 {
    GetAsyncKeyState(key)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn characters_are_keys() {
        assert_eq!(keys_of(b"aQ1 \n\x7f?"), [b'A', b'Q', b'1', 0x20, 0x0D, 8]);
        assert_eq!(keys_of(b"\x1b[A\x1bOD\x1b[3~x"), [0x26, 0x25, 0x2E, b'X']);
        assert_eq!(keys_of(b"\x1b"), [0x1B]);
        assert_eq!(keys_of(b"\x1b\x1b[B"), [0x1B, 0x28]);
    }

    #[test]
    fn a_press_is_told_once_and_holds_for_a_while() {
        let at = Instant::now();
        let mut press = Press { at, is_told: false };
        assert_eq!(state(&mut press, at), IS_DOWN | WAS_PRESSED);
        assert_eq!(state(&mut press, at + DOWN / 2), IS_DOWN);
        assert_eq!(state(&mut press, at + DOWN), 0);
        let mut late = Press { at, is_told: false };
        assert_eq!(state(&mut late, at + 9 * DOWN), IS_DOWN | WAS_PRESSED);
        assert_eq!(state(&mut late, at + 9 * DOWN), 0);
    }
}
