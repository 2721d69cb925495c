//! What a compiled file depends on: the preprocessed text of its source, and which programs compile it with which
//! options. A file for which this may not be all has no key, and is compiled at each start.

use std::collections::BTreeSet;
use std::env;
use std::ffi::{OsStr, OsString};
use std::fmt::Write;
use std::fs::{self, File};
use std::io::{ErrorKind, Read};
use std::path::{Path, PathBuf};

use twox_hash::XxHash3_128;

use crate::read;

/// The last words of the names of compilers that do nothing but what their options say. Others keep what they compile
/// themselves (`zig`, `ccache`), or take options from elsewhere, as scripts do.
const COMPILERS: [&str; 6] = ["cc", "gcc", "clang", "c++", "g++", "clang++"];
/// Options, also without the space, whose values only count for the preprocessor.
const WITH_VALUE: [&str; 6] = ["-I", "-D", "-U", "-iquote", "-isystem", "-idirafter"];
/// How options begin that only say how to compile.
const BEGINNINGS: [&str; 3] = ["-std=", "-O", "-W"];
/// Further options that do.
const OPTIONS: [&str; 15] = [
    "-g",
    "-w",
    "-ansi",
    "-pedantic",
    "-pthread",
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
/// How pragmas begin that mean the same in the preprocessor's text, or nothing.
const PLAIN: [&str; 9] =
    ["once", "STDC", "message", "warning", "comment", "region", "endregion", "hdrstop", "argsused"];
/// What pragmas of gcc and clang are about that mean the same in the preprocessor's text.
const OF_COMPILERS: [&str; 4] = ["diagnostic", "visibility", "system_header", "poison"];
/// What tells a program the place in its source, where the text has other places.
const PLACES: [&str; 4] =
    ["__builtin_COLUMN", "__builtin_FILE", "__builtin_LINE", "__builtin_source_location"];
/// How trigraphs end.
const TRIGRAPHS: [char; 9] = ['=', '/', '\'', '(', ')', '!', '<', '>', '-'];
/// Variables that bring something else into the compiler.
const INSERTS: [&str; 4] =
    ["LD_PRELOAD", "LD_AUDIT", "DYLD_INSERT_LIBRARIES", "CCC_OVERRIDE_OPTIONS"];
/// What gcc and clang say of a file with options, which may name anything.
const FILES: [&str; 2] = ["Reading specs from", "Configuration file"];
/// Variables that count by their values. What others change shows in the preprocessed text, or in the commands.
const VARIABLES: [&str; 8] = [
    "LD_LIBRARY_PATH",
    "DYLD_LIBRARY_PATH",
    "DYLD_FRAMEWORK_PATH",
    "LANG",
    "LANGUAGE",
    "LC_ALL",
    "LC_CTYPE",
    "LC_MESSAGES",
];

/// All that a compiled file depends on, as one number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Key(pub(crate) u128);

/// Whether this compiler does what its options say, and nothing else, with these options.
pub(crate) fn is_known_compiler(compiler: &OsStr, options: &[OsString]) -> bool {
    let is_set = |name: &&str| env::var_os(name).is_some_and(|value| !value.is_empty());
    if INSERTS.iter().any(is_set) || !are_known(options) {
        return false;
    }
    found(compiler).is_some_and(|file| is_compiler(&file) && state_of(&file).is_some())
}

/// What distinguishes this compiler from another one, and its options; `None` when that can't be known. `commands` is
/// what it says that it would run (`-###`): with all options, also those from elsewhere.
pub(crate) fn identity(compiler: &OsStr, commands: &str) -> Option<String> {
    let mut identity = commands.to_owned();
    let programs = programs(commands);
    // It is the compiler itself and the assembler.
    if programs.len() < 2 || FILES.iter().any(|file| commands.contains(file)) {
        return None;
    }
    for program in [compiler].into_iter().chain(programs.iter().map(OsStr::new)) {
        let place = place_of(program)?;
        let file = fs::canonicalize(&place).ok()?;
        let _ = write!(identity, " {} {}", state_of(&file)?, way_to(&place));
    }
    for name in VARIABLES {
        let _ = write!(identity, " {:?}", env::var_os(name));
    }
    Some(identity)
}

/// The programs in such a list of commands: each stands in a line that begins with a space.
fn programs(commands: &str) -> Vec<String> {
    let commands = commands.lines().filter_map(|line| line.strip_prefix(' '));
    let program = |command: &str| match command.strip_prefix('"') {
        Some(quoted) => quoted.split('"').next().unwrap_or_default().replace("\\\\", "\\"),
        None => command.split(' ').next().unwrap_or_default().to_owned(),
    };
    commands.map(program).collect()
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
    fs::canonicalize(place_of(program)?).ok()
}

/// Where the system finds this command; it may be a link. `None` if it may look in other folders, or if it does not
/// run this file for everybody: then it takes the next one.
fn place_of(program: &OsStr) -> Option<PathBuf> {
    let is_path = Path::new(program).components().count() > 1;
    let folders = match is_path {
        true => vec![PathBuf::new()],
        false => env::split_paths(&env::var_os("PATH")?).collect(),
    };
    let names =
        [program.to_owned(), [program, OsStr::new(env::consts::EXE_SUFFIX)].into_iter().collect()];
    let mut places = folders.iter().flat_map(|folder| names.iter().map(|name| folder.join(name)));
    let place = places.find(|place| who_runs(place) != 0)?;
    (who_runs(&place) == 0o111).then_some(place)
}

/// Who may run this file, as in its mode: owner, group, others.
fn who_runs(file: &Path) -> u32 {
    let Ok(data) = fs::metadata(file) else { return 0 };
    #[cfg(unix)]
    let mode = std::os::unix::fs::MetadataExt::mode(&data);
    #[cfg(not(unix))]
    let mode = 0o111;
    if data.is_file() {
        mode & 0o111
    } else {
        0
    }
}

/// Whether this is one of the compilers, as in `x86_64-linux-gnu-gcc-13`.
fn is_compiler(file: &Path) -> bool {
    let name = file.file_name().unwrap_or_default().to_string_lossy();
    let name = name.strip_suffix(env::consts::EXE_SUFFIX).unwrap_or(&name);
    let is_digit = |c: char| c.is_ascii_digit();
    let mut words = name.rsplit('-').skip_while(|word| word.starts_with(is_digit));
    words.next().is_some_and(|word| COMPILERS.contains(&word))
}

/// What changes with a program; `None` for a script, which may depend on anything.
fn state_of(program: &Path) -> Option<String> {
    let mut beginning = [0; 64];
    File::open(program).and_then(|mut file| file.read_exact(&mut beginning)).ok()?;
    let data = fs::metadata(program).ok().filter(|_| beginning.contains(&0))?;
    Some(format!("{program:?} {}", changed(&data)?))
}

/// What changes when a file is written.
fn changed(file: &fs::Metadata) -> Option<String> {
    let modified = file.modified().ok()?;
    #[cfg(unix)]
    let more = {
        use std::os::unix::fs::MetadataExt;
        // No program can set this time back.
        (file.dev(), file.ino(), file.ctime(), file.ctime_nsec())
    };
    #[cfg(not(unix))]
    let more = ();
    Some(format!("{} {modified:?} {more:?}", file.len()))
}

/// The key of what is compiled from this text, and what else distinguishes it from others. `None` when the text may mean
/// something else than the source, or the compiler reads a precompiled header for it.
pub(crate) fn of(text: &[u8], others: &[&[u8]]) -> Option<Key> {
    let lossy = String::from_utf8_lossy(text);
    let knows_place = PLACES.iter().any(|place| lossy.contains(place));
    // One that the preprocessor has made would be read once more.
    let has_trigraph = lossy.split("??").skip(1).any(|rest| rest.starts_with(TRIGRAPHS));
    let mut pragmas = lossy.lines().filter_map(|line| line.trim_start().strip_prefix("#pragma"));
    if knows_place || has_trigraph || !pragmas.all(is_plain_pragma) {
        return None;
    }
    let mut hasher = XxHash3_128::new();
    for part in others.iter().chain([&text]) {
        hasher.write(&(part.len() as u64).to_le_bytes());
        hasher.write(part);
    }
    Some(Key(hasher.finish_128()))
}

/// Whether what follows `#pragma` means the same in a text and in its source. clang leaves names of macros in it, which
/// have no meaning in the text; others change options of gcc, on which macros such as `__AVX2__` depend, but up to gcc 12
/// only where it compiles.
fn is_plain_pragma(rest: &str) -> bool {
    let is_word = |c: char| c.is_ascii_alphanumeric() || c == '_';
    let mut words = rest.split(|c| !is_word(c)).filter(|word| !word.is_empty());
    match words.next() {
        Some(first) if PLAIN.contains(&first) => true,
        Some("GCC" | "clang") => words.next().is_some_and(|word| OF_COMPILERS.contains(&word)),
        Some("pack") => {
            words.all(|word| ["push", "pop"].contains(&word) || word.parse::<u8>().is_ok())
        }
        _ => false,
    }
}

/// Whether a program itself asks for warnings in this text.
pub(crate) fn asks_for_warnings(text: &[u8]) -> bool {
    let asks = ["diagnostic warning", "diagnostic error"];
    let text = String::from_utf8_lossy(text);
    text.lines().any(|line| line.contains("#pragma") && asks.iter().any(|it| line.contains(it)))
}

/// A text with a fixed name for the build folder, which has another one each time.
pub(crate) fn with_fixed_name(text: &[u8], build: &Path) -> Vec<u8> {
    let build = in_text(build);
    let mut fixed = Vec::with_capacity(text.len());
    for line in text.split_inclusive(|byte| *byte == b'\n') {
        match std::str::from_utf8(line) {
            Ok(line) if line.contains(&build) => {
                fixed.extend(line.replace(&build, "tx_run").as_bytes());
            }
            _ => fixed.extend(line),
        }
    }
    fixed
}

/// Whether this text itself names the build folder, as `__FILE__` does in a header that is found there.
pub(crate) fn names_folder(text: &[u8], build: &Path) -> bool {
    let (text, build) = (String::from_utf8_lossy(text), in_text(build));
    text.lines().any(|line| !line.starts_with("# ") && line.contains(&build))
}

/// A path as a text in C has it.
fn in_text(path: &Path) -> String {
    let path = path.to_string_lossy();
    if cfg!(windows) {
        path.replace('\\', "\\\\")
    } else {
        path.into_owned()
    }
}

/// What is in the files that a text is from: with the comments and spaces that warnings depend on and show.
pub(crate) fn written_in(text: &[u8]) -> Result<Vec<u8>, &'static str> {
    let lines = text.split(|byte| *byte == b'\n').filter(|line| line.starts_with(b"# "));
    let names: BTreeSet<PathBuf> = lines.filter_map(name_in).collect();
    let mut written = Vec::new();
    for file in names.iter().filter(|file| file.is_file()) {
        // One that can't be read has no lines to show. A source may name any file by `#line`.
        // Those in which the kernel says something have no length, and reading may wait.
        let length = |it: &File| it.metadata().map(|data| data.len());
        let open = File::open(file).and_then(|it| Ok((length(&it)?, it)));
        let read = open.and_then(|(length, it)| read::more(it.take(length), &mut written));
        if read.is_err_and(|error| error.kind() == ErrorKind::FileTooLarge) {
            return Err("the files that it is from have more than 100 MB");
        }
    }
    Ok(written)
}

