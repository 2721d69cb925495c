//! `docs/reliability_matrix.md`: the table is made from the rows.

use std::path::PathBuf;
use std::time::Duration;

use super::row::Row;

/// The lines before and after the table.
const BEGIN: &str = "<!-- The table is written by tests/system/reliability. -->";
const END: &str = "<!-- The end of the table. -->";

const HEADER: &str = "\
| fault | where | the program sees | how soon | measured | duty 0 by | measured |
|---|---|---|---|---|---|---|";

/// The columns with measured values.
const MEASURED: [usize; 2] = [4, 6];

fn path() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../docs/reliability_matrix.md")
}

/// Whether the document's table has these rows and no others.
pub(crate) fn check(rows: &[Row]) -> Result<(), String> {
    let document = std::fs::read_to_string(path()).map_err(|error| error.to_string())?;
    let promised = |line: &str| {
        let mut cells = cells(line);
        MEASURED.iter().for_each(|&index| {
            if let Some(cell) = cells.get_mut(index) {
                *cell = "";
            }
        });
        cells.join("|")
    };
    let written: Vec<String> = table(&document)?.lines().map(promised).collect();
    let made = table_of(rows, "");
    let made: Vec<String> = made.lines().map(promised).collect();
    let mistakes: Vec<String> = made
        .iter()
        .filter(|line| !written.contains(line))
        .map(|line| format!("the document lacks {line}"))
        .chain(
            (written.iter().filter(|line| !made.contains(line)))
                .map(|line| format!("no test has {line}")),
        )
        .collect();
    match mistakes.is_empty() && made == written {
        true => Ok(()),
        false => Err(format!("docs/reliability_matrix.md: {}", mistakes.join("\n"))),
    }
}

/// Writes the table with the measured values. Rows that did not run keep their old figures.
pub(crate) fn write(rows: &[Row]) -> Result<(), String> {
    let document = std::fs::read_to_string(path()).map_err(|error| error.to_string())?;
    let old = table(&document)?.to_owned();
    let (begin, rest) = document.split_once(BEGIN).unwrap_or_default();
    let end = rest.split_once(END).map_or("", |(_, end)| end);
    let new = format!("{begin}{BEGIN}\n\n{}\n\n{END}{end}", table_of(rows, &old));
    std::fs::write(path(), new).map_err(|error| error.to_string())
}

/// The lines between the two marks.
fn table(document: &str) -> Result<&str, String> {
    let table = document.split_once(BEGIN).and_then(|(_, rest)| rest.split_once(END));
    table.map(|(table, _)| table.trim()).ok_or_else(|| format!("{BEGIN:?} or {END:?} is missing"))
}

fn table_of(rows: &[Row], old: &str) -> String {
    let mut lines = vec![HEADER.to_owned()];
    let mut section = "";
    for row in rows {
        if row.section != section {
            section = row.section;
            lines.push(format!("| **{section}** | | | | | | |"));
        }
        lines.push(line(row, old));
    }
    lines.join("\n")
}

fn line(row: &Row, old: &str) -> String {
    let Row { fault, place, sees, limit, .. } = *row;
    let findings = row.findings.lock().unwrap();
    let by: Vec<String> = row.by.iter().map(ToString::to_string).collect();
    let [soon, stopped] = if findings.is_empty() {
        let is_same = |line: &&str| cells(line).get(..4) == Some(&[fault, place, sees, limit][..]);
        let before = old.lines().find(is_same).map(cells).unwrap_or_default();
        MEASURED.map(|index| before.get(index).unwrap_or(&"–").to_string())
    } else {
        let soon = findings.iter().filter_map(|outcome| outcome.soon).collect();
        [soon, findings.iter().filter_map(|outcome| outcome.stopped).collect()].map(median)
    };
    format!("| {fault} | {place} | {sees} | {limit} | {soon} | {} | {stopped} |", by.join(" or "))
}

fn cells(line: &str) -> Vec<&str> {
    line.trim().trim_matches('|').split('|').map(str::trim).collect()
}

fn median(mut times: Vec<Duration>) -> String {
    times.sort_unstable();
    let Some(median) = times.get(times.len() / 2) else { return "–".to_owned() };
    match median.as_secs_f64() {
        seconds if seconds >= 1.0 => format!("{seconds:.1} s"),
        0.0 => "before".to_owned(),
        seconds if seconds >= 0.01 => format!("{:.0} ms", seconds * 1e3),
        seconds => format!("{:.2} ms", seconds * 1e3),
    }
}
