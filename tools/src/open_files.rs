//! How many files may be open, and for what.

/// A simulated TXT has a listener, a wait and a waker for each of its three ports, and a client at each.
const EACH: u64 = 3 * 3 + 3;

/// For the program itself.
const OTHER: u64 = 64;

/// No server has more pages.
const PAGES: usize = 200;

/// What a program that passes others on has open for itself, and to stop a controller.
const OF_WATCH: u64 = 24;

/// No port of a controller has more programs.
const PROGRAMS: usize = 32;

/// Which part of all is for browsers: one of so many. What drives or stops a controller always finds one.
const BROWSERS: u64 = 2;

/// Says so if fewer files may be open than these simulated TXTs need with their clients and pages.
pub(crate) fn check(controllers: usize, has_pages: bool) {
    let own = OTHER + EACH * controllers as u64;
    let needed = if has_pages { (own * BROWSERS).div_ceil(BROWSERS - 1) } else { own };
    if let Some(allowed) = allowed().filter(|allowed| *allowed < needed) {
        eprintln!(
            "{controllers} controllers with their clients need {needed} open files, and {allowed} are allowed here: \
             enter `ulimit -n {needed}` first"
        );
    }
}

/// How many pages may be open.
pub(crate) fn for_pages() -> usize {
    PAGES.min(for_browsers() / 2)
}

/// How many other connections of browsers may be open.
pub(crate) fn for_others() -> usize {
    for_browsers() - for_pages()
}

/// How many programs may be connected to each port of a controller that they are passed on to. For each there are two
/// connections, and one at the main port for a program that waits until a controller is stopped.
pub(crate) fn for_programs() -> usize {
    let Some(allowed) = allowed() else { return PROGRAMS };
    let rest = (allowed - allowed / BROWSERS).saturating_sub(OF_WATCH) / (3 * 2 + 1);
    PROGRAMS.min(rest.max(1) as usize)
}

fn for_browsers() -> usize {
    let allowed = allowed().and_then(|allowed| usize::try_from(allowed / BROWSERS).ok());
    allowed.unwrap_or(usize::MAX)
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
