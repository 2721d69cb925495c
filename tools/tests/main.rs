//! The program `txt`, in one program of tests, so that they are linked once and wait beside each other.

mod bridge;
mod browser;
mod camera;
mod classroom;
mod compare;
mod damaged;
mod ending;
mod examples;
mod find;
mod help;
mod lesson;
mod names;
mod one_name;
mod panel;
mod plot;
mod program;
mod recording;
mod replay;
mod running;
mod selftest;
mod start;
mod stop;
mod used_up;
mod watch;
