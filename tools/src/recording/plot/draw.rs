//! The picture: an SVG with one panel below the other, one for each unit.

use std::ops::Range;
use std::time::Duration;

use plotters::coord::ranged1d::{KeyPointHint, Ranged, ValueFormatter};
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::super::clock::Clock;
use super::thin::Point;

/// The width of the picture, and the height of a panel, in pixels.
const WIDTH: u32 = 1000;
const PANEL: u32 = 230;
const TITLE: u32 = 40;
/// Below the last panel are the times, and the times of day.
const TIMES: u32 = 45;
const TIMES_OF_DAY: u32 = 18;
/// A line of names above each panel, and each line more that they need.
const NAMES: u32 = 26;
const MORE_NAMES: u32 = 20;
/// About how many times are written.
const X_LABELS: usize = 12;
const LEFT: u32 = 80;
const RIGHT: u32 = 30;

/// Each colour as it is on a light and on a dark ground.
const GROUND: (RGBColor, &str) = (RGBColor(0xFF, 0xFF, 0xFF), "#0D1117");
const INK: (RGBColor, &str) = (RGBColor(0x1F, 0x23, 0x28), "#E6EDF3");
const GRID: (RGBColor, &str) = (RGBColor(0xD9, 0xDE, 0xE3), "#30363D");
const GAP: (RGBColor, &str) = (RGBColor(0xF1, 0xDC, 0xDC), "#4A2326");
const UNUSUAL: (RGBColor, &str) = (RGBColor(0xBF, 0x87, 0x00), "#D29922");
const LINES: [(RGBColor, &str); 8] = [
    (RGBColor(0x09, 0x69, 0xDA), "#58A6FF"),
    (RGBColor(0xBC, 0x4C, 0x00), "#F0883E"),
    (RGBColor(0x1A, 0x7F, 0x37), "#3FB950"),
    (RGBColor(0x82, 0x50, 0xDF), "#BC8CFF"),
    (RGBColor(0xCF, 0x22, 0x2E), "#FF7B72"),
    (RGBColor(0x0F, 0x76, 0x6E), "#2DD4BF"),
    (RGBColor(0xBF, 0x39, 0x89), "#F778BA"),
    (RGBColor(0x6E, 0x77, 0x81), "#9EA7B0"),
];

/// What a tick means.
const TICK: &str = "tick: distance done, stalled, extension";

/// Whose shades and ticks are where.
const HALVES: &str = "above: wide, below: thin";

/// What a line from top to bottom means.
const MARK: &str = "upright line: first difference";

/// What is drawn. Times are seconds.
pub(super) struct Picture {
    pub(super) title: String,
    /// What times are since.
    pub(super) since: &'static str,
    /// The times of day, if they are drawn, too.
    pub(super) clock: Option<Clock>,
    pub(super) time: Range<f64>,
    pub(super) panels: Vec<Panel>,
    /// When there was no connection, in the first recording and in the second.
    pub(super) gaps: [Vec<Range<f64>>; 2],
    /// When something happened that is drawn as a tick, in each.
    pub(super) ticks: [Vec<f64>; 2],
    /// When something was unusual, and its number if it has one.
    pub(super) unusual: Vec<(f64, Option<usize>)>,
    /// Whether it is of two recordings, of which the second is drawn over the wide lines of the first.
    pub(super) two: bool,
    /// Where they differ first.
    pub(super) mark: Option<f64>,
}

/// Lines with the same unit.
pub(super) struct Panel {
    /// Such as "distance in cm".
    pub(super) axis: String,
    pub(super) lines: Vec<Line>,
}

pub(super) struct Line {
    pub(super) name: String,
    /// Its connected parts.
    pub(super) parts: Vec<Vec<Point>>,
    /// The parts of the second recording, if there is one.
    pub(super) over: Vec<Vec<Point>>,
}

type Area<'a> = DrawingArea<SVGBackend<'a>, plotters::coord::Shift>;
type Failed<'a> = DrawingAreaErrorKind<<SVGBackend<'a> as DrawingBackend>::ErrorType>;

