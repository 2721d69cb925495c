//! C programs as users run them: through `tx_run`, against the simulated TXT of the test.

#![cfg(unix)]

mod bad_input;
mod cache;
mod ends;
mod hooks;
mod large;
mod machine;
mod sources;
mod support;
mod terminal;
mod tics;
mod unread;
