//! From the entries of a recording to the lines of a picture.

use std::ops::Range;

use anyhow::bail;
use ft_transfer_area::EventKind;
use ft_transfer_area_recorder::{Column, Cycle, Entry, Recorded, Transfer};

use super::draw::{Line, Panel, Picture};
use super::thin::Thin;
use crate::print;

/// More ticks than this are a grey bar, so the others are left out.
const TICKS: usize = 1000;

/// The events that are no ticks: they are seen by their values.
const SEEN: [EventKind; 4] = [
    EventKind::InputChanged,
    EventKind::CounterChanged,
    EventKind::CounterReset,
    EventKind::JoystickMoved,
];

/// What the picture shows, collected entry by entry.
pub(super) struct Tracks {
    /// What is drawn, in seconds.
    wanted: Range<f64>,
    /// Whether nothing was named, so all that changes is drawn.
    all: bool,
    /// How many areas have tracks then.
    areas: usize,
    tracks: Vec<Track>,
    /// The first and the last cycle.
    seen: Option<Range<f64>>,
    gaps: Vec<Range<f64>>,
    /// Since when there is no connection: since the last cycle, because a loss is noticed later.
    lost_since: Option<f64>,
    last_cycle: Option<f64>,
    ticks: Vec<f64>,
    controller: Option<String>,
}

/// A terminal. A new mode gives its values another unit, and so another line.
struct Track {
    column: Column,
    lines: Vec<(&'static str, Thin)>,
}

impl Tracks {
    pub(super) fn new(columns: Vec<Column>, wanted: Range<f64>) -> Self {
        let all = columns.is_empty();
        let tracks = columns.into_iter().map(Track::new).collect();
        Self {
            wanted,
            all,
            areas: 0,
            tracks,
            seen: None,
            gaps: Vec::new(),
            lost_since: None,
            last_cycle: None,
            ticks: Vec::new(),
            controller: None,
        }
    }

    /// Takes an entry in. Returns whether later ones are wanted.
    pub(super) fn take(&mut self, entry: Entry) -> bool {
        let at = entry.at.as_secs_f64();
        let is_wanted = at >= self.wanted.start;
        if at > self.wanted.end {
            return false;
        }
        match entry.what {
            Recorded::Cycle(cycle) => {
                self.end_gap(at);
                self.last_cycle = Some(at);
                if is_wanted {
                    self.take_cycle(at, &cycle);
                }
            }
            Recorded::Transfer(told) => self.take_transfer(at, told),
            Recorded::Event(event) => {
                let is_seen = SEEN.iter().any(|kind| kind.name() == event.event);
                if is_wanted && self.ticks.len() < TICKS && !is_seen {
                    self.ticks.push(at);
                }
            }
            _ => {}
        }
        true
    }

    fn take_cycle(&mut self, at: f64, cycle: &Cycle) {
        if self.all && self.areas < cycle.areas.len() {
            self.areas = cycle.areas.len();
            let new = Column::of_areas(self.areas).into_iter().skip(self.tracks.len());
            self.tracks.extend(new.map(Track::new));
        }
        let connected = !cycle.first && cycle.lost == 0;
        for track in &mut self.tracks {
            track.take(at, cycle, connected);
        }
        self.seen = Some(self.seen.as_ref().map_or(at, |seen| seen.start)..at);
    }

    fn take_transfer(&mut self, at: f64, told: Transfer) {
        match told {
            Transfer::Began { device_name, .. } => self.controller = Some(device_name),
            Transfer::Lost(_) | Transfer::Ended | Transfer::EndedBy(_) => {
                self.lost_since.get_or_insert(self.last_cycle.unwrap_or(at));
            }
            _ => {}
        }
    }

    fn end_gap(&mut self, at: f64) {
        if let Some(since) = self.lost_since.take() {
            self.gaps.push(since.max(self.wanted.start)..at);
        }
    }

    /// The picture. An error says what is missing.
    pub(super) fn picture(mut self, file: &str, title: Option<String>) -> anyhow::Result<Picture> {
        let Some(seen) = self.seen.clone() else {
            bail!("{file} has no cycle in this time");
        };
        // What was lost at the end was lost until the next entry, or to the end.
        self.end_gap(seen.end);
        let missing = self.tracks.iter().find(|track| track.lines.is_empty());
        if let Some(Track { column, .. }) = missing {
            bail!("{column} is not in {file}: its program has no area for it");
        }
        let panels = self.panels();
        if panels.is_empty() {
            bail!("nothing changes in this time of {file}: name what should be drawn, such as I1");
        }
        let controller = self.controller.filter(|name| !name.is_empty());
        let named = || match &controller {
            Some(name) => format!("{file} ({})", print::clean(name)),
            None => file.to_owned(),
        };
        let gaps = self.gaps.into_iter().filter(|gap| gap.end > seen.start && gap.start < gap.end);
        Ok(Picture {
            title: title.unwrap_or_else(named),
            gaps: gaps.map(|gap| gap.start.max(seen.start)..gap.end.min(seen.end)).collect(),
            ticks: self.ticks.into_iter().filter(|at| *at <= seen.end).collect(),
            panels,
            // A single cycle has no length.
            time: seen.start..seen.end.max(seen.start + 0.01),
        })
    }

    /// One panel for each unit, in the order in which units come first.
    fn panels(&self) -> Vec<Panel> {
        let mut panels: Vec<(&str, Panel)> = Vec::new();
        for Track { column, lines } in &self.tracks {
            for (unit, line) in lines {
                if self.all && line.is_constant() {
                    continue;
                }
                let line = Line { name: column.to_string(), parts: line.lines() };
                match panels.iter_mut().find(|(of, _)| of == unit) {
                    Some((_, panel)) => panel.lines.push(line),
                    None => panels.push((unit, Panel { axis: axis(unit), lines: vec![line] })),
                }
            }
        }
        panels.into_iter().map(|(_, panel)| panel).collect()
    }
}

impl Track {
    fn new(column: Column) -> Self {
        Self { column, lines: Vec::new() }
    }

    fn take(&mut self, at: f64, cycle: &Cycle, connected: bool) {
        let Some(value) = self.column.value(&cycle.areas) else { return };
        let unit = self.column.unit(&cycle.areas);
        let known = self.lines.iter().position(|(of, _)| *of == unit);
        let current = known.unwrap_or_else(|| {
            self.lines.push((unit, Thin::default()));
            self.lines.len() - 1
        });
        for (index, (_, line)) in self.lines.iter_mut().enumerate() {
            if index != current || !connected {
                line.cut();
            }
        }
        self.lines[current].1.add(at, value.into());
    }
}

/// What stands beside a panel.
fn axis(unit: &str) -> String {
    match unit {
        "" => String::from("0 or 1"),
        "mV" => String::from("voltage in mV"),
        "Ω" => String::from("resistance in Ω"),
        "cm" => String::from("distance in cm"),
        "duty" => String::from("duty, 512 is full"),
        other => other.to_owned(),
    }
}
