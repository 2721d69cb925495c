//! Nothing is reported as done that was not done.

use std::time::Instant;

use ft_transfer_area::transfer_area::LOCAL_IO;
use ft_transfer_area::tx::{Motor, SILENCE};
use ft_transfer_area::wire::ExchangeData;
use ft_transfer_area::Event;

use super::outputs::last_before_stop;
use super::Case;
use crate::programs::record::{Awaited, Exchange, Hold};

pub(super) fn really(case: &Case<'_>) -> Vec<String> {
    let mut breaches = Vec::new();
    for hold in &case.trace.holds {
        let Some(awaited) = hold.awaited else { continue };
        let breach = match awaited {
            Awaited::Motor(motor) => driven(case, hold, motor.index()),
            Awaited::Counter(counter) => reset(case, hold, counter.index()),
            Awaited::Sound => played(case, hold),
        };
        breaches.extend(breach.map(|text| {
            let got = case.at(hold.got);
            format!("a wait of {:?} for {awaited:?} returned Ok at {got}, but {text}", hold.who)
        }));
    }
    breaches.extend(again(case));
    breaches.extend(reset_again(case));
    breaches.truncate(3);
    breaches
}

/// The last guard before this one whose orders have what is looked for.
fn last_order<'a, T>(
    case: &Case<'a>,
    hold: &Hold,
    what: impl Fn(&'a Hold) -> Option<T>,
) -> Option<(&'a Hold, T)> {
    let before = case.trace.holds.iter().rev().filter(|other| other.order < hold.order);
    let given = |other: &Hold| !other.panicked && other.left < hold.got;
    before.filter(|other| given(other)).find_map(|other| Some((other, what(other)?)))
}

/// The requests that gave a new command, each with the exchanges from it on.
fn commands<'a>(
    case: &Case<'a>,
    id: impl Fn(&ExchangeData) -> u16 + Copy,
) -> impl Iterator<Item = &'a [Exchange]> {
    let connections: Vec<_> = case.connections().collect();
    connections.into_iter().flat_map(move |connection| {
        (0..connection.len()).filter_map(move |index| {
            let before = index.checked_sub(1).map_or(0, |before| id(&connection[before].master));
            (id(&connection[index].master) != before).then(|| &connection[index..])
        })
    })
}

fn driven(case: &Case<'_>, hold: &Hold, motor: usize) -> Option<String> {
    let (by, (pulses, duty)) = last_order(case, hold, |other| other.orders.drives[motor])?;
    let id = move |outputs: &ExchangeData| outputs.motor_command_id[motor];
    let is_done = commands(case, id).any(|exchanges| {
        let begun = &exchanges[0].master;
        let is_it = begun.distance[motor] == pulses && begun.duty[2 * motor] == duty;
        let same = exchanges.iter().take_while(|exchange| id(&exchange.master) == id(begun));
        let mut before = same.take_while(|exchange| exchange.at < hold.got);
        is_it && before.any(|exchange| exchange.report.motor_command_id[motor] == id(begun))
    });
    (pulses > 0 && !is_done).then(|| {
        format!(
            "the {pulses} pulses at {duty}, ordered by {:?} from {} to {}, were not driven",
            by.who,
            case.at(by.got),
            case.at(by.gone)
        )
    })
}

fn reset(case: &Case<'_>, hold: &Hold, counter: usize) -> Option<String> {
    let (by, ()) = last_order(case, hold, |other| other.orders.resets[counter].then_some(()))?;
    let id = move |outputs: &ExchangeData| outputs.counter_reset_id[counter];
    let is_done = commands(case, id)
        .any(|exchanges| exchanges[0].at > by.asked && exchanges[0].at < hold.got);
    (!is_done)
        .then(|| format!("the reset ordered by {:?} at {} was not sent", by.who, case.at(by.gone)))
}

fn played(case: &Case<'_>, hold: &Hold) -> Option<String> {
    let (by, repeat) = last_order(case, hold, |other| other.orders.sound)?;
    let is_done = commands(case, |outputs| outputs.sound_command_id).any(|exchanges| {
        let begun = &exchanges[0].master;
        let is_it = begun.sound_index != SILENCE && begun.sound_repeat == repeat;
        is_it && exchanges[0].at < hold.got
    });
    (!is_done).then(|| {
        format!("the sound {repeat} ordered by {:?} at {} was not played", by.who, case.at(by.gone))
    })
}

/// A reset that an end or a gap has cut off is not reported as done on the next connection, where the controller gets
/// its id again.
fn reset_again(case: &Case<'_>) -> Vec<String> {
    let mut breaches = Vec::new();
    // In lock-step the time of an event is not that of a request.
    if case.setup.lock_step {
        return breaches;
    }
    let connections: Vec<_> = case.transfers().collect();
    for pair in connections.windows(2) {
        let (last, again) = (&pair[0][pair[0].len() - 1], pair[1][0].at);
        for (counter, id) in last.master.counter_reset_id.into_iter().enumerate() {
            let done = done_at(case, counter, id);
            // An id that was done before is done again by a controller that has forgotten it.
            let Some(done) = done.filter(|done| *done > again) else { continue };
            let orders = |hold: &Hold| hold.orders.resets[counter];
            let new = |hold: &Hold| orders(hold) && hold.got > last.at && hold.got < done;
            // With a new command, the report can't be taken for that of the old one.
            if id > 0 && !case.trace.holds.iter().any(new) {
                breaches.push(format!("reset {id} of C{} is done after a gap", counter + 1));
            }
        }
    }
    breaches
}

/// When a reset was first reported as done.
fn done_at(case: &Case<'_>, looked_for: usize, id: u16) -> Option<Instant> {
    case.trace.events.iter().find_map(|reported| match reported.event {
        Event::CounterReset { area: LOCAL_IO, counter, command_id, .. }
            if (counter.index(), command_id) == (looked_for, id) =>
        {
            Some(reported.arrived)
        }
        _ => None,
    })
}

/// A distance or a sound from before an end or a gap that is driven or played after it.
fn again(case: &Case<'_>) -> Vec<String> {
    let mut breaches = Vec::new();
    let connections: Vec<_> = case.transfers().collect();
    for pair in connections.windows(2) {
        let Some(lost) = last_before_stop(pair[0]) else { continue };
        for exchange in pair[1] {
            let ExchangeData { sound_index, sound_repeat, .. } = exchange.master;
            // The numbers begin again after 60 000 guards.
            let of =
                |hold: &&Hold| hold.orders.sound == Some(sound_repeat) && hold.got < exchange.at;
            let order = case.trace.holds.iter().rev().find(of);
            if order.is_some_and(|hold| hold.got < lost) && sound_index != SILENCE {
                breaches.push(format!("the sound {sound_repeat} is played after a gap"));
            }
            for motor in [Motor::M3, Motor::M4].map(Motor::index) {
                let (pulses, duty) =
                    (exchange.master.distance[motor], exchange.master.duty[2 * motor]);
                let of = |hold: &&Hold| hold.orders.drives[motor] == Some((pulses, duty));
                let order = case.trace.holds.iter().rev().find(of);
                if order.is_some_and(|hold| hold.got < lost) && pulses > 0 {
                    breaches.push(format!("the {pulses} pulses at {duty} are driven after a gap"));
                }
            }
        }
    }
    breaches.dedup();
    breaches
}
