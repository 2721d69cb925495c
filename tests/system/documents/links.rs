//! The links between the documents: each leads to a file that exists and is in the package, and to a
//! heading in it. Links to the web are not followed.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::{env, fs};

use pulldown_cmark::{Event, LinkType, Options, Parser, Tag, TagEnd};

pub(super) fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").canonicalize().unwrap()
}

/// The published files, as paths from the root.
fn package() -> BTreeSet<PathBuf> {
    let mut files = files_of("ft-transfer-area", "");
    files.extend(files_of("ft-transfer-area-simulator", "simulator"));
    files
}

/// The published files of a package in this folder.
fn files_of(package: &str, folder: &str) -> BTreeSet<PathBuf> {
    let output = Command::new(env::var_os("CARGO").unwrap())
        .args(["package", "--list", "--allow-dirty", "--offline", "--package", package])
        .current_dir(root())
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let files = String::from_utf8(output.stdout).unwrap();
    files.lines().map(|file| Path::new(folder).join(file)).collect()
}

pub(super) fn parse(text: &str) -> Parser<'_> {
    Parser::new_ext(text, Options::ENABLE_TABLES)
}

/// A heading's name in links: lower-case letters and digits, `-` for a space.
fn anchor(heading: &str) -> String {
    let named = |c: &char| c.is_alphanumeric() || matches!(c, ' ' | '-' | '_');
    heading.to_lowercase().chars().filter(named).map(|c| if c == ' ' { '-' } else { c }).collect()
}

fn anchors(text: &str) -> BTreeSet<String> {
    let mut anchors = BTreeSet::new();
    let mut heading: Option<String> = None;
    for event in parse(text) {
        match event {
            Event::Start(Tag::Heading { .. }) => heading = Some(String::new()),
            Event::End(TagEnd::Heading(_)) => {
                anchors.extend(heading.take().map(|text| anchor(&text)))
            }
            Event::Text(text) | Event::Code(text) => {
                if let Some(heading) = &mut heading {
                    heading.push_str(&text);
                }
            }
            _ => {}
        }
    }
    anchors
}

fn links(text: &str) -> Vec<String> {
    let target = |event| match event {
        Event::Start(Tag::Link { dest_url, .. } | Tag::Image { dest_url, .. }) => {
            Some(dest_url.into_string())
        }
        _ => None,
    };
    parse(text).filter_map(target).filter(|link| !link.contains("://")).collect()
}

/// What is wrong with a link of this document.
fn mistake(document: &Path, link: &str, package: &BTreeSet<PathBuf>) -> Option<&'static str> {
    let (file, heading) = link.split_once('#').unwrap_or((link, ""));
    let path = match file {
        "" => document.to_owned(),
        _ => {
            let Ok(path) = root().join(document).parent()?.join(file).canonicalize() else {
                return Some("no such file");
            };
            path.strip_prefix(root()).ok()?.to_owned()
        }
    };
    // The samples need the simulated TXT, so they are only in the repository.
    if !package.contains(&path) && !path.starts_with("examples") {
        return Some("not in the package");
    }
    let text = fs::read_to_string(root().join(&path)).ok()?;
    (!heading.is_empty() && !anchors(&text).contains(heading)).then_some("no such heading")
}

#[cfg_attr(windows, ignore = "Wine has no cargo, which knows the files of a package")]
#[test]
fn every_link_in_the_documents_leads_to_something_in_the_package() {
    let package = package();
    let mut checked = 0;
    let mut mistakes = Vec::new();
    for document in package.iter().filter(|path| path.extension().is_some_and(|end| end == "md")) {
        let text = fs::read_to_string(root().join(document)).unwrap();
        for link in links(&text) {
            checked += 1;
            if let Some(mistake) = mistake(document, &link, &package) {
                mistakes.push(format!("{}: {link}: {mistake}", document.display()));
            }
        }
    }
    assert!(checked > 30, "only {checked} links were found");
    assert!(mistakes.is_empty(), "{mistakes:#?}");
}

#[test]
fn a_link_that_leads_nowhere_is_found() {
    let package: BTreeSet<PathBuf> = ["README.md", "docs/simulator.md"].map(PathBuf::from).into();
    let mistake = |link| mistake(Path::new("docs/simulator.md"), link, &package);
    assert_eq!(mistake("../README.md#try-it"), None);
    assert_eq!(mistake("#the-world"), None);
    assert_eq!(mistake("none.md"), Some("no such file"));
    assert_eq!(mistake("protocol.md"), Some("not in the package"));
    assert_eq!(mistake("../README.md#try-that"), Some("no such heading"));
    assert_eq!(mistake("#try-it"), Some("no such heading"));
}

/// rustdoc does not find this mistake: a link with the name of a file leads nowhere in the guide.
#[test]
fn links_to_files_lead_to_pages_in_the_guide_too() {
    let guide = fs::read_to_string(root().join("src/guide.rs")).unwrap();
    let pages: Vec<&str> = guide
        .split("include_str!(\"../")
        .skip(1)
        .filter_map(|rest| rest.split('"').next())
        .collect();
    assert!(pages.contains(&"docs/porting.md"), "{pages:?}");
    let mut mistakes = Vec::new();
    for page in pages {
        let text = fs::read_to_string(root().join(page)).unwrap();
        for event in parse(&text) {
            let Event::Start(Tag::Link { link_type, dest_url, id, .. }) = event else { continue };
            let is_named = link_type != LinkType::Inline && guide.contains(&format!("[{id}]: "));
            if !dest_url.starts_with('#') && !dest_url.contains("://") && !is_named {
                mistakes.push(format!("{page}: {dest_url}"));
            }
        }
    }
    assert!(mistakes.is_empty(), "{mistakes:#?}");
}
