//! What ends a program on Windows.

use std::ffi::{c_void, CStr};
use std::mem::transmute;
use std::ptr::null_mut;

use windows_sys::core::BOOL;
use windows_sys::Win32::Foundation::FARPROC;
use windows_sys::Win32::System::Console::SetConsoleCtrlHandler;
use windows_sys::Win32::System::LibraryLoader::{
    GetModuleHandleA, GetModuleHandleExA, GetProcAddress, GET_MODULE_HANDLE_EX_FLAG_FROM_ADDRESS,
    GET_MODULE_HANDLE_EX_FLAG_PIN,
};

use super::end_all;
use crate::ffi::guarded;

/// Called when the library is loaded, before the program begins. Windows asks the newest handler first, so
/// all of the program's come before this one, which is only asked when none of them has done anything.
#[used]
#[link_section = ".CRT$XCU"]
static ON_LOAD: extern "C" fn() = on_load;

extern "C" fn on_load() {
    let how = GET_MODULE_HANDLE_EX_FLAG_FROM_ADDRESS | GET_MODULE_HANDLE_EX_FLAG_PIN;
    let mut library = null_mut();
    // SAFETY: the first call keeps the library where it is until the process ends, so the handler is there as
    // long. The address is that of a function here.
    unsafe {
        if GetModuleHandleExA(how, on_load as *const u8, &raw mut library) != 0 {
            SetConsoleCtrlHandler(Some(on_control), 1);
        }
    }
}

/// Ctrl-C, a closed window, the end of the session. In a thread that Windows has made for it.
unsafe extern "system" fn on_control(_: u32) -> BOOL {
    guarded((), end_all);
    // The next handler is the one of Windows, which ends the process.
    0
}

/// The handler is there already.
pub(super) fn watch() {
    // So that the linker keeps it.
    std::hint::black_box(&raw const ON_LOAD);
}

/// Windows ends the process itself, with a status that says so.
pub(super) fn end_as_asked() {}

/// A function of a library that is loaded.
fn loaded(library: &CStr, function: &CStr) -> FARPROC {
    // SAFETY: both are texts that end with 0.
    unsafe {
        let library = GetModuleHandleA(library.as_ptr().cast());
        (!library.is_null()).then(|| GetProcAddress(library, function.as_ptr().cast())).flatten()
    }
}

/// Has this called when the program returns from `main` or calls `exit`. `atexit` of this library is called too
/// late, when the process's other threads are gone, so the runtimes of C that programs have are asked.
pub(crate) fn at_exit(function: extern "C" fn()) {
    /// `_crt_atexit` returns an `int` and `_onexit` a pointer. Neither is looked at.
    type Register = unsafe extern "C" fn(extern "C" fn()) -> *mut c_void;
    let runtimes = [(c"ucrtbase.dll", c"_crt_atexit"), (c"msvcrt.dll", c"_onexit")];
    for (library, name) in runtimes {
        if let Some(register) = loaded(library, name) {
            // SAFETY: both functions take a function without arguments. The callers' functions live as long as
            // this library, and do not unwind.
            unsafe {
                let register =
                    transmute::<unsafe extern "system" fn() -> isize, Register>(register);
                register(function);
            }
        }
    }
}

/// Whether the process ends in a way that leaves only the calling thread.
pub(crate) fn threads_are_gone() -> bool {
    type IsShutdown = unsafe extern "system" fn() -> u8;
    loaded(c"ntdll.dll", c"RtlDllShutdownInProgress").is_some_and(|is_shutdown| {
        // SAFETY: it is a function without arguments that returns a BOOLEAN.
        unsafe { transmute::<unsafe extern "system" fn() -> isize, IsShutdown>(is_shutdown)() != 0 }
    })
}