/// The picture as SVG.
pub(super) fn svg(picture: &Picture) -> anyhow::Result<String> {
    let height =
        TITLE + picture.panels.iter().map(panel_height).sum::<u32>() + times_height(picture);
    let mut svg = String::new();
    let root = SVGBackend::with_string(&mut svg, (WIDTH, height)).into_drawing_area();
    draw(picture, &root).map_err(|error| anyhow::anyhow!("the picture can't be drawn: {error}"))?;
    drop(root);
    Ok(with_dark_colours(&svg))
}

fn draw<'a>(picture: &Picture, root: &Area<'a>) -> Result<(), Failed<'a>> {
    root.fill(&GROUND.0)?;
    root.draw_text(&picture.title, &text(22), (LEFT as i32, 14))?;
    let has_gaps = picture.gaps.iter().any(|gaps| !gaps.is_empty());
    let has_ticks = picture.ticks.iter().any(|ticks| !ticks.is_empty());
    let notes = [
        ("shaded: no connection", !has_gaps),
        (TICK, !has_ticks),
        (HALVES, !picture.two || !(has_gaps || has_ticks)),
        ("yellow: unusual", picture.unusual.is_empty()),
        (MARK, picture.mark.is_none()),
    ];
    let notes: Vec<&str> = notes.iter().filter(|(_, none)| !none).map(|(note, _)| *note).collect();
    let right = text(15).pos(Pos::new(HPos::Right, VPos::Top));
    root.draw_text(&notes.join("; "), &right, ((WIDTH - RIGHT) as i32, 17))?;
    let mut rest = root.split_vertically(TITLE).1;
    for (index, panel) in picture.panels.iter().enumerate() {
        let is_last = index + 1 == picture.panels.len();
        let (area, below) = rest.split_vertically(
            panel_height(panel) + if is_last { times_height(picture) } else { 0 },
        );
        draw_panel(picture, panel, &area, is_last)?;
        rest = below;
    }
    root.present()
}

/// The style of a text. Without fonts, sizes are larger than in the picture.
fn text(size: u32) -> TextStyle<'static> {
    ("sans-serif", size).into_font().color(&INK.0)
}

fn draw_panel<'a>(
    picture: &Picture,
    panel: &Panel,
    area: &Area<'a>,
    with_times: bool,
) -> Result<(), Failed<'a>> {
    let (names, area) = area.split_vertically(names_height(panel));
    draw_names(panel, &names)?;
    let lane = lane(panel);
    let values = value_range(panel, lane);
    let mut chart = ChartBuilder::on(&area)
        .margin_right(RIGHT)
        .margin_bottom(10)
        .set_label_area_size(LabelAreaPosition::Left, LEFT)
        .set_label_area_size(
            LabelAreaPosition::Bottom,
            if with_times { times_height(picture) } else { 0 },
        )
        .build_cartesian_2d(Times(picture.time.clone()), values.clone())?;
    let height = values.end - values.start;
    // Above the half, what is of the first of two recordings.
    let half = if picture.two { values.start + height / 2.0 } else { values.start };
    for (gaps, from, to) in
        [(&picture.gaps[0], half, values.end), (&picture.gaps[1], values.start, half)]
    {
        for gap in gaps {
            let corners = [(gap.start, from), (gap.end, to)];
            chart.draw_series([Rectangle::new(corners, GAP.0.filled())])?;
        }
    }
    chart
        .configure_mesh()
        .axis_style(INK.0)
        .bold_line_style(GRID.0)
        .light_line_style(TRANSPARENT)
        .label_style(text(15))
        .axis_desc_style(text(16))
        .x_desc(if with_times { times_name(picture) } else { String::new() })
        .x_labels(X_LABELS)
        // A lane has no numbers.
        .y_labels(if lane > 0.0 { 0 } else { 5 })
        .y_label_formatter(&|value| number(*value))
        .draw()?;
    let tick = height * 0.06;
    let first = if picture.two { values.end - tick } else { values.start };
    for (ticks, from) in [(&picture.ticks[0], first), (&picture.ticks[1], values.start)] {
        for at in ticks {
            let ends = [(*at, from), (*at, from + tick)];
            chart.draw_series([PathElement::new(ends, INK.0.stroke_width(2))])?;
        }
    }
    for (at, number) in &picture.unusual {
        let ends = [(*at, values.start), (*at, values.end)];
        chart.draw_series([PathElement::new(ends, UNUSUAL.0.stroke_width(1))])?;
        let number = number.map_or(String::new(), |number| format!(" {number}"));
        let style = text(15).color(&UNUSUAL.0);
        chart.draw_series([Text::new(number, (*at, values.end), style)])?;
    }
    if let Some(at) = picture.mark {
        let ends = [(at, values.start), (at, values.end)];
        chart.draw_series([PathElement::new(ends, INK.0.stroke_width(1))])?;
    }
    if let Some(clock) = picture.clock.as_ref().filter(|_| with_times) {
        draw_times_of_day(&picture.time, clock, &area, |at| {
            chart.backend_coord(&(at, values.start))
        })?;
    }
    let lanes = (0..panel.lines.len()).rev().map(|below| below as f64 * lane);
    for ((line, raised), (colour, _)) in panel.lines.iter().zip(lanes).zip(LINES.iter().cycle()) {
        let wide =
            if picture.two { colour.mix(0.4).stroke_width(7) } else { colour.stroke_width(2) };
        for (parts, style) in [(&line.parts, wide), (&line.over, colour.stroke_width(2))] {
            for part in parts {
                let part = part.iter().map(|(at, value)| (*at, value + raised));
                chart.draw_series(LineSeries::new(part, style))?;
            }
        }
    }
    Ok(())
}

