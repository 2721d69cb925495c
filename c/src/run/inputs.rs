//! The files of a program: sources, and what is linked to them.

use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};

use crate::Sentence;

/// A language of sources.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Language {
    C,
    Cpp,
}

impl Language {
    /// That of a source by its name; `None` for another file.
    pub(crate) fn of(file: &Path) -> Option<Self> {
        let name = file.file_name().unwrap_or_default().to_string_lossy();
        let is_capital = !name.contains(char::is_lowercase);
        match file.extension().and_then(OsStr::to_str)? {
            "c" => Some(Self::C),
            // `STOPGO.C` is a name from Windows, `StopGo.C` is C++.
            "C" if is_capital => Some(Self::C),
            "cpp" | "cc" | "cxx" | "c++" | "C" | "CPP" => Some(Self::Cpp),
            _ => None,
        }
    }
}

/// A source, as it is named, and its language.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Source {
    pub(crate) path: PathBuf,
    pub(crate) language: Language,
}

/// What the command line names.
#[derive(Debug, Default, PartialEq, Eq)]
pub(crate) struct Inputs {
    /// The name of the program: that of the first source or folder. A folder `src` is called like the one that it is
    /// in.
    pub(crate) name: String,
    pub(crate) sources: Vec<Source>,
    /// Compiled files.
    pub(crate) objects: Vec<PathBuf>,
    /// Archives and dynamic libraries, in the order in which they are linked.
    pub(crate) archives: Vec<PathBuf>,
}

impl Inputs {
    pub(crate) fn of(files: &[PathBuf]) -> Result<Self, Sentence> {
        let mut inputs = Self::default();
        for file in files {
            let file = &as_no_option(file.clone());
            if file.is_dir() {
                let sources = sources_in(file)?;
                inputs.call(|| {
                    let folder = fs::canonicalize(file).unwrap_or_else(|_| file.clone());
                    let above = folder.parent().filter(|it| it.file_name().is_some());
                    match above {
                        Some(above) if folder.ends_with("src") => above.to_owned(),
                        _ => folder,
                    }
                });
                inputs.sources.extend(sources);
            } else if file.exists() && !file.is_file() {
                // It would be read twice, and a pipe without a writer never ends.
                return Err(format!("{} is neither a file nor a folder", file.display()).into());
            } else if let Some(language) = Language::of(file) {
                inputs.call(|| file.clone());
                inputs.sources.push(Source { path: file.clone(), language });
            } else {
                inputs.add_linked(file)?;
            }
        }
        if inputs.name.is_empty() {
            inputs.name = "program".into();
        }
        let mut named: Vec<&Path> = inputs.sources.iter().map(|source| &*source.path).collect();
        named.sort();
        match named.windows(2).find(|pair| pair[0] == pair[1]) {
            Some(twice) => Err(format!("{} is named twice", twice[0].display()).into()),
            None => Ok(inputs),
        }
    }

    fn call(&mut self, path: impl FnOnce() -> PathBuf) {
        if self.name.is_empty() {
            self.name = path().file_stem().unwrap_or_default().to_string_lossy().into_owned();
        }
    }

    fn add_linked(&mut self, file: &Path) -> Result<(), Sentence> {
        let places = match kind_of_linked(file) {
            Some(Linked::Object) => &mut self.objects,
            Some(Linked::Archive) => &mut self.archives,
            None if file.extension().is_none() && !file.exists() => {
                return Err(format!("there is no folder {}", file.display()).into());
            }
            None => {
                return Err(format!(
                    "{} is neither a source (.c, .cpp, .cc or .cxx) nor something to link (.o, .a or .so)",
                    file.display()
                )
                .into());
            }
        };
        // The linker would say it less clearly.
        fs::File::open(file)
            .map_err(|error| format!("{} can't be read: {error}", file.display()))?;
        places.push(file.to_owned());
        Ok(())
    }
}

enum Linked {
    Object,
    Archive,
}

fn kind_of_linked(file: &Path) -> Option<Linked> {
    let name = file.file_name()?.to_string_lossy();
    match file.extension().and_then(OsStr::to_str) {
        Some("o" | "obj") => Some(Linked::Object),
        Some("a" | "lib" | "so" | "dylib" | "dll") => Some(Linked::Archive),
        // `libjsoncpp.so.25`.
        _ if name.contains(".so.") => Some(Linked::Archive),
        _ => None,
    }
}

