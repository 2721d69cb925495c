//! What stops the motors, and how soon.

use std::time::Instant;

use super::{after, Case, SOON};
use crate::programs::record::{Call, Exchange, What, Who};

/// A panic that can be seen, a recorder that is dropped, and a hook that ends, panics or hangs: the next request has all
/// duties 0, and only a new transfer moves anything again.
pub(super) fn panics_and_hooks(case: &Case<'_>) -> Vec<String> {
    let mut breaches = Vec::new();
    for call in case.trace.calls.iter().filter(|call| call.what == What::Panic) {
        // The request before may be on its way.
        stopped(case, "the panic", call.start, call.end, 1, &mut breaches);
    }
    for call in case.trace.calls.iter().filter(|call| call.what == What::Leave) {
        // The motors do not wait for the disk.
        let to = call.end.min(after(call.start, SOON / 10));
        stopped(case, "the drop of a recorder", call.start, to, 1, &mut breaches);
    }
    for stop in &case.trace.hook.stops {
        // It is noted before the hook is left.
        stopped(case, "the hook's end", *stop, after(*stop, SOON / 10), 2, &mut breaches);
    }
    breaches.extend(hook_hangs(case));
    breaches.truncate(3);
    breaches
}

/// Requests with a duty while a hook has kept the areas for longer than its limit.
fn hook_hangs(case: &Case<'_>) -> Option<String> {
    // Signs of life of others count for the program's own watchdog.
    let limit = case.setup.hook_limit().filter(|_| case.setup.watchdog_ms.is_none())?;
    for hold in case.trace.holds.iter().filter(|hold| hold.who == Who::Hook) {
        let late = after(hold.got, limit + SOON / 10);
        let exchanges = case.trace.exchanges.iter();
        let on = |exchange: &&Exchange| exchange.at > late && exchange.at < hold.left;
        let on: Vec<_> = exchanges.filter(on).filter(|exchange| !exchange.is_off()).collect();
        if let [_, _, third, ..] = on[..] {
            let (got, third) = (case.at(hold.got), case.at(third.at));
            return Some(format!("a duty at {third}, while a hook has the areas since {got}"));
        }
    }
    None
}

/// After a reason to stop, which came between two times, at most these requests may have a duty.
fn stopped(
    case: &Case<'_>,
    reason: &str,
    from: Instant,
    to: Instant,
    most: usize,
    breaches: &mut Vec<String>,
) {
    for connection in case.connections() {
        let first = connection[0].at;
        if first >= from && begun_between(case, from, first) {
            continue;
        }
        // Until a first response says that there is an extension, it has the duties of the session before.
        let is_on = |exchange: &Exchange| {
            !exchange.is_off() && !exchange.stops_master_alone(&connection[0])
        };
        let on = |exchange: &&Exchange| exchange.at > to && is_on(exchange);
        let on: Vec<&Exchange> = connection.iter().filter(on).collect();
        let deadline = after(to, SOON);
        let index = connection.partition_point(|exchange| exchange.at <= to);
        let was_on = index.checked_sub(1).is_some_and(|index| is_on(&connection[index]));
        let next = connection.get(index);
        if on.len() > most {
            breaches.push(format!(
                "{} requests have a duty after {reason} at {}, the last one at {}",
                on.len(),
                case.at(to),
                case.at(on[on.len() - 1].at),
            ));
        } else if let Some(next) = next.filter(|next| was_on && next.at > deadline) {
            breaches.push(format!(
                "the request after {reason} at {} came only at {}",
                case.at(to),
                case.at(next.at),
            ));
        }
    }
}

/// Whether a transfer may have begun between two times.
fn begun_between(case: &Case<'_>, from: Instant, to: Instant) -> bool {
    let begins = case.trace.calls.iter().filter(|call| call.what == What::Begin);
    begins.into_iter().any(|call| call.end > from && call.start < to)
}

/// After `end_transfer` has returned, there is no request; the last one has stopped the motors.
pub(super) fn ends(case: &Case<'_>) -> Vec<String> {
    let mut breaches = Vec::new();
    let is_end = |call: &&Call| call.what == What::End && call.who != Who::Hook && !call.panicked;
    for call in case.trace.calls.iter().filter(is_end) {
        for connection in case.connections() {
            // A network may bring requests later.
            if case.setup.network.is_some() {
                continue;
            }
            let [first, last] = [&connection[0], &connection[connection.len() - 1]];
            if first.at < call.start && last.at > call.end {
                breaches.push(format!(
                    "a request at {}, after end_transfer had returned at {} ({:?})",
                    case.at(last.at),
                    case.at(call.end),
                    call.result,
                ));
            }
            if first.at > call.end && !begun_between(case, call.start, first.at) {
                breaches.push(format!(
                    "a connection at {} without a begin after end_transfer at {}",
                    case.at(first.at),
                    case.at(call.end)
                ));
            }
        }
        let before = case.connections().rfind(|connection| connection[0].at < call.end);
        let last = before.and_then(|before| before.iter().rfind(|exchange| exchange.at < call.end));
        let Some(last) = last else { continue };
        // Another thread may have begun the next transfer meanwhile.
        let begun = begun_between(case, last.at.min(call.start), call.end);
        if call.result.is_ok() && !last.is_off() && !begun {
            breaches.push(format!(
                "end_transfer returned Ok at {}, but the last request at {} has a duty",
                case.at(call.end),
                case.at(last.at)
            ));
        }
    }
    breaches.truncate(3);
    breaches
}
