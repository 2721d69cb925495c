//! The tables of names and values beside this file: a line of headings, then fields with `;` between them.

pub(crate) const CONSTANTS: &str = include_str!("constants.csv");
pub(crate) const ENUMERATIONS: &str = include_str!("enumerations.csv");
pub(crate) const ERRORS: &str = include_str!("errors.csv");
/// Offsets and sizes with 32-bit pointers. A line without a field is the whole structure.
pub(crate) const STRUCTURES: &str = include_str!("structures.csv");
pub(crate) const HOOKS: &str = include_str!("hooks.csv");
pub(crate) const FUNCTIONS: &str = include_str!("functions.csv");
pub(crate) const EX_FUNCTIONS: &str = include_str!("ex_functions.csv");

/// The lines of a table with `N` columns.
pub(crate) fn lines<const N: usize>(
    table: &'static str,
) -> impl Iterator<Item = [&'static str; N]> {
    table.lines().skip(1).map(|line| {
        let fields: Vec<_> = line.split(';').collect();
        fields.try_into().unwrap_or_else(|_| panic!("not {N} columns: {line}"))
    })
}
