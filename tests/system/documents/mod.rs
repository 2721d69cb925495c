//! The programs in the documents: each is a file in `programs/`, is built as an example, runs here
//! with a simulated TXT, and is in its document without changes. `cargo test` builds them, too. For
//! this test alone, `cargo build -p ft-transfer-area-system-tests --examples` does.
//!
//! `UPDATE_DOCUMENTS=1 cargo test --workspace --test system documents` writes them into the documents again.

mod architecture;
mod camera;
mod links;
mod troubleshooting;

use std::{env, fs};

const UPDATE: &str = "UPDATE_DOCUMENTS";

/// Programs and their documents. Each comes after the line that names it.
const PROGRAMS: [(&str, &str); 6] = [
    ("camera_pictures", "camera.md"),
    ("camera_file", "camera.md"),
    ("camera_browser", "camera.md"),
    ("camera_newest", "camera.md"),
    ("first_steps", "lessons/en/00-first-steps.md"),
    ("erste_schritte", "lessons/de/00-erste-schritte.md"),
];

/// The document with this program in it, between the line that names it and the end of its block.
fn with_program(document: &str, name: &str, program: &str) -> String {
    let head = format!("<!-- program {name} -->\n```rust,ignore\n");
    let (before, rest) =
        document.split_once(&head).unwrap_or_else(|| panic!("no place for {name}"));
    let (_, after) = rest.split_once("\n```\n").expect("the block has an end");
    format!("{before}{head}{}\n```\n{after}", program.trim_end())
}

#[test]
fn each_program_is_in_its_document_without_changes() {
    let root = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");
    for (name, document) in PROGRAMS {
        let program =
            fs::read_to_string(format!("{root}/tests/system/documents/programs/{name}.rs"))
                .unwrap();
        let path = format!("{root}/docs/{document}");
        let written = fs::read_to_string(&path).unwrap();
        let expected = with_program(&written, name, &program);
        if env::var_os(UPDATE).is_some() {
            fs::write(&path, expected).unwrap();
        } else {
            assert!(written == expected, "docs/{document} has another {name}: set {UPDATE}=1");
        }
    }
}

/// `cargo add` would offer them to everybody.
#[test]
fn the_published_packages_have_no_features() {
    for manifest in
        [include_str!("../../../Cargo.toml"), include_str!("../../../simulator/Cargo.toml")]
    {
        assert!(!manifest.contains("[features]"), "{manifest}");
    }
}
