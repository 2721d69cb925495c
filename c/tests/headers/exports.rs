//! The library has every function that the headers declare.
#![cfg(unix)]

use std::fmt::Write;
use std::path::PathBuf;

use super::compilers::{self, Language};
use super::tables::{lines, EX_FUNCTIONS, FUNCTIONS};

/// What the headers for other systems than Windows declare.
const WINDOWS_NAMES: &str = include_str!("windows_names.csv");

/// The folder of the library, which lies beside the tests.
pub(crate) fn folder() -> PathBuf {
    let mut folder = std::env::current_exe().unwrap();
    folder.pop();
    folder
}

/// The functions that the library has not.
fn missing(names: &[&str]) -> Option<Vec<String>> {
    let compiler = compilers::for_c().next()?;
    let mut source = String::new();
    for name in names {
        writeln!(source, "extern void {name}(void);").unwrap();
    }
    source += "int main(void) {\n    void (*all[])(void) = {\n";
    for name in names {
        writeln!(source, "        {name},").unwrap();
    }
    source += "    };\n    return all[0] == 0;\n}\n";
    let file = compilers::write(&source, Language::C);
    let said = compiler
        .command()
        .args(["-fno-builtin", "-w"])
        .arg(&file)
        .arg(format!("-L{}", folder().display()))
        .args(["-lftMscLib", "-o"])
        .arg(file.with_extension("exe"))
        .output()
        .unwrap();
    if said.status.success() {
        return Some(Vec::new());
    }
    let text = String::from_utf8_lossy(&said.stderr);
    let is_missing = |name: &&&str| {
        // The linker of macOS sets an underscore before a name.
        text.contains(&format!("`{name}'")) || text.contains(&format!("\"_{name}\""))
    };
    let missing: Vec<_> = names.iter().filter(is_missing).map(ToString::to_string).collect();
    assert!(!missing.is_empty(), "{text}");
    Some(missing)
}

#[test]
fn the_library_has_all_functions() {
    let tables = lines::<3>(FUNCTIONS).chain(lines::<3>(EX_FUNCTIONS));
    let names: Vec<_> = tables.map(|[name, ..]| name).collect();
    assert_eq!(missing(&names).unwrap_or_default(), Vec::<String>::new());
}

#[test]
fn the_library_has_what_the_headers_for_other_systems_declare() {
    let names: Vec<_> = lines::<1>(WINDOWS_NAMES).map(|[name]| name).collect();
    assert_eq!(missing(&names).unwrap_or_default(), Vec::<String>::new());
}

#[test]
fn a_missing_function_is_seen() {
    let Some(missing) = missing(&["ftxInitLibrary"]) else { return };
    assert_eq!(missing, ["ftxInitLibrary"]);
}

/// By what finished programs for Windows find the functions.
const NUMBERS: &str = include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/lib/ftMscLib.def"));

#[test]
fn every_function_has_a_number_that_stays() {
    let numbered: Vec<_> =
        NUMBERS.lines().filter_map(|line| line.trim().split_once(" @")).collect();
    for (index, (name, number)) in numbered.iter().enumerate() {
        assert_eq!(number.parse(), Ok(index + 1), "{name}");
    }
    let names: Vec<_> = numbered.iter().map(|(name, _)| *name).collect();
    let tables = lines::<3>(FUNCTIONS).chain(lines::<3>(EX_FUNCTIONS));
    let functions: Vec<_> = tables.map(|[name, ..]| name).collect();
    // Those of the original's last version have the numbers that a linker gives them by their names.
    let (original, others) = functions.split_at(76);
    let mut original = original.to_vec();
    original.sort_unstable();
    assert_eq!(names[..76], original);
    assert_eq!(names[76..], *others);
}
