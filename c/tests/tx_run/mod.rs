//! C programs as users run them: through `tx_run`, against the simulated TXT of the test.

#[cfg(unix)]
mod away;
mod bad_input;
#[cfg(unix)]
mod cache;
mod copies;
mod ends;
mod hooks;
#[cfg(unix)]
mod killed;
#[cfg(unix)]
mod large;
mod libraries;
mod machine;
#[cfg(unix)]
mod signals;
mod sources;
mod support;
#[cfg(unix)]
mod terminal;
mod tics;
#[cfg(unix)]
mod unread;
