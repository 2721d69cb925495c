//! Online mode and the exchange.

use std::time::{Duration, Instant};

use ft_transfer_area::wire::{CmprHeader, CommandId, ExchangeDataResponse};

use super::{Check, Found};
use crate::print::seconds;
use crate::selftest::bench::Bench;
use crate::selftest::outcome::{Outcome, Trouble};
use crate::selftest::session::{command, packet};

pub(super) const CHECKS: &[Check] = &[
    Check::new("start-online", "StartOnline takes about half a second.", start_online),
    Check::new(
        "extensions",
        "Extensions are reported from the first answer on, and words for one that is missing are ignored.",
        extensions,
    ),
    Check::new("query-status-online", "QueryStatus is answered in online mode, too.", query_online),
    Check::new(
        "both-exchanges",
        "The simple exchange leaves the state of the compressed one as it is.",
        both,
    ),
    Check::new("two-exchanges-at-once", "Two exchanges in one segment get two answers.", two_at_once),
    Check::new(
        "exchange-in-pieces",
        "A compressed exchange that is cut after its header is answered.",
        in_pieces,
    ),
    Check::new(
        "simple-counter-reset",
        "In the simple exchange a counter reset is reported as done with the same answer.",
        simple_counter_reset,
    ),
    Check::new("pace", "The answers to exchanges come 10 ms apart.", pace),
    Check::new(
        "answer-after-a-pause",
        "After a pause an exchange is answered within 10 ms.",
        after_a_pause,
    ),
];

fn start_online(bench: &mut Bench) -> Found {
    bench.end()?;
    let took = bench.online()?.began_in;
    let is_same = (0.3..1.2).contains(&took.as_secs_f64());
    Ok(Outcome::same_if(is_same, seconds(took)).with_time("ms", took))
}

fn query_online(bench: &mut Bench) -> Found {
    let session = bench.online()?;
    command(&mut session.main, CommandId::QueryStatus, &packet(CommandId::QueryStatus))?;
    session.exchange()?;
    Ok(Outcome::same_if(true, ""))
}

fn both(bench: &mut Bench) -> Found {
    let session = bench.online()?;
    session.exchange()?;
    let mut simple = Vec::new();
    session.outputs.emit(&mut simple);
    command(&mut session.main, CommandId::ExchangeData, &simple)?;
    // A state that is another one would give another checksum, unless all words are 0.
    session.exchange()?;
    Ok(Outcome::same_if(true, ""))
}

fn two_at_once(bench: &mut Bench) -> Found {
    let session = bench.online()?;
    session.exchange()?;
    let extensions = session.inputs.extensions;
    let both = [session.request(extensions), session.request(extensions)].concat();
    session.main.send(&both)?;
    session.take_answer()?;
    session.take_answer()?;
    Ok(Outcome::same_if(true, ""))
}

fn in_pieces(bench: &mut Bench) -> Found {
    let session = bench.online()?;
    session.exchange()?;
    let extensions = session.inputs.extensions;
    let request = session.request(extensions);
    let (header, data) = request.split_at(CmprHeader::LEN);
    session.main.send(header)?;
    bench.pause(Duration::from_millis(100))?;
    let session = bench.online()?;
    session.main.send(data)?;
    session.take_answer()?;
    Ok(Outcome::same_if(true, ""))
}

fn simple_counter_reset(bench: &mut Bench) -> Found {
    let session = bench.online()?;
    session.outputs.counter_reset_id[0] += 1;
    let id = session.outputs.counter_reset_id[0];
    let mut simple = Vec::new();
    session.outputs.emit(&mut simple);
    let answer = command(&mut session.main, CommandId::ExchangeData, &simple)?;
    let answer = ExchangeDataResponse::parse(&answer);
    let back = answer.map_err(|error| Trouble::Lost(error.to_string()))?.counter_reset_id[0];
    Ok(Outcome::same_if(back == id, if back == id { "" } else { "it comes later" }))
}

fn pace(bench: &mut Bench) -> Found {
    const COUNT: usize = 200;

    let session = bench.online()?;
    session.exchange()?;
    let mut last = Instant::now();
    let mut times = Vec::with_capacity(COUNT);
    for _ in 0..COUNT {
        session.exchange()?;
        let now = Instant::now();
        times.push(now - last);
        last = now;
    }
    times.sort();
    let part = |percent: usize| times[(COUNT - 1) * percent / 100];
    let is_same = (9.0..=11.0).contains(&(part(50).as_secs_f64() * 1e3));
    let [shortest, p1, median, p99, longest] = [0, 1, 50, 99, 100].map(part);
    let seen = format!(
        "{} in the middle, {} to {} for 98 of 100, {} to {} in all",
        seconds(median),
        seconds(p1),
        seconds(p99),
        seconds(shortest),
        seconds(longest)
    );
    let outcome = Outcome::same_if(is_same, seen).with("exchanges", COUNT);
    let outcome = outcome.with_time("shortest_ms", shortest).with_time("percent_1_ms", p1);
    let outcome = outcome.with_time("median_ms", median).with_time("percent_99_ms", p99);
    Ok(outcome.with_time("longest_ms", longest))
}

fn after_a_pause(bench: &mut Bench) -> Found {
    const COUNT: usize = 15;

    let mut times = Vec::with_capacity(COUNT);
    for _ in 0..COUNT {
        bench.pause(Duration::from_millis(30))?;
        let session = bench.online()?;
        let begin = Instant::now();
        session.exchange()?;
        times.push(begin.elapsed());
    }
    times.sort();
    let median = times[COUNT / 2];
    let is_same = median < Duration::from_millis(9);
    Ok(Outcome::same_if(is_same, seconds(median)).with_time("median_ms", median))
}

fn extensions(bench: &mut Bench) -> Found {
    let session = bench.online()?;
    // It is the first one in this session, and has words for the master only.
    session.exchange()?;
    let found = session.inputs.extensions;
    let (mask, seen) = match found {
        0 => (1, "none is plugged in".to_owned()),
        _ => (found, format!("{} plugged in", found.count_ones())),
    };
    // Zeros for the first one, whether it is there or not.
    let request = session.request(mask);
    session.main.send(&request)?;
    session.take_answer()?;
    let is_same = session.inputs.extensions == found;
    Ok(Outcome::same_if(is_same, seen).with("extensions", found.count_ones()))
}
