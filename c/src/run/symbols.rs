//! The functions in compiled files that show how a program begins.

use std::collections::BTreeSet;
use std::fs::File;
use std::path::{Path, PathBuf};

use object::{Object, ObjectSymbol, ReadCache};

use crate::Sentence;

/// How a program begins.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Entry {
    Main,
    PrgTic,
}

/// How a program ends at once. It may have a function of its own with the name of one of these.
pub(crate) const ENDS: [&str; 2] = ["exit", "quick_exit"];

/// How often each function is there.
#[derive(Debug, Default)]
pub(crate) struct Found {
    main: Vec<PathBuf>,
    tic: Vec<PathBuf>,
    init: Vec<PathBuf>,
    /// Which of [`ENDS`] are the program's own.
    pub(crate) own_ends: BTreeSet<&'static str>,
}

impl Found {
    /// In these compiled files. The paths beside them are the sources, for sentences.
    pub(crate) fn in_all(compiled: &[(PathBuf, PathBuf)]) -> Result<Self, Sentence> {
        let mut found = Self::default();
        for (source, object) in compiled {
            found.add(source, object)?;
        }
        Ok(found)
    }

    fn add(&mut self, source: &Path, object: &Path) -> Result<(), Sentence> {
        // It may be large.
        let parts = ReadCache::new(File::open(object)?);
        let file = object::File::parse(&parts).map_err(|error| {
            format!("what the compiler has made of {} is unknown: {error}", source.display())
        })?;
        for symbol in file.symbols().filter(|symbol| symbol.is_definition() && symbol.is_global()) {
            let Ok(name) = symbol.name() else { continue };
            self.own_ends.extend(ENDS.iter().find(|end| **end == name));
            let places = match name.strip_prefix('_').unwrap_or(name) {
                "main" | "wmain" => &mut self.main,
                "PrgTic" => &mut self.tic,
                "PrgInit" => &mut self.init,
                _ => continue,
            };
            places.push(source.to_owned());
        }
        Ok(())
    }

    /// How the program begins. With archives `main` may be in one of them.
    pub(crate) fn entry(&self, has_archives: bool) -> Result<Entry, String> {
        let names = |files: &[PathBuf]| {
            let names: Vec<String> = files.iter().map(|file| file.display().to_string()).collect();
            names.join(" and ")
        };
        let Self { main, tic, init, .. } = self;
        match (main.len(), tic.len(), init.len()) {
            (0, 0, 0) if has_archives => Ok(Entry::Main),
            (0, 0, 0) => Err("there is neither PrgTic nor main in the program".into()),
            (0, 0, _) => Err(format!("{} has PrgInit, but there is no PrgTic", names(init))),
            (0, 2.., _) => Err(format!("there is more than one PrgTic: in {}", names(tic))),
            (0, 1, 0) => Err(format!("{} has PrgTic, but there is no PrgInit", names(tic))),
            (0, 1, 1) => Ok(Entry::PrgTic),
            (0, 1, _) => Err(format!("there is more than one PrgInit: in {}", names(init))),
            (1, 0, _) => Ok(Entry::Main),
            (1.., 1.., _) => Err(format!(
                "there is PrgTic in {} and main in {}, and a program begins with one of them",
                names(tic),
                names(main)
            )),
            (2.., 0, _) => Err(format!("there is more than one main: in {}", names(main))),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entry_of(main: usize, tic: usize, init: usize) -> Result<Entry, String> {
        let files = |number| (0..number).map(|index| PathBuf::from(format!("{index}.c"))).collect();
        let (main, tic, init) = (files(main), files(tic), files(init));
        Found { main, tic, init, ..Found::default() }.entry(false)
    }

    #[test]
    fn a_program_begins_with_main_or_prg_tic_and_with_one_of_them() {
        assert_eq!(entry_of(1, 0, 0), Ok(Entry::Main));
        assert_eq!(entry_of(0, 1, 1), Ok(Entry::PrgTic));
        for (main, tic, init) in
            [(0, 0, 0), (0, 0, 1), (0, 1, 0), (0, 1, 2), (0, 2, 1), (1, 1, 1), (2, 0, 0)]
        {
            assert!(entry_of(main, tic, init).is_err(), "{main} {tic} {init}");
        }
        assert!(entry_of(0, 2, 2).unwrap_err().ends_with("more than one PrgTic: in 0.c and 1.c"));
    }
}
