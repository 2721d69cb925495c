//! Recordings, written and read, in one program of tests.

mod announced;
mod layouts;
mod python;
mod recording;
