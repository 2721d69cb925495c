//! What is in a recording, without its values.

use std::collections::BTreeMap;
use std::mem;
use std::path::Path;
use std::time::Duration;

use ft_transfer_area::transfer_area::{IZ_MOTOR, MAX_AREAS, MAX_EXTENSIONS};
use ft_transfer_area::FishX1Transfer;
use ft_transfer_area_recorder::{Column, Cycle, Error, Place, Recorded, Recording, Transfer};
use indicatif::{ProgressBar, ProgressStyle};
use serde::Serialize;

use super::answering::{known, Answering, Controller};
use super::clock::Clock;
use super::unusual::{Kind, Moment, Unusual, LISTED};
use super::whole::Transfers;
use crate::print;

/// How many kinds of events are listed: more than there are.
const EVENT_KINDS: usize = 100;
const OTHER_EVENTS: &str = "others";
/// How many later controllers are listed.
pub(super) const LISTED_CONTROLLERS: usize = 10;

/// What is in a recording.
#[derive(Debug, Default, Serialize)]
pub(crate) struct Survey {
    /// Seconds since 1970.
    pub(crate) started: f64,
    /// Date and time of day on this computer.
    pub(crate) started_at: String,
    pub(crate) ended_at: String,
    #[serde(skip)]
    pub(crate) clock: Clock,
    pub(crate) seconds: f64,
    #[serde(skip)]
    pub(crate) length: Duration,
    pub(crate) bytes: u64,
    /// Of the first controller. Empty, as the firmware, when the program has not asked for it, or the beginning was lost.
    pub(crate) device_name: String,
    pub(crate) firmware: String,
    /// The first of those that have answered later, by name, firmware and address, and how many there were.
    pub(crate) later_controllers: Vec<Later>,
    pub(crate) controller_changes: usize,
    #[serde(skip)]
    pub(super) answering: Answering,
    /// Of the first controller.
    pub(crate) address: String,
    pub(crate) areas: usize,
    /// The number of the last extension that took part.
    pub(crate) extensions: usize,
    /// By area, which pairs were two outputs in a cycle.
    #[serde(skip)]
    pub(super) outputs: [[bool; IZ_MOTOR]; MAX_AREAS],
    pub(crate) transfers: u64,
    pub(crate) cycles: u64,
    /// Where cycles begin anew or end, each place once.
    #[serde(skip)]
    pub(super) bounds: Vec<Place>,
    /// Entries that are missing because the disk was too slow.
    pub(crate) lost: u64,
    pub(crate) shortest_cycle_ms: f64,
    pub(crate) mean_cycle_ms: f64,
    pub(crate) longest_cycle_ms: f64,
    pub(crate) gaps: u64,
    /// Whether the last gap has begun, and all since then is known.
    #[serde(skip)]
    pub(crate) in_gap: bool,
    /// By kind.
    pub(crate) events: BTreeMap<String, u64>,
    pub(crate) pictures: u64,
    #[serde(skip)]
    pub(crate) first_picture: Option<Vec<u8>>,
    /// What was unusual: the first moments of each kind, in order.
    pub(crate) unusual: Vec<Listed>,
    pub(crate) unusual_counts: BTreeMap<Kind, u64>,
    pub(crate) is_cut_off: bool,
    /// What is missing because the file is damaged.
    pub(crate) damage: Option<String>,
}

/// An unusual moment with its number, from 1.
#[derive(Debug, Serialize)]
pub(crate) struct Listed {
    pub(crate) number: usize,
    pub(crate) kind: Kind,
    pub(crate) seconds: f64,
    pub(crate) local_time: String,
    #[serde(skip)]
    pub(crate) at: Duration,
    pub(crate) what: String,
}

/// A controller that answers from a time on, in seconds, in place of the one before.
#[derive(Debug, PartialEq, Serialize)]
pub(crate) struct Later {
    pub(crate) since: f64,
    pub(crate) device_name: String,
    pub(crate) firmware: String,
    pub(crate) address: String,
}

