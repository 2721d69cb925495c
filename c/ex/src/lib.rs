//! Everything of ftMscLib, in a library with the file name `ftMscLibEx`, which reports the version of that one.
#![allow(non_snake_case, reason = "the library has the name of the original")]

/// The system calls it when it loads the library: a program's first call asks for the version.
#[used]
#[cfg_attr(all(unix, not(target_vendor = "apple")), link_section = ".init_array")]
#[cfg_attr(target_vendor = "apple", link_section = "__DATA,__mod_init_func,mod_init_funcs")]
#[cfg_attr(windows, link_section = ".CRT$XCU")]
static WHEN_LOADED: extern "C" fn() = when_loaded;

extern "C" fn when_loaded() {
    // This also links the library, which exports its functions.
    ftMscLib::report_version_of_ex();
}
