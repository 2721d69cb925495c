//! Dynamic libraries, for programs that load ftMscLib by its name.

use std::ffi::{c_char, c_void, CString};
use std::ptr;

use super::text::wide_text_of;
use crate::ffi::{caught, text_of};

/// The file that this library was loaded from.
fn this_library() -> Option<CString> {
    let here: extern "C" fn(*mut c_void) -> i32 = FreeLibrary;
    // SAFETY: all bits 0 are such a struct, whose pointers are null then.
    let mut info: libc::Dl_info = unsafe { std::mem::zeroed() };
    // SAFETY: the address is one of this library, and `info` is there.
    let found = unsafe { libc::dladdr(here as *const c_void, &mut info) };
    if found == 0 || info.dli_fname.is_null() {
        return None;
    }
    // SAFETY: the system's text of the name of a loaded library.
    Some(unsafe { std::ffi::CStr::from_ptr(info.dli_fname) }.to_owned())
}

/// Whether the name means this library, as a Windows program says it.
fn is_this_library(name: &str) -> bool {
    let file = name.rsplit(['/', '\\']).next().unwrap_or(name).to_ascii_lowercase();
    let stem = file.strip_suffix(".dll").unwrap_or(&file);
    stem == "ftmsclib" || stem == "ftmsclibex"
}

fn load(name: Option<String>) -> *mut c_void {
    let Some(name) = name else { return ptr::null_mut() };
    let file = if is_this_library(&name) { this_library() } else { CString::new(name).ok() };
    let Some(file) = file else { return ptr::null_mut() };
    // SAFETY: a text that ends with 0. What a library does when it is loaded is the program's to know.
    unsafe { libc::dlopen(file.as_ptr(), libc::RTLD_NOW) }
}

/// Loads a library.
///
/// # Safety
///
/// `name` is null or a text that ends with 0 and does not change during the call.
#[no_mangle]
pub unsafe extern "C" fn LoadLibraryA(name: *const c_char) -> *mut c_void {
    // SAFETY: as the caller promises.
    caught(ptr::null_mut(), || load(unsafe { text_of(name) }))
}

/// Loads a library.
///
/// # Safety
///
/// As for [`LoadLibraryA`].
#[no_mangle]
pub unsafe extern "C" fn LoadLibraryW(name: *const libc::wchar_t) -> *mut c_void {
    // SAFETY: as the caller promises.
    caught(ptr::null_mut(), || load(unsafe { wide_text_of(name) }))
}

/// Finds a function of a library.
///
/// # Safety
///
/// `library` comes from [`LoadLibraryA`] and was not freed; `name` is null or a text that ends with 0.
#[no_mangle]
pub unsafe extern "C" fn GetProcAddress(library: *mut c_void, name: *const c_char) -> *mut c_void {
    if library.is_null() || name.is_null() {
        return ptr::null_mut();
    }
    // SAFETY: as the caller promises.
    unsafe { libc::dlsym(library, name) }
}

/// Frees a library.
#[no_mangle]
pub extern "C" fn FreeLibrary(library: *mut c_void) -> i32 {
    // SAFETY: the system checks whether it is a library's.
    i32::from(!library.is_null() && unsafe { libc::dlclose(library) } == 0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_library_is_known_as_windows_programs_name_it() {
        for name in ["ftMscLib.dll", "FTMSCLIB", r"..\bin\ftMscLibEx.DLL", "./ftmsclib.dll"] {
            assert!(is_this_library(name), "{name}");
        }
        for name in ["ftMscLib2.dll", "libc.so.6", ""] {
            assert!(!is_this_library(name), "{name}");
        }
    }
}
