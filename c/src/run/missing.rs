//! What a program lacks of its own: a header in a folder that was not named, a source that was not named.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use crate::inputs::Language;
use crate::link::folder_of;
use crate::{read, sources};

/// How far below and above the sources is looked, and at how many files at most. People wait for this.
const DEPTH: usize = 3;
const MOST_FILES: usize = 5000;
const MOST_SOURCES: usize = 200;
/// How much of their text is looked at for functions, in bytes, and for how many of these.
const MOST_TEXT: usize = 16 << 20;
const MOST_MISSING: usize = 50;
/// How long the parameters of a function are at most, in bytes. Parentheses in a text or a comment have no end.
const MOST_PARAMETERS: usize = 4096;
/// A few names show what is missing.
const MOST_NAMES: usize = 3;

/// What to do about a header that a compiler has not found.
pub(crate) fn advice_for_header(header: &str, source: &Path) -> String {
    match folder_with(header, source) {
        Some(folder) => format!("; {header} is found with -I {}", folder.display()),
        None => format!("; {header} is missing: name its folder with -I, if you have it"),
    }
}

/// The folder with a header: below that of the source, or the one above it.
fn folder_with(header: &str, source: &Path) -> Option<PathBuf> {
    let header = header.replace('\\', "/");
    let parts: Vec<&str> =
        header.split('/').filter(|part| !matches!(*part, "" | "." | "..")).collect();
    let mut left = MOST_FILES;
    let folder = folder_of(source);
    // Above the current folder there are other programs.
    let above = folder.parent().filter(|_| folder != Path::new("."));
    let above = above.map(|it| if it == Path::new("") { Path::new(".") } else { it });
    let found = find(&parts, folder, DEPTH, &mut left);
    found.or_else(|| find(&parts, above?, DEPTH - 1, &mut left))
}

/// The folder from which these parts of a path lead to a file, in any case.
fn find(parts: &[&str], folder: &Path, depth: usize, left: &mut usize) -> Option<PathBuf> {
    let mut below = Vec::new();
    let mut found = false;
    for entry in fs::read_dir(folder).ok()?.flatten() {
        *left = left.checked_sub(1)?;
        let name = entry.file_name().to_string_lossy().into_owned();
        if parts.first().is_some_and(|first| name.eq_ignore_ascii_case(first)) {
            found |= leads_to_file(&parts[1..], &entry.path(), left);
        }
        let is_folder = entry.file_type().is_ok_and(|it| it.is_dir()) && !name.starts_with('.');
        if is_folder && depth > 0 {
            below.push(entry.path());
        }
    }
    if found {
        return Some(
            folder
                .strip_prefix(".")
                .ok()
                .filter(|it| *it != Path::new(""))
                .unwrap_or(folder)
                .into(),
        );
    }
    below.sort();
    below.iter().find_map(|folder| find(parts, folder, depth - 1, left))
}

fn leads_to_file(parts: &[&str], place: &Path, left: &mut usize) -> bool {
    let [first, rest @ ..] = parts else { return place.is_file() };
    for entry in fs::read_dir(place).into_iter().flatten().flatten() {
        // Of links that lead back there are more with each part.
        if *left == 0 {
            return false;
        }
        *left -= 1;
        let is_named = entry.file_name().to_string_lossy().eq_ignore_ascii_case(first);
        if is_named && leads_to_file(rest, &entry.path(), left) {
            return true;
        }
    }
    false
}

/// What to do about functions that a linker has not found. `named` are the sources that it was made of.
pub(crate) fn advice_for_names(missing: &[&str], named: &[&Path]) -> String {
    let mut nowhere = missing[..missing.len().min(MOST_MISSING)].to_vec();
    let mut left = MOST_TEXT;
    let in_own =
        take_defined(&mut nowhere, named.iter().map(|source| source.to_path_buf()), &mut left);
    let in_others = take_defined(&mut nowhere, other_sources(named).into_iter(), &mut left);
    let differs = "but not as it is called: with other arguments, or in the other language (extern \"C\", -x)";
    let in_own = in_own.iter().map(|(file, names)| (file, names, differs));
    let in_others = in_others.iter().map(|(file, names)| (file, names, "name this file, too"));
    let found = in_own.chain(in_others);
    let found = found
        .map(|(file, names, what)| format!("; {} has {}: {what}", file.display(), listed(names)));
    let nowhere = (!nowhere.is_empty()).then(|| {
        format!("; no source here has {}: a file is missing, or a library (-l)", listed(&nowhere))
    });
    found.chain(nowhere).collect()
}

/// Names, by the file that has them.
type ByFile<'a> = BTreeMap<PathBuf, Vec<&'a str>>;

/// Takes those names that one of these files defines. Only one file's text is in memory.
fn take_defined<'a>(
    missing: &mut Vec<&'a str>,
    files: impl Iterator<Item = PathBuf>,
    left: &mut usize,
) -> ByFile<'a> {
    let mut found = ByFile::new();
    for file in files {
        if missing.is_empty() || *left == 0 {
            break;
        }
        let mut text = read::file(&file).unwrap_or_default();
        text.truncate(*left);
        *left -= text.len();
        let code = sources::without_comments(&text);
        let text = String::from_utf8_lossy(&code);
        let (defined, others) = missing.iter().partition(|name| defines(&text, name));
        *missing = others;
        if !defined.is_empty() {
            found.insert(file, defined);
        }
    }
    found
}

