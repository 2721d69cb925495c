//! Lamps, as plain data.

use toml::de::DeValue;

use super::mistake::Mistake;
use super::read::Read;

/// The colour of a lamp's cap. Only pages show it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum LampColour {
    /// A red cap.
    Red,
    /// A yellow cap.
    Yellow,
    /// A green cap.
    Green,
    /// A blue cap.
    Blue,
    /// A clear cap.
    White,
}

impl LampColour {
    /// One of each kind.
    pub const ALL: [Self; 5] = [Self::Red, Self::Yellow, Self::Green, Self::Blue, Self::White];

    /// Its name in a world file, such as `red`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Red => "red",
            Self::Yellow => "yellow",
            Self::Green => "green",
            Self::Blue => "blue",
            Self::White => "white",
        }
    }

    pub(super) fn read(value: &DeValue<'_>) -> Read<Self> {
        let named = |name| Self::ALL.into_iter().find(|colour| colour.name() == name);
        value.as_str().and_then(named).ok_or_else(|| {
            let names = Self::ALL.map(|colour| format!("\"{}\"", colour.name())).join(", ");
            Mistake::new(format!("expected one of {names}"))
        })
    }
}
