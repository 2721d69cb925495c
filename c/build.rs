//! The headers are part of `tx_run`, which must be compiled again when one of them has changed. For Windows the
//! functions get numbers that stay.

use std::env;

fn main() {
    println!("cargo::rerun-if-changed=include");
    println!("cargo::rerun-if-changed=lib");
    let is = |name: &str, value: &str| env::var(name).is_ok_and(|it| it == value);
    // It calls its own functions, also when the program has one of the same name, such as _getch.
    if is("CARGO_CFG_TARGET_OS", "linux") {
        println!("cargo::rustc-link-arg-cdylib=-Wl,-Bsymbolic");
    }
    // Microsoft's linker takes one such file only, and rustc has one of its own.
    if is("CARGO_CFG_TARGET_OS", "windows") && is("CARGO_CFG_TARGET_ENV", "gnu") {
        let folder = env::var("CARGO_MANIFEST_DIR").unwrap_or_default();
        println!("cargo::rustc-link-arg-cdylib={folder}/lib/ftMscLib.def");
    }
}
