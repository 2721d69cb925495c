//! From the entries of a recording to the lines of a picture.

use std::ops::Range;

use anyhow::bail;
use ft_transfer_area::EventKind;
use ft_transfer_area_recorder::{Column, Cycle, Entry, Recorded, Transfer};

use super::super::answering::Answering;
use super::super::clock::Clock;
use super::super::survey::LISTED_CONTROLLERS;
use super::draw::{Line, Panel, Picture};
use super::marks::Marks;
use super::thin::Thin;
use crate::names::Names;
use crate::print;

/// More ticks than this are a grey bar, so those close to another one are left out.
const TICKS: usize = 1000;

/// The events that are not ticks: they are seen by their values.
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
    names: Names,
    /// How many areas have tracks then.
    areas: usize,
    /// How many buckets a line has at most, if not as many as a picture needs.
    buckets: Option<usize>,
    tracks: Vec<Track>,
    /// The first and the last cycle.
    seen: Option<Range<f64>>,
    gaps: Vec<Range<f64>>,
    /// Since when there is no connection: since the last cycle, because a loss is noticed later.
    lost_since: Option<f64>,
    last_cycle: Option<f64>,
    /// Whether cycles since the last one are not recorded.
    has_lost: bool,
    ticks: Vec<f64>,
    /// How far from each other they are at least.
    apart: f64,
    /// What is unusual, if that is drawn.
    marks: Option<Marks>,
    answering: Answering,
    /// The names of those that answer in the picture: the first ones, and whether there are others.
    controllers: Vec<String>,
    has_others: bool,
}

/// A terminal. A new mode gives its values another unit, and so another line.
struct Track {
    column: Column,
    lines: Vec<(&'static str, Thin)>,
}

impl Tracks {
    pub(super) fn new(columns: Vec<Column>, names: Names, wanted: Range<f64>) -> Self {
        let all = columns.is_empty();
        let tracks = columns.into_iter().map(Track::new).collect();
        Self {
            wanted,
            all,
            names,
            areas: 0,
            buckets: None,
            tracks,
            seen: None,
            gaps: Vec::new(),
            lost_since: None,
            last_cycle: None,
            has_lost: false,
            ticks: Vec::new(),
            apart: 0.0,
            marks: None,
            answering: Answering::default(),
            controllers: Vec::new(),
            has_others: false,
        }
    }

    /// With lines of so many buckets, which can be looked at more closely than a picture.
    pub(super) fn finer(self, buckets: usize) -> Self {
        Self { buckets: Some(buckets), ..self }
    }

    /// What is unusual is drawn, too.
    pub(super) fn with_unusual(self) -> Self {
        Self { marks: Some(Marks::default()), ..self }
    }

    /// Takes an entry in. Returns whether later ones are wanted.
    pub(super) fn take(&mut self, entry: Entry) -> bool {
        let at = entry.at.as_secs_f64();
        let is_wanted = at >= self.wanted.start;
        if at > self.wanted.end {
            // An event may be in the file before its cycle, so only a cycle is the end.
            return !matches!(entry.what, Recorded::Cycle(_));
        }
        if let Some(marks) = &mut self.marks {
            marks.look(&entry, is_wanted);
        }
        match entry.what {
            Recorded::Cycle(cycle) => {
                let has_lost = std::mem::take(&mut self.has_lost) || cycle.lost > 0;
                let goes_on = self.lost_since.is_none() && !has_lost;
                self.end_gap(at);
                self.last_cycle = Some(at);
                if is_wanted {
                    self.take_cycle(at, &cycle, goes_on);
                }
            }
            Recorded::Transfer(reported) => self.take_transfer(at, reported),
            Recorded::Missing => self.lose(at),
            Recorded::Event(event) => {
                let is_seen = SEEN.iter().any(|kind| kind.name() == event.event);
                if is_wanted && !is_seen {
                    self.add_tick(at);
                }
            }
            _ => {}
        }
        true
    }

    fn add_tick(&mut self, at: f64) {
        let is_apart = |last: &f64| (at - last).abs() >= self.apart;
        if self.ticks.last().is_none_or(is_apart) {
            self.ticks.push(at);
        }
        if self.ticks.len() > TICKS {
            self.apart = 2.0 * (at - self.ticks[0]) / TICKS as f64;
            let mut kept = f64::NEG_INFINITY;
            self.ticks.retain(|at| {
                let is_apart = at - kept >= self.apart;
                kept = if is_apart { *at } else { kept };
                is_apart
            });
        }
    }

    fn take_cycle(&mut self, at: f64, cycle: &Cycle, goes_on: bool) {
        if self.all && self.areas < cycle.areas.len() {
            self.areas = cycle.areas.len();
            let new = Column::all_of_areas(self.areas).into_iter().skip(self.tracks.len());
            self.tracks.extend(new.map(Track::new));
        }
        self.note_controller();
        let connected = goes_on && !cycle.first;
        for track in &mut self.tracks {
            // Of a pair, what it is.
            if !self.all || track.column.is_configured(&cycle.areas) {
                track.take(at, cycle, connected, self.buckets);
            } else {
                track.cut();
            }
        }
        self.seen = Some(self.seen.as_ref().map_or(at, |seen| seen.start)..at);
    }

