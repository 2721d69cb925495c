//! Areas in memory that a C program reads and writes at any time, from any thread, without a lock.
//!
//! Rust must not make references to such memory. It is reached by pointers only, field by field, by atomic
//! accesses of the field's width: a 16-bit field never tears, and a race with the program only decides who
//! writes first.

mod array;
mod cells;
mod ta;
#[cfg(test)]
mod tests;

pub(crate) use array::{areas_of_program, Area, AreaArray, Places, AREAS};
pub(crate) use cells::Cell;
pub(crate) use ta::{HookTable, Ta};
