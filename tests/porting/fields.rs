//! The transfer area's fields: C fields and Rust fields are matched by their place in memory.

use std::collections::HashMap;
use std::path::Path;

use crate::source::{Item, Kind, Source};

/// Every field of the TXT's header, where a C compiler places it.
const TXT: &str = include_str!("transfer_area.csv");
/// The fields of the ROBO TX's header, which has other names for the same memory.
const ROBO_TX: &str = include_str!("robo_tx.csv");
/// Every field of the crate, checked when the crate is compiled.
const RUST: &str = include_str!("../../src/transfer_area/layout.rs");

/// Offset and size in bytes, and the depth in the structure: a struct and its only field have the
/// same offset and size.
type Place = (usize, usize, usize);

struct Field {
    /// Its path, with `[0]` after an array of structs.
    path: Vec<String>,
    place: Place,
}

impl Field {
    fn new(path: &str, offset: &str, size: &str) -> Self {
        let path: Vec<String> = path.split('.').map(str::to_owned).collect();
        let number = |text: &str| text.trim().parse().unwrap();
        let place = (number(offset), number(size), path.len());
        Self { path, place }
    }

    fn show(&self) -> String {
        self.path.join(".")
    }
}

fn c_fields(csv: &str) -> Vec<Field> {
    let rows = csv.lines().skip(1).map(|row| {
        let mut cells = row.split(',');
        let mut next = || cells.next().unwrap_or_else(|| panic!("three cells in {row:?}"));
        Field::new(next(), next(), next())
    });
    // Its last line is the whole area.
    rows.filter(|field| field.path[0] != "FISH_X1_TRANSFER").collect()
}

fn rust_fields() -> Vec<Field> {
    let list = RUST.lines().skip_while(|line| line.trim() != "$use_them! {").skip(1);
    let list = list.take_while(|line| line.trim() != "}");
    list.map(|line| {
        let (path, place) = line.trim().trim_end_matches(';').split_once(": ").unwrap();
        let (offset, size) = place.split_once(", ").unwrap();
        let path = match path.split_once(" [0] ") {
            Some((array, element)) => format!("{array}[0].{}", element.split_once('.').unwrap().1),
            None => path.to_owned(),
        };
        Field::new(&path, offset, size)
    })
    .collect()
}

/// The rows of the table, and what is wrong with them.
pub(crate) fn rows(source: &Source) -> (Vec<String>, Vec<String>) {
    let mut mistakes = Vec::new();
    let rust = by_place(rust_fields());
    let txt = by_place(c_fields(TXT));
    let robo_tx = by_place(c_fields(ROBO_TX));
    for (c, others) in [(&txt, &rust), (&robo_tx, &rust), (&rust, &txt)] {
        for (place, field) in c {
            if !others.contains_key(place) {
                mistakes.push(format!("{} has no counterpart at {place:?}", field.show()));
            }
        }
    }
    let mut places: Vec<&Place> = txt.keys().filter(|place| rust.contains_key(place)).collect();
    places.sort_by_key(|(offset, size, depth)| (*offset, *depth, *size));
    let mut rows = vec!["| TXT | ROBO TX | Rust |".to_owned(), "|---|---|---|".to_owned()];
    for place in places {
        let (field, c) = (&rust[place], &txt[place]);
        let tx = robo_tx.get(place);
        for c in [Some(c), tx].into_iter().flatten() {
            mistakes.extend(misnamed(source, field, c));
        }
        let tx = tx.map(|tx| format!("`{}`", tx.show())).unwrap_or_default();
        rows.push(format!("| `{}` | {tx} | `area.{}` |", c.show(), field.show()));
    }
    (rows, mistakes)
}

fn by_place(fields: Vec<Field>) -> HashMap<Place, Field> {
    let count = fields.len();
    let fields: HashMap<Place, Field> =
        fields.into_iter().map(|field| (field.place, field)).collect();
    assert_eq!(fields.len(), count, "two fields at one place");
    fields
}

/// The parts of a path whose C name is neither the Rust name nor an alias.
fn misnamed(source: &Source, field: &Field, c: &Field) -> Vec<String> {
    let mut mistakes = Vec::new();
    let mut of = source.type_named("FishX1Transfer", Path::new("transfer_area/mod.rs"));
    for (index, (name, c_name)) in field.path.iter().zip(&c.path).enumerate() {
        let [name, c_name] = [name, c_name].map(|part| part.trim_end_matches("[0]"));
        let Some(item) = source.fields(of).find(|item| item.name == name) else {
            mistakes.push(format!("{} has no field {name}", of.place()));
            break;
        };
        mistakes.extend(unnamed(item, c_name));
        if index + 1 < field.path.len() {
            of = source.type_named(&item.type_name, &item.file);
        }
    }
    mistakes
}

/// A mistake when an item has neither this name nor this alias.
pub(crate) fn unnamed(item: &Item, c_name: &str) -> Option<String> {
    debug_assert_eq!(item.kind, Kind::Field);
    let is_named = item.name == c_name || item.aliases.iter().any(|alias| alias == c_name);
    (!is_named).then(|| format!("{} needs #[doc(alias = \"{c_name}\")]", item.place()))
}
