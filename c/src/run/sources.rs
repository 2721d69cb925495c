//! What sources include, as far as their text tells it.

use std::collections::BTreeSet;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// An include in a source.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Include {
    /// As it is written, such as `../Common/ROBO_TX_PRG.H`.
    pub(crate) written: String,
    /// The program's own file that is meant, when there is one.
    pub(crate) file: Option<PathBuf>,
}

impl Include {
    /// The header's name, without folders.
    pub(crate) fn name(&self) -> &str {
        self.written.rsplit(['/', '\\']).next().unwrap_or_default()
    }
}

/// Everything that these sources include, also by files of the program that they include.
#[derive(Debug, Default)]
pub(crate) struct Included {
    pub(crate) includes: BTreeSet<Include>,
    /// The program's own files, the sources too.
    pub(crate) files: BTreeSet<PathBuf>,
}

impl Included {
    pub(crate) fn by(sources: &[PathBuf]) -> Result<Self, (PathBuf, io::Error)> {
        let mut included = Self::default();
        for source in sources {
            included.add(source).map_err(|error| (source.clone(), error))?;
        }
        Ok(included)
    }

    fn add(&mut self, file: &Path) -> io::Result<()> {
        if !self.files.insert(file.to_owned()) {
            return Ok(());
        }
        let text = fs::read(file)?;
        for (written, quoted) in includes(&String::from_utf8_lossy(&text)) {
            let beside = file.parent().unwrap_or(Path::new("")).join(written.replace('\\', "/"));
            let found = (quoted && beside.is_file()).then_some(beside);
            if let Some(own) = &found {
                // A header that can't be read is the compiler's to complain about.
                let _ = self.add(own);
            }
            self.includes.insert(Include { written, file: found });
        }
        Ok(())
    }
}

/// The names in `#include` lines, and whether they are quoted. A line in a comment counts too: it does no harm.
fn includes(text: &str) -> Vec<(String, bool)> {
    let name = |line: &str| {
        let rest = line.trim_start().strip_prefix('#')?.trim_start().strip_prefix("include")?;
        let rest = rest.trim_start();
        let quoted = rest.starts_with('"');
        let rest = rest.strip_prefix(['"', '<'])?;
        let end = rest.find(if quoted { '"' } else { '>' })?;
        Some((rest[..end].trim().to_owned(), quoted))
    };
    text.lines().filter_map(name).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_ways_to_write_an_include_are_read() {
        let text = "#include \"a.h\"\n  # include <b/c.h> /* why */\r\n#include\"..\\D.H\"\n\
                    #include MACRO\n#define X \"x.h\"\n";
        let expected = [("a.h", true), ("b/c.h", false), ("..\\D.H", true)];
        assert_eq!(includes(text), expected.map(|(name, quoted)| (name.to_owned(), quoted)));
    }

    #[test]
    fn files_of_the_program_are_followed_once() {
        let folder = tempfile::tempdir().unwrap();
        let write = |name: &str, text: &str| {
            let path = folder.path().join(name);
            fs::write(&path, text).unwrap();
            path
        };
        let source = write("a.c", "#include \"a.h\"\n#include \"ROBO_TX_PRG.H\"\n");
        let header = write("a.h", "#include \"a.h\"\n#include <math.h>\n");
        let included = Included::by(std::slice::from_ref(&source)).unwrap();
        assert_eq!(included.files, BTreeSet::from([source, header.clone()]));
        let names: Vec<&str> = included.includes.iter().map(Include::name).collect();
        assert_eq!(names, ["ROBO_TX_PRG.H", "a.h", "math.h"]);
        assert_eq!(included.includes.iter().find_map(|it| it.file.clone()), Some(header));
        let missing = folder.path().join("b.c");
        assert_eq!(Included::by(std::slice::from_ref(&missing)).unwrap_err().0, missing);
    }
}
