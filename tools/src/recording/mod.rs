//! Recordings: written, read, drawn, replayed.

mod clock;
pub(crate) mod compare;
pub(crate) mod csv;
pub(crate) mod in_parts;
pub(crate) mod info;
pub(crate) mod on_demand;
pub(crate) mod output;
pub(crate) mod part;
pub(crate) mod plot;
pub(crate) mod record;
pub(crate) mod replay;
mod survey;
mod unusual;
mod whole;
