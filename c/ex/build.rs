//! As for ftMscLib: it calls its own functions, and for Windows they get the numbers that they have there.

use std::env;

fn main() {
    println!("cargo::rerun-if-changed=../lib/ftMscLib.def");
    let is = |name: &str, value: &str| env::var(name).is_ok_and(|it| it == value);
    if is("CARGO_CFG_TARGET_OS", "linux") {
        println!("cargo::rustc-link-arg-cdylib=-Wl,-Bsymbolic");
    }
    if is("CARGO_CFG_TARGET_OS", "windows") && is("CARGO_CFG_TARGET_ENV", "gnu") {
        let folder = env::var("CARGO_MANIFEST_DIR").unwrap_or_default();
        println!("cargo::rustc-link-arg-cdylib={folder}/../lib/ftMscLib.def");
    }
}
