//! Whether a thread has begun to panic.

/// Distinguishes a panic that began after this was made from an earlier one, as when a destructor uses
/// the area while its thread unwinds.
#[derive(Debug)]
pub(super) struct PanicCheck {
    before: bool,
}

impl PanicCheck {
    pub(super) fn new() -> Self {
        Self { before: std::thread::panicking() }
    }

    pub(super) fn has_begun(&self) -> bool {
        !self.before && std::thread::panicking()
    }
}
