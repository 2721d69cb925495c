//! What was unusual in a recording, found while it is read from its beginning.

mod pace;
mod terminals;

use std::collections::BTreeMap;
use std::time::Duration;

use ft_transfer_area::EventKind;
use ft_transfer_area_recorder::{Cycle, Failure, FailureKind, Recorded, RecordedEvent, Transfer};
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

/// What has happened, in the languages of the page.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Sentence {
    pub(crate) en: String,
    pub(crate) de: String,
}

impl Sentence {
    fn new(en: impl Into<String>, de: impl Into<String>) -> Self {
        Self { en: en.into(), de: de.into() }
    }

    /// The same after the name of an area.
    fn of_area(self, area: &str) -> Self {
        Self { en: format!("{area}{}", self.en), de: format!("{area}{}", self.de) }
    }
}

#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Moment {
    /// In the list of all that is listed; `None` if there are too many of its kind.
    pub(crate) number: Option<usize>,
    pub(crate) kind: Kind,
    pub(crate) at: Duration,
    pub(crate) what: Sentence,
}

/// Its kind, for how many it counts, and what has happened.
type Found = (Kind, u64, Sentence);

/// Knows what came before, and numbers what it finds.
#[derive(Debug, Default)]
pub(super) struct Unusual {
    pace: Pace,
    terminals: Terminals,
    /// Of this transfer, until the last statistics; unknown until the first ones where the file begins within it.
    late_reactions: Option<u64>,
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
                    // At the beginning of the file, that of a transfer which runs already may be repeated.
                    self.late_reactions = (!at.is_zero()).then_some(0);
                }
                found.extend(of_transfer(transfer));
            }
            Recorded::Event(event) if event.event == EventKind::MotorStalled.name() => {
                found.push((Kind::BlockedMotor, 1, blocked(event)));
            }
            Recorded::Statistics(statistics) => {
                let until_now = statistics.late_reactions;
                let before = self.late_reactions.replace(until_now).unwrap_or(until_now);
                let late = until_now.saturating_sub(before);
                if late > 0 {
                    let what = Sentence::new(
                        format!("late reactions of the program since the last second: {late}"),
                        format!("späte Reaktionen des Programms seit der letzten Sekunde: {late}"),
                    );
                    found.push((Kind::LateReaction, late, what));
                }
            }
            _ => {}
        }
        found.into_iter().map(|(kind, count, what)| self.number(at, kind, count, what)).collect()
    }

    fn look_at_cycle(&mut self, at: Duration, cycle: &Cycle, found: &mut Vec<Found>) {
        if cycle.number == 1 {
            self.late_reactions.get_or_insert(0);
            // Another program may have another pace.
            self.pace = Pace::default();
        }
        if cycle.lost > 0 {
            found.push(not_recorded(cycle.lost));
        }
        if !cycle.first {
            if let Some(usual) = self.pace.longer_than_usual(cycle.since_last) {
                let took = cycle.since_last.as_millis();
                let what = Sentence::new(
                    format!("a cycle took {took} ms, usually {usual} ms"),
                    format!("ein Zyklus dauerte {took} ms, sonst {usual} ms"),
                );
                found.push((Kind::LongCycle, 1, what));
            }
        }
        let found = |kind, what| found.push((kind, 1, what));
        self.terminals.look(at, cycle.first, &cycle.areas, found);
    }

    fn number(&mut self, at: Duration, kind: Kind, count: u64, what: Sentence) -> Moment {
        *self.counts.entry(kind).or_default() += count;
        let moments = self.moments.entry(kind).or_default();
        *moments += 1;
        let is_listed = *moments <= LISTED;
        self.listed += usize::from(is_listed);
        Moment { number: is_listed.then_some(self.listed), kind, at, what }
    }
}

fn not_recorded(entries: u64) -> Found {
    let what = Sentence::new(
        format!("{entries} entries are not recorded: disk or computer was too slow"),
        format!("nicht aufgezeichnete Einträge: {entries}; Platte oder Computer war zu langsam"),
    );
    (Kind::NotRecorded, entries, what)
}

fn of_transfer(transfer: &Transfer) -> Option<Found> {
    let (kind, what) = match transfer {
        Transfer::Lost(failure) => {
            (Kind::Gap, failed("the connection was lost", "die Verbindung riss ab", failure))
        }
        Transfer::Failed(failure) => (
            Kind::Error,
            failed("a transfer could not begin", "die Verbindung kam nicht zustande", failure),
        ),
        Transfer::EndedBy(failure) => {
            (Kind::Error, failed("the transfer ended", "die Verbindung endete", failure))
        }
        Transfer::WatchdogExpired { limit_ms } => (
            Kind::Watchdog,
            Sentence::new(
                format!("the watchdog stopped the motors after {limit_ms} ms"),
                format!("der Watchdog hielt nach {limit_ms} ms die Motoren an"),
            ),
        ),
        Transfer::NotRecorded { entries } => return Some(not_recorded(*entries)),
        _ => return None,
    };
    Some((kind, 1, what))
}

/// What has failed, and why. The file has the library's words; in German it is what the controller did.
fn failed(en: &str, de: &str, Failure { kind, error }: &Failure) -> Sentence {
    let why = match kind {
        FailureKind::NoAnswer => "der Controller hat nicht geantwortet",
        FailureKind::WrongData => "der Controller hat etwas Falsches gesendet",
        FailureKind::Closed => "sie wurde getrennt",
        _ => error,
    };
    Sentence::new(format!("{en}: {error}"), format!("{de}: {why}"))
}

fn blocked(event: &RecordedEvent) -> Sentence {
    let RecordedEvent { controller, terminal, value, .. } = event;
    let area = if controller == "TXT" { String::new() } else { format!("{controller}.") };
    Sentence::new(
        format!("{terminal} is blocked, at {value} pulses"),
        format!("{terminal} ist blockiert, bei {value} Impulsen"),
    )
    .of_area(&area)
}

#[cfg(test)]
mod tests;
