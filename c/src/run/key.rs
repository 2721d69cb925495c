//! What a compiled file depends on: the text that the preprocessor makes of its source, the compiler, and what both
//! are told. A file for which this may not be all has no key, and is compiled at each start.

use std::env;
use std::ffi::{OsStr, OsString};
use std::fmt::Write;
use std::fs::{self, File};
use std::io::Read;
use std::path::{Path, PathBuf};

use twox_hash::XxHash3_128;

/// The last words of the names of compilers that do nothing but what their options say. Others keep what they compile
/// themselves (`zig`, `ccache`), or take options from elsewhere, as scripts do.
const COMPILERS: [&str; 6] = ["cc", "gcc", "clang", "c++", "g++", "clang++"];
/// Options, also without the space, whose values are seen in the preprocessor's text, or are only values.
const WITH_VALUE: [&str; 6] = ["-I", "-D", "-U", "-iquote", "-isystem", "-idirafter"];
/// How options begin that only say how to compile.
const BEGINNINGS: [&str; 3] = ["-std=", "-O", "-W"];
/// Further options that do.
const OPTIONS: [&str; 16] = [
    "-g",
    "-w",
    "-ansi",
    "-pedantic",
    "-pthread",
    "-pipe",
    "-m32",
    "-m64",
    "-fcommon",
    "-fsigned-char",
    "-funsigned-char",
    "-fPIC",
    "-fpermissive",
    "-fno-exceptions",
    "-fno-rtti",
    "-fno-strict-aliasing",
];
/// Variables that have a compiler run something else, or write further files.
const CHANGES: [&str; 7] = [
    "COMPILER_PATH",
    "GCC_EXEC_PREFIX",
    "CCC_OVERRIDE_OPTIONS",
    "DEPENDENCIES_OUTPUT",
    "SUNPRO_DEPENDENCIES",
    "LD_PRELOAD",
    "DYLD_INSERT_LIBRARIES",
];
/// Variables that count by their values. Those with folders for headers show in the preprocessor's text.
const VARIABLES: [&str; 10] = [
    "PATH",
    "PWD",
    "LD_LIBRARY_PATH",
    "LANG",
    "LC_ALL",
    "LC_CTYPE",
    "LC_MESSAGES",
    "SDKROOT",
    "DEVELOPER_DIR",
    "MACOSX_DEPLOYMENT_TARGET",
];

/// All that a compiled file depends on, as one number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Key(pub(crate) u128);

/// What tells a compiler, and the options that the user has given it, from another one; `None` when they do not tell
/// all.
pub(crate) fn identity(words: &[OsString], version: &str, flags: &[OsString]) -> Option<String> {
    let (program, options) = words.split_first()?;
    let is_set = |name: &&str| env::var_os(name).is_some_and(|value| !value.is_empty());
    // clang says which files it takes options from.
    let takes_more = version.contains("Configuration file") || CHANGES.iter().any(is_set);
    if takes_more || !are_known(options) || !are_known(flags) {
        return None;
    }
    let file = found(program)?;
    if !is_compiler(&file) {
        return None;
    }
    let mut identity = format!("{version} {options:?} {flags:?} {}", state_of(&file)?);
    // gcc may have none of its own.
    let assembler = found(OsStr::new("as")).and_then(|file| state_of(&file));
    let _ = write!(identity, " {assembler:?}");
    for name in VARIABLES {
        let _ = write!(identity, " {:?}", env::var_os(name));
    }
    Some(identity)
}

/// Whether these options are known to say how to compile, and nothing else.
fn are_known(options: &[OsString]) -> bool {
    let mut options = options.iter().map(|option| option.to_str());
    while let Some(option) = options.next() {
        let Some(option) = option else { return false };
        if WITH_VALUE.contains(&option) {
            // Also in this place `@FILE` stands for what is in the file.
            if options.next().flatten().is_none_or(|value| value.starts_with('@')) {
                return false;
            }
            continue;
        }
        let begins = |with: &[&str]| with.iter().any(|beginning| option.starts_with(beginning));
        // `-Wa,` is for the assembler, and such.
        let is_known = OPTIONS.contains(&option)
            || begins(&WITH_VALUE)
            || (begins(&BEGINNINGS) && !option.contains(','));
        if !is_known {
            return false;
        }
    }
    true
}

