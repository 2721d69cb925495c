//! What sources include, as far as their text shows it, and which of the program's own files that is.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::fs;
use std::io;
use std::ops::Range;
use std::path::{Component, Path, PathBuf};

use crate::headers;
use crate::read;
use crate::search::Folders;

/// An include in a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Include {
    /// As it is written, such as `../Common/ROBO_TX_PRG.H`.
    pub(crate) written: String,
    /// Where that is in the file, with its quotes.
    pub(crate) place: Range<usize>,
    pub(crate) found: Found,
}

/// What an include means.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Found {
    Own(Own),
    /// A header in one of the compiler's own folders.
    System,
    Nothing,
}

/// A file of the program that an include means.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Own {
    pub(crate) file: PathBuf,
    /// Whether a compiler finds it under the written name. On Windows `Common.h` and `..\common.h` mean the file
    /// `common.h`, too.
    pub(crate) is_exact: bool,
    /// Whether it was found from the folder of the including file, and not in an include folder.
    pub(crate) is_beside: bool,
}

impl Include {
    /// The header's name in lower case, without folders.
    pub(crate) fn name(&self) -> String {
        self.written.rsplit(['/', '\\']).next().unwrap_or_default().to_lowercase()
    }

    /// The program's own file that it means.
    pub(crate) fn own(&self) -> Option<&Own> {
        match &self.found {
            Found::Own(own) => Some(own),
            Found::System | Found::Nothing => None,
        }
    }
}

/// A file of the program.
#[derive(Debug, Default)]
pub(crate) struct OwnFile {
    pub(crate) text: Vec<u8>,
    /// The same with spaces in place of the comments that may be longer than a line.
    pub(crate) code: Vec<u8>,
    pub(crate) includes: Vec<Include>,
}

impl OwnFile {
    /// Whether there may be includes that are not known, such as `#include MACRO`, `%:include`, `#import` and one that goes
    /// on in the next line, or questions for files, such as `__has_include`.
    pub(crate) fn may_have_more_includes(&self) -> bool {
        let text = joined(&self.text);
        let words = ["include", "import", "embed"].map(|word| text.matches(word).count());
        words.iter().sum::<usize>() > self.includes.len()
    }

    /// Whether it may include what comes after its own folder.
    fn names_next(&self) -> bool {
        let code = joined(&self.code);
        let is_directive =
            |line: &&str| ["#", "%:"].iter().any(|sign| line.trim_start().starts_with(sign));
        let mut directives = code.lines().filter(is_directive);
        directives.any(|directive| directive.contains("include_next"))
    }
}

/// A text in which no line, and so no word, goes on in the next line.
fn joined(text: &[u8]) -> String {
    let text = String::from_utf8_lossy(text);
    let lines = text.split_inclusive('\n');
    lines.map(|line| line.trim_end().strip_suffix('\\').unwrap_or(line)).collect()
}

/// The files of a program in one language: its sources, and what they include directly or not.
#[derive(Debug, Default)]
pub(crate) struct OwnFiles {
    pub(crate) files: BTreeMap<PathBuf, OwnFile>,
    listings: Listings,
}