/// The sources directly in a folder, by their names. Below it there may be tests and other programs.
fn sources_in(folder: &Path) -> Result<Vec<Source>, Sentence> {
    let unreadable = |error| format!("{} can't be read: {error}", folder.display());
    let mut sources = Vec::new();
    for entry in fs::read_dir(folder).map_err(unreadable)? {
        let path = entry.map_err(unreadable)?.path();
        let is_hidden = path.file_name().is_some_and(|name| name.as_encoded_bytes()[0] == b'.');
        match Language::of(&path) {
            // A link to a file that is gone is not left out: it can't be read then.
            Some(language) if (path.is_file() || !path.exists()) && !is_hidden => {
                sources.push(Source { path: as_no_option(without_dot(path)), language });
            }
            _ => {}
        }
    }
    if sources.is_empty() {
        return Err(format!(
            "there is no source in {}; those in the folders below it are not taken, so name these folders, too",
            folder.display()
        )
        .into());
    }
    sources.sort_by(|one, other| one.path.cmp(&other.path));
    Ok(sources)
}

/// `main.cpp` for `./main.cpp`, as people write it.
fn without_dot(path: PathBuf) -> PathBuf {
    path.strip_prefix(".").map(Path::to_owned).unwrap_or(path)
}

/// `./-w.c` for `-w.c`: compilers would take the name for an option, or `@a.c` for a file with options.
fn as_no_option(path: PathBuf) -> PathBuf {
    let is_option = matches!(path.as_os_str().as_encoded_bytes().first(), Some(b'-' | b'@'));
    if is_option {
        Path::new(".").join(path)
    } else {
        path
    }
}

#[cfg(test)]
mod tests {
    use std::slice;

    use super::*;

    fn inputs(files: &[PathBuf]) -> Result<Inputs, String> {
        Inputs::of(files).map_err(|error| error.to_string())
    }

    #[test]
    fn files_are_told_apart_by_their_names() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        for name in ["b.cpp", "A.c", "lib.so.2", "x.o", "y.a", "z.so", "notes.txt", ".c.c"] {
            fs::write(at(name), "").unwrap();
        }
        fs::create_dir_all(at("below.c")).unwrap();
        fs::write(at("below.c/other.c"), "").unwrap();
        let all = inputs(&[folder.path().to_owned(), at("y.a"), at("z.so"), at("x.o")]).unwrap();
        let sources: Vec<_> = all.sources.iter().map(|it| (it.path.clone(), it.language)).collect();
        assert_eq!(sources, [(at("A.c"), Language::C), (at("b.cpp"), Language::Cpp)]);
        assert_eq!((all.objects, all.archives), (vec![at("x.o")], vec![at("y.a"), at("z.so")]));
        assert_eq!(all.name, folder.path().file_stem().unwrap().to_string_lossy());
        assert_eq!(inputs(&[at("lib.so.2"), at("b.cpp")]).unwrap().name, "b");
    }

    #[test]
    fn a_folder_src_is_called_like_the_one_that_it_is_in() {
        let folder = tempfile::tempdir().unwrap();
        let src = folder.path().join("gate/src");
        fs::create_dir_all(&src).unwrap();
        fs::write(src.join("main.cpp"), "").unwrap();
        assert_eq!(inputs(slice::from_ref(&src)).unwrap().name, "gate");
        assert_eq!(inputs(&[src.join("main.cpp")]).unwrap().name, "main");
    }

    #[test]
    fn what_can_not_be_used_is_named_in_a_sentence() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::write(at("a.txt"), "").unwrap();
        assert!(inputs(&[at("a.txt")]).unwrap_err().contains("a.txt is neither a source"));
        assert!(inputs(&[at("a.o")]).unwrap_err().contains("a.o can't be read"));
        assert!(inputs(&[at("src")]).unwrap_err().contains("there is no folder"));
        assert!(inputs(&[folder.path().into()]).unwrap_err().contains("there is no source in"));
        assert!(inputs(&[at("a.c"), at("a.c")]).unwrap_err().contains("named twice"));
    }
}
