//! How far the pupils of a class are, in a file beside the class: for a spreadsheet, and for the next start.

use std::io::ErrorKind;
use std::path::PathBuf;
use std::time::Duration;

use anyhow::{anyhow, bail, Context};
use crossbeam_channel::{Receiver, RecvTimeoutError};
use serde::{Deserialize, Serialize};

use super::class::{as_seen, keep, read};
use crate::check::{Desk, Language};
use crate::lines;
use crate::panel::course::Progress;

/// How often to look whether something has changed.
const LOOK: Duration = Duration::from_secs(2);

/// What a spreadsheet may begin a file with, to tell that it is in UTF-8.
const MARK: &str = "\u{feff}";
/// What may be between two columns: spreadsheets choose by language.
const BETWEEN: &[u8] = b",;\t";

/// The names in the first line.
const COLUMNS: [&str; 5] = ["name", "lesson", "passed", "wrong_since", "last_wrong"];

/// The file, and what was written last.
pub(super) struct Kept {
    path: PathBuf,
    written: String,
    /// All that was read, also of pupils who have no lesson now.
    rows: Vec<Row>,
}

/// One line of the file.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
struct Row {
    name: String,
    lesson: u8,
    /// The numbers of lessons, with spaces.
    passed: String,
    wrong_since: u32,
    last_wrong: String,
}

impl Row {
    fn of(name: &str, progress: Progress, language: Language) -> Self {
        let wrong = progress.wrong.map(|wrong| match language {
            Language::En => wrong.en,
            Language::De => wrong.de,
        });
        let passed: Vec<_> = progress.passed.iter().map(u8::to_string).collect();
        Self {
            name: name.to_owned(),
            lesson: progress.lesson,
            passed: passed.join(" "),
            wrong_since: progress.failed,
            last_wrong: wrong.unwrap_or_default(),
        }
    }
}

impl Kept {
    /// Goes on where the pupils were, if there is such a file.
    pub(super) fn go_on(path: PathBuf, desks: &[(&str, Desk)]) -> anyhow::Result<Self> {
        let written = match read(&path) {
            Err(error) if error.kind() == ErrorKind::NotFound => Ok(String::new()),
            Err(error) if error.kind() == ErrorKind::InvalidData => Err(not_read(error)),
            read => read.map_err(anyhow::Error::from),
        };
        let written = written.with_context(|| path.display().to_string())?;
        let rows = rows(&written).map_err(not_read).with_context(|| path.display().to_string())?;
        for (name, desk) in desks {
            if let Some(row) = place(&rows, name).map(|place| &rows[place]) {
                let passed = lessons(&row.passed).map_err(not_read);
                let passed = passed.with_context(|| path.display().to_string())?;
                desk.go_on(row.lesson, passed, row.wrong_since, &row.last_wrong);
            }
        }
        Ok(Self { path, written, rows })
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
        for (name, desk) in desks {
            let Some(progress) = desk.progress() else { continue };
            let row = Row::of(name, progress, language);
            match place(&self.rows, name) {
                Some(place) => self.rows[place] = row,
                None => self.rows.push(row),
            }
        }
        let text = text(&self.rows, &self.written)?;
        if text != self.written {
            keep(&self.path, &text)?;
            self.written = text;
        }
        Ok(())
    }
}

/// The numbers of lessons, also as a teacher writes them: with commas.
fn lessons(text: &str) -> anyhow::Result<Vec<u8>> {
    let is_between = |c: char| c == ',' || c.is_whitespace();
    let words = text.split(is_between).filter(|word| !word.is_empty());
    let number = |word: &str| word.parse::<u8>().map_err(|_| anyhow!("{word} is no lesson"));
    words.map(number).collect()
}

/// Where this pupil's line is. A program for tables may have written the name in another way that looks the same.
fn place(rows: &[Row], name: &str) -> Option<usize> {
    let exact = rows.iter().position(|row| row.name == name);
    exact.or_else(|| {
        let seen = as_seen(name);
        rows.iter().position(|row| as_seen(&row.name) == seen)
    })
}

fn not_read(cause: impl std::fmt::Display) -> anyhow::Error {
    anyhow!(
        "this can't be read ({cause}): save it as CSV in UTF-8, with the columns name, lesson, passed, wrong_since and \
         last_wrong"
    )
}

/// The file with these rows, in the form that it had before.
fn text(rows: &[Row], before: &str) -> anyhow::Result<String> {
    let mut bytes = Vec::new();
    if before.starts_with(MARK) {
        bytes.extend_from_slice(MARK.as_bytes());
    }
    let mut writer = csv::WriterBuilder::new().delimiter(between(before)).from_writer(bytes);
    rows.iter().try_for_each(|row| writer.serialize(row))?;
    Ok(String::from_utf8(writer.into_inner()?)?)
}

fn rows(text: &str) -> anyhow::Result<Vec<Row>> {
    let mut reader =
        csv::ReaderBuilder::new().delimiter(between(text)).from_reader(text.as_bytes());
    let head = reader.headers()?;
    // A file with one line has no row that would lack one.
    let lacked = COLUMNS.into_iter().find(|column| head.iter().all(|name| name != *column));
    match lacked {
        Some(column) if !text.trim().is_empty() => bail!("there is no column {column}"),
        _ => Ok(reader.deserialize().collect::<csv::Result<_>>()?),
    }
}

