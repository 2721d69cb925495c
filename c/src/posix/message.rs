//! Messages with buttons, at the console.

use std::ffi::{c_char, c_int, c_void};

use super::console;
use super::keyboard::{self, NO_KEYS};
use crate::ffi::{caught, text_of};

const OK: c_int = 1;
const CANCEL: c_int = 2;
const RETRY: c_int = 4;
const YES: c_int = 6;
const NO: c_int = 7;
/// The bits for the buttons.
const BUTTONS: u32 = 0xF;
const ENTER: c_int = b'\r' as c_int;
const ESCAPE: c_int = keyboard::ESCAPE as c_int;

/// The buttons of a kind of message, and what is said of them.
fn buttons(kind: u32) -> (&'static [c_int], &'static str) {
    match kind & BUTTONS {
        1 => (&[OK, CANCEL], "Enter: OK, Esc: Cancel"),
        3 => (&[YES, NO, CANCEL], "Enter: Yes, n: No, Esc: Cancel"),
        4 => (&[YES, NO], "Enter: Yes, n: No"),
        5 => (&[RETRY, CANCEL], "Enter: Retry, Esc: Cancel"),
        _ => (&[OK], "Press any key"),
    }
}

/// The button of a key. Without further keys it is the last one, which does least.
fn pressed(buttons: &[c_int], key: c_int) -> Option<c_int> {
    let is_no = |key| matches!(u8::try_from(key), Ok(b'n' | b'N'));
    let is_yes = |key| matches!(u8::try_from(key), Ok(b'y' | b'Y' | b'j' | b'J'));
    let named = match key {
        ENTER => return buttons.first().copied(),
        NO_KEYS | ESCAPE => return buttons.last().copied(),
        key if is_no(key) => NO,
        key if is_yes(key) => YES,
        _ => return None,
    };
    buttons.contains(&named).then_some(named)
}

/// Shows a message and waits for the key of one of its buttons.
///
/// # Safety
///
/// `text` and `title` are null or texts that end with 0 and do not change during the call.
#[no_mangle]
pub unsafe extern "C" fn MessageBoxA(
    _window: *mut c_void,
    text: *const c_char,
    title: *const c_char,
    kind: u32,
) -> c_int {
    caught(CANCEL, || {
        // SAFETY: as the caller promises.
        let [text, title] = [text, title].map(|it| unsafe { text_of(it) }.unwrap_or_default());
        let (buttons, keys) = buttons(kind);
        console::send(format!("{title}: {text}\n[{keys}] ").as_bytes());
        let button = if buttons == [OK] {
            keyboard::wait_for_any();
            OK
        } else {
            // Of a key without a character both parts are none of a button.
            std::iter::repeat_with(keyboard::next_key)
                .find_map(|key| pressed(buttons, key))
                .unwrap_or(CANCEL)
        };
        keyboard::show(b"\n");
        button
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_are_buttons() {
        let of = |kind, key: u8| pressed(buttons(kind).0, key.into());
        assert_eq!((of(1, b'\r'), of(1, 27), of(1, b'n')), (Some(OK), Some(CANCEL), None));
        assert_eq!((of(4, b'j'), of(4, b'N'), of(4, 27)), (Some(YES), Some(NO), Some(NO)));
        assert_eq!((of(3, b'y'), of(3, 27), of(3, b'x')), (Some(YES), Some(CANCEL), None));
        assert_eq!(of(0x24, b'\r'), Some(YES));
        assert_eq!(pressed(buttons(4).0, NO_KEYS), Some(NO));
    }
}
