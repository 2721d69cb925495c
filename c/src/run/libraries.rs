//! In which folders the program looks for its dynamic libraries, and in which order: it gets those that it is linked with.
//!
//! The loader knows a library by the name in it, and takes it from the first folder that has a file of this name.

use std::collections::BTreeSet;
use std::ffi::OsString;
use std::fmt::Display;
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::Command;

use object::elf::{
    FileHeader32, FileHeader64, DT_SONAME, STB_LOCAL, STT_FUNC, STT_GNU_IFUNC, STT_NOTYPE,
};
use object::read::elf::{ElfFile, FileHeader, ProgramHeader, Sym};
use object::{Endianness, FileKind, ReadCache};

use crate::link::folder_of;
use crate::read;
use crate::say;
use crate::signals;
use crate::Sentence;

/// Where the system has its libraries.
const SYSTEM: [&str; 6] = ["/lib", "/lib32", "/lib64", "/usr/lib", "/usr/lib32", "/usr/lib64"];
/// How many functions are told.
const MOST_NAMES: usize = 10;
/// How the parts of a C library begin.
const OF_C: [&str; 6] = ["libc.so", "libm.so", "libpthread.so", "libdl.so", "librt.so", "ld-"];

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
        let other = fs::canonicalize(folder.join(&self.name)).ok();
        other.is_some() && other != self.place()
    }

    /// Where the file is that the loader has to take.
    fn place(&self) -> Option<PathBuf> {
        fs::canonicalize(folder_of(&self.file).join(&self.name)).ok()
    }

    /// Whether this file, which the loader takes, is the one.
    fn is(&self, file: &Path) -> bool {
        let file = fs::canonicalize(file).ok();
        file.is_some() && (file == self.place() || file == fs::canonicalize(&self.file).ok())
    }

    /// The file, if it is one of the system's.
    #[cfg(target_os = "linux")]
    pub(crate) fn file_of_system(&self) -> Option<&Path> {
        self.is_of_system().then_some(&*self.file)
    }

    /// Whether the loader finds it without being told of a folder. It is itself a part of the C library.
    fn is_of_system(&self) -> bool {
        let name = self.name.to_string_lossy();
        OF_C.iter().any(|part| name.starts_with(part)) || is_in_system(&self.file)
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

/// Functions of a dynamic library.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Which {
    Own,
    /// From other libraries.
    #[cfg_attr(not(target_os = "linux"), allow(dead_code, reason = "nobody asks for them"))]
    Needed,
}

/// The names of these functions.
pub(crate) fn functions_of(library: &Path, which: Which) -> Result<BTreeSet<Vec<u8>>, Sentence> {
    let parts = ReadCache::new(File::open(library)?);
    let names = match FileKind::parse(&parts) {
        Ok(FileKind::Elf32) => functions::<FileHeader32<Endianness>>(&parts, which),
        Ok(FileKind::Elf64) => functions::<FileHeader64<Endianness>>(&parts, which),
        _ => return Ok(BTreeSet::new()),
    };
    names.map_err(|error| format!("{} can't be read: {error}", library.display()).into())
}

fn functions<Elf: FileHeader<Endian = Endianness>>(
    parts: &ReadCache<File>,
    which: Which,
) -> object::Result<BTreeSet<Vec<u8>>> {
    let file = ElfFile::<Elf, &ReadCache<File>>::parse(parts)?;
    let (endian, table) = (file.endian(), file.elf_dynamic_symbol_table());
    let functions = table.iter().filter(|symbol| {
        let is_own = !symbol.is_undefined(endian);
        // What is needed often has no type.
        let is_function = [STT_FUNC, STT_GNU_IFUNC].contains(&symbol.st_type())
            || (!is_own && symbol.st_type() == STT_NOTYPE);
        is_function && symbol.st_bind() != STB_LOCAL && is_own == (which == Which::Own)
    });
    let names = functions.map(|symbol| symbol.name(endian, table.strings()));
    names.map(|name| name.map(<[u8]>::to_vec)).collect()
}

/// The dynamic libraries in what a linker says of the files that it takes (`--trace`), without our own.
pub(crate) fn taken(said: &[u8], own: &Path) -> Vec<Library> {
    let lines = said.split(|byte| *byte == b'\n').filter_map(|line| {
        // mold writes `trace: file`.
        let line = line.strip_prefix(b"trace: ").unwrap_or(line).trim_ascii();
        // Older ones write `-lname (file)`.
        let inner = line.strip_prefix(b"-l").and_then(|line| line.strip_suffix(b")"));
        let file = inner.and_then(|line| line.splitn(2, |byte| *byte == b'(').nth(1));
        read::path(file.unwrap_or(line))
    });
    lines.filter(|file| file != own).filter_map(|file| Library::of(&file)).collect()
}

