//! The messages in docs/troubleshooting.md are those of the programs.

use std::fs;
use std::path::{Path, PathBuf};

/// Where messages come from. Those of the system and of other programs are in none of them.
const SOURCES: [&str; 4] = ["src", "simulator/src", "c/src", "tools/src"];

/// What others say: the dynamic linker, and the name of a signal.
const OTHERS: [&str; 2] = ["error while loading shared libraries", "SIGSEGV"];

fn add_sources(folder: &Path, text: &mut String) {
    let mut entries: Vec<PathBuf> =
        fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    entries.sort();
    for path in entries {
        if path.is_dir() {
            add_sources(&path, text);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            text.push_str(&fs::read_to_string(path).unwrap().replace("\r\n", "\n"));
        }
    }
}

/// The sources, with each text that goes on in the next line as one line.
fn messages() -> String {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let mut text = String::new();
    SOURCES.iter().for_each(|folder| add_sources(&root.join(folder), &mut text));
    let mut parts = text.split("\\\n");
    let first = parts.next().unwrap_or_default().to_owned();
    parts.fold(first, |all, part| all + part.trim_start())
}

#[test]
fn the_messages_in_the_document_are_those_of_the_programs() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let document = fs::read_to_string(root.join("docs/troubleshooting.md")).unwrap();
    let messages = messages();
    let seen = document.lines().filter_map(|line| line.strip_prefix("| ")?.split(" | ").next());
    let quoted = seen.flat_map(|seen| seen.split('`').skip(1).step_by(2));
    let quoted: Vec<&str> = quoted.filter(|message| !OTHERS.contains(message)).collect();
    assert!(quoted.len() > 20, "{quoted:?}");
    for message in quoted {
        // Between its parts is what differs.
        for part in message.split('…').map(str::trim).filter(|part| !part.is_empty()) {
            assert!(messages.contains(part), "no program says {part:?}");
        }
    }
}