impl OwnFiles {
    /// Reads sources, and what of their includes is found beside them or in these folders. The error is the
    /// source that can't be read.
    pub(crate) fn read<'a>(
        sources: impl Iterator<Item = &'a Path>,
        folders: &Folders,
    ) -> Result<Self, (PathBuf, io::Error)> {
        let mut own = Self::default();
        let mut bytes = 0;
        let mut count = |file: &Path, text: &[u8]| {
            bytes += text.len();
            match bytes > read::MOST {
                true => Err((
                    file.to_owned(),
                    read::too_much("with all before it, it has more than 100 MB"),
                )),
                false => Ok(()),
            }
        };
        for source in sources {
            if own.files.contains_key(source) {
                continue;
            }
            let text = read::file(source).map_err(|error| (source.to_owned(), error))?;
            count(source, &text)?;
            let mut rest = own.add(source.to_owned(), text, folders);
            while let Some(file) = rest.pop() {
                if own.files.contains_key(&file) {
                    continue;
                }
                // A header that can't be read is the compiler's to complain about.
                if let Ok(text) = read::file(&file) {
                    count(&file, &text)?;
                    rest.extend(own.add(file, text, folders));
                }
            }
        }
        Ok(own)
    }

    /// Returns which files this one includes that are not known yet.
    fn add(&mut self, file: PathBuf, text: Vec<u8>, folders: &Folders) -> Vec<PathBuf> {
        let mut includes = Vec::new();
        let mut included = Vec::new();
        let code = without_comments(&text);
        for (written, place, is_quoted) in includes_of(&code) {
            let beside = if is_quoted { file.parent() } else { None };
            let found = self.listings.find(&written, beside, folders);
            let include = Include { written, place, found };
            // A kit's header means the same whatever the copy beside the program says.
            let followed = include.own().filter(|_| !headers::is_of_a_kit(&include.name()));
            let unknown = followed.filter(|own| !self.files.contains_key(&own.file));
            included.extend(unknown.map(|own| own.file.clone()));
            includes.push(include);
        }
        self.files.insert(file, OwnFile { text, code, includes });
        included
    }

    /// The names of all headers that a source includes, directly or not.
    pub(crate) fn reached_from(&self, source: &Path) -> BTreeSet<String> {
        let mut names = BTreeSet::new();
        let mut seen = BTreeSet::new();
        let mut next = vec![source];
        while let Some(file) = next.pop() {
            if !seen.insert(file) {
                continue;
            }
            for include in self.files.get(file).into_iter().flat_map(|file| &file.includes) {
                names.insert(include.name());
                next.extend(include.own().map(|own| own.file.as_path()));
            }
        }
        names
    }

    /// Whether this file is found in an include folder, and includes what comes after that: a copy has no place there, and
    /// would find the file itself.
    pub(crate) fn includes_next(&self, path: &Path) -> bool {
        let is_in_folder = |own: &Own| !own.is_beside && own.file == path;
        self.files[path].names_next() && self.includes().filter_map(Include::own).any(is_in_folder)
    }

    /// All includes of all files.
    pub(crate) fn includes(&self) -> impl Iterator<Item = &Include> {
        self.files.values().flat_map(|file| &file.includes)
    }
}

/// The names in folders, by their spelling in lower case.
#[derive(Debug, Default)]
struct Listings {
    read: HashMap<PathBuf, HashMap<String, String>>,
}

impl Listings {
    /// The file that is meant: first as it is written, in the order in which the compiler looks, then in other
    /// cases. `beside` is the folder of a file that includes it in quotes.
    fn find(&mut self, written: &str, beside: Option<&Path>, folders: &Folders) -> Found {
        let is_absolute = Path::new(written).is_absolute() || written.contains(':');
        if written.is_empty() || is_absolute {
            return Found::Nothing;
        }
        let path = written.replace('\\', "/");
        let quoted = beside.map_or(&[][..], |_| &folders.quoted);
        let others = quoted.iter().chain(&folders.all).map(|folder| (folder.as_path(), false));
        let places: Vec<_> = beside.map(|it| (it, true)).into_iter().chain(others).collect();
        let is_system = |(folder, is_beside): (&Path, bool)| {
            !is_beside && folders.system.iter().any(|it| it == folder)
        };
        let exact = places.iter().find(|(folder, _)| folder.join(&path).is_file());
        if let Some((folder, is_beside)) = exact {
            if is_system((folder, *is_beside)) {
                return Found::System;
            }
            let (file, is_exact) = (folder.join(&path), cfg!(windows) || path == written);
            let file = without_detours(file);
            return Found::Own(Own { file, is_exact, is_beside: *is_beside });
        }
        let mut own = places.into_iter().filter(|place| !is_system(*place));
        let in_other_case = own.find_map(|(folder, is_beside)| {
            let file = without_detours(self.in_other_case(folder, &path)?);
            Some(Own { file, is_exact: false, is_beside })
        });
        in_other_case.map_or(Found::Nothing, Found::Own)
    }

    fn in_other_case(&mut self, folder: &Path, path: &str) -> Option<PathBuf> {
        let mut place = folder.to_owned();
        for part in path.split('/') {
            match part {
                "" | "." => {}
                ".." => place.push(part),
                _ => {
                    let name = self.names_in(&place).get(&part.to_lowercase())?.clone();
                    place.push(name);
                }
            }
        }
        place.is_file().then_some(place)
    }

    fn names_in(&mut self, folder: &Path) -> &HashMap<String, String> {
        self.read.entry(folder.to_owned()).or_insert_with(|| {
            // The current folder has no name.
            let named = if folder == Path::new("") { Path::new(".") } else { folder };
            let entries = fs::read_dir(named).into_iter().flatten().flatten();
            let names = entries.filter_map(|entry| entry.file_name().into_string().ok());
            let mut names: Vec<String> = names.collect();
            // Of two, each disk may list another one last.
            names.sort_unstable();
            names.into_iter().map(|name| (name.to_lowercase(), name)).collect()
        })
    }
}

