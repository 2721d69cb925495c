//! What can't be read of a recording.

use std::fmt;
use std::time::Duration;

/// What is missing in a recording because parts of its file are damaged, as by a bad disk. As `{}` it is a sentence.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Damage {
    /// How many parts.
    pub parts: u64,
    /// How many bytes they have in the file.
    pub bytes: u64,
    /// What was recorded last before the first of them; 0 if there is nothing.
    pub after: Duration,
    /// What was recorded first behind the last of them; `None` if there is nothing.
    pub before: Option<Duration>,
    /// What is wrong with the first of them.
    pub cause: String,
}

impl Damage {
    /// Adds another part, after what was recorded at this time.
    pub(crate) fn add(damage: &mut Option<Self>, bytes: u64, cause: String, after: Duration) {
        let all = damage.get_or_insert(Self { parts: 0, bytes: 0, after, before: None, cause });
        all.parts += 1;
        all.bytes += bytes;
        all.before = None;
    }
}

impl fmt::Display for Damage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { parts, bytes, after, before, cause } = self;
        match parts {
            1 => write!(f, "a part of {bytes} bytes is damaged ({cause}) and left out, ")?,
            _ => write!(f, "{parts} parts of {bytes} bytes in all are damaged (the first: {cause}) and left out, ")?,
        }
        let after = after.as_secs_f64();
        match before {
            Some(before) => write!(f, "between {after:.2} s and {:.2} s", before.as_secs_f64()),
            None => write!(f, "after {after:.2} s"),
        }
    }
}
