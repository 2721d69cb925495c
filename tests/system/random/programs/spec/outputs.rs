//! What a request contains.

use std::time::Instant;

use super::{after, Case, GRACE};
use crate::programs::record::{Call, Exchange, What, Who};

/// What is written under one lock goes out in one request, and nothing that nobody wrote; inputs are of one
/// response.
pub(super) fn whole(case: &Case<'_>) -> Vec<String> {
    let mut breaches = Vec::new();
    for exchange in &case.trace.exchanges {
        match exchange.tag() {
            Ok(0) => {}
            Ok(tag) => match case.writer(tag) {
                None => breaches.push(format!("{tag} was sent, which no guard has left")),
                Some(hold) if hold.panicked => {
                    breaches.push(format!("{tag} was sent, which a panic has undone"));
                }
                Some(_) => {}
            },
            Err(torn) => breaches.push(format!("torn outputs: {torn:?}")),
        }
    }
    for connection in case.connections() {
        // A simple exchange is for the master only, and the first response says that there is an extension. When it does
        // not come, the last request is for the master only, too.
        let first = match connection {
            [first, last] if last.stops_master_alone(first) => 2,
            _ => 1,
        };
        let mut named = connection.iter().skip(first);
        if let Some(torn) = named.find(|exchange| !case.setup.simple && !exchange.agrees()) {
            breaches.push(format!("torn between controllers: {torn:?}"));
        }
    }
    for hold in &case.trace.holds {
        if hold.uni.iter().any(|value| *value != hold.uni[0]) {
            breaches.push(format!("torn inputs: {hold:?}"));
        }
    }
    breaches.truncate(3);
    breaches
}

/// A request contains the last outputs that a guard has left before it, or later ones.
pub(super) fn in_order(case: &Case<'_>) -> Vec<String> {
    let mut breaches = Vec::new();
    for connection in case.connections() {
        // Until the exchange goes on, what a handle writes may be thrown away.
        let Some(goes_on) = connection.get(1).map(|second| second.at) else { continue };
        for pair in connection.windows(2) {
            let Some(writer) = pair[1].tag().ok().and_then(|tag| case.writer(tag)) else {
                continue;
            };
            let newer = case.trace.holds.iter().find(|hold| {
                hold.order > writer.order
                    && hold.orders.tag.is_some()
                    && !hold.panicked
                    && hold.gone < pair[0].at
                    && hold.got > goes_on
            });
            if let Some(newer) = newer {
                breaches.push(format!(
                    "at {} the request has {:?} of {:?}, but {:?} had left {:?} at {}",
                    case.at(pair[1].at),
                    writer.orders.tag,
                    writer.who,
                    newer.who,
                    newer.orders.tag,
                    case.at(newer.gone),
                ));
            }
        }
    }
    breaches.truncate(3);
    breaches
}

/// What was written before an end or a gap moves nothing after it; the first request has only what was written
/// by a handle that knew of it.
pub(super) fn not_before_interruptions(case: &Case<'_>) -> Vec<String> {
    let mut breaches = Vec::new();
    let connections: Vec<_> = case.transfers().collect();
    for pair in connections.windows(2) {
        let [before, after] = [pair[0], pair[1]];
        let Some(lost) = last_before_stop(before) else { continue };
        for (index, exchange) in after.iter().enumerate() {
            let Some(writer) = exchange.tag().ok().and_then(|tag| case.writer(tag)) else {
                continue;
            };
            if writer.got < lost {
                breaches.push(format!(
                    "{:?} was locked at {}, before the connection's last request at {}, and sent on the next \
                     one at {}",
                    writer.orders.tag,
                    case.at(writer.got),
                    case.at(lost),
                    case.at(exchange.at),
                ));
            }
            let knew = case.trace.calls.iter().any(|call| {
                is_by(call, writer.who)
                    && call.reported()
                    && call.end > lost
                    && call.start < writer.left
            });
            // When a transfer has begun, the exchange goes on.
            let knew = knew || begun_before(case, lost, writer.left);
            if index == 0 && !knew {
                breaches.push(format!(
                    "{:?} is in the first request of a connection, at {}, but {:?} did not know",
                    writer.orders.tag,
                    case.at(exchange.at),
                    writer.who,
                ));
            }
        }
    }
    breaches.truncate(3);
    breaches
}

/// Whether a call reports something to this handle. A hook makes its calls with the handler's.
fn is_by(call: &Call, who: Who) -> bool {
    let by_hook = who == Who::Handler && call.who == Who::Hook && call.what != What::Wait;
    call.who == who || by_hook
}

/// When the last request of a connection came that was not the one that stops the motors. That one may be sent
/// after the program was notified.
pub(super) fn last_before_stop(connection: &[Exchange]) -> Option<Instant> {
    let (last, before) = connection.split_last()?;
    if last.is_off() {
        return before.last().map(|exchange| exchange.at);
    }
    Some(last.at)
}

/// Whether a transfer has begun between two times, even if the thread that began it has not noted it yet.
fn begun_before(case: &Case<'_>, from: Instant, to: Instant) -> bool {
    let mut begins = case.trace.calls.iter().filter(|call| call.what == What::Begin);
    let noted = after(to, GRACE);
    begins.any(|call| call.result.is_ok() && from < call.end && call.start < to && call.end < noted)
}
