//! Workpieces.

use std::fmt;

use toml::de::DeValue;

use super::mistake::Mistake;
use super::read::Read;

/// A workpiece, or a container for one.
///
/// Workpieces are discs with a diameter of 27 mm.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Piece {
    /// A white workpiece.
    White,
    /// A red workpiece.
    Red,
    /// A blue workpiece.
    Blue,
    /// A container for one workpiece.
    Container,
}

impl Piece {
    /// One of each kind.
    pub const ALL: [Self; 4] = [Self::White, Self::Red, Self::Blue, Self::Container];

    /// Its name in a world file, such as `white`.
    pub fn name(self) -> &'static str {
        match self {
            Self::White => "white",
            Self::Red => "red",
            Self::Blue => "blue",
            Self::Container => "container",
        }
    }

    /// What a colour sensor over its middle gives, in mV; `None` for a container, which it does not see.
    pub(super) fn colour_mv(self) -> Option<f64> {
        match self {
            Self::White => Some(564.0),
            Self::Red => Some(1320.0),
            Self::Blue => Some(1540.0),
            Self::Container => None,
        }
    }

    pub(super) fn read(value: &DeValue<'_>) -> Read<Self> {
        let named = |name| Self::ALL.into_iter().find(|piece| piece.name() == name);
        value.as_str().and_then(named).ok_or_else(|| {
            let names = Self::ALL.map(|piece| format!("\"{}\"", piece.name())).join(", ");
            Mistake::new(format!("expected one of {names}"))
        })
    }
}

/// As in a sentence.
impl fmt::Display for Piece {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::White | Self::Red | Self::Blue => write!(f, "the {} workpiece", self.name()),
            Self::Container => f.write_str("the container"),
        }
    }
}