    fn take_transfer(&mut self, at: f64, reported: Transfer) {
        self.answering.take(&reported);
        match reported {
            Transfer::Lost(_) | Transfer::Ended | Transfer::EndedBy(_) => self.lose(at),
            Transfer::NotRecorded { .. } => self.has_lost = true,
            _ => {}
        }
    }

    /// Notes who answers in the picture.
    fn note_controller(&mut self) {
        let name = &self.answering.now().device_name;
        if self.controllers.contains(name) {
            return;
        }
        match self.controllers.len() < LISTED_CONTROLLERS {
            true => self.controllers.push(name.clone()),
            false => self.has_others = true,
        }
    }

    fn lose(&mut self, at: f64) {
        self.lost_since.get_or_insert(self.last_cycle.unwrap_or(at));
    }

    fn end_gap(&mut self, at: f64) {
        if let Some(since) = self.lost_since.take() {
            self.gaps.push(since.max(self.wanted.start)..at);
        }
    }

    /// The picture. An error says what is missing.
    pub(super) fn picture(
        mut self,
        file: &str,
        title: Option<String>,
        clock: Clock,
    ) -> anyhow::Result<Picture> {
        let seen = self.ensure_seen(file)?;
        let panels = self.panels();
        if panels.is_empty() {
            bail!("nothing changes in this time of {file}: name what should be drawn, such as I1");
        }
        let title = self.title(file, title);
        Ok(Picture {
            title,
            gaps: [self.take_gaps(), Vec::new()],
            ticks: [self.ticks().collect(), Vec::new()],
            unusual: self.marks.as_ref().map(Marks::places).unwrap_or_default(),
            panels,
            // A single cycle has no length.
            time: seen.start..seen.end.max(seen.start + 0.01),
            since: "the beginning of the recording",
            clock: Some(clock),
            two: false,
            mark: None,
        })
    }

    /// The first and the last cycle. An error says what is missing.
    pub(super) fn ensure_seen(&self, file: &str) -> anyhow::Result<Range<f64>> {
        let Some(seen) = self.seen.clone() else {
            bail!("{file} has no cycle in this time");
        };
        let missing = self.tracks.iter().find(|track| track.lines.is_empty());
        if let Some(Track { column, .. }) = missing.filter(|_| !self.all) {
            bail!(
                "{column} is not in {file}: in this time its program had no area for it, or the \
                 extension was not connected"
            );
        }
        Ok(seen)
    }

    /// The line above it all: the file's name, and those of the controllers, if there is no other one.
    pub(super) fn title(&self, file: &str, title: Option<String>) -> String {
        let name = |name: &String| if name.is_empty() { "unknown".into() } else { name.clone() };
        let mut controllers = self.controllers.iter().map(name).collect::<Vec<_>>().join(", then ");
        if self.has_others {
            controllers += ", then others";
        }
        title.unwrap_or_else(|| match &*controllers {
            "" | "unknown" => file.to_owned(),
            names => format!("{file} ({})", print::clean(names)),
        })
    }

    /// What is unusual in the picture, if that is drawn.
    pub(super) fn marks(&self) -> Option<&Marks> {
        self.marks.as_ref()
    }

    /// What is unusual in the picture, as lines for people.
    pub(super) fn unusual_lines(&self, clock: &Clock) -> Vec<String> {
        self.marks.as_ref().map(|marks| marks.lines(clock)).unwrap_or_default()
    }

    /// The first and the last cycle.
    pub(super) fn seen(&self) -> Option<Range<f64>> {
        self.seen.clone()
    }

    /// Whether nothing was named, so all that changes is drawn.
    pub(super) fn is_of_all(&self) -> bool {
        self.all
    }

    /// When there was no connection, within what is drawn.
    pub(super) fn take_gaps(&mut self) -> Vec<Range<f64>> {
        let Some(seen) = self.seen.clone() else { return Vec::new() };
        // What was lost at the end was lost until the next entry, or to the end.
        self.end_gap(seen.end);
        let gaps = self.gaps.drain(..).filter(|gap| gap.end > seen.start && gap.start < gap.end);
        let gaps = gaps.map(|gap| gap.start.max(seen.start)..gap.end.min(seen.end)).collect();
        fewer(gaps, (seen.end - seen.start) / TICKS as f64)
    }

    pub(super) fn ticks(&self) -> impl Iterator<Item = f64> + '_ {
        let end = self.seen.as_ref().map_or(0.0, |seen| seen.end);
        self.ticks.iter().copied().filter(move |at| *at <= end)
    }

    /// The line of a terminal in a unit.
    pub(super) fn line(&self, column: Column, unit: &str) -> Option<&Thin> {
        let mut lines = self.lines();
        lines.find(|line| (line.0, line.1) == (column, unit)).map(|(_, _, line)| line)
    }

