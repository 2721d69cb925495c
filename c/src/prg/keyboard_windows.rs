//! The settings of the keyboard of a console: its events come key by key anyway.

/// Nothing has to be set.
pub(super) fn without_lines() -> bool {
    true
}

/// Nothing was set.
pub(super) fn restore() {}
