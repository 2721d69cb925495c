//! The C libraries that programs for the ROBO TX and the TXT expect, over `ft-transfer-area`.
#![allow(non_snake_case, reason = "the library has the name of the original")]

/// Sanitizers see only the system's memory.
#[cfg(all(unix, not(miri), not(asan)))]
mod allocator;
mod calling;
mod errors;
mod ex2;
mod exit;
mod ffi;
mod host;
mod i2c;
mod inside;
mod jpeg;
mod kelib;
mod kit;
mod memory;
mod mirror;
mod msclib;
mod online;
mod port_entries;
mod ports;
#[cfg(unix)]
mod posix;
mod prg;
mod process;
mod report;
mod results;
mod sentences;
mod session;
mod supply;
mod text_file;

pub use msclib::report_version_of_ex;
