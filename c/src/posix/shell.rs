//! `system`, the C library's function for commands, with those of Windows that programs use for their console: `pause`,
//! with which they wait before their window closes, `cls`, `color` and `title`.

use std::ffi::{c_char, c_int, CStr, OsStr};
use std::mem::{transmute, zeroed};
use std::os::unix::ffi::OsStrExt;
use std::os::unix::process::ExitStatusExt;
use std::process::Command;

use super::{console, keyboard};
use crate::exit;
use crate::ffi::{caught, text_of};

type System = unsafe extern "C" fn(*const c_char) -> c_int;

/// What `system` answers when it could do nothing.
const NOTHING: c_int = -1;

/// Runs a command of the shell, or does what one of Windows does.
///
/// # Safety
///
/// `command` is null or a text that ends with 0 and does not change during the call.
#[no_mangle]
pub unsafe extern "C" fn system(command: *const c_char) -> c_int {
    // SAFETY: as the caller promises.
    let text = unsafe { text_of(command) }.unwrap_or_default();
    match OfWindows::new(&text) {
        Some(command) => caught(NOTHING, || {
            command.run();
            0
        }),
        None if !command.is_null() && exit::ends_by_ctrl_c() => {
            // SAFETY: as the caller promises.
            run(unsafe { CStr::from_ptr(command) })
        }
        // SAFETY: the C library's, with what the caller has given.
        None => unsafe { next_system().map_or(NOTHING, |system| system(command)) },
    }
}

/// Runs a command of the shell. The C library's function ignores Ctrl-C meanwhile: the motors would go on.
fn run(command: &CStr) -> c_int {
    // A handler of the program for its children would take the status.
    let _held = Held::new(libc::SIGCHLD);
    let mut shell = Command::new("/bin/sh");
    let status = shell.arg("-c").arg(OsStr::from_bytes(command.to_bytes())).status();
    status.map_or(NOTHING, |status| status.into_raw())
}

/// Until this is dropped, a signal does not reach this thread.
struct Held {
    before: libc::sigset_t,
}

impl Held {
    fn new(signal: c_int) -> Self {
        // SAFETY: sets, for which all bits 0 are valid.
        let (mut only, mut before): (libc::sigset_t, libc::sigset_t) =
            unsafe { (zeroed(), zeroed()) };
        // SAFETY: the sets are this function's.
        unsafe {
            libc::sigemptyset(&raw mut only);
            libc::sigaddset(&raw mut only, signal);
            libc::pthread_sigmask(libc::SIG_BLOCK, &raw const only, &raw mut before);
        }
        Self { before }
    }
}

impl Drop for Held {
    fn drop(&mut self) {
        // SAFETY: the set is one that this thread had.
        unsafe {
            libc::pthread_sigmask(libc::SIG_SETMASK, &raw const self.before, std::ptr::null_mut())
        };
    }
}

/// A command of Windows.
#[derive(Debug, PartialEq)]
enum OfWindows {
    /// Whether it shows nothing, as in `pause > nul`.
    Pause {
        is_silent: bool,
    },
    Cls,
    Color(u16),
    Title(String),
}

impl OfWindows {
    fn new(command: &str) -> Option<Self> {
        let command = command.trim().trim_end_matches(';');
        let (name, rest) = command.split_at(command.find([' ', '>']).unwrap_or(command.len()));
        let short = rest.replace(' ', "").to_ascii_lowercase();
        Some(match (name.to_ascii_lowercase().as_str(), short.as_str()) {
            ("pause", "") => Self::Pause { is_silent: false },
            ("pause", ">nul" | ">/dev/null") => Self::Pause { is_silent: true },
            ("cls", "") => Self::Cls,
            ("color", "") => Self::Color(7),
            ("color", digits) if digits.len() <= 2 => {
                Self::Color(u16::from_str_radix(digits, 16).ok()?)
            }
            ("title", title) if !title.is_empty() => Self::Title(rest.trim().into()),
            _ => return None,
        })
    }

    fn run(self) {
        match self {
            Self::Pause { is_silent } => wait_for_key(is_silent),
            Self::Cls => _ = console::control("\x1b[2J\x1b[3J\x1b[H"),
            Self::Color(attributes) => console::set_colours(attributes),
            Self::Title(title) => console::set_title(&title),
        }
    }
}

fn wait_for_key(is_silent: bool) {
    console::send(if is_silent { b"" } else { b"Press any key to continue . . . " });
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
    fn commands_of_windows_are_known_as_programs_write_them() {
        let of = OfWindows::new;
        for command in ["pause", "PAUSE", " pause ", "pause;"] {
            assert_eq!(of(command), Some(OfWindows::Pause { is_silent: false }), "{command}");
        }
        for command in ["pause > nul", "Pause>NUL"] {
            assert_eq!(of(command), Some(OfWindows::Pause { is_silent: true }), "{command}");
        }
        assert_eq!(of("CLS"), Some(OfWindows::Cls));
        assert_eq!(
            (of("color 0A"), of("Color")),
            (Some(OfWindows::Color(0xA)), Some(OfWindows::Color(7)))
        );
        assert_eq!(of("title Gate 1"), Some(OfWindows::Title("Gate 1".into())));
        for command in
            ["", "pauses", "echo pause", "./pause.sh", "clsx", "color red", "title", "cls | x"]
        {
            assert_eq!(of(command), None, "{command}");
        }
    }
}