/// What is between two columns.
fn between(text: &str) -> u8 {
    let head = text.lines().next().unwrap_or_default();
    head.bytes().find(|byte| BETWEEN.contains(byte)).unwrap_or(b',')
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::path::Path;

    use ft_transfer_area_simulator::SimulatedTxt;
    use tempfile::TempDir;

    use super::*;
    use crate::check;

    const TWO: &str = "\
name,lesson,passed,wrong_since,last_wrong
\"Zoë, 7b\",2,1,2,\"It is \"\"dark\"\", still.\"
Ben,4,1 2 3,0,
";

    fn file(text: impl AsRef<[u8]>) -> (TempDir, PathBuf) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("7b.csv");
        fs::write(&path, text).unwrap();
        (folder, path)
    }

    fn desks<const N: usize>(names: [&str; N]) -> [(&str, Desk); N] {
        names
            .map(|name| (name, check::desk("1", SimulatedTxt::builder(), name.to_owned()).unwrap()))
    }

    /// Goes on with these pupils, and writes how far they are.
    fn written(path: &Path, desks: &[(&str, Desk)]) -> String {
        let mut kept = Kept::go_on(path.to_owned(), desks).unwrap();
        kept.write(desks).unwrap();
        fs::read_to_string(path).unwrap()
    }

    #[test]
    fn the_next_start_goes_on_where_the_pupils_were() {
        let (_folder, path) = file(TWO);
        let desks = desks(["Zoë, 7b", "Ben"]);
        assert_eq!(written(&path, &desks), TWO);
        let [zoe, ben] = desks.map(|(_, desk)| desk.progress().unwrap());
        assert_eq!((zoe.lesson, zoe.passed, zoe.failed), (2, vec![1], 2));
        assert_eq!(zoe.wrong.unwrap().de, "It is \"dark\", still.");
        assert_eq!((ben.lesson, ben.passed, ben.failed), (4, vec![1, 2, 3], 0));
        assert_eq!(ben.wrong, None);
    }

    #[test]
    fn a_name_that_only_looks_the_same_is_that_pupils() {
        let (_folder, path) = file(TWO.replace("Zoë", "Zoe\u{308}").replace("Ben", "Ben "));
        let desks = desks(["Zoë, 7b", "Ben"]);
        assert_eq!(written(&path, &desks), TWO);
        assert_eq!(desks.map(|(_, desk)| desk.progress().unwrap().lesson), [2, 4]);
    }

    #[test]
    fn lessons_are_read_as_a_teacher_writes_them_or_refused() {
        let (_folder, path) = file(TWO.replace("1 2 3", "\"1, 2,3\""));
        let both = desks(["Zoë, 7b", "Ben"]);
        assert_eq!(written(&path, &both), TWO);
        let other = TWO.replace("1 2 3", "1 two");
        let (_folder, path) = file(&other);
        let refused = Kept::go_on(path.clone(), &desks(["Ben"])).map(drop).unwrap_err();
        assert!(format!("{refused:#}").contains("two is no lesson"), "{refused:#}");
        assert_eq!(fs::read_to_string(&path).unwrap(), other);
    }

    #[test]
    fn who_has_no_lesson_for_one_start_keeps_the_line() {
        let (_folder, path) = file(TWO);
        let first = desks(["New", "Zoë, 7b"]);
        assert_eq!(written(&path, &first), format!("{TWO}New,1,,0,\n"));
        let next = desks(["Ben"]);
        written(&path, &next);
        assert_eq!(next[0].1.progress().unwrap().lesson, 4);
    }

    #[test]
    fn a_table_that_a_spreadsheet_has_saved_is_read_and_stays_one() {
        let saved = format!("\u{feff}{}", TWO.replace(',', ";").replace('\n', "\r\n"));
        for (text, between) in [(saved.clone(), ";"), (saved.replace(';', "\t"), "\t")] {
            let text = text.replace(&format!("Zoë{between} 7b"), "Zoë");
            let (_folder, path) = file(text);
            let desks = desks(["Zoë", "Ben"]);
            let now = written(&path, &desks);
            let line = ["Ben", "4", "1 2 3", "0", ""].join(between);
            assert!(now.starts_with('\u{feff}') && now.contains(&line), "{now}");
            assert_eq!(desks[1].1.progress().unwrap().lesson, 4);
        }
    }

    #[test]
    fn what_can_t_be_read_gets_a_sentence_and_stays() {
        let no_utf8: &[u8] = b"name,lesson,passed,wrong_since,last_wrong\nZo\xEB,2,1,0,\n";
        let no_number = b"name,lesson,passed,wrong_since,last_wrong\nBen,two,1,0,\n";
        for text in [
            no_utf8,
            no_number,
            b"name,passed\nBen,1\n",
            b"milk, bread and eggs\n",
            b"name,lesson,passed",
        ] {
            let (_folder, path) = file(text);
            let refused = Kept::go_on(path.clone(), &desks(["Ben"])).err().unwrap();
            let said = format!("{refused:#}");
            assert!(said.contains("7b.csv") && said.contains("as CSV in UTF-8"), "{said}");
            assert_eq!(fs::read(&path).unwrap(), text);
        }
    }
}
