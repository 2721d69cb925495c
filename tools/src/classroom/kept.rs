//! How far the pupils of a class are, in a file beside the class: for a spreadsheet, and for the next start.

use std::collections::HashMap;
use std::fs;
use std::io::ErrorKind;
use std::path::PathBuf;
use std::time::Duration;

use anyhow::Context;
use crossbeam_channel::{Receiver, RecvTimeoutError};
use serde::{Deserialize, Serialize};

use super::class::write;
use crate::check::{Desk, Language};
use crate::lines;
use crate::panel::course::Progress;

/// How often to look whether something has changed.
const LOOK: Duration = Duration::from_secs(2);

/// The file, and what was written last.
pub(super) struct Kept {
    path: PathBuf,
    written: String,
}

/// One line of the file.
#[derive(Debug, PartialEq, Deserialize, Serialize)]
struct Row {
    name: String,
    lesson: u8,
    /// The numbers of lessons, with spaces.
    passed: String,
    wrong_since: u32,
    last_wrong: String,
}

impl Kept {
    /// Goes on where the pupils were, if there is such a file.
    pub(super) fn go_on(path: PathBuf, desks: &[(&str, Desk)]) -> anyhow::Result<Self> {
        let written = match fs::read_to_string(&path) {
            Err(error) if error.kind() == ErrorKind::NotFound => String::new(),
            read => read.with_context(|| path.display().to_string())?,
        };
        let rows = rows(&written).with_context(|| path.display().to_string())?;
        for (name, desk) in desks {
            if let Some(row) = rows.get(*name) {
                let passed = row.passed.split_whitespace().filter_map(|number| number.parse().ok());
                desk.go_on(row.lesson, passed);
            }
        }
        Ok(Self { path, written })
    }

    /// Writes what has changed, until the program should end.
    pub(super) fn write_until(
        mut self,
        interrupted: &Receiver<()>,
        desks: &[(&str, Desk)],
    ) -> anyhow::Result<()> {
        let mut is_told = false;
        while interrupted.recv_timeout(LOOK) == Err(RecvTimeoutError::Timeout) {
            // The class goes on without the file.
            is_told = match self.write(desks) {
                Ok(()) => false,
                Err(_) if is_told => true,
                Err(error) => {
                    lines::print(&format!("{}: {error:#}", self.path.display()));
                    true
                }
            };
        }
        self.write(desks)
    }

    fn write(&mut self, desks: &[(&str, Desk)]) -> anyhow::Result<()> {
        let language = Language::of_system();
        let progress = desks.iter().filter_map(|(name, desk)| Some((*name, desk.progress()?)));
        let text = text(progress, language)?;
        if text != self.written {
            write(&self.path, &text)?;
            self.written = text;
        }
        Ok(())
    }
}

fn text<'a>(
    progress: impl Iterator<Item = (&'a str, Progress)>,
    language: Language,
) -> anyhow::Result<String> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    for (name, progress) in progress {
        let wrong = progress.wrong.map(|wrong| match language {
            Language::En => wrong.en,
            Language::De => wrong.de,
        });
        let passed: Vec<_> = progress.passed.iter().map(u8::to_string).collect();
        writer.serialize(Row {
            name: name.to_owned(),
            lesson: progress.lesson,
            passed: passed.join(" "),
            wrong_since: progress.failed,
            last_wrong: wrong.unwrap_or_default(),
        })?;
    }
    Ok(String::from_utf8(writer.into_inner()?)?)
}

/// The lines by name.
fn rows(text: &str) -> anyhow::Result<HashMap<String, Row>> {
    let mut reader = csv::Reader::from_reader(text.as_bytes());
    let rows = reader.deserialize().map(|row| row.map(|row: Row| (row.name.clone(), row)));
    Ok(rows.collect::<Result<_, _>>()?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::panel::course::Both;

    #[test]
    fn what_is_written_is_read_again() {
        let wrong = Both { en: "It is dark.".into(), de: "Es ist \"dunkel\", immer noch.".into() };
        let progress = Progress {
            lesson: 4,
            phase: "wrong",
            passed: vec![1, 2, 3],
            failed: 2,
            wrong: Some(wrong),
            wrong_ago: Some(7),
        };
        let text = text([("Zoë, 7b", progress)].into_iter(), Language::De).unwrap();
        let rows = rows(&text).unwrap();
        let row = &rows["Zoë, 7b"];
        assert_eq!((row.lesson, &*row.passed, row.wrong_since), (4, "1 2 3", 2));
        assert_eq!(row.last_wrong, "Es ist \"dunkel\", immer noch.");
    }
}
