//! What was unusual in a recording, found while it is read from its beginning.

mod pace;
mod terminals;

use std::collections::BTreeMap;
use std::time::Duration;

use ft_transfer_area::EventKind;
use ft_transfer_area_recorder::{Cycle, Recorded, RecordedEvent, Transfer};
use serde::Serialize;

use pace::Pace;
use terminals::Terminals;

/// How many moments of each kind are listed, and so have a number.
pub(crate) const LISTED: u64 = 10;

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Kind {
    Gap,
    Error,
    Watchdog,
    BlockedMotor,
    OverRange,
    CounterJump,
    LongCycle,
    LateReaction,
    NotRecorded,
}

impl Kind {
    /// So many of them, as "1 gap".
    pub(super) fn counted(self, count: u64) -> String {
        let [one, more] = match self {
            Self::Gap => ["gap", "gaps"],
            Self::Error => ["error", "errors"],
            Self::Watchdog => ["stop by the watchdog", "stops by the watchdog"],
            Self::BlockedMotor => ["blocked motor", "blocked motors"],
            Self::OverRange => ["input over range", "inputs over range"],
            Self::CounterJump => ["jump of a counter", "jumps of counters"],
            Self::LongCycle => ["long cycle", "long cycles"],
            Self::LateReaction => ["late reaction", "late reactions"],
            Self::NotRecorded => ["entry not recorded", "entries not recorded"],
        };
        format!("{count} {}", if count == 1 { one } else { more })
    }
}

#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Moment {
    /// In the list of all that is listed; `None` if there are too many of its kind.
    pub(crate) number: Option<usize>,
    pub(crate) kind: Kind,
    pub(crate) at: Duration,
    pub(crate) what: String,
}

/// Knows what came before, and numbers what it finds.
#[derive(Debug, Default)]
pub(super) struct Unusual {
    pace: Pace,
    terminals: Terminals,
    /// Of this transfer, until the last statistics.
    late_reactions: u64,
    counts: BTreeMap<Kind, u64>,
    /// How many moments of each kind were found: one may count for several.
    moments: BTreeMap<Kind, u64>,
    listed: usize,
}

impl Unusual {
    /// How many there are of each kind.
    pub(super) fn into_counts(self) -> BTreeMap<Kind, u64> {
        self.counts
    }

    /// Looks at the next entry.
    pub(super) fn look(&mut self, at: Duration, what: &Recorded) -> Vec<Moment> {
        let mut found = Vec::new();
        match what {
            Recorded::Cycle(cycle) => self.look_at_cycle(at, cycle, &mut found),
            Recorded::Transfer(transfer) => {
                if matches!(transfer, Transfer::Began { .. }) {
                    self.late_reactions = 0;
                }
                found.extend(of_transfer(transfer));
            }
            Recorded::Event(event) if event.event == EventKind::MotorStalled.name() => {
                found.push((Kind::BlockedMotor, 1, blocked(event)));
            }
            Recorded::Statistics(statistics) => {
                let before = std::mem::replace(&mut self.late_reactions, statistics.late_reactions);
                let late = statistics.late_reactions.saturating_sub(before);
                if late > 0 {
                    let what =
                        format!("late reactions of the program since the last second: {late}");
                    found.push((Kind::LateReaction, late, what));
                }
            }
            _ => {}
        }
        found.into_iter().map(|(kind, count, what)| self.number(at, kind, count, what)).collect()
    }

    fn look_at_cycle(&mut self, at: Duration, cycle: &Cycle, found: &mut Vec<(Kind, u64, String)>) {
        if cycle.lost > 0 {
            found.push(not_recorded(cycle.lost));
        }
        if !cycle.first {
            if let Some(usual) = self.pace.longer_than_usual(cycle.since_last) {
                let took = cycle.since_last.as_millis();
                let what = format!("a cycle took {took} ms, usually {usual} ms");
                found.push((Kind::LongCycle, 1, what));
            }
        }
        let found = |kind, what| found.push((kind, 1, what));
        self.terminals.look(at, cycle.first, &cycle.areas, found);
    }

    fn number(&mut self, at: Duration, kind: Kind, count: u64, what: String) -> Moment {
        *self.counts.entry(kind).or_default() += count;
        let moments = self.moments.entry(kind).or_default();
        *moments += 1;
        let is_listed = *moments <= LISTED;
        self.listed += usize::from(is_listed);
        Moment { number: is_listed.then_some(self.listed), kind, at, what }
    }
}

fn not_recorded(entries: u64) -> (Kind, u64, String) {
    let what = format!("{entries} entries are not recorded: the disk was too slow");
    (Kind::NotRecorded, entries, what)
}

fn of_transfer(transfer: &Transfer) -> Option<(Kind, u64, String)> {
    let (kind, what) = match transfer {
        Transfer::Lost(failure) => {
            (Kind::Gap, format!("the connection was lost: {}", failure.error))
        }
        Transfer::Failed(failure) => {
            (Kind::Error, format!("a transfer could not begin: {}", failure.error))
        }
        Transfer::EndedBy(failure) => {
            (Kind::Error, format!("the transfer ended: {}", failure.error))
        }
        Transfer::WatchdogExpired { limit_ms } => {
            (Kind::Watchdog, format!("the watchdog stopped the motors after {limit_ms} ms"))
        }
        Transfer::NotRecorded { entries } => return Some(not_recorded(*entries)),
        _ => return None,
    };
    Some((kind, 1, what))
}

fn blocked(event: &RecordedEvent) -> String {
    let RecordedEvent { controller, terminal, value, .. } = event;
    let area = if controller == "TXT" { String::new() } else { format!("{controller}.") };
    format!("{area}{terminal} is blocked, at {value} pulses")
}

#[cfg(test)]
mod tests;
