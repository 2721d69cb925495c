//! Recordings, written and read, in one program of tests.

mod python;
mod recording;
