//! What handles learn.

use std::time::Instant;

use ft_transfer_area::{Error, Event, TimedEvent};

use super::Case;
use crate::programs::record::{Call, Hold, Who};

/// Each handle learns of each gap and each expired watchdog once, and gets each response once.
pub(super) fn once(case: &Case<'_>) -> Vec<String> {
    let mut breaches = responses(case);
    if !case.setup.listens {
        return breaches;
    }
    let is_gap = |event: &Event| matches!(event, Event::ConnectionLost { .. });
    let is_expiry = |event: &Event| matches!(event, Event::WatchdogExpired { .. });
    let told_gap = |error: &Error| matches!(error, Error::ConnectionLost { .. });
    let told_expiry = |error: &Error| matches!(error, Error::WatchdogExpired { .. });
    breaches.extend(count(case, "gap", &is_gap, &told_gap));
    breaches.extend(count(case, "expired watchdog", &is_expiry, &told_expiry));
    breaches.truncate(3);
    breaches
}

/// What was reported to each handle that only one thread uses.
fn count(
    case: &Case<'_>,
    name: &str,
    is_it: &dyn Fn(&Event) -> bool,
    tells: &dyn Fn(&Error) -> bool,
) -> Vec<String> {
    let mut breaches = Vec::new();
    let happened: Vec<_> =
        case.trace.events.iter().filter(|reported| is_it(&reported.event)).collect();
    for thread in 0..crate::programs::plan::THREADS_MAX {
        let own = |call: &&Call| call.who == Who::Own(thread);
        let reported: Vec<&Call> = case
            .trace
            .calls
            .iter()
            .filter(own)
            .filter(|call| call.result.as_ref().is_err_and(tells))
            .collect();
        if reported.len() > happened.len() {
            breaches.push(format!(
                "thread {thread} got {} errors of a(n) {name}, which happened {} times",
                reported.len(),
                happened.len(),
            ));
        }
    }
    breaches
}

/// A gap or an expired watchdog ends all waits with an error.
pub(super) fn by_waits(case: &Case<'_>) -> Vec<String> {
    let mut breaches = Vec::new();
    // In lock-step the time of an event is not that of a call.
    if case.setup.lock_step {
        return breaches;
    }
    let interrupts = |event: &Event| {
        matches!(event, Event::ConnectionLost { .. } | Event::WatchdogExpired { .. })
    };
    // Another thread with the same handle may have been notified instead.
    let waited =
        |hold: &&Hold| matches!(hold.who, Who::Own(_)) && (hold.is_new || hold.awaited.is_some());
    for hold in case.trace.holds.iter().filter(waited) {
        let is_between = |reported: &TimedEvent, from: Instant| {
            from < reported.arrived && reported.arrived < hold.arrived
        };
        // A wait that begins late may find a later transfer, where nothing of an earlier one is reported.
        let ended = |from: Instant| {
            let mut ends = case.trace.events.iter();
            ends.any(|reported| {
                matches!(reported.event, Event::TransferEnded { .. }) && is_between(reported, from)
            })
        };
        let meanwhile =
            |reported: &&TimedEvent| is_between(reported, hold.asked) && !ended(reported.arrived);
        let mut events = case.trace.events.iter().filter(|reported| interrupts(&reported.event));
        if let Some(event) = events.find(meanwhile) {
            breaches.push(format!(
                "a wait of {:?} from {} on returned Ok for a response at {}, after {:?} at {}",
                hold.who,
                case.at(hold.asked),
                case.at(hold.arrived),
                event.event,
                case.at(event.arrived),
            ));
        }
    }
    breaches.truncate(3);
    breaches
}

/// No wait for the next response returns one that the handle has returned before.
fn responses(case: &Case<'_>) -> Vec<String> {
    let mut breaches = Vec::new();
    // In lock-step the time begins again with each transfer.
    if case.setup.lock_step {
        return breaches;
    }
    let holds = &case.trace.holds;
    for (index, hold) in holds.iter().enumerate().filter(|(_, hold)| hold.is_new) {
        let again = holds[..index].iter().find(|other| {
            other.who == hold.who
                && (other.cycle, other.arrived) == (hold.cycle, hold.arrived)
                // Two threads may have waited for it at the same time.
                && (other.is_new || other.awaited.is_some())
                && other.got < hold.asked
        });
        if let Some(again) = again {
            breaches.push(format!(
                "{:?} got response {} twice, at {} and {}",
                hold.who,
                hold.cycle,
                case.at(again.got),
                case.at(hold.got),
            ));
        }
    }
    breaches
}
