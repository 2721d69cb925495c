//! What happened in a run, for people.

use std::time::Instant;

use super::record::Trace;

/// A line for each thing, in the order of the times.
pub(crate) fn of(trace: &Trace) -> String {
    let mut lines: Vec<(Instant, String)> = Vec::new();
    for call in &trace.calls {
        let result = if call.panicked { "panic".to_owned() } else { format!("{:?}", call.result) };
        lines.push((call.start, format!("{:?} calls {:?}", call.who, call.what)));
        lines.push((call.end, format!("{:?} returns from {:?}: {result}", call.who, call.what)));
    }
    for hold in &trace.holds {
        let number = hold.order;
        let awaited = hold.awaited.map(|awaited| format!(", awaited {awaited:?}"));
        let orders = format!("{:?}{}", hold.orders, awaited.unwrap_or_default());
        let cycle = hold.cycle;
        lines.push((hold.got, format!("{:?} has guard {number} of response {cycle}", hold.who)));
        lines.push((hold.left, format!("{:?} drops guard {number}: {orders}", hold.who)));
        lines.push((hold.gone, format!("{:?} has dropped guard {number}", hold.who)));
    }
    let mut before = None;
    for exchange in &trace.exchanges {
        let text = exchange.describe();
        if before.as_ref() != Some(&text) {
            lines.push((exchange.at, text.clone()));
            before = Some(text);
        }
    }
    for reported in &trace.events {
        lines.push((reported.arrived, format!("event {:?}", reported.event)));
    }
    for (begin, end) in &trace.hook.times {
        lines.push((*begin, "the hook is called".to_owned()));
        lines.extend(end.map(|end| (end, "the hook returns".to_owned())));
    }
    lines.sort_by_key(|(at, _)| *at);
    let begin = lines.first().map(|(at, _)| *at);
    let line = |(at, text): &(Instant, String)| {
        let since = begin.map_or(0.0, |begin| (*at - begin).as_secs_f64() * 1000.0);
        format!("{since:9.3} ms  {text}\n")
    };
    lines.iter().map(line).collect()
}