/// The file that such a line names, in any character set. Compilers write a backslash before some characters, and clang
/// writes a byte beyond ASCII as three octal digits behind one.
fn name_in(line: &[u8]) -> Option<PathBuf> {
    let begin = line.iter().position(|byte| *byte == b'"')? + 1;
    let end = line.iter().rposition(|byte| *byte == b'"')?;
    let mut written = line.get(begin..end)?;
    let mut name = Vec::new();
    while let [first, rest @ ..] = written {
        let (byte, rest) = match (first, rest) {
            (b'\\', [a @ b'0'..=b'3', b @ b'0'..=b'7', c @ b'0'..=b'7', rest @ ..]) => {
                ((a - b'0') << 6 | (b - b'0') << 3 | (c - b'0'), rest)
            }
            (b'\\', [escaped, rest @ ..]) => (*escaped, rest),
            _ => (*first, rest),
        };
        name.push(byte);
        written = rest;
    }
    read::path(&name)
}

/// What changes when another file comes in the place of this one, because a link or a folder on the way to it is another one
/// for a moment.
#[cfg(unix)]
fn way_to(file: &Path) -> String {
    use std::os::unix::fs::MetadataExt;
    let mut states = String::new();
    let mut seen = BTreeSet::new();
    let mut next = vec![file.to_owned()];
    while let Some(path) = next.pop() {
        for place in path.ancestors() {
            if !seen.insert(place.to_owned()) {
                break;
            }
            let Ok(data) = fs::symlink_metadata(place) else { continue };
            if let Ok(target) = fs::read_link(place) {
                next.push(place.parent().unwrap_or(place).join(target));
            }
            // A folder that only gets or loses a file has both times.
            let changed = (data.ctime(), data.ctime_nsec());
            let is_same = data.is_dir() && changed == (data.mtime(), data.mtime_nsec());
            let _ = write!(states, "{} {:?} ", data.ino(), (!is_same).then_some(changed));
        }
    }
    states
}

