//! `txt watch`: what passes through it, and what it reports.

mod again;
pub(crate) mod away;
mod beside;
mod bytes;
mod clients;
mod gone;
mod recorded;
mod reported;
mod silent;
pub(crate) mod slow;
pub(crate) mod support;
mod unanswered;
mod unused;

/// Longer than anything takes on a busy machine; only a failing test waits this long.
const LIMIT: std::time::Duration = std::time::Duration::from_secs(60);
