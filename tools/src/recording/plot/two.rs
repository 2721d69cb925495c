//! Two recordings in one picture.

use std::ffi::OsStr;
use std::path::Path;
use std::time::Duration;

use anyhow::bail;
use ft_transfer_area_recorder::{Column, Recording};

use super::draw::{Line, Panel, Picture};
use super::thin::Thin;
use super::tracks::{panel_for, Tracks};
use super::{read, save};
use crate::names::Names;

/// Draws the second recording as thin lines over the wide ones of the first. Times are those since these beginnings,
/// and the mark is where they differ first.
pub(crate) fn second_over_first(
    recordings: [(&Path, &mut Recording); 2],
    begins: [Duration; 2],
    terminals: Vec<Column>,
    names: &Names,
    mark: Option<f64>,
    output: &Path,
) -> anyhow::Result<()> {
    let mut both =
        [(); 2].map(|()| Tracks::new(terminals.clone(), names.clone(), 0.0..f64::INFINITY));
    let paths = recordings.each_ref().map(|(path, _)| *path);
    let mut files = paths.map(|path| path.file_name().unwrap_or_default());
    if files[0] == files[1] {
        files = paths.map(Path::as_os_str);
    }
    let files = files.map(OsStr::to_string_lossy);
    for (((_, recording), begin), tracks) in recordings.into_iter().zip(begins).zip(&mut both) {
        read(recording, tracks, begin)?;
    }
    let title = format!("{} wide, {} thin", files[0], files[1]);
    save(&picture(both, title, mark)?, output)
}

fn picture(mut both: [Tracks; 2], title: String, mark: Option<f64>) -> anyhow::Result<Picture> {
    let seen = both.iter().filter_map(Tracks::seen);
    let Some(time) = seen.reduce(|one, other| one.start.min(other.start)..one.end.max(other.end))
    else {
        bail!("neither of the two recordings has a cycle to draw");
    };
    let gaps = both.each_mut().map(Tracks::take_gaps);
    let panels = panels(&both);
    if panels.is_empty() {
        bail!("nothing changes in the two recordings: name what should be drawn, such as I1");
    }
    let ticks = both.each_ref().map(|tracks| tracks.ticks().collect());
    Ok(Picture {
        title,
        // A single cycle has no length.
        time: time.start..time.end.max(time.start + 0.01),
        since: "the first cycle",
        clock: None,
        panels,
        gaps,
        ticks,
        unusual: Vec::new(),
        two: true,
        mark,
    })
}

/// One panel for each unit, with the lines of both.
fn panels(both: &[Tracks; 2]) -> Vec<Panel> {
    let mut panels = Vec::new();
    let [first, second] = both;
    let only_second =
        second.lines().filter(|(column, unit, _)| first.line(*column, unit).is_none());
    let wide = first
        .lines()
        .map(|(column, unit, line)| (column, unit, Some(line), second.line(column, unit)));
    let thin = only_second.map(|(column, unit, line)| (column, unit, None, Some(line)));
    for (column, unit, wide, thin) in wide.chain(thin) {
        let lines = [wide, thin];
        if first.is_of_all() && Thin::are_constant(lines.iter().flatten().copied()) {
            continue;
        }
        let [parts, over] = lines.map(|line| line.map(Thin::lines).unwrap_or_default());
        panel_for(unit, &mut panels).lines.push(Line { name: first.name(column), parts, over });
    }
    panels.into_iter().map(|(_, panel)| panel).collect()
}
