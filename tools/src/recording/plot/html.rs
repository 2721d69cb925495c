//! A page for a browser with the lines of a recording.

use std::collections::HashSet;
use std::fs;
use std::path::Path;
use std::time::Duration;

use anyhow::Context;
use serde::Serialize;

use super::super::clock::{Clock, Twice};
use super::super::unusual::{Kind, Moment, Sentence};
use super::marks::Marks;
use super::thin::{Point, Thin};
use super::tracks::Tracks;
use crate::{plotter, print};

/// How many buckets a line has at most: an hour has 0.64 s in each.
pub(super) const BUCKETS: usize = 8000;
/// How many lines are seen at first.
const CHOSEN: usize = 8;

/// What the page gets.
#[derive(Serialize)]
struct Sheet {
    title: String,
    begin: f64,
    end: f64,
    /// When second 0 was, in milliseconds since 1970.
    started: i64,
    /// The time zone of the times of day; without it, it is the browser's.
    zone: Option<String>,
    /// Those that are there twice, in this time zone.
    twice: Vec<Twice>,
    gaps: Vec<[f64; 2]>,
    unusual: Vec<Mark>,
    /// Whether some of a kind are not in `unusual`.
    more_unusual: bool,
    /// The longest stretch of which only some values are kept, in seconds; 0 if all are.
    step: f64,
    lines: Vec<Line>,
    /// The ids of those that are seen at first.
    chosen: Vec<String>,
}

#[derive(Serialize)]
struct Line {
    id: String,
    name: String,
    area: usize,
    kind: &'static str,
    /// In milliseconds, each as what is added to the one before.
    times: Vec<i64>,
    /// `None` begins a stretch of which nothing is known.
    values: Vec<Option<f64>>,
}

/// An unusual moment.
#[derive(Serialize)]
struct Mark {
    /// In `txt info`.
    number: Option<usize>,
    at: f64,
    kind: Kind,
    what: Sentence,
}

impl Mark {
    fn of(moment: &Moment) -> Self {
        let Moment { number, kind, at, what: Sentence { en, de } } = moment;
        let what = Sentence { en: print::clean(en).into(), de: print::clean(de).into() };
        Self { number: *number, at: at.as_secs_f64(), kind: *kind, what }
    }
}

/// Nobody wants to overwrite a recording by a page.
pub(super) fn is_page(path: &Path) -> bool {
    path.extension().is_some_and(|end| end.eq_ignore_ascii_case("html"))
}

pub(super) fn save(
    tracks: Tracks,
    file: &str,
    title: Option<String>,
    clock: &Clock,
    output: &Path,
) -> anyhow::Result<()> {
    let sheet = sheet(tracks, file, title, clock)?;
    let page = plotter::page(&sheet.title, &serde_json::to_string(&sheet)?)?;
    fs::write(output, page).with_context(|| format!("can't write {}", output.display()))
}

fn sheet(
    mut tracks: Tracks,
    file: &str,
    title: Option<String>,
    clock: &Clock,
) -> anyhow::Result<Sheet> {
    let seen = tracks.ensure_seen(file)?;
    let title = tracks.title(file, title);
    let gaps = tracks.take_gaps().into_iter().map(|gap| [gap.start, gap.end]).collect();
    let (mut lines, mut chosen, mut known) = (Vec::new(), Vec::new(), HashSet::new());
    let mut step: f64 = 0.0;
    for (column, unit, line) in tracks.lines() {
        let terminal = column.to_string();
        // A terminal in another mode is another line.
        let is_new = known.insert(column);
        let id = if is_new { terminal } else { format!("{terminal} {}", kind(unit)) };
        let changes = !Thin::are_constant([line]);
        if !tracks.is_of_all() || (changes && chosen.len() < CHOSEN) {
            chosen.push(id.clone());
        }
        step = step.max(line.step());
        let (times, values) = points(&line.lines());
        let (name, area) = (tracks.name(column), column.area());
        lines.push(Line { id, name, area, kind: kind(unit), times, values });
    }
    let marks = tracks.marks();
    let seen_until = Duration::try_from_secs_f64(seen.end).unwrap_or_default();
    Ok(Sheet {
        title,
        begin: seen.start,
        end: seen.end,
        started: clock.started(),
        zone: clock.zone().map(str::to_owned),
        twice: clock.zone().map_or(Vec::new(), |_| clock.twice(seen_until)),
        gaps,
        unusual: marks.map(Marks::moments).unwrap_or_default().iter().map(Mark::of).collect(),
        more_unusual: marks.is_some_and(Marks::are_some_left_out),
        step,
        lines,
        chosen,
    })
}

/// What the page calls a unit.
fn kind(unit: &'static str) -> &'static str {
    match unit {
        "" => "digital",
        other => other,
    }
}

/// Times and values of the connected parts of a line, with a `None` right after each part.
fn points(parts: &[Vec<Point>]) -> (Vec<i64>, Vec<Option<f64>>) {
    let (mut times, mut values) = (Vec::new(), Vec::new());
    let mut before = 0;
    let mut add = |at: i64, value: Option<f64>| {
        // Also when two parts follow each other within a millisecond.
        let at = at.max(before);
        times.push(at - before);
        values.push(value);
        before = at;
    };
    let ms = |at: f64| (at * 1000.0).round() as i64;
    for part in parts {
        for (at, value) in part {
            add(ms(*at), Some(*value));
        }
        if let Some((at, _)) = part.last() {
            add(ms(*at) + 1, None);
        }
    }
    (times, values)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_steps_and_a_gap_follows_each_part() {
        let parts = [vec![(0.5, 1.0), (0.51, 2.0)], vec![(3.0, 7.0)]];
        let (times, values) = points(&parts);
        assert_eq!(times, [500, 10, 1, 2489, 1]);
        assert_eq!(values, [Some(1.0), Some(2.0), None, Some(7.0), None]);
    }
}
