//! What the documents promise, checked on what happened. It knows the calls, what they returned, and what the
//! controller saw; nothing of the code of the library.

mod answers;
mod bounds;
mod done;
mod outputs;
mod reported;
mod stops;
mod watchdog;

use std::time::{Duration, Instant};

use super::plan::Setup;
use super::record::{Exchange, Hold, Trace};
use super::stalls;

/// What happened at one handler.
pub(crate) struct Case<'a> {
    pub(crate) setup: &'a Setup,
    pub(crate) trace: &'a Trace,
    /// Whether the logger blocks.
    pub(crate) blocks: bool,
}

/// How soon a reason stops the motors on an idle machine, if the controller answers.
const SOON: Duration = Duration::from_millis(700);

/// How long a thread takes to note what it has done.
const GRACE: Duration = Duration::from_millis(30);

/// Everything that is wrong, in words.
pub(crate) fn judge(case: &Case<'_>) -> Vec<String> {
    let rules: [fn(&Case<'_>) -> Vec<String>; 13] = [
        outputs::whole,
        outputs::in_order,
        answers::in_the_next_request,
        answers::in_lock_step,
        answers::after_the_hook,
        outputs::not_before_interruptions,
        stops::panics_and_hooks,
        stops::ends,
        watchdog::keeps_its_limit,
        reported::once,
        reported::by_waits,
        done::really,
        bounds::kept,
    ];
    rules.iter().flat_map(|rule| rule(case)).collect()
}

impl<'a> Case<'a> {
    /// The exchanges of each connection.
    fn connections(&self) -> impl DoubleEndedIterator<Item = &'a [Exchange]> {
        self.trace.exchanges.chunk_by(|one, next| one.connection == next.connection)
    }

    /// The same without those on which a transfer was ended before it ran, which only stop what the session before left.
    fn transfers(&self) -> impl DoubleEndedIterator<Item = &'a [Exchange]> {
        self.connections().filter(|connection| !connection.iter().all(Exchange::only_stops))
    }

    /// The guard that has written these duties; `None` for duties 0.
    fn writer(&self, tag: u64) -> Option<&'a Hold> {
        if tag == 0 {
            return None;
        }
        self.trace.holds.iter().find(|hold| hold.orders.tag == Some(tag))
    }

    /// A time in the run, for people.
    fn at(&self, time: Instant) -> String {
        let begin = self.trace.exchanges.first().map_or(time, |first| first.at);
        if time >= begin {
            format!("{:.1?}", time - begin)
        } else {
            format!("-{:.1?}", begin - time)
        }
    }
}

/// The end of a limit on this machine.
fn after(time: Instant, limit: Duration) -> Instant {
    let end = time + limit;
    end + stalls::between(time, end)
}
