//! The name of a random program: its seed, and the steps that have made it smaller.

use std::fmt;
use std::str::FromStr;

use super::plan::Plan;
use super::strategy;

/// One in so many programs meets a logger that blocks.
const BLOCKED_IN: u64 = 16;

/// `17`, or `17/sscs` for a smaller one.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Name {
    pub(crate) seed: u64,
    pub(crate) steps: String,
}

impl Name {
    pub(crate) fn new(seed: u64) -> Self {
        Self { seed, steps: String::new() }
    }

    pub(crate) fn plan(&self) -> Plan {
        strategy::tree(self.seed, &self.steps).current()
    }

    /// Whether the logger of its process blocks.
    pub(crate) fn blocks(&self) -> bool {
        self.seed % BLOCKED_IN == 0
    }
}

impl fmt::Display for Name {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.seed)?;
        if self.steps.is_empty() {
            return Ok(());
        }
        write!(f, "/{}", self.steps)
    }
}

impl FromStr for Name {
    type Err = std::num::ParseIntError;

    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let (seed, steps) = text.split_once('/').unwrap_or((text, ""));
        Ok(Self { seed: seed.parse()?, steps: steps.to_owned() })
    }
}
