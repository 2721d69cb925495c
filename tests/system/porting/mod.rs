//! docs/names.md gives the Rust name of every field and every call of the C headers. Here its
//! tables are made from the crate's source and compared with the document.
//!
//! `UPDATE_PORTING=1 cargo test --workspace --test system porting` writes them again.

#[allow(dead_code, unused_mut, unused_variables, reason = "compiled and read as text, never run")]
mod calls;
mod fields;
mod libraries;
mod names;
mod public;
mod rows;
mod source;
mod whole;

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use libraries::{Calls, Library, Without, CALLS};
use names::{NAMES, PACKETS, PACKET_IDS};
use source::{Item, Source};

const BEGIN: &str = "<!-- The tables from here on are made by tests/system/porting. -->\n";
const END: &str = "<!-- The tables end here. -->";
const UPDATE: &str = "UPDATE_PORTING";

#[test]
fn the_document_names_every_field_and_call() {
    let source = Source::read();
    let (fields, mut mistakes) = fields::rows(&source);
    let mut tables = Tables { source: &source, by_name: by_name(&source), lines: Vec::new() };
    tables.section("Fields of the transfer area", &fields);
    for library in CALLS {
        mistakes.extend(tables.calls(library));
    }
    for library in NAMES {
        mistakes.extend(tables.library(library));
    }
    mistakes.extend(tables.packets());
    tables.further_names();
    // Several libraries have the same call.
    let mistakes: BTreeSet<String> = mistakes.into_iter().collect();
    assert!(mistakes.is_empty(), "{mistakes:#?}");

    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/names.md");
    let document = fs::read_to_string(&path).unwrap().replace("\r\n", "\n");
    let (before, rest) = document.split_once(BEGIN).expect("no line where the tables begin");
    let (present, after) = rest.split_once(END).expect("no line where the tables end");
    let expected = format!("\n{}\n", tables.lines.join("\n"));
    if std::env::var_os(UPDATE).is_some() {
        fs::write(&path, format!("{before}{BEGIN}{expected}{END}{after}")).unwrap();
        return;
    }
    let difference = difference(present, &expected);
    assert!(
        difference.is_empty(),
        "docs/names.md does not agree with the crate's names:\n{difference}\
         {UPDATE}=1 cargo test --workspace --test system porting writes its tables again\n"
    );
}

/// Lines that the document should not have (`-`), and lines that it lacks (`+`).
fn difference(present: &str, expected: &str) -> String {
    let [old, new] = [present, expected].map(|text| text.lines().collect::<BTreeSet<_>>());
    let removed = old.difference(&new).map(|line| format!("- {line}\n"));
    let added = new.difference(&old).map(|line| format!("+ {line}\n"));
    let lines: String = removed.chain(added).collect();
    if lines.is_empty() && present != expected {
        return "the same lines in another order\n".to_owned();
    }
    lines
}

/// The Rust items of each C name: by their alias, or for a constant by its own name.
fn by_name(source: &Source) -> BTreeMap<&str, Vec<String>> {
    let mut names = source.by_alias();
    for item in source.constants() {
        names.entry(&item.name).or_insert_with(|| vec![source.show(item)]);
    }
    names
}

struct Tables<'a> {
    source: &'a Source,
    by_name: BTreeMap<&'a str, Vec<String>>,
    lines: Vec<String>,
}

