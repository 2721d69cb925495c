//! No call waits beyond its bound.

use std::time::Duration;

use super::Case;
use crate::programs::logger::BLOCKED;
use crate::programs::record::What;
use crate::programs::stalls;

/// Calls that wait for the controller: connecting, some responses, closing; and a gap.
const WAITS: Duration = Duration::from_secs(4);
/// The end: a current attempt to connect, the last responses, and closing.
const ENDS: Duration = Duration::from_secs(2);
/// In a gap the current attempt, and one more.
const ENDS_IN_GAP: Duration = Duration::from_secs(5);
/// The end of a recording on a disk that stands still.
const RECORDED: Duration = Duration::from_secs(6);
/// Calls that do not wait.
const NOT_WAITING: Duration = Duration::from_millis(500);

pub(super) fn kept(case: &Case<'_>) -> Vec<String> {
    let mut breaches = Vec::new();
    // A program may do under a guard what waits, such as ending a recorder.
    let held =
        case.trace.holds.iter().map(|hold| hold.left.saturating_duration_since(hold.got)).max();
    let held = held.unwrap_or_default();
    for call in &case.trace.calls {
        // A blocked logger may hold the call that says something, but no end.
        let blocked = if case.blocks { 3 * BLOCKED } else { Duration::ZERO };
        let ends = if case.setup.reconnect_ms.is_some() { ENDS_IN_GAP } else { ENDS };
        let bound = match call.what {
            What::End => ends,
            // It clears the hook, which waits for it.
            What::DropHandler => ends + Duration::from_millis(500),
            What::Finish | What::Leave => RECORDED + blocked,
            What::Look | What::Feed | What::Ask => NOT_WAITING + blocked,
            _ => WAITS + blocked + held,
        };
        let took = call.end - call.start;
        if took > bound + stalls::between(call.start, call.end) {
            breaches.push(format!(
                "{:?} of {:?} took {took:.1?} from {} on",
                call.what,
                call.who,
                case.at(call.start),
            ));
        }
    }
    breaches.truncate(3);
    breaches
}
