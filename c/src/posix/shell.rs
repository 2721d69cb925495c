//! `system`, the C library's function for commands, with the command `pause` of Windows. No other system has it,
//! and programs wait with it before their window closes.

use std::ffi::{c_char, c_int, CStr};
use std::mem::transmute;

use super::keyboard;
use crate::ffi::{caught, text_of};

type System = unsafe extern "C" fn(*const c_char) -> c_int;

/// What `system` answers when it could do nothing.
const NOTHING: c_int = -1;

/// Runs a command of the shell, or waits for a key.
///
/// # Safety
///
/// `command` is null or a text that ends with 0 and does not change during the call.
#[no_mangle]
pub unsafe extern "C" fn system(command: *const c_char) -> c_int {
    // SAFETY: as the caller promises.
    let text = unsafe { text_of(command) }.unwrap_or_default();
    match pause(&text) {
        Some(is_silent) => caught(NOTHING, || {
            wait_for_key(is_silent);
            0
        }),
        // SAFETY: the C library's, with what the caller has given.
        None => unsafe { next_system().map_or(NOTHING, |system| system(command)) },
    }
}

/// Whether a command is `pause`, and then whether it shows nothing, as in `pause > nul`.
fn pause(command: &str) -> Option<bool> {
    let command = command.trim().trim_end_matches(';').to_ascii_lowercase();
    let rest = command.strip_prefix("pause")?.replace(' ', "");
    match rest.as_str() {
        "" => Some(false),
        ">nul" | ">/dev/null" => Some(true),
        _ => None,
    }
}

fn wait_for_key(is_silent: bool) {
    // SAFETY: everything that the program has printed goes out before it waits.
    unsafe { libc::fflush(std::ptr::null_mut()) };
    if !is_silent {
        keyboard::show(b"Press any key to continue . . . ");
    }
    keyboard::wait_for_any();
    if !is_silent {
        keyboard::show(b"\n");
    }
}

/// The function of this name that programs have without this library.
fn next_system() -> Option<System> {
    const NAME: &CStr = c"system";
    // SAFETY: the name is a text that ends with 0.
    let found = unsafe { libc::dlsym(libc::RTLD_NEXT, NAME.as_ptr()) };
    // SAFETY: the C library's function has this type.
    (!found.is_null()).then(|| unsafe { transmute::<*mut libc::c_void, System>(found) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pause_is_known_as_programs_write_it() {
        for command in ["pause", "PAUSE", " pause ", "pause;"] {
            assert_eq!(pause(command), Some(false), "{command}");
        }
        assert_eq!(pause("pause > nul"), Some(true));
        assert_eq!(pause("Pause>NUL"), Some(true));
        for command in ["", "pauses", "echo pause", "./pause.sh"] {
            assert_eq!(pause(command), None, "{command}");
        }
    }
}
