//! The screen of the console: its size, the cursor, and filling it.

use std::ffi::{c_char, c_int};
use std::sync::atomic::{AtomicU32, Ordering};

use super::console::{
    attributes, control, file_of, give_count, hide_cursor, is_cursor_hidden, is_screen,
};
use super::objects::Handle;
use crate::ffi::caught;

const TRUE: i32 = 1;
const FALSE: i32 = 0;
/// As on Windows: a line of a quarter of a character's height.
const CURSOR_SIZE: u32 = 25;

/// Where the program has set the cursor last: the column in the upper half.
static POSITION: AtomicU32 = AtomicU32::new(0);

/// A place on the screen, counted from 0.
#[repr(C)]
#[derive(Clone, Copy, Default)]
pub struct Coord {
    x: i16,
    y: i16,
}

/// What is known of the screen.
#[repr(C)]
pub struct ScreenInfo {
    size: Coord,
    cursor: Coord,
    attributes: u16,
    window: [i16; 4],
    most: Coord,
}

/// How the cursor looks.
#[repr(C)]
pub struct CursorInfo {
    size: u32,
    is_visible: i32,
}

fn to_position(to: Coord) -> String {
    format!("\x1b[{};{}H", i32::from(to.y) + 1, i32::from(to.x) + 1)
}

/// The columns and lines of a terminal.
fn size_of(file: c_int) -> Option<(u16, u16)> {
    let mut size = libc::winsize { ws_row: 0, ws_col: 0, ws_xpixel: 0, ws_ypixel: 0 };
    // SAFETY: the struct is there.
    let asked = unsafe { libc::ioctl(file, libc::TIOCGWINSZ as _, &raw mut size) };
    // A serial line does not say it.
    let known =
        |number: u16, otherwise| if number == 0 { otherwise } else { number.min(i16::MAX as u16) };
    (asked == 0).then(|| (known(size.ws_col, 80), known(size.ws_row, 25)))
}

/// The size of the screen, and what the program has set.
///
/// # Safety
///
/// `info` is null or a place that this call alone uses.
#[no_mangle]
pub unsafe extern "C" fn GetConsoleScreenBufferInfo(output: Handle, info: *mut ScreenInfo) -> i32 {
    caught(FALSE, || {
        let size = file_of(output).filter(|_| is_screen(output)).and_then(size_of);
        let Some((columns, lines)) = size.filter(|_| !info.is_null()) else { return FALSE };
        let size = Coord { x: columns as i16, y: lines as i16 };
        let position = POSITION.load(Ordering::Acquire);
        let known = ScreenInfo {
            size,
            cursor: Coord { x: (position >> 16) as i16, y: position as i16 },
            attributes: attributes(),
            window: [0, 0, size.x - 1, size.y - 1],
            most: size,
        };
        // SAFETY: as the caller promises.
        unsafe { info.write(known) };
        TRUE
    })
}

/// Sets the cursor.
#[no_mangle]
pub extern "C" fn SetConsoleCursorPosition(output: Handle, position: Coord) -> i32 {
    caught(FALSE, || {
        if !is_screen(output) || position.x < 0 || position.y < 0 {
            return FALSE;
        }
        let together = u32::from(position.x as u16) << 16 | u32::from(position.y as u16);
        POSITION.store(together, Ordering::Release);
        control(&to_position(position)).into()
    })
}

/// How the cursor looks.
///
/// # Safety
///
/// `info` is null or a place that this call alone uses.
#[no_mangle]
pub unsafe extern "C" fn GetConsoleCursorInfo(output: Handle, info: *mut CursorInfo) -> i32 {
    if info.is_null() || !is_screen(output) {
        return FALSE;
    }
    let is_visible = i32::from(!is_cursor_hidden());
    // SAFETY: as the caller promises.
    unsafe { info.write(CursorInfo { size: CURSOR_SIZE, is_visible }) };
    TRUE
}

/// Shows or hides the cursor.
///
/// # Safety
///
/// `info` is null or there.
#[no_mangle]
pub unsafe extern "C" fn SetConsoleCursorInfo(output: Handle, info: *const CursorInfo) -> i32 {
    caught(FALSE, || {
        if info.is_null() || !is_screen(output) {
            return FALSE;
        }
        // SAFETY: as the caller promises.
        let is_hidden = unsafe { (*info).is_visible } == 0;
        hide_cursor(is_hidden).into()
    })
}

/// Shows a character again and again, as programs do to clear the screen. The cursor stays where it is.
///
/// # Safety
///
/// `written` is null or a place that this call alone uses.
#[no_mangle]
pub unsafe extern "C" fn FillConsoleOutputCharacterA(
    output: Handle,
    character: c_char,
    count: u32,
    from: Coord,
    written: *mut u32,
) -> i32 {
    caught(FALSE, || {
        let size = file_of(output).filter(|_| is_screen(output)).and_then(size_of);
        let Some((columns, lines)) = size.filter(|_| from.x >= 0 && from.y >= 0) else {
            return FALSE;
        };
        let before = u32::from(columns) * from.y as u32 + from.x as u32;
        let most = (u32::from(columns) * u32::from(lines)).saturating_sub(before);
        let shown = if count >= most && character as u8 == b' ' {
            String::from("\x1b[J")
        } else {
            char::from(character as u8).to_string().repeat(count.min(most) as usize)
        };
        control(&format!("\x1b7{}{shown}\x1b8", to_position(from)));
        // SAFETY: as the caller promises.
        unsafe { give_count(written, count) };
        TRUE
    })
}

/// Only counts: a terminal can't colour what it shows.
///
/// # Safety
///
/// `written` is null or a place that this call alone uses.
#[no_mangle]
pub unsafe extern "C" fn FillConsoleOutputAttribute(
    output: Handle,
    _: u16,
    count: u32,
    _: Coord,
    written: *mut u32,
) -> i32 {
    if !is_screen(output) {
        return FALSE;
    }
    // SAFETY: as the caller promises.
    unsafe { give_count(written, count) };
    TRUE
}
