//! A program's own functions with names of the C library's, such as `close`, are not called by libraries of the system in
//! its place.
//!
//! Loaders take the first definition of a name, and look in the program first. Only names that these libraries need are
//! hidden: a dynamic library of the program shares all others with it, such as variables.

use std::collections::BTreeSet;
use std::ffi::{c_void, CStr};
use std::fs::{self, File};
use std::io::{Seek, SeekFrom, Write};
use std::mem::{self, offset_of, size_of};
use std::path::{Path, PathBuf};

use object::elf::{FileHeader32, FileHeader64, Sym32, Sym64, STB_LOCAL, STV_HIDDEN};
use object::read::elf::{ElfFile, FileHeader, SectionHeader, Sym};
use object::{Endianness, FileKind, ReadCache};

use crate::libraries::{functions_of, Which};
use crate::read;
use crate::Sentence;

/// All use the same of these.
const ALLOCATORS: [&[u8]; 10] = [
    b"malloc",
    b"calloc",
    b"realloc",
    b"free",
    b"posix_memalign",
    b"memalign",
    b"aligned_alloc",
    b"valloc",
    b"pvalloc",
    b"malloc_usable_size",
];

/// A symbol that others see.
struct Symbol {
    /// Where the byte with its visibility is, and what that has to be.
    place: u64,
    byte: u8,
}

/// Hides what these compiled files have of the C library's names, as far as one of these libraries needs them. A file that is
/// not in the build folder is left as it is: a copy takes its place. Returns whether there was something to hide.
pub(crate) fn hide<'a>(
    objects: &mut [PathBuf],
    libraries: impl IntoIterator<Item = &'a Path>,
    build: &Path,
) -> Result<bool, Sentence> {
    let Some(c_library) = c_library() else { return Ok(false) };
    let mut names = functions_of(&c_library, Which::Own)?;
    let mut has_any = false;
    for object in objects.iter() {
        has_any |= !visible(object, &names)?.is_empty();
    }
    // Few programs have, and the libraries need not be read for the others.
    if !has_any {
        return Ok(false);
    }
    let mut needed = BTreeSet::new();
    for library in libraries {
        needed.append(&mut functions_of(library, Which::Needed)?);
    }
    names.retain(|name| needed.contains(name) && !ALLOCATORS.contains(&name.as_slice()));
    let mut is_hidden = false;
    for (number, object) in objects.iter_mut().enumerate() {
        let symbols = visible(object, &names)?;
        if symbols.is_empty() {
            continue;
        }
        is_hidden = true;
        if !object.starts_with(build) {
            let copy = build.join(format!("hidden_{number}.o"));
            fs::write(&copy, fs::read(&*object)?)?;
            *object = copy;
        }
        let mut file = File::options().write(true).open(object)?;
        for symbol in symbols {
            file.seek(SeekFrom::Start(symbol.place))?;
            file.write_all(&[symbol.byte])?;
        }
    }
    Ok(is_hidden)
}

/// The file of the C library with which this program runs: those of programs have the same names.
fn c_library() -> Option<PathBuf> {
    // SAFETY: a pointer that may be null.
    let mut info: libc::Dl_info = unsafe { mem::zeroed() };
    // SAFETY: the place is this function's.
    if unsafe { libc::dladdr(libc::close as *const c_void, &raw mut info) } == 0 {
        return None;
    }
    // SAFETY: the name of the file is there as long as the library.
    read::path(unsafe { CStr::from_ptr(info.dli_fname) }.to_bytes())
}

/// Where a compiled file has these names, if others see them. It was read before, so one that can't be read has none.
fn visible(object: &Path, names: &BTreeSet<Vec<u8>>) -> Result<Vec<Symbol>, Sentence> {
    let parts = ReadCache::new(File::open(object)?);
    let bytes = match FileKind::parse(&parts) {
        Ok(FileKind::Elf32) => {
            let place = offset_of!(Sym32<Endianness>, st_other);
            visible_in::<FileHeader32<Endianness>>(&parts, place, names)
        }
        Ok(FileKind::Elf64) => {
            let place = offset_of!(Sym64<Endianness>, st_other);
            visible_in::<FileHeader64<Endianness>>(&parts, place, names)
        }
        _ => return Ok(Vec::new()),
    };
    bytes.map_err(|error| format!("{} can't be read: {error}", object.display()).into())
}

fn visible_in<Elf: FileHeader<Endian = Endianness>>(
    parts: &ReadCache<File>,
    place_in_symbol: usize,
    names: &BTreeSet<Vec<u8>>,
) -> object::Result<Vec<Symbol>> {
    let file = ElfFile::<Elf, &ReadCache<File>>::parse(parts)?;
    let (endian, table) = (file.endian(), file.elf_symbol_table());
    if table.is_empty() {
        return Ok(Vec::new());
    }
    let section = file.elf_section_table().section(table.section())?;
    let begin: u64 = section.sh_offset(endian).into();
    let mut symbols = Vec::new();
    for (index, symbol) in table.enumerate() {
        if symbol.is_undefined(endian) || symbol.st_bind() == STB_LOCAL {
            continue;
        }
        if names.contains(symbol.name(endian, table.strings())?) {
            let place = begin + (index.0 * size_of::<Elf::Sym>() + place_in_symbol) as u64;
            let byte = symbol.st_other() & !symbol.st_visibility() | STV_HIDDEN;
            symbols.push(Symbol { place, byte });
        }
    }
    Ok(symbols)
}
