//! The program `txt`, in one program of tests, so that they are linked once and wait beside each other.

mod bridge;
mod browser;
mod camera;
mod classroom;
mod find;
mod help;
mod panel;
mod plot;
mod recording;
mod running;
mod watch;