impl Later {
    /// Name and firmware, for people.
    pub(crate) fn controller(&self) -> [&str; 2] {
        known(&self.device_name, &self.firmware)
    }
}

impl Survey {
    /// Reads a recording to its end.
    pub(crate) fn of_file(path: &Path) -> Result<Self, Error> {
        Self::of(&mut Recording::open(path)?, path)
    }

    /// Reads a recording of this file to its end.
    pub(crate) fn of(recording: &mut Recording, path: &Path) -> Result<Self, Error> {
        let progress = progress("reads");
        let started = recording.started().duration_since(std::time::UNIX_EPOCH);
        let mut survey = Self {
            started: started.unwrap_or_default().as_secs_f64(),
            clock: Clock::of(recording.started()),
            bytes: std::fs::metadata(path).map_or(0, |file| file.len()),
            ..Self::default()
        };
        let mut measured = (0, Duration::ZERO);
        let mut transfers = Transfers::default();
        let mut unusual = Unusual::default();
        let mut last_number = u64::MAX;
        while let Some(entry) = recording.next() {
            let entry = entry?;
            let place = recording.place();
            if is_bound(&entry.what, &mut last_number) && survey.bounds.last() != Some(&place) {
                survey.bounds.push(place);
            }
            progress.inc(1);
            survey.length = survey.length.max(entry.at);
            let moments = unusual.look(entry.at, &entry.what);
            moments.into_iter().for_each(|moment| survey.list(moment));
            match entry.what {
                Recorded::Cycle(cycle) => {
                    transfers.cycle(cycle.number);
                    survey.in_gap &= cycle.lost == 0;
                    survey.count(&cycle, &mut measured);
                }
                Recorded::Transfer(transfer) => {
                    match &transfer {
                        Transfer::Began { .. } => transfers.begin(),
                        Transfer::NotRecorded { .. } => transfers.miss(),
                        _ => {}
                    }
                    survey.note(&transfer, entry.at);
                }
                Recorded::Missing => {
                    transfers.miss();
                    survey.in_gap = false;
                }
                Recorded::Event(event) => survey.count_event(event.event),
                Recorded::Picture(jpeg) => {
                    survey.pictures += 1;
                    survey.first_picture.get_or_insert(jpeg);
                }
                _ => {}
            }
        }
        progress.finish_and_clear();
        let (count, total) = measured;
        if count > 0 {
            survey.mean_cycle_ms = millis(total) / f64::from(count);
        }
        survey.unusual_counts = unusual.into_counts();
        survey.seconds = survey.length.as_secs_f64();
        survey.started_at = survey.clock.date(Duration::ZERO);
        survey.ended_at = survey.clock.date(survey.length);
        survey.transfers = transfers.count;
        survey.is_cut_off = recording.is_cut_off();
        survey.damage = recording.damage().map(ToString::to_string);
        Ok(survey)
    }

    /// Name and firmware, for people.
    pub(crate) fn controller(&self) -> [&str; 2] {
        known(&self.device_name, &self.firmware)
    }

    /// Name and firmware of the controller that answered at this time, and those that came later.
    pub(super) fn controllers_from(&self, at: Duration) -> ([&str; 2], &[Later]) {
        let count = self.later_controllers.partition_point(|one| one.since <= at.as_secs_f64());
        let (before, later) = self.later_controllers.split_at(count);
        let first = [&*self.device_name, &*self.firmware];
        (before.last().map_or(first, |one| [&one.device_name, &one.firmware]), later)
    }

    /// What a table has: outputs only of pairs that were two outputs.
    pub(super) fn columns(&self) -> Vec<Column> {
        let areas = self.outputs.map(|pairs| {
            let mut area = FishX1Transfer::default();
            *area.config.motor = pairs.map(|outputs| u8::from(!outputs));
            area
        });
        let (count, others) = (1 + self.extensions, Column::of_areas(MAX_AREAS));
        let mut columns = Column::all_of_areas(count);
        columns.retain(|column| others.contains(column) || column.is_configured(&areas));
        columns
    }

