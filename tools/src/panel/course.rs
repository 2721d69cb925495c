//! A lesson that goes with a controller: its page shows task, machine and steps side by side.

use std::sync::Arc;

use ft_transfer_area_simulator::world::World;
use serde::Serialize;
use serde_json::Value;

/// What a page can know of a lesson and ask of it.
pub(crate) trait Course: Send + Sync {
    /// The lesson, its steps and what came out, in all languages.
    fn state(&self) -> Value;

    /// The machine of the lesson, if that changes with it.
    fn world(&self) -> Option<Arc<World>>;

    /// How far its pupil is; `None` when there is no pupil.
    fn progress(&self) -> Option<Progress>;

    /// Whether a check moves the machine now.
    fn is_checking(&self) -> bool;

    /// Checks the program that comes next, or ends a check. The error is a sentence.
    fn check(&self, begins: bool) -> Result<(), &'static str>;

    /// Goes to the lesson with this number. The error is a sentence.
    fn go_to(&self, lesson: u8) -> Result<(), &'static str>;
}

/// How far a pupil is.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Progress {
    pub(crate) lesson: u8,
    /// How far the check is.
    pub(crate) phase: &'static str,
    /// The lessons that were passed.
    pub(crate) passed: Vec<u8>,
    /// Verdicts since the last lesson was passed.
    pub(crate) failed: u32,
    /// What was wrong last, in each language.
    pub(crate) wrong: Option<Both>,
    /// How many seconds ago that was; `None` when it was before the start.
    pub(crate) wrong_ago: Option<u64>,
}

/// A text in each language.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct Both {
    pub(crate) en: String,
    pub(crate) de: String,
}
