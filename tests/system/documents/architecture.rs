//! The tables of the architecture name files and folders: each is there.

use std::fs;
use std::path::Path;

use pulldown_cmark::{Event, Tag, TagEnd};

use super::links::{parse, root};

/// What these tables name as a file of Rust or a folder.
fn named(text: &str) -> Vec<String> {
    let mut is_table = false;
    let mut named = Vec::new();
    for event in parse(text) {
        match event {
            Event::Start(Tag::Table(_)) => is_table = true,
            Event::End(TagEnd::Table) => is_table = false,
            Event::Code(name) if is_table && (name.ends_with(".rs") || name.ends_with('/')) => {
                named.push(name.trim_end_matches('/').to_owned());
            }
            _ => {}
        }
    }
    named
}

/// Whether a file or folder in this one has such a path, whatever is before it.
fn has(folder: &Path, name: &str) -> bool {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let mut entries = entries.filter(|path| !path.ends_with("target") && !path.ends_with(".git"));
    entries.any(|path| path.ends_with(name) || (path.is_dir() && has(&path, name)))
}

fn missing(text: &str) -> Vec<String> {
    named(text).into_iter().filter(|name| !has(&root(), name)).collect()
}

#[test]
fn each_file_and_folder_in_a_table_of_the_architecture_is_there() {
    let text = fs::read_to_string(root().join("docs/architecture.md")).unwrap();
    assert!(named(&text).len() > 80, "the tables are found");
    assert_eq!(missing(&text), [""; 0]);
}

#[test]
fn a_name_of_nothing_is_found() {
    let text = "| file | |\n|---|---|\n| `watch/tap.rs`, `gone.rs` | `panel/` |\n\n`other.rs`";
    assert_eq!(missing(text), [""; 0]);
    let text = text.replace("tap.rs", "top.rs").replace("panel/", "penal/");
    assert_eq!(missing(&text), ["watch/top.rs", "penal"]);
}