    /// All lines, with their terminals and units.
    pub(super) fn lines(&self) -> impl Iterator<Item = (Column, &'static str, &Thin)> {
        self.tracks
            .iter()
            .flat_map(|track| track.lines.iter().map(|(unit, line)| (track.column, *unit, line)))
    }

    /// What is written beside a piece of a terminal's line.
    pub(super) fn name(&self, column: Column) -> String {
        self.names.beside(&column)
    }

    /// One panel for each unit, in the order in which units come first.
    fn panels(&self) -> Vec<Panel> {
        let mut panels = Vec::new();
        for (column, unit, line) in self.lines() {
            if self.all && Thin::are_constant([line]) {
                continue;
            }
            let (name, parts) = (self.name(column), line.lines());
            panel_for(unit, &mut panels).lines.push(Line { name, parts, over: Vec::new() });
        }
        panels.into_iter().map(|(_, panel)| panel).collect()
    }
}

/// Of more gaps than anybody can tell apart, those that are not farther from each other than this are one.
fn fewer(gaps: Vec<Range<f64>>, apart: f64) -> Vec<Range<f64>> {
    if gaps.len() <= TICKS {
        return gaps;
    }
    let mut fewer: Vec<Range<f64>> = Vec::new();
    for gap in gaps {
        match fewer.last_mut() {
            Some(last) if gap.start - last.end <= apart => last.end = last.end.max(gap.end),
            _ => fewer.push(gap),
        }
    }
    fewer
}

/// The panel of a unit, which is added if it is the first of it.
pub(super) fn panel_for<'a>(
    unit: &'static str,
    panels: &'a mut Vec<(&'static str, Panel)>,
) -> &'a mut Panel {
    let known = panels.iter().position(|(of, _)| *of == unit);
    let place = known.unwrap_or_else(|| {
        panels.push((unit, Panel { axis: axis(unit), lines: Vec::new() }));
        panels.len() - 1
    });
    &mut panels[place].1
}

impl Track {
    fn new(column: Column) -> Self {
        Self { column, lines: Vec::new() }
    }

    /// The next value is not connected with the last one.
    fn cut(&mut self) {
        self.lines.iter_mut().for_each(|(_, line)| line.cut());
    }

    fn take(&mut self, at: f64, cycle: &Cycle, connected: bool, buckets: Option<usize>) {
        let Some(value) = self.column.value(&cycle.areas) else {
            return self.cut();
        };
        let unit = self.column.unit(&cycle.areas);
        let known = self.lines.iter().position(|(of, _)| *of == unit);
        let current = known.unwrap_or_else(|| {
            self.lines.push((unit, buckets.map_or_else(Thin::default, Thin::of)));
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_many_ticks_some_are_drawn_over_the_whole_time() {
        let mut tracks = Tracks::new(Vec::new(), Names::default(), 0.0..f64::MAX);
        let seconds = 30_000;
        (0..seconds).for_each(|at| tracks.add_tick(f64::from(at)));
        assert!((TICKS / 4..=TICKS).contains(&tracks.ticks.len()), "{}", tracks.ticks.len());
        let ends = [tracks.ticks[0], *tracks.ticks.last().unwrap()];
        assert!(ends[0] < 100.0 && ends[1] > f64::from(seconds) - 100.0, "{ends:?}");
        assert!(tracks.ticks.windows(2).all(|two| two[1] - two[0] < 150.0));
    }

    #[test]
    fn of_many_controllers_the_title_names_the_first_ones() {
        let mut tracks = Tracks::new(Vec::new(), Names::default(), 0.0..f64::MAX);
        let mut answers = |name: String| {
            let began = serde_json::json!({"what": "began", "device_name": name, "firmware": "", "address": "", "areas": 1});
            tracks.take_transfer(0.0, serde_json::from_value(began).unwrap());
            tracks.note_controller();
            tracks.title("run.mcap", None)
        };
        assert_eq!(answers(String::new()), "run.mcap", "nobody has asked");
        let mut title = String::new();
        for number in 0..9 {
            title = answers(format!("TXT-{number}"));
        }
        assert!(title.starts_with("run.mcap (unknown, then TXT-0, "), "{title}");
        assert_eq!(answers("TXT-0".to_owned()), title, "it has one name");
        for number in 0..30_000 {
            title = answers(format!("ANOTHER-{number}"));
        }
        assert!(title.ends_with(", then TXT-8, then others)"), "{title}");
    }
    #[test]
    fn of_many_gaps_those_that_nobody_tells_apart_are_one() {
        let gap = |at: usize| at as f64..at as f64 + 0.5;
        assert_eq!(fewer((0..TICKS).map(gap).collect(), 100.0).len(), TICKS, "not too many");
        let gaps = (0..30_000).chain(60_000..60_010).map(gap).collect();
        let seen = 60_010.5;
        let fewer = fewer(gaps, seen / TICKS as f64);
        assert_eq!(fewer, [0.0..29_999.5, 60_000.0..60_009.5]);
    }
}
