//! What people call the terminals of a machine, in a small file. A name stands beside I1, never instead of it.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use anyhow::{anyhow, ensure, Context};
use ft_transfer_area::transfer_area::{MAX_AREAS, MAX_EXTENSIONS};
use ft_transfer_area_recorder::Column;
use serde::Serialize;
use toml::de::{DeTable, DeValue};

use crate::print;
use crate::text_file::{self, line_at};

/// How long a file may be, in bytes, and a name, in characters.
const FILE_MAX: u64 = 16 << 10;
const NAME_MAX: usize = 40;

/// The option of a command for one machine.
#[derive(clap::Args)]
pub(crate) struct File {
    /// Names for the terminals, in a TOML file
    #[arg(id = "names_file", long = "names", value_name = "FILE")]
    path: Option<PathBuf>,
}

/// The option of a command for several controllers.
#[derive(clap::Args)]
pub(crate) struct Files {
    /// Names for the terminals, in a TOML file; once for each HOST in order
    #[arg(id = "names_files", long = "names", value_name = "FILE")]
    paths: Vec<PathBuf>,
}

impl File {
    pub(crate) fn read(&self) -> anyhow::Result<Names> {
        self.path.as_deref().map_or_else(|| Ok(Names::default()), Names::load)
    }
}

impl Files {
    /// The names for so many controllers.
    pub(crate) fn read(&self, controllers: usize) -> anyhow::Result<Vec<Names>> {
        if self.paths.is_empty() {
            return Ok(vec![Names::default(); controllers]);
        }
        let given = self.paths.len();
        ensure!(
            given == controllers,
            "there are {controllers} controllers, but {given} times --names; give each controller a file, or none"
        );
        self.paths.iter().map(|path| Names::load(path)).collect()
    }
}

/// For each area that has some: names by terminal, such as I1.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
#[serde(transparent)]
pub(crate) struct Names(BTreeMap<usize, BTreeMap<String, String>>);

impl Names {
    fn load(path: &Path) -> anyhow::Result<Self> {
        let text = text_file::read(path, FILE_MAX).map_err(anyhow::Error::from);
        text.and_then(|text| Self::parse(&text)).with_context(|| path.display().to_string())
    }

    pub(crate) fn parse(text: &str) -> anyhow::Result<Self> {
        let wrong = |at: usize, reason: String| {
            anyhow!("line {} of the names is wrong: {reason}", line_at(text.as_bytes(), at))
        };
        let table = DeTable::parse(text).map_err(|error| {
            let reason = error.message().split_whitespace().collect::<Vec<_>>().join(" ");
            wrong(error.span().map_or(0, |span| span.start), reason)
        })?;
        let mut names = Self::default();
        for (key, terminals) in table.get_ref() {
            let area = area(key.get_ref()).map_err(|why| wrong(key.span().start, why))?;
            let terminals = terminals.get_ref().as_table().ok_or_else(|| {
                let why = format!("{}: expected a table, as in [master]", key.get_ref());
                wrong(key.span().start, why)
            })?;
            for (terminal, name) in terminals {
                let (terminal, name) =
                    entry(area, terminal.get_ref(), name.get_ref()).map_err(|why| {
                        wrong(terminal.span().start, format!("{}.{why}", key.get_ref()))
                    })?;
                names.0.entry(area).or_default().insert(terminal, name);
            }
        }
        Ok(names)
    }

    pub(crate) fn of(&self, area: usize, terminal: &str) -> Option<&str> {
        self.0.get(&area)?.get(terminal).map(String::as_str)
    }

    /// A terminal of a recording with its name, as in "E1.M2 (arm)".
    pub(crate) fn beside(&self, column: &Column) -> String {
        let full = column.to_string();
        let terminal = full.rsplit('.').next().unwrap_or_default();
        match self.of(column.area(), terminal) {
            Some(name) => format!("{full} ({name})"),
            None => full,
        }
    }

    /// A sentence about the master, in which its terminals have their names where they come first. What is between
    /// backquotes is code.
    pub(crate) fn in_sentence(&self, text: &str) -> String {
        let is_between = |one: char| !one.is_alphanumeric() && one != '_';
        let (mut told, mut is_code) = (BTreeSet::new(), false);
        let mut named = String::new();
        for piece in text.split_inclusive(is_between) {
            let word = piece.trim_end_matches(is_between);
            named += word;
            match self.of(0, word) {
                Some(name) if !is_code && told.insert(word) => named += &format!(" ({name})"),
                _ => {}
            }
            named += &piece[word.len()..];
            is_code ^= piece.ends_with('`');
        }
        named
    }

    /// All of them by what follows prefix and name in a topic of the bridge, such as "ext1/M2".
    pub(crate) fn by_topic(&self) -> BTreeMap<String, String> {
        let all = self.0.iter().flat_map(|(area, names)| names.iter().map(move |it| (*area, it)));
        let topic = |area: usize, terminal: &str| match area {
            0 => terminal.to_owned(),
            _ => format!("ext{area}/{terminal}"),
        };
        all.map(|(area, (terminal, name))| (topic(area, terminal), name.clone())).collect()
    }
}