/// The file that the system runs for this command, behind all links.
fn found(program: &OsStr) -> Option<PathBuf> {
    let is_path = Path::new(program).components().count() > 1;
    let path = if is_path { None } else { env::var_os("PATH") };
    let folders = match &path {
        Some(path) => env::split_paths(path).collect(),
        None => vec![PathBuf::new()],
    };
    let names =
        [program.to_owned(), [program, OsStr::new(env::consts::EXE_SUFFIX)].into_iter().collect()];
    let places = folders.iter().flat_map(|folder| names.iter().map(|name| folder.join(name)));
    fs::canonicalize(places.into_iter().find(|place| place.is_file())?).ok()
}

/// Whether this is one of the compilers, as in `x86_64-linux-gnu-gcc-13`, and no script with its name.
fn is_compiler(file: &Path) -> bool {
    let name = file.file_name().unwrap_or_default().to_string_lossy();
    let name = name.strip_suffix(env::consts::EXE_SUFFIX).unwrap_or(&name);
    let is_digit = |c: char| c.is_ascii_digit();
    let mut words = name.rsplit('-').skip_while(|word| word.starts_with(is_digit));
    let mut beginning = [0; 64];
    let is_program = File::open(file)
        .and_then(|mut file| file.read_exact(&mut beginning))
        .is_ok_and(|()| beginning.contains(&0));
    is_program && words.next().is_some_and(|word| COMPILERS.contains(&word))
}

/// What changes with a file.
fn state_of(file: &Path) -> Option<String> {
    let data = fs::metadata(file).ok()?;
    let changed = data.modified().ok()?;
    #[cfg(unix)]
    let more = {
        use std::os::unix::fs::MetadataExt;
        // No program can set this time back.
        (data.dev(), data.ino(), data.ctime(), data.ctime_nsec())
    };
    #[cfg(not(unix))]
    let more = ();
    Some(format!("{file:?} {} {changed:?} {more:?}", data.len()))
}

/// The key of a source with this text, after the preprocessor, and what else tells it from others. What lies in the
/// build folder lies in another one each time. `None` when compiling it reads further files.
pub(crate) fn of<'a>(
    text: &[u8],
    others: impl Iterator<Item = &'a [u8]>,
    build: &Path,
) -> Option<Key> {
    if reads_files(&String::from_utf8_lossy(text)) {
        return None;
    }
    let build = build.to_str()?;
    // As a text in C.
    let in_text = if cfg!(windows) { build.replace('\\', "\\\\") } else { build.to_owned() };
    let mut hasher = XxHash3_128::new();
    for other in others {
        let other = without(other, build);
        hasher.write(&(other.len() as u64).to_le_bytes());
        hasher.write(&other);
    }
    for line in text.split_inclusive(|byte| *byte == b'\n') {
        match line.first() {
            // It names the file that the next lines are from.
            Some(b'#') => hasher.write(&without(line, &in_text)),
            _ => hasher.write(line),
        }
    }
    Some(Key(hasher.finish_128()))
}

/// A text without the name of this folder.
fn without(text: &[u8], folder: &str) -> Vec<u8> {
    match std::str::from_utf8(text) {
        Ok(text) => text.replace(folder, "\0").into_bytes(),
        Err(_) => text.to_owned(),
    }
}

/// Whether the compiler reads files for this text: a precompiled header, or by a directive of the assembler. Those
/// begin with a dot, so no assembler text with a dot counts as known, and none with an escape that may be one.
fn reads_files(text: &str) -> bool {
    ["pch_preprocess", "incbin", ".include"].iter().any(|word| text.contains(word))
        || text.match_indices("asm").any(|(at, asm)| may_have_directive(&text[at + asm.len()..]))
}