impl Tables<'_> {
    fn section(&mut self, heading: &str, rows: &[String]) {
        self.lines.extend([format!("## {heading}"), String::new()]);
        self.table(rows);
    }

    fn table(&mut self, rows: &[String]) {
        self.lines.extend_from_slice(rows);
        self.lines.push(String::new());
    }

    /// Adds the tables of a library's calls; returns which calls have no counterpart by their name.
    fn calls(&mut self, library: &Calls) -> Vec<String> {
        let rows = rows::rows(library.heading);
        let mut mistakes = Vec::new();
        if rows.is_empty() {
            mistakes.push(format!("calls.rs has nothing for {}", library.heading));
        }
        for row in rows.iter().filter(|_| library.has_aliases) {
            let name = row.name();
            match self.by_name.get(name) {
                Some(shown) if shown.iter().any(|shown| row.code.contains(last_name(shown))) => {}
                Some(shown) => mistakes.push(format!("calls.rs has {name} without {shown:?}")),
                None => mistakes.push(format!("nothing has #[doc(alias = \"{name}\")]")),
            }
        }
        let lines = rows.iter().map(rows::Row::line);
        let lines: Vec<String> = head("Rust").into_iter().chain(lines).collect();
        self.section(library.heading, &lines);
        mistakes.extend(self.without(library.without));
        mistakes
    }

    /// Adds a library's tables; returns which names have neither a counterpart nor a reason.
    fn library(&mut self, library: &Library) -> Vec<String> {
        let mut mistakes = Vec::new();
        let mut rows = head("Rust");
        let mut kept = Vec::new();
        for name in library.names {
            match self.by_name.get(name) {
                Some(shown) if *shown == [format!("transfer_area::{name}")] => {
                    kept.push(format!("`{name}`"));
                }
                Some(shown) => rows.push(row(name, shown)),
                None => mistakes.push(format!("nothing has #[doc(alias = \"{name}\")]")),
            }
        }
        if !kept.is_empty() {
            rows.push(format!("| {} | the same names in `transfer_area` |", kept.join(", ")));
        }
        self.section(library.heading, &rows);
        mistakes.extend(self.without(library.without));
        mistakes
    }

    /// Adds a table of names without a counterpart; returns which of them have one.
    fn without(&mut self, without: Without) -> Vec<String> {
        let mut mistakes = Vec::new();
        let mut rows = head("none, because");
        for (names, reason) in without {
            for name in names.iter().filter(|name| self.by_name.contains_key(*name)) {
                mistakes.push(format!("{name} has a counterpart, so it needs no reason"));
            }
            let names: Vec<String> = names.iter().map(|name| format!("`{name}`")).collect();
            rows.push(format!("| {} | {reason} |", names.join(", ")));
        }
        if !without.is_empty() {
            self.table(&rows);
        }
        mistakes
    }

    fn packets(&mut self) -> Vec<String> {
        let mut mistakes = Vec::new();
        let mut rows = head("Rust");
        for id in PACKET_IDS {
            match self.by_name.get(id) {
                Some(shown) => rows.push(row(id, shown)),
                None => mistakes.push(format!("nothing has #[doc(alias = \"{id}\")]")),
            }
        }
        for (packet, c_fields) in PACKETS {
            let is_packet = |item: &&Item| item.aliases.iter().any(|alias| alias == packet);
            let Some(item) = self.source.items.iter().find(is_packet) else {
                mistakes.push(format!("nothing has #[doc(alias = \"{packet}\")]"));
                continue;
            };
            rows.push(row(packet, &[self.source.show(item)]));
            let fields: Vec<&Item> = self.source.fields(item).collect();
            if fields.len() != c_fields.len() {
                mistakes.push(format!("{} does not have the fields of {packet}", item.place()));
            }
            for (field, name) in fields.into_iter().zip(*c_fields) {
                rows.push(row(&format!("{packet}.{name}"), &[self.source.show(field)]));
                if name.strip_prefix("m_") != Some(&field.name) {
                    mistakes.extend(fields::unnamed(field, name));
                }
            }
        }
        self.section("Packets", &rows);
        mistakes
    }

    /// Adds the C names that are in none of the tables yet, such as the name of an argument.
    fn further_names(&mut self) {
        let cells = self.lines.iter().filter_map(|line| line.split(" | ").next());
        // The last part of a path; an array has `[0]` after its name.
        let names = cells.flat_map(|cell| cell.split(['|', '`', '.', '[', '(', ' ']));
        let tx = self.lines.iter().filter_map(|line| line.split(" | ").nth(1));
        let tx = tx.flat_map(|cell| cell.split(['`', '.', '[']));
        let reported: BTreeSet<&str> = names.chain(tx).collect();
        let aliases = self.source.by_alias().into_iter();
        let further = aliases.filter(|(name, _)| !reported.contains(name));
        let rows = further.map(|(name, shown)| row(name, &shown));
        let head = ["| name | Rust |", "|---|---|"].map(str::to_owned);
        let rows: Vec<String> = head.into_iter().chain(rows).collect();
        self.section("Further names", &rows);
    }
}

fn head(second: &str) -> Vec<String> {
    vec![format!("| C | {second} |"), "|---|---|".to_owned()]
}

fn row(name: &str, shown: &[String]) -> String {
    let shown: Vec<String> = shown.iter().map(|name| format!("`{name}`")).collect();
    format!("| `{name}` | {} |", shown.join(", "))
}

/// The last name of a path or a call, such as `lock` of `handler.areas().lock()`.
fn last_name(shown: &str) -> &str {
    let path = shown.split('(').next().unwrap_or(shown);
    path.rsplit(['.', ':']).next().unwrap_or(path)
}