fn times_height(picture: &Picture) -> u32 {
    TIMES + if picture.clock.is_some() { TIMES_OF_DAY } else { 0 }
}

/// What the times below the last panel are.
fn times_name(picture: &Picture) -> String {
    let since = format!("time since {}", picture.since);
    match &picture.clock {
        Some(clock) => {
            let begin = clock.date(since_beginning(picture.time.start));
            format!("{since}; time of day, from {begin} on")
        }
        None => since,
    }
}

fn since_beginning(seconds: f64) -> Duration {
    Duration::try_from_secs_f64(seconds).unwrap_or_default()
}

/// About half of the width of a small letter, in tenths of a pixel.
const HALF_LETTER: i32 = 35;

/// Below each time its time of day. The place is that of a time on the axis.
fn draw_times_of_day<'a>(
    time: &Range<f64>,
    clock: &Clock,
    area: &Area<'a>,
    place: impl Fn(f64) -> (i32, i32),
) -> Result<(), Failed<'a>> {
    let (columns, rows) = area.get_pixel_range();
    let style = text(15).pos(Pos::new(HPos::Center, VPos::Top));
    let length = time.end - time.start;
    let digits = if length < 0.1 {
        3
    } else if length < 10.0 {
        2
    } else {
        0
    };
    for at in Times(time.clone()).key_points(X_LABELS) {
        let (x, y) = place(at);
        let label = clock.label(since_beginning(at), digits);
        // A long one at the end would be cut off.
        let half = label.len() as i32 * HALF_LETTER / 10;
        let x = (x - columns.start).min(columns.len() as i32 - half);
        area.draw_text(&label, &style, (x, y - rows.start + 24))?;
    }
    Ok(())
}

/// What the values are, and the name of each line with a piece of it.
fn draw_names<'a>(panel: &Panel, area: &Area<'a>) -> Result<(), Failed<'a>> {
    area.draw_text(&axis(panel), &text(17), (LEFT as i32, 7))?;
    let places = panel.lines.iter().zip(name_places(panel));
    for ((line, (left, top)), (colour, _)) in places.zip(LINES.iter().cycle()) {
        let piece = [(left, top + 7), (left + 18, top + 7)];
        area.draw(&PathElement::new(piece, colour.stroke_width(3)))?;
        area.draw_text(&line.name, &text(17), (left + 23, top))?;
    }
    Ok(())
}

fn axis(panel: &Panel) -> String {
    format!("{}:", panel.axis)
}

/// Where the name of each line is drawn, with its piece: what does not fit beside the others is below them.
fn name_places(panel: &Panel) -> Vec<(i32, i32)> {
    /// About how wide a letter is.
    const LETTER: i32 = 9;
    let width = |text: &str| LETTER * text.chars().count() as i32;
    let (begin, end) = (LEFT as i32, (WIDTH - RIGHT) as i32);
    let (mut left, mut top) = (begin + width(&axis(panel)), 7);
    let place = |line: &Line| {
        let wide = 23 + width(&line.name);
        if left > begin && left + wide > end {
            (left, top) = (begin, top + MORE_NAMES as i32);
        }
        let place = (left, top);
        left += wide + 14;
        place
    };
    panel.lines.iter().map(place).collect()
}