    fn count(&mut self, cycle: &Cycle, (count, total): &mut (u32, Duration)) {
        self.cycles += 1;
        self.lost += cycle.lost;
        self.areas = self.areas.max(cycle.areas.len());
        for (outputs, area) in self.outputs.iter_mut().zip(&cycle.areas) {
            for (outputs, kind) in outputs.iter_mut().zip(*area.config.motor) {
                *outputs |= kind == 0;
            }
        }
        let alive = cycle.areas[0].state.io_slave_alive;
        let last = (0..MAX_EXTENSIONS).rev().find(|extension| alive[*extension] != 0);
        self.extensions = self.extensions.max(last.map_or(0, |last| last + 1));
        if cycle.first {
            return;
        }
        let time = millis(cycle.since_last);
        let is_first = *count == 0;
        self.shortest_cycle_ms = if is_first { time } else { self.shortest_cycle_ms.min(time) };
        self.longest_cycle_ms = self.longest_cycle_ms.max(time);
        *count = count.saturating_add(1);
        *total += cycle.since_last;
    }

    /// This controller answers.
    fn answers(&mut self, now: Controller, before: &Controller, at: Duration) {
        let Controller { device_name, firmware, address } = now;
        if *before == Controller::default() {
            (self.device_name, self.firmware, self.address) = (device_name, firmware, address);
            return;
        }
        self.controller_changes += 1;
        if self.controller_changes <= LISTED_CONTROLLERS {
            let since = at.as_secs_f64();
            self.later_controllers.push(Later { since, device_name, firmware, address });
        }
    }

    pub(super) fn note(&mut self, transfer: &Transfer, at: Duration) {
        if let Some((now, before)) = self.answering.take(transfer) {
            let now = now.clone();
            self.answers(now, &before, at);
        }
        match transfer {
            Transfer::Lost(_) => (self.gaps, self.in_gap) = (self.gaps + 1, true),
            Transfer::NotRecorded { entries } => {
                self.lost += entries;
                self.in_gap = false;
            }
            Transfer::Restored { after_ms, .. } if mem::take(&mut self.in_gap) => {
                self.end_gap(*after_ms);
            }
            _ => {}
        }
    }

    fn count_event(&mut self, kind: String) {
        let is_listed = self.events.len() < EVENT_KINDS || self.events.contains_key(&kind);
        let kind = if is_listed { kind } else { OTHER_EVENTS.to_owned() };
        *self.events.entry(kind).or_default() += 1;
    }

    fn list(&mut self, moment: Moment) {
        let Moment { number: Some(number), kind, at, what } = moment else { return };
        let (seconds, local_time) = (at.as_secs_f64(), self.clock.date(at));
        self.unusual.push(Listed { number, kind, seconds, local_time, at, what: what.en });
    }

    /// The last gap, if it is listed, was so long.
    fn end_gap(&mut self, after_ms: u64) {
        let last = self.unusual.iter_mut().rfind(|moment| moment.kind == Kind::Gap);
        if let Some(gap) = last.filter(|_| self.gaps <= LISTED) {
            gap.what += "; it was back after ";
            gap.what += &print::seconds(Duration::from_millis(after_ms));
        }
    }
}

/// Whether cycles begin anew with this entry, or end: numbers rise within a session.
fn is_bound(what: &Recorded, last_number: &mut u64) -> bool {
    match what {
        Recorded::Cycle(cycle) => {
            let last = mem::replace(last_number, cycle.number);
            cycle.first || cycle.number <= last
        }
        Recorded::Transfer(transfer) => {
            matches!(transfer, Transfer::Lost(_) | Transfer::Ended | Transfer::EndedBy(_))
        }
        _ => false,
    }
}

fn millis(time: Duration) -> f64 {
    time.as_secs_f64() * 1e3
}

/// Counts entries on stderr, if that is a terminal.
pub(crate) fn progress(doing: &str) -> ProgressBar {
    let style = ProgressStyle::with_template("{spinner} {msg} {human_pos} entries ({elapsed})");
    let bar = ProgressBar::no_length();
    if let Ok(style) = style {
        bar.set_style(style);
    }
    bar.set_message(doing.to_owned());
    bar
}

