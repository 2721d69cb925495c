//! In which folders the program looks for its dynamic libraries, and in which order: it gets those that it is linked with.
//!
//! The loader knows a library by the name in it, and takes it from the first folder that has a file of this name.

use std::ffi::OsString;
use std::fs::{self, File};
use std::path::{Path, PathBuf};

use object::elf::{FileHeader32, FileHeader64, DT_SONAME};
use object::read::elf::{ElfFile, FileHeader};
use object::{Endianness, FileKind, ReadCache};

use crate::link::folder_of;
use crate::read;
use crate::Sentence;

/// A dynamic library that a program is linked with.
pub(crate) struct Library {
    file: PathBuf,
    /// How the loader calls it.
    name: OsString,
}

impl Library {
    /// The one in this file; `None` if it is something else, such as an archive.
    fn of(file: &Path) -> Option<Self> {
        let parts = ReadCache::new(File::open(file).ok()?);
        let name = match FileKind::parse(&parts).ok()? {
            FileKind::Elf32 => name_in::<FileHeader32<Endianness>>(&parts)?,
            FileKind::Elf64 => name_in::<FileHeader64<Endianness>>(&parts)?,
            _ => return None,
        };
        let name = name.or_else(|| file.file_name().map(Into::into))?;
        Some(Self { file: file.to_owned(), name })
    }

    /// Whether the loader would take another file in this folder for it.
    fn is_hidden_by(&self, folder: &Path) -> bool {
        let place = |file: &Path| fs::canonicalize(file).ok();
        let other = place(&folder.join(&self.name));
        other.is_some() && other != place(&folder_of(&self.file).join(&self.name))
    }
}

/// The name in a library; `None` if that is none, `Some(None)` for one without a name.
fn name_in<Elf: FileHeader<Endian = Endianness>>(
    parts: &ReadCache<File>,
) -> Option<Option<OsString>> {
    let file = ElfFile::<Elf, &ReadCache<File>>::parse(parts).ok()?;
    let table = file.elf_section_table().dynamic_table(file.endian(), parts).ok()?;
    if table.is_empty() {
        return None;
    }
    let named = table.iter().find(|entry| entry.tag == DT_SONAME);
    let name = named.and_then(|entry| read::path(table.string(entry).ok()?));
    Some(name.map(PathBuf::into_os_string))
}

/// The dynamic libraries in what a linker says of the files that it takes (`--trace`), without those of the system and our
/// own.
pub(crate) fn taken(said: &[u8], own: &Path) -> Vec<Library> {
    let lines = said.split(|byte| *byte == b'\n').filter_map(|line| {
        let line = line.trim_ascii();
        // Older ones write `-lname (file)`.
        let inner = line.strip_prefix(b"-l").and_then(|line| line.strip_suffix(b")"));
        let file = inner.and_then(|line| line.splitn(2, |byte| *byte == b'(').nth(1));
        read::path(file.unwrap_or(line))
    });
    let others = lines.filter(|file| file != own && !is_of_system(file));
    others.filter_map(|file| Library::of(&file)).collect()
}

/// Whether the loader looks there without being told.
fn is_of_system(file: &Path) -> bool {
    let file = fs::canonicalize(file).unwrap_or_else(|_| file.to_owned());
    ["/lib", "/lib32", "/lib64", "/usr/lib", "/usr/lib32", "/usr/lib64"]
        .iter()
        .any(|folder| file.starts_with(folder))
}

/// Checks that no library is in this folder: the loader takes a `:` in its name for the end of the name.
fn check_needs_none_of(folder: &Path, libraries: &[Library]) -> Result<(), Sentence> {
    match libraries.iter().find(|library| folder_of(&library.file) == folder) {
        Some(library) => {
            let file = library.file.display();
            Err(format!("the program would not find {file}: no folder of a library may have a `:` in its name").into())
        }
        None => Ok(()),
    }
}

/// These folders, and those of the libraries, in an order in which none hides a library in another one. The error is a
/// library for which there is no such order.
pub(crate) fn folders(
    mut rest: Vec<PathBuf>,
    libraries: &[Library],
) -> Result<Vec<PathBuf>, Sentence> {
    rest.extend(libraries.iter().map(|library| folder_of(&library.file).to_owned()));
    let mut ordered: Vec<PathBuf> = Vec::new();
    while !rest.is_empty() {
        let hidden_by = |folder: &PathBuf| {
            let hidden = |it: &&Library| {
                rest.iter().any(|rest| rest == folder_of(&it.file)) && it.is_hidden_by(folder)
            };
            libraries.iter().find(hidden)
        };
        match rest.iter().position(|folder| hidden_by(folder).is_none()) {
            Some(place) => {
                let next = rest.remove(place);
                rest.retain(|folder| *folder != next);
                match next.as_os_str().as_encoded_bytes().contains(&b':') {
                    false => ordered.push(next),
                    true => check_needs_none_of(&next, libraries)?,
                }
            }
            None => {
                let library = rest.iter().find_map(hidden_by);
                let [file, folder] = [library.map(|it| &*it.file), rest.first().map(|it| &**it)]
                    .map(|path| path.unwrap_or(Path::new("")).display());
                return Err(format!(
                    "the program would not get {file}, with which it is linked: {folder} has another library with the \
                     same name"
                )
                .into());
            }
        }
    }
    Ok(ordered)
}
