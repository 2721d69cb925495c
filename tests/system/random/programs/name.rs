//! The name of a random program: its seed, and what is left out to make it smaller.

use std::fmt;
use std::str::FromStr;

use super::plan::Plan;
use super::shrink::Edit;
use super::strategy;

/// One in so many programs meets a logger that blocks.
const BLOCKED_IN: u64 = 16;

/// `17`, or `17/t2-g0.1` for a smaller one.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Name {
    pub(crate) seed: u64,
    pub(crate) edits: Vec<Edit>,
}

impl Name {
    pub(crate) fn new(seed: u64) -> Self {
        Self { seed, edits: Vec::new() }
    }

    pub(crate) fn plan(&self) -> Plan {
        let mut plan = strategy::plan_of(self.seed);
        for edit in &self.edits {
            edit.apply(&mut plan);
        }
        plan
    }

    /// Whether the logger of its process blocks.
    pub(crate) fn blocks(&self) -> bool {
        self.seed % BLOCKED_IN == 0
    }
}

impl fmt::Display for Name {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.seed)?;
        for (index, edit) in self.edits.iter().enumerate() {
            write!(f, "{}{edit}", if index == 0 { '/' } else { '-' })?;
        }
        Ok(())
    }
}

impl FromStr for Name {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (seed, edits) = text.split_once('/').unwrap_or((text, ""));
        let seed = seed.parse().map_err(|_| format!("{seed} is not a seed"))?;
        let edits = edits.split('-').filter(|edit| !edit.is_empty());
        Ok(Self { seed, edits: edits.map(str::parse).collect::<Result<_, _>>()? })
    }
}
