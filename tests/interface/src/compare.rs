//! The difference between two interfaces, each a text with one item per line.

use std::collections::BTreeSet;

/// What has changed.
pub(crate) struct Difference {
    /// Changes that may break programs: removed lines begin with `-`, new ones with `+`.
    pub(crate) breaks: Vec<String>,
    /// How many other items are new.
    pub(crate) additions: usize,
}

/// Compares the interface `now` with the stored one. An item that has changed counts as removed and
/// as new.
pub(crate) fn compare(stored: &str, now: &str) -> Difference {
    let stored: BTreeSet<&str> = stored.lines().collect();
    let now: BTreeSet<&str> = now.lines().collect();
    let gone = stored.difference(&now).map(|line| format!("- {line}"));
    let (breaking, harmless): (Vec<&str>, Vec<&str>) =
        now.difference(&stored).partition(|line| is_unexpected(line, &stored));
    let breaks = gone.chain(breaking.into_iter().map(|line| format!("+ {line}"))).collect();
    Difference { breaks, additions: harmless.len() }
}

/// Whether a new item belongs to something that programs may write out in full: a variant or a field
/// of a type that is not `#[non_exhaustive]`, or a call of a trait.
fn is_unexpected(line: &str, stored: &BTreeSet<&str>) -> bool {
    let item = without_attributes(line).trim_start_matches("pub ");
    let (keyword, path) = match item.split_once(' ') {
        Some((first, rest)) if !first.contains("::") => (first, rest),
        _ => ("", item),
    };
    let end = path.find(['(', '<', ' ', '=']).unwrap_or(path.len());
    let Some((parent, _)) = path[..end].trim_end_matches(':').rsplit_once("::") else {
        return false;
    };
    let is_stored = |head: &str| {
        let head = format!("{head}{parent}");
        let may_grow = |line: &str| line.contains("#[non_exhaustive] ");
        stored.iter().filter(|line| !may_grow(line)).any(|line| {
            let rest = without_attributes(line).strip_prefix(&head);
            rest.is_some_and(|rest| rest.is_empty() || rest.starts_with(['<', '(', ' ']))
        })
    };
    match keyword {
        // The parent may be a variant with fields, which has no keyword.
        "" => ["pub enum ", "pub struct ", "pub "].into_iter().any(is_stored),
        "fn" | "const" | "type" => is_stored("pub trait "),
        _ => false,
    }
}

fn without_attributes(line: &str) -> &str {
    line.find("pub ").filter(|_| line.starts_with("#[")).map_or(line, |start| &line[start..])
}

/// Whether the version `now` may break programs for the version that is stored.
pub(crate) fn allows_breaks(stored: &str, now: &str) -> bool {
    let significant = |version: &str| {
        let numbers: Vec<String> = version.split('.').map(String::from).collect();
        let leading_zeros = numbers.iter().take_while(|number| *number == "0").count();
        numbers.into_iter().take(leading_zeros + 1).collect::<Vec<_>>()
    };
    significant(stored) != significant(now)
}

#[cfg(test)]
mod tests {
    use super::*;

    const STORED: &str = "\
pub mod a
pub enum a::Closed
pub a::Closed::One
pub a::Closed::One::mv: u16
#[non_exhaustive] pub enum a::Open
pub a::Open::One
pub struct a::Area
pub a::Area::input: u16
impl a::Area
pub fn a::Area::lock(&self) -> a::Guard
pub struct a::Guard<'a>
pub a::Guard::areas: u16
#[non_exhaustive] pub struct a::Options
pub a::Options::size: u16
#[repr(C)] pub struct a::Plain
pub a::Plain::x: u8
pub trait a::Mode
pub fn a::Mode::value(self) -> u8
";

    fn breaks(now: &str) -> Vec<String> {
        compare(STORED, now).breaks
    }

    fn with(line: &str) -> String {
        format!("{STORED}{line}\n")
    }

    #[test]
    fn the_same_interface_differs_in_nothing() {
        let difference = compare(STORED, STORED);
        assert_eq!((difference.breaks, difference.additions), (vec![], 0));
    }

    #[test]
    fn an_item_that_is_gone_breaks_programs() {
        for line in STORED.lines() {
            let now = STORED.replace(&format!("{line}\n"), "");
            assert_eq!(breaks(&now), [format!("- {line}")]);
        }
    }

    #[test]
    fn an_item_that_has_changed_breaks_programs() {
        let now = STORED.replace("&self) -> a::Guard", "&mut self) -> a::Guard");
        let lock = "pub fn a::Area::lock";
        assert_eq!(breaks(&now), [format!("- {lock}(&self) -> a::Guard")]);
        assert_eq!(compare(STORED, &now).additions, 1);
    }

    #[test]
    fn most_new_items_break_nothing() {
        for line in [
            "pub mod b",
            "pub struct a::New",
            "pub a::New::field: u16",
            "pub enum a::Newer<T>",
            "pub a::Newer::Variant(u16)",
            "pub a::Open::Two",
            "pub a::Open::Two::mv: u16",
            "pub a::Options::pause: core::time::Duration",
            "pub fn a::Area::try_lock(&self) -> core::option::Option<a::Guard>",
            "pub const a::Area::SIZE: usize",
            "pub const a::PORT: u16",
            "impl core::clone::Clone for a::Area",
            "pub fn a::find() -> alloc::vec::Vec<a::Area>",
            "pub use a::Area",
        ] {
            let difference = compare(STORED, &with(line));
            assert_eq!((difference.breaks, difference.additions), (vec![], 1), "{line}");
        }
    }

    #[test]
    fn a_new_part_of_something_that_programs_write_out_in_full_breaks_them() {
        for line in [
            "pub a::Closed::Two",
            "pub a::Closed::Two(u16)",
            "pub a::Closed::Two = 2",
            "#[non_exhaustive] pub a::Closed::Two",
            "pub a::Closed::One::cm: f64",
            "pub a::Open::One::cm: f64",
            "pub a::Area::output: a::OutputValues",
            "pub a::Guard::cycle: u64",
            "pub a::Plain::y: u8",
            "pub fn a::Mode::name(self) -> &'static str",
        ] {
            assert_eq!(breaks(&with(line)), [format!("+ {line}")]);
        }
    }

    #[test]
    fn a_version_tells_whether_it_may_break_programs() {
        for (stored, now, may) in [
            ("0.1.0", "0.1.0", false),
            ("0.1.0", "0.1.12", false),
            ("0.1.9", "0.2.0", true),
            ("0.0.1", "0.0.2", true),
            ("0.9.0", "1.0.0", true),
            ("1.2.3", "1.3.0", false),
            ("1.2.3", "2.0.0", true),
        ] {
            assert_eq!(allows_breaks(stored, now), may, "{stored} {now}");
        }
    }
}