/// `inc/a.h` for `src/../inc/a.h`, so that a file has one name.
fn without_detours(file: PathBuf) -> PathBuf {
    let mut short = PathBuf::new();
    for part in file.components() {
        let is_after_name = matches!(short.components().next_back(), Some(Component::Normal(_)));
        if part == Component::ParentDir && is_after_name {
            short.pop();
        } else {
            short.push(part);
        }
    }
    // Where a folder is a link, `..` leads elsewhere.
    let is_same = short == file || fs::canonicalize(&short).ok() == fs::canonicalize(&file).ok();
    if is_same {
        short
    } else {
        file
    }
}

/// The text with spaces in place of all comments of several lines and of raw texts, so that all else stays where it is.
pub(crate) fn without_comments(text: &[u8]) -> Vec<u8> {
    blanked(text, false)
}

/// The same with spaces also in place of all other comments and of all texts.
pub(crate) fn without_texts(text: &[u8]) -> Vec<u8> {
    blanked(text, true)
}

fn blanked(text: &[u8], is_all: bool) -> Vec<u8> {
    let mut code = text.to_owned();
    let mut at = 0;
    while at < text.len() {
        at += match &text[at..] {
            [b'/', b'*', rest @ ..] => {
                let Some(end) = rest.windows(2).position(|it| it == b"*/") else { break };
                blank(&mut code[at..at + end + 4]);
                end + 4
            }
            [b'/', b'/', ..] => {
                let length = length_to(&text[at..], b'\n');
                // In its first line it may also be a part of a path, and does no harm.
                let first = if is_all { 0 } else { length_to_line(&text[at..]).min(length) };
                blank(&mut code[at + first..at + length]);
                length
            }
            [b'R', b'"', ..] if is_prefix(word_before(&text[..at])) => blank_raw(&mut code[at..]),
            // In a number a quote separates digits.
            [b'0'..=b'9', ..] if word_before(&text[..at]).is_empty() => {
                length_of_number(&text[at..])
            }
            [quote @ (b'"' | b'\''), rest @ ..] => {
                let length = 1 + length_to(rest, *quote);
                if is_all {
                    blank(&mut code[at..at + length]);
                }
                length
            }
            _ => 1,
        };
    }
    code
}

/// What stands before the `R` of a raw text. Any other word with it is a name, such as a macro.
fn is_prefix(word: &[u8]) -> bool {
    matches!(word, b"" | b"u8" | b"u" | b"U" | b"L")
}

/// The letters and digits at the end.
fn word_before(text: &[u8]) -> &[u8] {
    let is_of_word = |byte: &u8| byte.is_ascii_alphanumeric() || *byte == b'_';
    // A prefix is not longer.
    let length = text.iter().rev().take(3).take_while(|byte| is_of_word(byte)).count();
    &text[text.len() - length..]
}

/// Puts spaces in place of a raw text `R"x(…)x"` that begins here. Returns how long it is: one without an end is the rest.
fn blank_raw(code: &mut [u8]) -> usize {
    // Its mark has at most 16 characters.
    let begin = code.iter().take(2 + 17).position(|byte| *byte == b'(');
    let end_of = |begin: usize| {
        let end = [b")", &code[2..begin], b"\""].concat();
        let length = code[begin..].windows(end.len()).position(|it| it == end)?;
        Some(begin + length + end.len())
    };
    let Some(begin) = begin else { return 1 };
    let Some(end) = end_of(begin) else { return code.len() };
    blank(&mut code[2..end]);
    end
}

/// Puts spaces in place of this. Lines stay lines.
fn blank(code: &mut [u8]) {
    code.iter_mut().filter(|it| !matches!(it, b'\r' | b'\n')).for_each(|it| *it = b' ');
}

/// How long the first line is.
fn length_to_line(text: &[u8]) -> usize {
    text.iter().position(|byte| *byte == b'\n').map_or(text.len(), |end| end + 1)
}

/// How long a number is.
fn length_of_number(text: &[u8]) -> usize {
    let is_of_word = |byte: &u8| byte.is_ascii_alphanumeric() || matches!(byte, b'_' | b'.');
    let mut at = 1;
    while text.get(at).is_some_and(is_of_word)
        || (text.get(at) == Some(&b'\'') && text.get(at + 1).is_some_and(is_of_word))
    {
        at += 1;
    }
    at
}

/// How long this is with the character that ends it, at most until the end of the line.
fn length_to(text: &[u8], end: u8) -> usize {
    let mut at = 0;
    while let Some(byte) = text.get(at) {
        at += match byte {
            // Spaces between it and the end of its line do not count.
            b'\\' => match text[at + 1..].iter().position(|it| !matches!(it, b' ' | b'\t' | b'\r'))
            {
                Some(spaces) if text[at + 1 + spaces] == b'\n' => spaces + 2,
                _ => 2,
            },
            _ if *byte == end || *byte == b'\n' => return at + 1,
            _ => 1,
        };
    }
    text.len()
}

