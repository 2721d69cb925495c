//! The program of the pages for people with ftrobopy.

use super::ftrobopy::Ftrobopy;
use crate::program::{output_in_time, txt};

const ENGLISH: &str = include_str!("../../../docs/python.md");
const GERMAN: &str = include_str!("../../../docs/python.de.md");

fn program_in(page: &str) -> &str {
    let (_, program) = page.split_once("```python\n").unwrap();
    program.split_once("```").unwrap().0
}

/// How many rows and links a page has.
fn shape(page: &str) -> [usize; 3] {
    ["\n| ", "](", "\n- "].map(|part| page.matches(part).count())
}

#[test]
fn both_languages_have_the_same_program_and_rows() {
    assert_eq!(program_in(ENGLISH), program_in(GERMAN));
    assert_eq!(shape(ENGLISH), shape(GERMAN));
}

#[cfg_attr(not(unix), ignore = "ftrobopy is only compared on Unix")]
#[test]
fn the_program_of_the_page_solves_the_first_lesson() {
    let Some(ftrobopy) = Ftrobopy::find() else { return };
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("switch.py");
    std::fs::write(&file, program_in(ENGLISH)).unwrap();
    let mut check = txt();
    check.args(["check", "--language", "en", "1", ftrobopy.python()]).arg(&file);
    let output = output_in_time(&mut check);
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{said}{}", String::from_utf8_lossy(&output.stderr));
    assert!(said.contains("Solved."), "{said}");
}
