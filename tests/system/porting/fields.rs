//! The transfer area's fields: C fields and Rust fields are matched by their place in memory.

use std::any::type_name;
use std::collections::HashMap;
use std::mem::{offset_of, size_of};
use std::path::Path;

use ft_transfer_area::transfer_area::*;

use super::source::{Item, Kind, Source};

#[macro_use]
#[path = "../../../src/transfer_area/structs.rs"]
mod structs;

/// Every field of the TXT's header, where a C compiler places it.
const TXT: &str = include_str!("transfer_area.csv");
/// The fields of the ROBO TX's header, which has other names for the same memory.
const ROBO_TX: &str = include_str!("robo_tx.csv");
/// Fields of the crate of which the header's table says nothing: unused bytes, and parts of which it has only
/// the whole or only the fields.
const WITHOUT_C: [&str; 9] = [
    "state.master_pgm.dummy",
    "state.local_pgm.name",
    "state.local_pgm.state",
    "state.local_pgm.dummy",
    "config.uni[0].dummy",
    "config.cnt[0].dummy",
    "display.display_msg",
    "display.display_frame",
    "txt_outputs.dummy",
];

/// Offset and size in bytes, and the depth in the structure: a struct and its only field have the
/// same offset and size.
type Place = (usize, usize, usize);

struct Field {
    /// Its path, with `[0]` after several structs.
    path: Vec<String>,
    place: Place,
    /// The type that the compiler gives a field of the crate.
    type_name: &'static str,
}

impl Field {
    fn new(path: &str, offset: &str, size: &str) -> Self {
        let path: Vec<String> = path.split('.').map(str::to_owned).collect();
        let number = |text: &str| text.trim().parse().unwrap();
        let place = (number(offset), number(size), path.len());
        Self { path, place, type_name: "" }
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

/// A field of one of the crate's structs, as the compiler has placed it.
struct Part {
    of: &'static str,
    name: &'static str,
    type_name: &'static str,
    offset: usize,
    size: usize,
}

impl Part {
    fn new<T, F>(name: &'static str, offset: usize, _field: fn(&T) -> &F) -> Self {
        let (of, type_name) = (last_name(type_name::<T>()), type_name::<F>());
        Self { of, name, type_name, offset, size: size_of::<F>() }
    }
}

/// The name of a type, or of the elements of an array or of `PerInput` and the like, without its modules.
fn last_name(type_name: &'static str) -> &'static str {
    let element = type_name.split_once('<').map_or(type_name, |(_, element)| element);
    let element = element.trim_start_matches('[').split([';', '>']).next().unwrap_or_default();
    element.rsplit("::").next().unwrap_or_default()
}

/// A type as a program writes it: `[transfer_area::input::IrInput; 5]` without the path.
fn short(type_name: &str) -> String {
    let parts = type_name.split_inclusive(['[', ' ', '<']);
    parts.map(|part| part.rsplit("::").next().unwrap_or(part)).collect()
}

macro_rules! parts {
    ($($name:ident { $($field:ident)+ })+) => {
        vec![$($(Part::new(stringify!($field), offset_of!($name, $field), |of: &$name| &of.$field)),+),+]
    };
}

/// Every field of the crate's area but those without a counterpart.
fn rust_fields() -> Vec<Field> {
    let parts = transfer_area_structs!(parts);
    let mut fields = Vec::new();
    add_fields(&parts, "FishX1Transfer", &[], 0, &mut fields);
    let count = fields.len();
    fields.retain(|field| !WITHOUT_C.contains(&field.show().as_str()));
    assert_eq!(fields.len() + WITHOUT_C.len(), count, "a field without a counterpart is gone");
    fields
}

fn add_fields(parts: &[Part], of: &str, above: &[String], begin: usize, fields: &mut Vec<Field>) {
    for part in parts.iter().filter(|part| part.of == of) {
        let mut path = [above, &[part.name.to_owned()]].concat();
        let (offset, depth) = (begin + part.offset, path.len());
        let place = (offset, part.size, depth);
        fields.push(Field { path: path.clone(), place, type_name: part.type_name });
        if part.type_name.contains(['[', '<']) {
            path[depth - 1] += "[0]";
        }
        add_fields(parts, last_name(part.type_name), &path, offset, fields);
    }
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
    let mut rows =
        vec!["| TXT | ROBO TX | Rust | type |".to_owned(), "|---|---|---|---|".to_owned()];
    for place in places {
        let (field, c) = (&rust[place], &txt[place]);
        let tx = robo_tx.get(place);
        for c in [Some(c), tx].into_iter().flatten() {
            mistakes.extend(misnamed(source, field, c));
        }
        let tx = tx.map(|tx| format!("`{}`", tx.show())).unwrap_or_default();
        let (c, rust, kind) = (c.show(), field.show(), short(field.type_name));
        rows.push(format!("| `{c}` | {tx} | `area.{rust}` | `{kind}` |"));
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