#[cfg(test)]
pub(super) mod tests {
    use std::time::Instant;

    use ft_transfer_area_recorder::{Options, Recorder};
    use serde_json::json;

    use super::super::unusual::Sentence;
    use super::*;

    /// Records 300 transfers that have no cycle.
    pub(in super::super) fn record_ends(path: &Path) {
        let (recorder, mut feed) = Recorder::fed(path, Options::default()).unwrap();
        for _ in 0..300 {
            feed.transfer(Instant::now(), Transfer::Ended);
        }
        drop(feed);
        recorder.finish().unwrap();
    }

    #[test]
    fn of_controllers_in_turn_the_first_are_listed_and_all_are_counted() {
        let mut survey = Survey::default();
        for number in 0..1000 {
            let name = if number % 2 == 0 { "FIRST" } else { "SECOND" };
            let transfer = json!({"what": "began", "device_name": name, "firmware": "4.7.0", "address": "127.0.0.1", "areas": 1});
            survey.note(&serde_json::from_value(transfer).unwrap(), Duration::ZERO);
        }
        assert_eq!((&*survey.device_name, survey.controller_changes), ("FIRST", 999));
        assert_eq!(survey.later_controllers.len(), LISTED_CONTROLLERS);
    }

    #[test]
    fn of_many_ends_of_cycles_in_one_place_one_is_kept() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.mcap");
        record_ends(&path);
        let bounds = Survey::of_file(&path).unwrap().bounds;
        assert!(!bounds.is_empty() && bounds.is_sorted_by(|one, next| one < next), "{bounds:?}");
    }

    #[test]
    fn of_many_kinds_of_events_the_first_are_listed_and_all_are_counted() {
        let mut survey = Survey::default();
        (0..1000).for_each(|number| survey.count_event(format!("kind {}", number % 500)));
        assert_eq!(survey.events.len(), EVENT_KINDS + 1);
        assert_eq!((survey.events["kind 7"], survey.events[OTHER_EVENTS]), (2, 800));
    }

    #[test]
    fn a_controller_at_another_address_of_the_same_name_is_there() {
        let mut survey = Survey::default();
        let transfer = |value| serde_json::from_value(value).unwrap();
        let at = Duration::ZERO;
        let mut note = |what: Transfer| survey.note(&what, at);
        note(transfer(
            json!({"what": "began", "device_name": "ALPHA", "firmware": "4.7.0", "address": "127.0.0.2", "areas": 1}),
        ));
        note(transfer(
            json!({"what": "restored", "after_ms": 9, "device_name": "BETA", "firmware": "4.7.0", "address": "127.0.0.3"}),
        ));
        // An older file has no address there.
        note(transfer(
            json!({"what": "restored", "after_ms": 9, "device_name": "GAMMA", "firmware": "4.7.0"}),
        ));
        let later = survey.later_controllers.iter().map(|it| (&*it.device_name, &*it.address));
        assert_eq!(later.collect::<Vec<_>>(), [("BETA", "127.0.0.3"), ("GAMMA", "127.0.0.3")]);
    }

    #[test]
    fn a_gap_whose_beginning_is_not_known_is_not_the_one_before() {
        let mut survey = Survey::default();
        let transfer = |value| serde_json::from_value(value).unwrap();
        let lost: Transfer =
            transfer(json!({"what": "lost", "kind": "no_answer", "error": "away"}));
        let restored = |after_ms| transfer(json!({"what": "restored", "after_ms": after_ms}));
        let at = Duration::ZERO;
        survey.note(&lost, at);
        let what = Sentence { en: "away".into(), de: String::new() };
        survey.list(Moment { number: Some(1), kind: Kind::Gap, at, what });
        survey.note(&restored(1500), at);
        survey.note(&restored(3500), at);
        assert_eq!(survey.unusual[0].what, "away; it was back after 1.50 s");
    }
}
