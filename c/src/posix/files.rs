//! Files and folders by their names, as `io.h`, `direct.h` and `windows.h` have them.

use std::env;
use std::ffi::{c_char, c_int, c_void};
use std::os::unix::ffi::OsStrExt;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use crate::ffi::caught;

const FAILED: c_int = -1;
const ALL: libc::mode_t = 0o777;

/// Where the program was started: Windows programs look there for their files, and `tx_run` has made the program itself
/// in a folder that nobody knows.
static BEGUN_IN: LazyLock<PathBuf> = LazyLock::new(|| env::current_dir().unwrap_or_default());

/// Copies a path to the program, with a 0 behind it, if there is room for all of it. Returns its length.
///
/// # Safety
///
/// `to` is null or has `size` bytes that the program gives to this call alone.
unsafe fn put(path: &Path, to: *mut c_char, size: u32) -> Result<u32, u32> {
    let bytes = path.as_os_str().as_bytes();
    let length = bytes.len() as u32;
    if to.is_null() || length >= size {
        return Err(length);
    }
    // SAFETY: one byte more than the path fits, as the caller promises.
    unsafe {
        to.cast::<u8>().copy_from_nonoverlapping(bytes.as_ptr(), bytes.len());
        *to.add(bytes.len()) = 0;
    }
    Ok(length)
}

/// The current folder. Returns its length, and with its 0 when it does not fit; 0 when there is none.
///
/// # Safety
///
/// `to` is null or has `size` bytes that the program gives to this call alone.
#[no_mangle]
pub unsafe extern "C" fn GetCurrentDirectoryA(size: u32, to: *mut c_char) -> u32 {
    caught(0, || {
        LazyLock::force(&BEGUN_IN);
        let Ok(folder) = env::current_dir() else { return 0 };
        // SAFETY: as the caller promises.
        unsafe { put(&folder, to, size) }.unwrap_or_else(|length| length + 1)
    })
}

/// Makes a folder the current one.
///
/// # Safety
///
/// `folder` is null or a text that ends with 0 and does not change during the call.
#[no_mangle]
pub unsafe extern "C" fn SetCurrentDirectoryA(folder: *const c_char) -> c_int {
    // SAFETY: as the caller promises.
    unsafe { (_chdir(folder) == 0).into() }
}

/// The path of the program: its name in the folder in which it was started. Returns the length, 0 when it does not fit.
///
/// # Safety
///
/// `to` is null or has `size` bytes that the program gives to this call alone.
#[no_mangle]
pub unsafe extern "C" fn GetModuleFileNameA(_: *mut c_void, to: *mut c_char, size: u32) -> u32 {
    caught(0, || {
        let program = env::current_exe().unwrap_or_default();
        let path = BEGUN_IN.join(program.file_name().unwrap_or_default());
        // SAFETY: as the caller promises.
        unsafe { put(&path, to, size) }.unwrap_or(0)
    })
}

/// Declares a function that does with a name what one of the C library does.
macro_rules! of_c_library {
    ($($(#[doc = $doc:literal])+ $name:ident($path:ident $(, $argument:ident: $type:ty)?) $call:block)+) => {$(
        $(#[doc = $doc])+
        ///
        /// # Safety
        ///
        /// The name is null or a text that ends with 0 and does not change during the call.
        #[no_mangle]
        pub unsafe extern "C" fn $name($path: *const c_char $(, $argument: $type)?) -> c_int {
            if $path.is_null() {
                return FAILED;
            }
            // SAFETY: as the caller promises.
            unsafe { $call }
        }
    )+};
}

of_c_library! {
    /// Whether a file may be used in a way: 0 in any, 2 to write, 4 to read, which are the system's numbers.
    _access(path, mode: c_int) { libc::access(path, mode & 6) }
    /// Removes a file.
    _unlink(path) { libc::unlink(path) }
    /// Makes a folder.
    _mkdir(path) { libc::mkdir(path, ALL) }
    /// Removes an empty folder.
    _rmdir(path) { libc::rmdir(path) }
    /// Makes a folder the current one.
    _chdir(path) {
        LazyLock::force(&BEGUN_IN);
        libc::chdir(path)
    }
}

/// The current folder, in new memory if there is no place for it.
///
/// # Safety
///
/// `to` is null or has `size` bytes that the program gives to this call alone.
#[no_mangle]
pub unsafe extern "C" fn _getcwd(to: *mut c_char, size: c_int) -> *mut c_char {
    let size = if to.is_null() { 0 } else { usize::try_from(size).unwrap_or(0) };
    // SAFETY: as the caller promises. Both systems make memory for it when there is no place.
    unsafe { libc::getcwd(to, size) }
}
