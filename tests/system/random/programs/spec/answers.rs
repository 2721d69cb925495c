//! Which request has a thread's answer to a response.

use std::time::{Duration, Instant};

use super::{after, Case, GRACE};
use crate::programs::record::{Call, Exchange, Hold, What, Who};

/// What a thread writes that has waited for a response is in the very next request, if it drops its guard within the
/// window: the request waits for it.
pub(super) fn in_the_next_request(case: &Case<'_>) -> Vec<String> {
    // There, no time is that of a response.
    if case.setup.lock_step {
        return Vec::new();
    }
    let window = Duration::from_millis(case.setup.window_ms);
    let in_time = |hold: &&Hold| hold.is_new && !hold.panicked && hold.gone < hold.arrived + window;
    let mut breaches = Vec::new();
    for hold in case.trace.holds.iter().filter(in_time) {
        let Some(tag) = hold.orders.tag.filter(|tag| *tag > 0) else { continue };
        let find = |is_it: &dyn Fn(&Exchange) -> bool| case.trace.exchanges.iter().position(is_it);
        // Outputs that were stopped, or were replaced by a later guard, are not sent at all.
        let Some(has_it) = find(&|exchange| exchange.tag().ok() == Some(tag)) else { continue };
        let next = find(&|exchange| exchange.at > hold.arrived);
        if next.is_some_and(|next| next < has_it) {
            breaches.push(format!(
                "{tag} of {:?} answers the response at {}, and is dropped within its window at {}, but the next \
                 request does not have it; that at {} has it",
                hold.who,
                case.at(hold.arrived),
                case.at(hold.gone),
                case.at(case.trace.exchanges[has_it].at),
            ));
        }
    }
    breaches.truncate(3);
    breaches
}

/// In lock-step no request leaves while a thread has the areas. After a gap, the first one leaves for a command to the
/// camera for which that thread itself waits.
pub(super) fn in_lock_step(case: &Case<'_>) -> Vec<String> {
    // A network may bring requests later.
    if !case.setup.lock_step || case.setup.network.is_some() {
        return Vec::new();
    }
    let mut breaches = Vec::new();
    for hold in &case.trace.holds {
        // One may be on its way.
        let from = after(hold.got, GRACE);
        let under = |exchange: &&Exchange| from < exchange.at && exchange.at < hold.left;
        let cameras = case
            .trace
            .calls
            .iter()
            .filter(|call| call.what == What::Camera && call.thread == hold.thread);
        for connection in case.connections() {
            let mut requests = before_last(case, connection);
            let first = connection[0].at;
            if cameras.clone().any(|call| call.start < first && first < call.end) {
                requests = requests.get(1..).unwrap_or_default();
            }
            if let Some(exchange) = requests.iter().find(under) {
                breaches.push(format!(
                    "a request at {}, while {:?} had the areas from {} to {} in lock-step",
                    case.at(exchange.at),
                    hold.who,
                    case.at(hold.got),
                    case.at(hold.left),
                ));
            }
        }
    }
    breaches.truncate(3);
    breaches
}

/// Without what stops the motors at the end, which waits for nobody: the last request, and the one before it when that was
/// the end's, and its response was wrong.
fn before_last<'a>(case: &Case<'_>, connection: &'a [Exchange]) -> &'a [Exchange] {
    let before = &connection[..connection.len() - 1];
    let of_an_end = |exchange: &Exchange| {
        let ends = |call: &&Call| matches!(call.what, What::End | What::DropHandler);
        let mut ends = case.trace.calls.iter().filter(ends);
        exchange.is_off() && ends.any(|call| call.start < exchange.at && exchange.at < call.end)
    };
    match before.split_last() {
        Some((last, rest)) if of_an_end(last) => rest,
        _ => before,
    }
}

/// A cycle hook has the areas before the threads that wait for the same response.
pub(super) fn after_the_hook(case: &Case<'_>) -> Vec<String> {
    if case.setup.lock_step {
        return Vec::new();
    }
    let window = Duration::from_millis(case.setup.window_ms);
    let hooks: Vec<_> = case.trace.holds.iter().filter(|hold| hold.who == Who::Hook).collect();
    let mut breaches = Vec::new();
    for pair in hooks.windows(2).filter(|pair| is_next_call(case, pair[0], pair[1])) {
        let [before, hook] = [pair[0], pair[1]];
        let overtakes = |hold: &&Hold| {
            let in_time = hold.got < hold.arrived + window;
            let between = before.order < hold.order && hold.order < hook.order;
            hold.is_new && between && hold.arrived == hook.arrived && in_time
        };
        if let Some(first) = case.trace.holds.iter().find(overtakes) {
            breaches.push(format!(
                "{:?} got the areas at {}, before the hook at {} for the same response",
                first.who,
                case.at(first.got),
                case.at(hook.got),
            ));
        }
    }
    breaches.truncate(3);
    breaches
}

/// Whether these are two calls of one hook, without another call between them.
fn is_next_call(case: &Case<'_>, before: &Hold, hook: &Hold) -> bool {
    let between = |at: Instant| before.got < at && at < hook.got;
    let calls = case.trace.hook.times.iter().filter(|(begin, _)| between(*begin)).count();
    let sets = case.trace.calls.iter().filter(|call| call.what == What::SetHook);
    calls == 1 && !sets.into_iter().any(|call| call.start < hook.got && call.end > before.got)
}