/// The dynamic libraries among these files, and those with these names in the first folder that has one, as linkers take them
/// that do not say it.
pub(crate) fn named(files: &[PathBuf], names: &[PathBuf], folders: &[PathBuf]) -> Vec<Library> {
    let first = |name: &PathBuf| {
        let name = name.to_string_lossy();
        let files = match name.strip_prefix(':') {
            Some(file) => vec![file.to_owned()],
            None => ["so", "a"].map(|ending| format!("lib{name}.{ending}")).into(),
        };
        let all = folders.iter().flat_map(|folder| files.iter().map(|file| folder.join(file)));
        all.into_iter().find(|file| file.is_file())
    };
    let found = files.iter().cloned().chain(names.iter().filter_map(first));
    found.filter_map(|file| Library::of(&file)).collect()
}

/// Whether the loader looks in the folder of this file without being told. The compiler's own folder has links to there.
fn is_in_system(file: &Path) -> bool {
    let is_there = |file: &Path| {
        let folder = folder_of(file);
        // Each processor may have one of its own, such as `x86_64-linux-gnu`. Others are for those who name them.
        let name = folder.file_name().unwrap_or_default().to_string_lossy();
        let around = if name.contains("-linux-") { folder_of(folder) } else { folder };
        SYSTEM.iter().any(|place| around == Path::new(place))
    };
    is_there(file) || fs::canonicalize(file).is_ok_and(|file| is_there(&file))
}

/// Whether this file is there or below, as one for a newer processor.
fn is_below_system(file: &Path) -> bool {
    let file = fs::canonicalize(file).unwrap_or_else(|_| file.to_owned());
    SYSTEM.iter().any(|place| file.starts_with(place))
}

/// Whether the loader takes this for a folder: a `:` is the end of a name for it, and these words mean others.
fn is_for_loader(folder: &Path) -> bool {
    let folder = std::path::absolute(folder).unwrap_or_else(|_| folder.to_owned());
    let name = folder.to_string_lossy();
    !["$ORIGIN", "$LIB", "$PLATFORM", "${", ":"].iter().any(|part| name.contains(part))
}