/// The index of an area by the name of its table.
fn area(name: &str) -> Result<usize, String> {
    let found = (0..MAX_AREAS).find(|area| table_name(*area) == name);
    found.ok_or_else(|| {
        let name = name.escape_debug();
        format!(
            "{name}: there is no such table here; there are master and ext1 to ext{MAX_EXTENSIONS}"
        )
    })
}

fn table_name(area: usize) -> String {
    match area {
        0 => String::from("master"),
        _ => format!("ext{area}"),
    }
}

/// A terminal and its name, or what is wrong with them.
fn entry(area: usize, terminal: &str, name: &DeValue<'_>) -> Result<(String, String), String> {
    // Only as it is printed on the box.
    let place = if area == 0 { terminal.to_owned() } else { format!("E{area}.{terminal}") };
    if !place.parse::<Column>().is_ok_and(|column| column.to_string() == place) {
        let shown = terminal.escape_debug();
        return Err(format!(
            "{shown}: there is no such terminal; there are I1 to I8, C1 to C4, M1 to M4 and O1 to O8"
        ));
    }
    let expected =
        || format!("{terminal}: expected a name, as in {terminal} = \"barrier at the gate\"");
    let name = name.as_str().map(str::trim).filter(|name| !name.is_empty()).ok_or_else(expected)?;
    if name.chars().count() > NAME_MAX {
        return Err(format!("{terminal}: a name has at most {NAME_MAX} characters"));
    }
    if print::clean(name) != name {
        return Err(format!("{terminal}: a name is one line, without control characters"));
    }
    Ok((terminal.to_owned(), name.to_owned()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_stands_beside_its_terminal() {
        let text = "# a press\n[master]\nI1 = \"barrier at the gate\"\nO8 = \" lamp \"\n[ext8]\nM2 = \"Größe = 5\"\n";
        let names = Names::parse(text).unwrap();
        let beside = |column: &str| names.beside(&column.parse().unwrap());
        let expected =
            ["I1 (barrier at the gate)", "O8 (lamp)", "E8.M2 (Größe = 5)", "M2", "E8.I1"];
        assert_eq!(["I1", "O8", "E8.M2", "M2", "E8.I1"].map(beside), expected);
        assert_eq!(Names::parse("").unwrap(), Names::default());
    }

    #[test]
    fn a_sentence_has_each_name_once_and_code_has_none() {
        let names =
            Names::parse("[master]\nI1 = \"door\"\nM1 = \"Tür\"\n[ext1]\nI2 = \"a\"").unwrap();
        for (text, expected) in [
            ("I1 opens.", "I1 (door) opens."),
            ("M1, I1; M1.", "M1 (Tür), I1 (door); M1."),
            ("bis I1", "bis I1 (door)"),
            (
                "I2, I11, xI1, I1_a and `M1` – über M1",
                "I2, I11, xI1, I1_a and `M1` – über M1 (Tür)",
            ),
            ("", ""),
        ] {
            assert_eq!(names.in_sentence(text), expected);
        }
        let topics: Vec<_> = names.by_topic().into_keys().collect();
        assert_eq!(topics, ["I1", "M1", "ext1/I2"]);
    }

    #[test]
    fn a_mistake_is_told_with_its_line_and_key() {
        let long = format!("[ext1]\nI1 = \"{}\"", "ß".repeat(41));
        for (text, expected) in [
            // The words are the parser's.
            ("[master\n", "line 1 of the names is wrong: "),
            ("[master]\nI1 = \"a\"\nI1 = \"b\"", "line 3 of the names is wrong: "),
            ("\n[boss]\n", "line 2 of the names is wrong: boss: there is no such table here; there are master and ext1"),
            ("[ext9]\n", "line 1 of the names is wrong: ext9: there is no such table"),
            ("I1 = \"a\"", "line 1 of the names is wrong: I1: there is no such table"),
            ("master = 1", "line 1 of the names is wrong: master: expected a table, as in [master]"),
            ("[master]\n\nI9 = \"a\"", "line 3 of the names is wrong: master.I9: there is no such terminal; there are I1"),
            ("[ext2]\ni1 = \"a\"", "line 2 of the names is wrong: ext2.i1: there is no such terminal"),
            ("[master]\n\"TXT.I1\" = \"a\"", "line 2 of the names is wrong: master.TXT.I1: there is no such"),
            ("[master]\nI1 = 5", "line 2 of the names is wrong: master.I1: expected a name, as in I1 = \"barrier"),
            ("[master]\nI1 = \" \"", "line 2 of the names is wrong: master.I1: expected a name"),
            ("[master]\nM1 = \"a\\nb\"", "line 2 of the names is wrong: master.M1: a name is one line"),
            (&long, "line 2 of the names is wrong: ext1.I1: a name has at most 40 characters"),
        ] {
            let error = format!("{:#}", Names::parse(text).unwrap_err());
            assert!(error.starts_with(expected), "{text:?}: {error}");
        }
    }
}