/// Whether a dot or an unknown escape is in the text for the assembler that follows.
fn may_have_directive(rest: &str) -> bool {
    let rest =
        rest.trim_start_matches(|c: char| c.is_whitespace() || c.is_alphanumeric() || c == '_');
    match rest.chars().next() {
        Some('(') => {}
        // Assembler in another form, or a new line between.
        Some('{' | '#') => return true,
        // It was part of another word.
        _ => return false,
    }
    let (mut depth, mut is_quoted) = (0, false);
    let mut chars = rest.chars();
    while let Some(next) = chars.next() {
        match next {
            '"' => is_quoted = !is_quoted,
            '\\' if matches!(chars.next(), Some('n' | 't')) => {}
            '\\' | '\'' => return true,
            '.' | '#' | 'R' if is_quoted || next == 'R' => return true,
            '(' if !is_quoted => depth += 1,
            ')' if !is_quoted => depth -= 1,
            _ => {}
        }
        if depth == 0 {
            return false;
        }
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    fn known(options: &str) -> bool {
        are_known(&options.split_whitespace().map(OsString::from).collect::<Vec<_>>())
    }

    #[test]
    fn options_that_may_bring_in_more_are_not_known() {
        assert!(known(
            "-O2 -g -Wall -Wno-error=x -std=c11 -I inc -Iinc -D A=1 -DB -isystem x -pthread"
        ));
        for option in [
            "@file",
            "-I @file",
            "-I",
            "-specs=file",
            "-include a.h",
            "-fplugin=a.so",
            "-Wa,-I,folder",
            "-Wp,-MD,file",
            "-B folder",
            "-march=native",
            "-fprofile-use",
            "-x assembler",
            "a.c",
        ] {
            assert!(!known(option), "{option}");
        }
    }

    #[test]
    fn text_for_the_assembler_that_may_read_a_file_is_found() {
        for harmless in [
            "extern int scanf(const char *) __asm__ (\"\" \"__isoc99_scanf\") ;",
            "__asm__ __volatile__ (\"rorw $8, %w0\\n\\tnop\" : \"=r\" (x) : \"0\" (y) : \"cc\"); x = a.b;",
            "const char *plasma = \"a plasma. (x.y)\";",
            "int asmara = f(1.5);",
        ] {
            assert!(!reads_files(harmless), "{harmless}");
        }
        for reads in [
            "__asm__(\".section .rodata\\n.incbin \\\"data\\\"\");",
            "asm(\".inc\" \"bin 'x'\");",
            "asm volatile (\"\\x2einc\" \"bin\");",
            "asm\n# 7 \"a.c\"\n(\"nop\");",
            "__asm { nop }",
            "asm(R\"(nop)\");",
            "asm(\"nop\"",
            "#pragma GCC pch_preprocess \"h.h.gch\"",
            "__attribute__((section(\"a\\n.incbin b\")))",
        ] {
            assert!(reads_files(reads), "{reads}");
        }
    }

    #[test]
    fn the_build_folder_does_not_count_and_all_else_does() {
        let of = |text: &str, other: &str, build: &str| {
            super::of(text.as_bytes(), [other.as_bytes()].into_iter(), Path::new(build)).unwrap()
        };
        let key = of("# 1 \"/x/a.h\"\nint a;\n", "-I/x/inc", "/x");
        assert_eq!(key, of("# 1 \"/y/z/a.h\"\nint a;\n", "-I/y/z/inc", "/y/z"));
        for (text, other) in [
            ("# 1 \"/x/b.h\"\nint a;\n", "-I/x/inc"),
            ("# 1 \"/x/a.h\"\nint b;\n", "-I/x/inc"),
            ("# 1 \"/x/a.h\"\nint a;\n", "-I/x"),
        ] {
            assert_ne!(key, of(text, other, "/x"));
        }
    }

    #[cfg(unix)]
    #[test]
    fn only_programs_with_the_names_of_compilers_are_known() {
        let folder = tempfile::tempdir().unwrap();
        let is_known = |name: &str, text: &[u8]| {
            let file = folder.path().join(name);
            fs::write(&file, text).unwrap();
            is_compiler(&file)
        };
        let program = [b"\x7fELF\0".as_slice(), &[0; 64]].concat();
        for name in ["gcc", "x86_64-linux-gnu-g++-13", "clang-18", "clang++", "cc", "gcc-13.2"] {
            assert!(is_known(name, &program), "{name}");
        }
        for name in ["ccache", "zig", "python3", "icecc", "gcc-ar"] {
            assert!(!is_known(name, &program), "{name}");
        }
        assert!(!is_known(
            "gcc",
            &[b"#!/bin/sh\nexec gcc \"$@\"\n".as_slice(), &[b'\n'; 64]].concat()
        ));
    }
}