fn names_height(panel: &Panel) -> u32 {
    let lowest = name_places(panel).last().map_or(7, |(_, top)| *top);
    NAMES + u32::try_from(lowest - 7).unwrap_or(0)
}

/// With the names above it.
fn panel_height(panel: &Panel) -> u32 {
    PANEL + names_height(panel) - NAMES
}

fn values(panel: &Panel) -> impl Iterator<Item = f64> + '_ {
    let parts = panel.lines.iter().flat_map(|line| line.parts.iter().chain(&line.over));
    parts.flatten().map(|point| point.1)
}

/// How far lines stand above each other: those of 0 and 1 would hide each other.
fn lane(panel: &Panel) -> f64 {
    let hide = panel.lines.len() > 1 && values(panel).all(|value| (0.0..=1.0).contains(&value));
    if hide {
        1.5
    } else {
        0.0
    }
}

/// The values of all lines, with some room around them.
fn value_range(panel: &Panel, lane: f64) -> Range<f64> {
    let low = values(panel).fold(f64::MAX, f64::min);
    let high = values(panel).fold(f64::MIN, f64::max);
    if low >= 0.0 && high <= 1.0 {
        return -0.2..1.2 + lane * (panel.lines.len() - 1) as f64;
    }
    let room = ((high - low) * 0.06).max(0.1);
    low - room..high + room
}

/// A number without needless digits.
fn number(value: f64) -> String {
    let rounded = (value * 1000.0).round() / 1000.0;
    // No minus before a zero.
    format!("{}", rounded + 0.0)
}

/// The axis of time, whose labels are full seconds, minutes or hours.
struct Times(Range<f64>);

impl Ranged for Times {
    type FormatOption = plotters::coord::ranged1d::NoDefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, limit: (i32, i32)) -> i32 {
        let length = (self.0.end - self.0.start).max(f64::MIN_POSITIVE);
        let share = (value - self.0.start) / length;
        limit.0 + (share * f64::from(limit.1 - limit.0)).round() as i32
    }

    fn key_points<Hint: KeyPointHint>(&self, hint: Hint) -> Vec<f64> {
        let length = self.0.end - self.0.start;
        let most = hint.max_num_points().clamp(2, 14) as f64;
        let step = STEPS.into_iter().find(|step| length / step <= most).unwrap_or(length);
        let first = (self.0.start / step).ceil();
        let count = ((self.0.end / step).floor() - first) as u32 + 1;
        (0..count).map(|number| (first + f64::from(number)) * step).collect()
    }

    fn range(&self) -> Range<f64> {
        self.0.clone()
    }
}

/// Distances of the labels in seconds.
const STEPS: [f64; 21] = [
    0.001, 0.005, 0.01, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 15.0, 30.0, 60.0, 120.0, 300.0,
    600.0, 1800.0, 3600.0, 7200.0, 21600.0,
];

impl ValueFormatter<f64> for Times {
    fn format_ext(&self, value: &f64) -> String {
        let whole = *value as u64;
        if self.0.end <= 120.0 {
            return format!("{} s", number(*value));
        }
        let (hours, minutes) = (whole / 3600, whole / 60 % 60);
        let seconds = number(value % 60.0);
        let seconds = if seconds.len() < 2 { format!("0{seconds}") } else { seconds };
        format!("{hours}:{minutes:02}:{seconds}")
    }
}

/// Adds the colours on a dark ground. Programs that don't know them show the light ones.
fn with_dark_colours(svg: &str) -> String {
    let colours = [GROUND, INK, GRID, GAP, UNUSUAL].into_iter().chain(LINES);
    let rules: String = colours
        .map(|(RGBColor(red, green, blue), dark)| {
            let light = format!("#{red:02X}{green:02X}{blue:02X}");
            format!("[fill=\"{light}\"]{{fill:{dark}}}[stroke=\"{light}\"]{{stroke:{dark}}}\n")
        })
        .collect();
    let style = format!("<style>@media (prefers-color-scheme: dark) {{\n{rules}}}</style>\n");
    match svg.find("<rect") {
        Some(at) => format!("{}{style}{}", &svg[..at], &svg[at..]),
        None => svg.to_owned(),
    }
}