#[cfg(not(unix))]
fn way_to(_: &Path) -> String {
    String::new()
}

/// Whether the assembler reads a further file for this text, or may: a macro can put the directive together, and a
/// comment or quotes divide it.
pub(crate) fn reads_files(assembler: &[u8]) -> bool {
    let text = String::from_utf8_lossy(assembler).to_ascii_lowercase();
    let words = ["incbin", ".include", ".macro", ".irp", "endm", "endr", "/*"];
    // An empty text stands alone, and what ends with an escaped quote has no name in it.
    let divides = |(place, _): (usize, &str)| {
        text[..place]
            .chars()
            .next_back()
            .is_some_and(|before| !before.is_whitespace() && !['\\', ','].contains(&before))
    };
    words.iter().any(|word| text.contains(word)) || text.match_indices("\"\"").any(divides)
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
    fn directives_of_the_assembler_that_may_read_a_file_are_found() {
        assert!(!reads_files(b"\t.string\t\"/usr/include/stdio.h\"\n\trorw $8, %ax\n"));
        assert!(!reads_files(b"\t.string\t\"\"\n\t.string\t\"a \\\"b\\\"\"\n"));
        assert!(!reads_files(b"\t.section\t.note.GNU-stack,\"\",@progbits\n"));
        for reads in [
            ".incbin \"data\"",
            ".INCBIN \"data\"",
            ".include \"data\"",
            ".inc/**/bin \"data\"",
            "\".inc\"\"bin\" \"data\"",
            "\".mac\"\"ro\" foo x\n.inc\\x \"data\"\n.endm\nfoo bin",
            ".irp x,bin\n.inc\\x \"data\"\n.endr",
            ".macro a x\n.\\x \"data\"\n.endm\na incbin",
        ] {
            assert!(reads_files(reads.as_bytes()), "{reads}");
        }
    }

    #[test]
    fn all_counts_but_the_name_of_the_build_folder() {
        let of = |text: &str, other: &str, build: &str| {
            super::of(&with_fixed_name(text.as_bytes(), Path::new(build)), &[other.as_bytes()])
        };
        let key = of("# 1 \"/x/a.h\"\nint a;\n", "-g", "/x").unwrap();
        assert_eq!(Some(key), of("# 1 \"/y/z/a.h\"\nint a;\n", "-g", "/y/z"));
        for (text, other) in [
            ("# 1 \"/x/b.h\"\nint a;\n", "-g"),
            ("# 1 \"/x/a.h\"\nint b;\n", "-g"),
            ("# 1 \"/x/a.h\"\nint a;\n", "-w"),
        ] {
            assert_ne!(Some(key), of(text, other, "/x"));
        }
        for pragma in [
            "GCC pch_preprocess \"h.h.gch\"",
            "GCC target(\"avx2\")",
            "GCC optimize \"O2\"",
            "GCC pop_options",
            "pack(SIZE)",
            "pack ( push, SIZE )",
            "weak HOOK",
        ] {
            assert_eq!(of(&format!("int a;\n#pragma {pragma}\n"), "", "/x"), None, "{pragma}");
        }
        let plain = "#pragma GCC visibility push(default)\n#pragma once\n#pragma pack(push, 1)\n#pragma pack()\n\
            #pragma warning(disable: 4996)\n #pragma clang diagnostic ignored \"-Wall\"\n";
        assert!(of(plain, "", "/x").is_some());
        assert_eq!(of("int a = __builtin_LINE();\n", "", "/x"), None);
        assert_eq!(of("const char *a = __builtin_FILE();\n", "", "/x"), None);
        assert_eq!(of("const char *a = \"??/\";\n", "", "/x"), None);
        assert!(of("const char *a = \"Why??\";\n", "", "/x").is_some());
    }

    #[test]
    fn the_programs_that_a_compiler_runs_are_found() {
        let gcc =
            "Target: x86_64-linux-gnu\n /usr/lib/gcc/cc1 -quiet - -o a.s\nA=1 2\n as --64 a.s\n";
        assert_eq!(programs(gcc), ["/usr/lib/gcc/cc1", "as"]);
        let clang = "InstalledDir: C:\\\\bin\n \"C:\\\\the bin\\\\clang\" \"-cc1\"\n \"/b/clang\" \"-cc1as\"\n";
        assert_eq!(programs(clang), ["C:\\the bin\\clang", "/b/clang"]);
    }

    #[test]
    fn names_are_read_as_gcc_and_clang_write_them() {
        for line in [&b"# 1 \"j\xc3\xb6rg/b.c\" 2 3"[..], b"# 1 \"j\\303\\266rg/b.c\""] {
            assert_eq!(name_in(line), Some("j\u{f6}rg/b.c".into()));
        }
        assert_eq!(name_in(br#"# 1 "C:\\a \"b\".c""#), Some(r#"C:\a "b".c"#.into()));
        assert_eq!(name_in(b"# 1 \"\xf6.c\"").is_some(), cfg!(unix));
        assert_eq!((name_in(b"# pragma"), name_in(b"# 1 \"")), (None, None));
    }

    #[cfg(unix)]
    #[test]
    fn only_programs_count_and_only_some_are_compilers() {
        for name in ["gcc", "x86_64-linux-gnu-g++-13", "clang-18", "clang++", "cc", "gcc-13.2"] {
            assert!(is_compiler(Path::new(name)), "{name}");
        }
        for name in ["ccache", "zig", "python3", "icecc", "gcc-ar"] {
            assert!(!is_compiler(Path::new(name)), "{name}");
        }
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("gcc");
        fs::write(&file, [b"\x7fELF\0".as_slice(), &[0; 64]].concat()).unwrap();
        assert!(state_of(&file).is_some());
        for (mode, runs) in [(0o644, false), (0o744, false), (0o755, true)] {
            let mode = std::os::unix::fs::PermissionsExt::from_mode(mode);
            fs::set_permissions(&file, mode).unwrap();
            assert_eq!(found(file.as_os_str()).is_some(), runs, "only for everybody");
        }
        fs::write(&file, [b"#!/bin/sh\nexec gcc \"$@\"\n".as_slice(), &[b'\n'; 64]].concat())
            .unwrap();
        assert_eq!(state_of(&file), None);
    }
}
