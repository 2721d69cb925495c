//! The headers, which are part of this program, and where the compiler finds them.

use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use include_dir::{include_dir, Dir};

use crate::copies::write_include;
use crate::kind::Kind;

static HEADERS: Dir = include_dir!("$CARGO_MANIFEST_DIR/include");

/// The folders with the headers of the kits; the first has those that lie in no folder.
const KITS: [&str; 5] = ["", "txt", "kit", "kit466", "fttxtlib"];
/// The folder with what programs use of Windows.
const WINDOWS: &str = "posix";
/// The folder in those of the kits that programs name.
const OF_PROGRAMS: &str = "Common";
/// A header with this name may also be something of the program's own.
pub(crate) const COMMON: &str = "common.h";

/// Whether a kit has a header with this name, which is in lower case. `common.h` does not count.
pub(crate) fn is_of_a_kit(name: &str) -> bool {
    name != COMMON && KITS.iter().any(|folder| names_in(folder).any(|(of_kit, _)| of_kit == name))
}

/// The names of the headers in a folder in lower case, and where they lie among all headers.
fn names_in(folder: &str) -> impl Iterator<Item = (String, &'static Path)> {
    let folder = if folder.is_empty() { Some(&HEADERS) } else { HEADERS.get_dir(folder) };
    folder.into_iter().flat_map(Dir::files).map(|file| {
        let name = file.path().file_name().unwrap_or_default();
        (name.to_string_lossy().to_lowercase(), file.path())
    })
}

/// Makes a folder for the compiler with the headers of this one and of those in it for programs. The others that lie around
/// it, such as `posix`, may be names of the program's own.
fn search(folder: &str, include: &Path, to: PathBuf) -> io::Result<PathBuf> {
    for name in [folder, &format!("{folder}/{OF_PROGRAMS}")] {
        let place = if name == folder { to.clone() } else { to.join(OF_PROGRAMS) };
        let is_first = |header: &str| name != folder || header != COMMON;
        for (_, at) in names_in(name).filter(|(header, _)| is_first(header)) {
            fs::create_dir_all(&place)?;
            let file = at.file_name().unwrap_or_default();
            write_include(&place.join(file), &include.join(at))?;
        }
    }
    Ok(to)
}

/// The headers as files, for one program.
pub(crate) struct Headers {
    /// Folders for the compiler that come before those of the program.
    pub(crate) folders: Vec<PathBuf>,
    /// The folder that comes last: a program may have headers with such names of its own.
    pub(crate) last: PathBuf,
    /// Where headers lie, by their names in lower case.
    pub(crate) of_kit: BTreeMap<String, PathBuf>,
    of_windows: BTreeMap<String, PathBuf>,
}

impl Headers {
    /// Writes the headers of a kind into the build folder.
    pub(crate) fn write(kind: Kind, build: &Path) -> io::Result<Self> {
        let include = build.join("include");
        fs::create_dir(&include)?;
        HEADERS.extract(&include)?;
        let placed = |folder: &str| names_in(folder).map(|(name, at)| (name, include.join(at)));
        let mut of_kit = BTreeMap::new();
        for (name, place) in kind.folders().iter().flat_map(|folder| placed(folder)) {
            of_kit.entry(name).or_insert(place);
        }
        let of_windows = if cfg!(windows) { BTreeMap::new() } else { placed(WINDOWS).collect() };
        let searched = build.join("searched");
        let in_order = kind.folders().iter().enumerate();
        let folders = in_order
            .map(|(number, folder)| search(folder, &include, searched.join(number.to_string())))
            .collect::<io::Result<_>>()?;
        let last = searched.join(WINDOWS);
        fs::create_dir_all(&last)?;
        if !cfg!(windows) {
            search(WINDOWS, &include, last.clone())?;
        }
        if let Some(common) = of_kit.get(COMMON) {
            write_include(&last.join(COMMON), common)?;
        }
        Ok(Self { folders, last, of_kit, of_windows })
    }

    /// Our header with this name.
    pub(crate) fn ours(&self, name: &str) -> Option<&Path> {
        self.of_kit.get(name).or_else(|| self.of_windows.get(name)).map(PathBuf::as_path)
    }
}
