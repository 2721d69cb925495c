//! The headers are part of `tx_run`, which must be compiled again when one of them has changed.

fn main() {
    println!("cargo::rerun-if-changed=include");
    println!("cargo::rerun-if-changed=lib");
}
