//! What a check has found, in words and as JSON.

use std::fmt;
use std::time::Duration;

use serde_json::{json, Map, Value};

use super::checks::Check;

/// Why a check can't go on.
#[derive(Debug)]
pub(super) enum Trouble {
    /// Ctrl-C.
    Interrupted,
    /// The button at I1 is pressed while a motor may turn.
    Button,
    /// What the controller did instead of what the check needs.
    Lost(String),
    /// Why the check can't be tried.
    NotTried(&'static str),
    /// Which other controller has the address now.
    Another(String),
}

impl Trouble {
    /// Says in which step.
    pub(super) fn during(self, step: &str) -> Self {
        match self {
            Self::Lost(what) => Self::Lost(format!("{what} ({step})")),
            other => other,
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Verdict {
    Same,
    Differs,
    NotTried,
}

impl Verdict {
    fn words(self) -> &'static str {
        match self {
            Self::Same => "as the firmware does",
            Self::Differs => "differs",
            Self::NotTried => "not tried",
        }
    }
}

/// A verdict with what was seen.
#[derive(Debug)]
pub(super) struct Outcome {
    verdict: Verdict,
    seen: String,
    /// The same in numbers.
    values: Map<String, Value>,
}

impl Outcome {
    /// The controller does what the maker's firmware does if this is true.
    pub(super) fn same_if(is_same: bool, seen: impl Into<String>) -> Self {
        Self::new(if is_same { Verdict::Same } else { Verdict::Differs }, seen)
    }

    pub(super) fn differs(seen: impl Into<String>) -> Self {
        Self::new(Verdict::Differs, seen)
    }

    pub(super) fn not_tried(why: impl Into<String>) -> Self {
        Self::new(Verdict::NotTried, why)
    }

    fn new(verdict: Verdict, seen: impl Into<String>) -> Self {
        Self { verdict, seen: seen.into(), values: Map::new() }
    }

    /// Adds a number for scripts.
    pub(super) fn with(mut self, name: &str, value: impl Into<Value>) -> Self {
        self.values.insert(name.to_owned(), value.into());
        self
    }

    /// Adds a time in milliseconds for scripts.
    pub(super) fn with_time(self, name: &str, time: Duration) -> Self {
        self.with(name, (time.as_secs_f64() * 1e5).round() / 100.0)
    }
}

impl fmt::Display for Outcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.verdict.words())?;
        if self.seen.is_empty() {
            return Ok(());
        }
        write!(f, ": {}", self.seen)
    }
}

/// A check that has run, or has not.
pub(super) struct Row {
    check: &'static Check,
    outcome: Outcome,
}

impl Row {
    pub(super) fn new(check: &'static Check, outcome: Outcome) -> Self {
        Self { check, outcome }
    }

    /// One line, and a second one with what was expected if that is something else.
    pub(super) fn line(&self) -> String {
        let Check { name, expected, .. } = self.check;
        let line = format!("{name:28} {}", self.outcome);
        if self.outcome.verdict == Verdict::Differs {
            return format!("{line}\n{:28} expected: {expected}", "");
        }
        line
    }

    pub(super) fn json(&self) -> Value {
        json!({
            "check": self.check.name,
            "expected": self.check.expected,
            "result": self.outcome.verdict.words(),
            "seen": self.outcome.seen,
            "values": self.outcome.values,
        })
    }
}

/// How many rows there are of each kind.
pub(super) fn summary(rows: &[Row]) -> String {
    let count = |verdict| rows.iter().filter(|row| row.outcome.verdict == verdict).count();
    let [same, differ, not_tried] = [Verdict::Same, Verdict::Differs, Verdict::NotTried].map(count);
    format!("{same} as the firmware does, {differ} differ, {not_tried} not tried")
}

#[cfg(test)]
mod tests {
    use super::Outcome;

    #[test]
    fn an_outcome_is_a_verdict_and_what_was_seen() {
        assert_eq!(Outcome::same_if(true, "0.52 s").to_string(), "as the firmware does: 0.52 s");
        assert_eq!(Outcome::same_if(false, "closed").to_string(), "differs: closed");
        assert_eq!(Outcome::not_tried("").to_string(), "not tried");
    }
}
