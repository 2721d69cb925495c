//! The watchdog.

use std::time::{Duration, Instant};

use ft_transfer_area::{Error, Event, TimedEvent};

use super::{after, Case, GRACE};
use crate::programs::record::{Call, Hold, What, Who};

/// It stops the motors when there was no sign of life for its limit, not before, and until the program knows.
pub(super) fn keeps_its_limit(case: &Case<'_>) -> Vec<String> {
    let Some(limit) = case.setup.watchdog_ms.filter(|_| !case.setup.lock_step) else {
        return Vec::new();
    };
    let limit = Duration::from_millis(limit);
    let mut breaches = Vec::from_iter(in_time(case, limit));
    let reported = case
        .trace
        .events
        .iter()
        .filter(|reported| matches!(reported.event, Event::WatchdogExpired { .. }));
    for expired in reported.map(|reported| reported.arrived) {
        breaches.extend(too_early(case, limit, expired));
        breaches.extend(on_again(case, expired));
    }
    breaches.truncate(3);
    breaches
}

/// A sign of life within the limit before it expired.
fn too_early(case: &Case<'_>, limit: Duration, expired: Instant) -> Option<String> {
    let since = expired - limit;
    let hooks = case.trace.holds.iter().filter(|hold| hold.who == Who::Hook);
    if hooks.into_iter().any(|hook| hook.got < expired && expired <= hook.left) {
        // It has a limit of its own, whatever other threads do.
        return None;
    }
    let holds = case.trace.holds.iter().filter(|hold| !hold.panicked && hold.who != Who::Hook);
    let drops = holds.map(|hold| (hold.left, hold.gone));
    let feeds =
        case.trace.calls.iter().filter(|call| call.what == What::Feed && call.result.is_ok());
    // In a gap the program can't show that it is alive.
    let is_end_of_gap =
        |reported: &&TimedEvent| matches!(reported.event, Event::ConnectionRestored { .. });
    let gaps = case.trace.events.iter().filter(is_end_of_gap);
    let gaps = gaps.map(|reported| (reported.arrived - GRACE, reported.arrived));
    let mut signs = drops.chain(feeds.map(|call| (call.start, call.end))).chain(gaps);
    let (start, _) = signs.find(|(start, end)| *start > since && *end < expired)?;
    Some(format!(
        "the watchdog of {limit:?} expired at {}, though there was a sign of life at {}",
        case.at(expired),
        case.at(start),
    ))
}

/// Duties that went out after it expired, but were written before that, or before a call returned its error.
fn on_again(case: &Case<'_>, expired: Instant) -> Option<String> {
    let knows = |call: &&Call| {
        matches!(call.result, Err(Error::WatchdogExpired { .. })) && call.end >= expired
    };
    // The program learns of it by the end of a transfer, too.
    let first = |call: &&Call| (call.reported() || knows(call)) && call.end >= expired;
    let known = case.trace.calls.iter().filter(first).map(|call| call.start).min();
    for connection in case.connections() {
        let later = connection.iter().filter(|exchange| exchange.at > expired);
        // Two cycles, and a request that may be on its way; the first one of a connection is for the master alone.
        let skipped = if connection[0].at > expired { 1 } else { 3 };
        for exchange in later.skip(skipped).filter(|exchange| !exchange.is_off()) {
            if known.is_none_or(|known| known > exchange.at) {
                return Some(format!(
                    "a duty at {}, after the watchdog expired at {}, but nobody was notified",
                    case.at(exchange.at),
                    case.at(expired),
                ));
            }
            let writer = exchange.tag().ok().and_then(|tag| case.writer(tag));
            if let Some(writer) = writer.filter(|writer| writer.got < expired) {
                return Some(format!(
                    "{:?} of {:?}, locked at {}, was sent at {} after the watchdog expired at {}",
                    writer.orders.tag,
                    writer.who,
                    case.at(writer.got),
                    case.at(exchange.at),
                    case.at(expired),
                ));
            }
        }
    }
    None
}

/// Requests with a duty when there was no sign of life for the limit.
fn in_time(case: &Case<'_>, limit: Duration) -> Option<String> {
    let mut signs = signs_of_life(case);
    signs.sort_unstable();
    for connection in case.connections() {
        let mut late = 0;
        for exchange in connection {
            let index = signs.partition_point(|sign| *sign <= exchange.at);
            let last = index.checked_sub(1).map_or(connection[0].at, |index| signs[index]);
            let last = last.max(connection[0].at);
            let is_late = exchange.at > after(last, limit + GRACE) && !exchange.is_off();
            late = if is_late { late + 1 } else { 0 };
            // The request in which it expires, and one on its way.
            if late > 2 {
                return Some(format!(
                    "a duty at {}, with a watchdog of {limit:?} and the last sign of life at {}",
                    case.at(exchange.at),
                    case.at(last),
                ));
            }
        }
    }
    None
}

/// When the program showed that it is alive; also while it may be waiting for a response.
fn signs_of_life(case: &Case<'_>) -> Vec<Instant> {
    let trace = case.trace;
    let mut signs: Vec<Instant> = trace.checks.clone();
    signs.extend(trace.holds.iter().flat_map(|hold| [hold.left, hold.gone]));
    let fed = trace.calls.iter().filter(|call| matches!(call.what, What::Feed | What::Begin));
    signs.extend(fed.flat_map(|call| [call.start, call.end]));
    // The response that a wait returned was delivered during it.
    let returned = trace.calls.iter().filter(|call| call.what == What::Wait && call.result.is_ok());
    signs.extend(returned.map(|call| call.end));
    // A hook has waited for its response, too.
    let waited = |hold: &&Hold| hold.is_new || hold.who == Who::Hook;
    signs.extend(trace.holds.iter().filter(waited).map(|hold| hold.got));
    // While a hook is set, its thread may be about to wait.
    let waits = |call: &&Call| matches!(call.what, What::Wait | What::SetHook);
    let waits: Vec<&Call> = trace.calls.iter().filter(waits).collect();
    for exchange in &trace.exchanges {
        let at = exchange.at;
        // When a hook's guard is gone is not known if no other call follows.
        let is_held = trace.holds.iter().any(|hold| hold.got <= at && at <= hold.left);
        let waited = waits.iter().any(|call| call.start <= at && at <= call.end);
        if waited && !is_held {
            signs.push(at);
        }
    }
    signs
}
