//! Programs for the TXT itself and of its kits, compiled against the headers and the library, and run against
//! a simulated TXT. Without a C++ compiler this is reported, and nothing is tested.

#[cfg(unix)]
mod ends;
mod ex2;
#[cfg(unix)]
mod handlers;
mod headers;
mod kelib;
mod kit;
mod kit466;
#[cfg(unix)]
mod projects;
mod support;
