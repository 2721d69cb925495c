//! The pictures of the document, readable on a light and on a dark ground.

use std::fs;
use std::path::Path;

use anyhow::{anyhow, Result};
use plotters::coord::ranged1d::{KeyPointHint, NoDefaultFormatting, Ranged, ValueFormatter};
pub(crate) use plotters::prelude::SeriesLabelPosition;
use plotters::prelude::*;

const SIZE: (u32, u32) = (900, 420);

/// Each colour as it is on a light and on a dark ground.
const GROUND: (RGBColor, &str) = (RGBColor(0xFF, 0xFF, 0xFF), "#0D1117");
const INK: (RGBColor, &str) = (RGBColor(0x1F, 0x23, 0x28), "#E6EDF3");
const GRID: (RGBColor, &str) = (RGBColor(0xD9, 0xDE, 0xE3), "#30363D");
const LINES: [(RGBColor, &str); 6] = [
    (RGBColor(0x09, 0x69, 0xDA), "#58A6FF"),
    (RGBColor(0xBC, 0x4C, 0x00), "#F0883E"),
    (RGBColor(0x1A, 0x7F, 0x37), "#3FB950"),
    (RGBColor(0x82, 0x50, 0xDF), "#BC8CFF"),
    (RGBColor(0xCF, 0x22, 0x2E), "#FF7B72"),
    (RGBColor(0x0F, 0x76, 0x6E), "#2DD4BF"),
];

/// A picture of points that are connected.
pub(crate) struct Picture<'a> {
    pub(crate) title: &'a str,
    pub(crate) across: &'a str,
    pub(crate) up: &'a str,
    /// The values at the grid's lines; the axes go from the first to the last, each by the logarithm.
    pub(crate) columns: &'a [f64],
    pub(crate) rows: &'a [f64],
    pub(crate) lines: Vec<(String, Vec<(f64, f64)>)>,
    /// Whether each point is marked.
    pub(crate) marked: bool,
    /// Where no line is.
    pub(crate) names: SeriesLabelPosition,
}

impl Picture<'_> {
    pub(crate) fn write(&self, path: &Path) -> Result<()> {
        let mut svg = String::new();
        self.draw(&mut svg).map_err(|error| anyhow!("the picture can't be drawn: {error}"))?;
        Ok(fs::write(path, with_dark_colours(&svg))?)
    }

    fn draw(&self, svg: &mut String) -> Result<(), Box<dyn std::error::Error>> {
        let root = SVGBackend::with_string(svg, SIZE).into_drawing_area();
        root.fill(&GROUND.0)?;
        let text = |size: u32| ("sans-serif", size).into_font().color(&INK.0);
        let mut chart = ChartBuilder::on(&root)
            .margin(14)
            .caption(self.title, text(20))
            .set_label_area_size(LabelAreaPosition::Left, 70)
            .set_label_area_size(LabelAreaPosition::Bottom, 48)
            .build_cartesian_2d(Axis(self.columns.to_vec()), Axis(self.rows.to_vec()))?;
        chart
            .configure_mesh()
            .axis_style(INK.0)
            .bold_line_style(GRID.0)
            .light_line_style(TRANSPARENT)
            .label_style(text(14))
            .axis_desc_style(text(15))
            .x_desc(self.across)
            .y_desc(self.up)
            .draw()?;
        for ((name, points), (colour, _)) in self.lines.iter().zip(LINES.iter().cycle()) {
            let inside = points.iter().map(|(x, y)| (*x, y.max(self.rows[0])));
            let line = LineSeries::new(inside.clone(), colour.stroke_width(2));
            let colour = *colour;
            chart.draw_series(line)?.label(name).legend(move |(x, y)| {
                PathElement::new([(x, y), (x + 22, y)], colour.stroke_width(3))
            });
            if self.marked {
                chart.draw_series(inside.map(|point| Circle::new(point, 4, colour.filled())))?;
            }
        }
        chart
            .configure_series_labels()
            .position(self.names.clone())
            .label_font(text(14))
            .background_style(GROUND.0)
            .border_style(GRID.0)
            .draw()?;
        root.present()?;
        Ok(())
    }
}

/// A logarithmic axis with these lines.
#[derive(Clone)]
struct Axis(Vec<f64>);

impl Ranged for Axis {
    type FormatOption = NoDefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, (from, to): (i32, i32)) -> i32 {
        let range = self.range();
        let share = (value / range.start).ln() / (range.end / range.start).ln();
        from + (f64::from(to - from) * share).round() as i32
    }

    fn key_points<Hint: KeyPointHint>(&self, _hint: Hint) -> Vec<f64> {
        self.0.clone()
    }

    fn range(&self) -> std::ops::Range<f64> {
        self.0[0]..self.0[self.0.len() - 1]
    }
}

impl ValueFormatter<f64> for Axis {
    fn format_ext(&self, value: &f64) -> String {
        value.to_string()
    }
}

/// Gives the picture its colours for a dark ground.
fn with_dark_colours(svg: &str) -> String {
    let mut style = "<style>@media (prefers-color-scheme: dark) {\n".to_owned();
    for (RGBColor(red, green, blue), dark) in [GROUND, INK, GRID].iter().chain(&LINES) {
        for kind in ["fill", "stroke"] {
            style += &format!("[{kind}=\"#{red:02X}{green:02X}{blue:02X}\"]{{{kind}:{dark}}}");
        }
        style.push('\n');
    }
    style += "}</style>\n";
    // After the first line, which opens the picture.
    match svg.split_once('\n') {
        Some((first, rest)) => format!("{first}\n{style}{rest}"),
        None => svg.to_owned(),
    }
}