/// Checks that no library is in this folder, which the loader would not find.
fn check_needs_none_of(folder: &Path, libraries: &[&Library]) -> Result<(), Sentence> {
    match libraries.iter().find(|library| folder_of(&library.file) == folder) {
        Some(library) => {
            let file = library.file.display();
            Err(format!("the program would not find {file}: no folder of a library may have a `:`, or a word such as $LIB, in its name").into())
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
    let libraries: Vec<&Library> = libraries.iter().filter(|it| !it.is_of_system()).collect();
    rest.extend(libraries.iter().map(|library| folder_of(&library.file).to_owned()));
    let mut ordered: Vec<PathBuf> = Vec::new();
    while !rest.is_empty() {
        let hidden_by = |folder: &PathBuf| {
            let hidden = |it: &&Library| {
                rest.iter().any(|rest| rest == folder_of(&it.file)) && it.is_hidden_by(folder)
            };
            libraries.iter().copied().find(hidden)
        };
        let Some(place) = rest.iter().position(|folder| hidden_by(folder).is_none()) else {
            let hides = rest.iter().find_map(|folder| Some((hidden_by(folder)?, folder)));
            return hides.map_or(Ok(ordered), |(library, folder)| {
                let other = folder.join(&library.name);
                Err(other_library(library.file.display(), other.display()))
            });
        };
        let next = rest.remove(place);
        rest.retain(|folder| *folder != next);
        match is_for_loader(&next) {
            true => ordered.push(next),
            false => check_needs_none_of(&next, &libraries)?,
        }
    }
    Ok(ordered)
}

fn other_library(file: impl Display, other: impl Display) -> Sentence {
    format!(
        "the program would not get {file}, with which it is linked: {other} is another library with the same name"
    )
    .into()
}

/// Checks that the loader takes no other library than the linker, which has taken these. In our folders, which are those
/// that the user has named, with the one of our own library, it may find another one first; and the system's, where the
/// folder of one that was taken has no file of its name. What the user's own options and variables lead to is meant.
pub(crate) fn check(
    program: &Path,
    libraries: &[Library],
    folders: &[PathBuf],
    own: &Path,
) -> Result<(), Sentence> {
    let ours = folder_of(own);
    let Some(loader) = loader_of(program) else { return Ok(()) };
    // Where it can't be started, as for another processor, the start tells why.
    let listed = signals::output_of(Command::new(loader).arg("--list").arg(program));
    let Ok(said) = listed else { return Ok(()) };
    let mut is_behind_ours = false;
    for (name, file) in said.stdout.split(|byte| *byte == b'\n').filter_map(found) {
        let is_ours = is_same(folder_of(&file), ours) && !is_in_system(&file);
        let is_led = is_ours || folders.iter().any(|folder| is_same(folder_of(&file), folder));
        let taken = libraries.iter().find(|library| *library.name == *name);
        let is_wrong = match taken {
            Some(taken) if taken.is(&file) => false,
            Some(taken) if taken.is_of_system() => is_led,
            // One that is only for the linker.
            Some(taken) if taken.place().is_none() => is_below_system(&file),
            // Our own library needs those of the compiler, too.
            Some(_) => is_led || (is_below_system(&file) && !is_of_each_program(&name)),
            None => is_ours && is_of_each_program(&name),
        };
        if is_wrong {
            let meant = taken.map_or(name, |taken| taken.file.clone());
            return Err(other_library(meant.display(), file.display()));
        }
        if is_behind_ours && !is_ours && !is_in_system(&file) {
            tell_common_names(&file, own)?;
        }
        is_behind_ours |= is_same(&file, own);
    }
    Ok(())
}

/// Tells in place of which functions of a library ours are called, often by itself, too: the loader finds them first.
fn tell_common_names(file: &Path, own: &Path) -> Result<(), Sentence> {
    let [its, ours] = [file, own].map(|library| functions_of(library, Which::Own));
    let (its, ours) = (its?, ours?);
    let common = its.intersection(&ours).take(MOST_NAMES);
    let names: Vec<_> = common.map(|name| String::from_utf8_lossy(name)).collect();
    if !names.is_empty() {
        let names = names.join(", ");
        say(&format!(
            "in place of functions of {} those of ftMscLib are called, which have the same names: {names}",
            file.display()
        ));
    }
    Ok(())
}

/// Whether each program is linked with this library, without being told.
fn is_of_each_program(name: &Path) -> bool {
    let of_compiler = ["libgcc_s.so", "libstdc++.so", "libc++.so"];
    let name = name.to_string_lossy();
    OF_C.iter().chain(&of_compiler).any(|part| name.starts_with(part))
}

fn is_same(one: &Path, other: &Path) -> bool {
    fs::canonicalize(one).is_ok_and(|one| fs::canonicalize(other).is_ok_and(|other| one == other))
}

/// The name and the file in a line of the loader such as `libm.so.6 => /lib/libm.so.6 (0x7f4a)`, or without the arrow when
/// the name is a path, as that of our own library. One that is not found is told by the loader when the program starts.
fn found(line: &[u8]) -> Option<(PathBuf, PathBuf)> {
    let arrow = line.windows(4).position(|part| part == b" => ");
    let end = line.windows(4).rposition(|part| part == b" (0x")?;
    let (name, file) = match arrow {
        Some(arrow) => (&line[..arrow], line.get(arrow + 4..end)?),
        None => (&line[..end], &line[..end]),
    };
    let [name, file] = [name, file].map(|part| read::path(part.trim_ascii()));
    Some((name?, file.filter(|file| file.is_absolute())?))
}

/// What starts a program with dynamic libraries.
fn loader_of(program: &Path) -> Option<PathBuf> {
    let parts = ReadCache::new(File::open(program).ok()?);
    let loader = match FileKind::parse(&parts).ok()? {
        FileKind::Elf32 => loader_in::<FileHeader32<Endianness>>(&parts)?,
        FileKind::Elf64 => loader_in::<FileHeader64<Endianness>>(&parts)?,
        _ => return None,
    };
    // They know `--list`. Another one would start the program.
    let name = loader.file_name()?.as_encoded_bytes();
    ["ld-", "ld.so", "ld64.so"].iter().any(|it| name.starts_with(it.as_bytes())).then_some(loader)
}

fn loader_in<Elf: FileHeader<Endian = Endianness>>(parts: &ReadCache<File>) -> Option<PathBuf> {
    let file = ElfFile::<Elf, &ReadCache<File>>::parse(parts).ok()?;
    let mut headers = file.elf_program_headers().iter();
    read::path(headers.find_map(|header| header.interpreter(file.endian(), parts).ok()?)?)
}
