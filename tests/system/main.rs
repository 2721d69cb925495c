//! The tests of the whole in one program, so that they are linked once and wait beside each other.

mod documents;
mod examples;
mod fuzz_replay;
mod interop;
mod lessons;
mod porting;

#[path = "../ports/mod.rs"]
mod ports;
mod program;
