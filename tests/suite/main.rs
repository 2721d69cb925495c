//! The tests that use the crate from outside, in one program so that they link once.

mod codec;
mod recorded_sessions;
mod vectors;