/// The names in `#include` lines, where they are, and whether they are quoted.
fn includes_of(text: &[u8]) -> Vec<(String, Range<usize>, bool)> {
    let mut begin = 0;
    let mut goes_on = false;
    let mut found = Vec::new();
    for line in text.split_inclusive(|byte| *byte == b'\n') {
        // Otherwise it belongs to a text or a macro.
        let include = include_in(line).filter(|_| !goes_on);
        found.extend(include.map(|(name, place, is_quoted)| {
            (name, place.start + begin..place.end + begin, is_quoted)
        }));
        begin += line.len();
        let before_end = line.trim_ascii_end().strip_suffix(b"\\");
        goes_on = before_end.is_some_and(|line| goes_on || !line.trim_ascii().is_empty());
    }
    found
}

fn include_in(line: &[u8]) -> Option<(String, Range<usize>, bool)> {
    let line = line.strip_prefix(b"\xEF\xBB\xBF").map_or((line, 0), |rest| (rest, 3));
    let (line, mark) = line;
    let rest = line.trim_ascii_start().strip_prefix(b"#")?.trim_ascii_start();
    let rest = rest.strip_prefix(b"include")?.trim_ascii_start();
    let close = match rest.first()? {
        b'"' => b'"',
        b'<' => b'>',
        _ => return None,
    };
    let length = rest[1..].iter().position(|byte| *byte == close)?;
    let start = line.len() - rest.len() + mark;
    // In another character set it is one that is not known.
    let name = std::str::from_utf8(&rest[1..=length]).ok()?.trim().to_owned();
    Some((name, start..start + length + 2, close == b'"'))
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// Writes a file, and the folders that it lies in.
    pub(crate) fn write(folder: &Path, name: &str, text: &str) -> PathBuf {
        let path = folder.join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(&path, text).unwrap();
        path
    }

    #[test]
    fn of_two_files_in_other_cases_the_last_one_in_order_is_meant() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["GATE.H", "Gate.h", "gATE.h"].map(|name| write(folder.path(), name, "")) {
            assert!(name.is_file());
        }
        let found = Listings::default().in_other_case(folder.path(), "gate.h").unwrap();
        let is_last = found.file_name().unwrap() == "gATE.h";
        assert!(is_last || cfg!(any(windows, target_os = "macos")), "{found:?}");
    }

    #[test]
    fn a_raw_text_includes_nothing() {
        let text = b"auto a = R\"x(\n#include \"a.h\" // )\"\n)x\", b = u8R\"(\n#include \"a.h\"\n)\";\n#include \"b.h\"\n\
                     ERR\"(a\", /*\n#include \"a.h\"\n*/ \")\"\nR\"(open\n#include \"c.h\"\n";
        let names: Vec<_> =
            includes_of(&without_comments(text)).into_iter().map(|(name, ..)| name).collect();
        assert_eq!(names, ["b.h", "c.h"]);
    }

    #[test]
    fn all_ways_to_write_an_include_are_read() {
        let text =
            "\u{feff}#include \"a.h\"\n  # include <b/c.h> /* why */\r\n#include\"..\\D.H\"\n\
                    #include MACRO\n#define X \"x.h\"\n#include_next <n.h>\n";
        let expected = [
            ("a.h", "\"a.h\"", true),
            ("b/c.h", "<b/c.h>", false),
            ("..\\D.H", "\"..\\D.H\"", true),
        ];
        let found = includes_of(text.as_bytes());
        let found: Vec<_> = found
            .iter()
            .map(|(name, place, quoted)| (name.as_str(), &text[place.clone()], *quoted))
            .collect();
        assert_eq!(found, expected);
    }

    #[test]
    fn what_goes_on_from_the_line_before_is_not_included() {
        let text = b"char *a = S( \\\n#include <no.h> \\\n), *b = \"\\\n#include \\\"no.h\\\"\\n\\ \r\n\";\n#include \"a.h\"\n";
        let found = includes_of(&without_comments(text));
        let names: Vec<&str> = found.iter().map(|(name, ..)| name.as_str()).collect();
        assert_eq!(names, ["a.h"]);
        // Unless that is empty.
        let text = b"\\\n#include \"a.h\"\n /* why */ \\ \n \\\n # include <b.h>\n";
        let found = includes_of(&without_comments(text));
        let names: Vec<&str> = found.iter().map(|(name, ..)| name.as_str()).collect();
        assert_eq!(names, ["a.h", "b.h"]);
    }

    #[test]
    fn what_is_in_a_comment_is_not_included() {
        let text = "/* one */ #include \"a.h\"\n/*\n#include \"no.h\"\n*/\n// it's /* one\n#include <b.h>\n\
                    char *s = \"\\\"/*\", c = '\"', d = '\\'';\n#include \"dir//*c.h\"\n/* no end\n#include <d.h>\n";
        let more = "int x = 1'000; /* old:\n#include \"no.h\"\n*/ // C:\\dir\\\r\n#include \"no.h\"\r\nint y = 0x1'f; /*'*/\n";
        let text = &[more, text].concat();
        let code = without_comments(text.as_bytes());
        assert_eq!(code.len(), text.len());
        let found = includes_of(&code);
        let names: Vec<&str> = found.iter().map(|(name, ..)| name.as_str()).collect();
        assert_eq!(names, ["a.h", "b.h", "dir//*c.h", "d.h"]);
        assert!(found.iter().all(|(name, place, _)| text[place.clone()].contains(name)));
    }

    #[test]
    fn headers_may_include_each_other_however_deep() {
        const DEPTH: usize = 5000;
        let folder = tempfile::tempdir().unwrap();
        let sources: Vec<_> = (0..DEPTH)
            .map(|number| {
                let text = format!("#include \"{}.h\"\n#include \"0.h\"\n", number + 1);
                write(folder.path(), &format!("{number}.h"), &text)
            })
            .collect();
        let own = OwnFiles::read([&*sources[0]].into_iter(), &Folders::default()).unwrap();
        assert!(own.files.keys().eq(&BTreeSet::from_iter(sources)));
    }

    #[test]
    fn includes_that_the_text_does_not_show_are_counted() {
        let may_have_more = |text: &str| {
            let folder = tempfile::tempdir().unwrap();
            let source = write(folder.path(), "a.c", text);
            let own = OwnFiles::read([&*source].into_iter(), &Folders::default()).unwrap();
            own.files[&source].may_have_more_includes()
        };
        assert!(!may_have_more(" #  include <a.h>\n#include \"b.h\"\nint main(void);\n"));
        for more in
            ["# include MACRO", "#include \\\n \"c.h\"", "%:include \"c.h\"", "#import \"c.h\""]
        {
            assert!(may_have_more(&format!("#include \"b.h\"\n{more}\n")), "{more}");
        }
    }

    #[test]
    fn files_of_the_program_are_followed_once() {
        let folder = tempfile::tempdir().unwrap();
        let folder = folder.path();
        let source = write(folder, "a.c", "#include \"a.h\"\n#include \"ROBO_TX_PRG.H\"\n");
        let header = write(folder, "a.h", "#include \"a.h\"\n#include <math.h>\n");
        let own = OwnFiles::read([&*source].into_iter(), &Folders::default()).unwrap();
        assert!(own.files.keys().eq([&source, &header]), "{:?}", own.files.keys());
        let names: Vec<String> = own.includes().map(Include::name).collect();
        assert_eq!(names, ["a.h", "robo_tx_prg.h", "a.h", "math.h"]);
        let missing = folder.join("b.c");
        assert_eq!(
            OwnFiles::read([&*missing].into_iter(), &Folders::default()).unwrap_err().0,
            missing
        );
    }

    #[cfg_attr(windows, ignore = "file names are not case-sensitive there")]
    #[test]
    fn headers_are_found_in_include_folders_and_in_other_cases() {
        let folder = tempfile::tempdir().unwrap();
        let folder = folder.path();
        let source =
            write(folder, "src/a.c", "#include \"One.h\"\n#include <two.h>\n#include <three.h>\n");
        let one = write(folder, "src/one.h", "");
        let two = write(folder, "inc/two.h", "#include \"..\\Inc2\\FOUR.H\"\n");
        write(folder, "inc2/TWO.h", "");
        let four = write(folder, "inc2/four.h", "");
        let all = vec![folder.join("inc2"), folder.join("inc")];
        let folders = Folders { all, ..Folders::default() };
        let own = OwnFiles::read([&*source].into_iter(), &folders).unwrap();
        let found = |file: &Path| {
            own.files[file].includes.iter().map(|it| it.own().cloned()).collect::<Vec<_>>()
        };
        let own_file = |file, is_exact, is_beside| Some(Own { file, is_exact, is_beside });
        assert_eq!(
            found(&source),
            [own_file(one, false, true), own_file(two.clone(), true, false), None]
        );
        assert_eq!(found(&two), [own_file(four, false, true)]);
    }
}