fn listed(names: &[&str]) -> String {
    let shown = names[..names.len().min(MOST_NAMES)].join(", ");
    if names.len() > MOST_NAMES {
        shown + " and more"
    } else {
        shown
    }
}

/// The sources that lie beside those that were named.
fn other_sources(named: &[&Path]) -> Vec<PathBuf> {
    let mut folders: Vec<&Path> = named.iter().map(|source| folder_of(source)).collect();
    folders.sort();
    folders.dedup();
    let whole: BTreeSet<_> = named.iter().map(|source| fs::canonicalize(source).ok()).collect();
    let is_named = |file: &Path| whole.contains(&fs::canonicalize(file).ok());
    let files =
        folders.iter().flat_map(|folder| fs::read_dir(folder).into_iter().flatten().flatten());
    let files =
        files.map(|entry| entry.path().strip_prefix(".").map_or(entry.path(), Path::to_owned));
    let mut files: Vec<PathBuf> = files
        .filter(|file| Language::of(file).is_some() && file.is_file() && !is_named(file))
        .take(MOST_SOURCES)
        .collect();
    files.sort();
    files
}

/// Whether a text defines a function or an object with this name, as far as that can be seen: behind the name and the
/// parentheses comes a brace, or a value.
fn defines(text: &str, name: &str) -> bool {
    let is_part = |c: char| c.is_alphanumeric() || c == '_';
    text.match_indices(name).any(|(at, _)| {
        let is_whole =
            !text[..at].ends_with(is_part) && !text[at + name.len()..].starts_with(is_part);
        is_whole && is_definition(&text[at + name.len()..])
    })
}

fn is_definition(rest: &str) -> bool {
    let rest = rest.trim_start();
    let Some(inner) = rest.strip_prefix('(') else {
        return rest.starts_with('=') && !rest.starts_with("==");
    };
    let mut depth = 1;
    let end = inner.char_indices().take_while(|(at, _)| *at < MOST_PARAMETERS).find(|(_, c)| {
        depth += i32::from(*c == '(') - i32::from(*c == ')');
        depth == 0
    });
    let behind = end.map_or("", |(end, _)| inner[end + 1..].trim_start());
    let behind = behind.strip_prefix("const").unwrap_or(behind).trim_start();
    behind.starts_with('{') || (behind.starts_with(':') && !behind.starts_with("::"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sources::tests::write;

    #[test]
    fn the_folder_of_a_header_is_found_beside_and_above_the_source() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        let main = write(folder.path(), "src/main.c", "");
        write(folder.path(), "src/inc/one.h", "");
        write(folder.path(), "deps/include/line/Two.h", "");
        let found = |header| folder_with(header, &main);
        assert_eq!(found("one.h"), Some(at("src/inc")));
        assert_eq!(found("line\\two.h"), Some(at("deps/include")));
        assert_eq!(found("../line/two.h"), Some(at("deps/include")));
        assert_eq!(found("three.h"), None);
        assert!(advice_for_header("three.h", &main).contains("-I"));
    }

    #[cfg(unix)]
    #[test]
    fn links_that_lead_back_are_followed_for_a_while() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["a", "A"] {
            std::os::unix::fs::symlink(".", folder.path().join(name)).unwrap();
        }
        let main = write(folder.path(), "main.c", "");
        assert_eq!(folder_with(&("a/".repeat(60) + "none.h"), &main), None);
        assert!(folder_with(&("a/".repeat(5) + "main.c"), &main).is_some());
    }

    #[test]
    fn a_definition_is_told_from_a_call_and_a_declaration() {
        assert!(defines("int axis_move(int a, int (*f)(void))\n{\n}", "axis_move"));
        assert!(defines("void Axis::move(int a) const {", "Axis::move"));
        assert!(defines("Axis::Axis() : a(1) {", "Axis::Axis"));
        assert!(defines("int axis = 4;", "axis"));
        for text in
            ["int axis(int);", "x = axis(1) + 2;", "void my_axis(void) {", "if (axis == 1)", "axis"]
        {
            assert!(!defines(text, "axis"), "{text}");
        }
    }

    #[test]
    fn no_more_is_looked_at_than_people_wait_for() {
        let parameters = |count| format!("int axis({}) {{", "int, ".repeat(count));
        assert!(defines(&parameters(100), "axis") && !defines(&parameters(1000), "axis"));
        let folder = tempfile::tempdir().unwrap();
        let source = write(folder.path(), "axis.c", "int one = 1; int two = 2;");
        let found = |left: &mut usize| {
            let mut missing = vec!["one", "two"];
            take_defined(&mut missing, [source.clone(), source.clone()].into_iter(), left);
            missing
        };
        let mut left = 30;
        assert_eq!((found(&mut left), left), (vec![], 5));
        assert_eq!((found(&mut left), left), (vec!["one", "two"], 0));
    }

    #[test]
    fn the_other_file_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let main = write(folder.path(), "main.c", "int one(void) { return two(); }");
        let axis = write(folder.path(), "axis.c", "int two(void) { return 2; }");
        let advice = |names: &[&str]| advice_for_names(names, &[&main]);
        assert_eq!(advice(&["two"]), format!("; {} has two: name this file, too", axis.display()));
        assert!(advice(&["three", "four", "five", "six"])
            .contains("has three, four, five and more: a file"));
        assert!(advice(&["one"]).contains("main.c has one: but not as it is called"));
        assert_eq!(advice(&[]), "");
    }
}
