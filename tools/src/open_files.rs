//! How many files simulated TXTs need.

/// A simulated TXT has a listener, a wait and a waker for each of its three ports, and a client at each.
const EACH: u64 = 3 * 3 + 3;

/// For the program itself, and for a page.
const OTHER: u64 = 64;

/// Says so if fewer files may be open than these simulated TXTs need with their clients.
pub(crate) fn check(controllers: usize) {
    let needed = OTHER + EACH * controllers as u64;
    if let Some(allowed) = allowed().filter(|allowed| *allowed < needed) {
        eprintln!(
            "{controllers} controllers with their clients need {needed} open files, and {allowed} are allowed here: \
             enter `ulimit -n {needed}` first"
        );
    }
}

#[cfg(unix)]
fn allowed() -> Option<u64> {
    use nix::sys::resource::{getrlimit, Resource};

    // Some systems count with 32 bits.
    getrlimit(Resource::RLIMIT_NOFILE).ok().map(|(allowed, _)| allowed as _)
}

/// There is no such limit.
#[cfg(not(unix))]
fn allowed() -> Option<u64> {
    None
}
