//! Recordings, written and read, in one program of tests.

mod announced;
mod damaged;
mod layouts;
mod one_name;
mod python;
mod recording;
