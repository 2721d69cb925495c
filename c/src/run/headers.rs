//! The headers, which are part of this program, and where the compiler finds them.

use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use include_dir::{include_dir, Dir};

use crate::kind::Kind;

static HEADERS: Dir = include_dir!("$CARGO_MANIFEST_DIR/include");

/// The folders with the headers of the kits; the first has those that lie in no folder.
const KITS: [&str; 5] = ["", "txt", "kit", "kit466", "fttxtlib"];
/// The folder with what programs use of Windows.
const WINDOWS: &str = "posix";
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

/// The headers as files, for one program.
pub(crate) struct Headers {
    /// Folders for the compiler that come before those of the program.
    pub(crate) folders: Vec<PathBuf>,
    /// The folder that comes last: a program may have headers with such names of its own.
    pub(crate) windows: Option<PathBuf>,
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
        let windows = (!cfg!(windows)).then(|| include.join(WINDOWS));
        let of_windows = if cfg!(windows) { BTreeMap::new() } else { placed(WINDOWS).collect() };
        let folders = kind.folders().iter().map(|folder| include.join(folder)).collect();
        Ok(Self { folders, windows, of_kit, of_windows })
    }

    /// Our header with this name.
    pub(crate) fn ours(&self, name: &str) -> Option<&Path> {
        self.of_kit.get(name).or_else(|| self.of_windows.get(name)).map(PathBuf::as_path)
    }
}
