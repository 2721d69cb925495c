//! Terminals of any controller of a TXT, for parts that reach over several of them.

use std::fmt::{self, Display};

use ft_transfer_area::transfer_area::MAX_EXTENSIONS;
use toml::de::DeValue;

use super::mistake::Mistake;
use super::read::{terminal, Read};

/// The greatest index of a controller.
pub(super) const CONTROLLERS: i64 = MAX_EXTENSIONS as i64;

/// A terminal of the master or of an extension, as in `I1` or `E1.I1`. It needs no other fields, so it
/// is closed on purpose.
///
/// ```
/// use ft_transfer_area_simulator::world::Plug;
/// use ft_transfer_area::tx::Motor;
///
/// assert_eq!(Plug::from(Motor::M1).to_string(), "M1");
/// assert_eq!(Plug::extension(1, Motor::M2).to_string(), "E1.M2");
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Plug<T> {
    /// The controller: 0 the master, 1..=8 an extension.
    pub controller: usize,
    /// The terminal.
    pub terminal: T,
}

impl<T> Plug<T> {
    /// A terminal of an extension, 1..=8.
    pub fn extension(extension: usize, terminal: T) -> Self {
        Self { controller: extension, terminal }
    }
}

impl<T> From<T> for Plug<T> {
    /// A terminal of the master.
    fn from(terminal: T) -> Self {
        Self { controller: 0, terminal }
    }
}

impl<T: Display> Display for Plug<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.controller {
            0 => self.terminal.fmt(f),
            extension => write!(f, "E{extension}.{}", self.terminal),
        }
    }
}

/// One of these terminals, of any controller, as a value.
pub(super) fn plug<T: Copy + Display>(all: &'static [T]) -> impl Fn(&DeValue<'_>) -> Read<Plug<T>> {
    move |value| match value.as_str() {
        Some(name) => named(all, name),
        None => Err(Mistake::new(format!("expected a name, as in \"{0}\" or \"E1.{0}\"", all[0]))),
    }
}

/// One of these terminals, of any controller, by its name.
pub(super) fn named<T: Copy + Display>(all: &[T], name: &str) -> Read<Plug<T>> {
    let Some((extension, rest)) = name.split_once('.') else {
        return Ok(Plug::from(terminal(all, name)?));
    };
    let number = extension.strip_prefix('E').and_then(|number| number.parse().ok());
    let number = number.filter(|number| (1..=MAX_EXTENSIONS).contains(number));
    let number = number.ok_or_else(|| {
        Mistake::new(format!("expected E1 to E{MAX_EXTENSIONS} before the dot, not {extension:?}"))
    })?;
    Ok(Plug::extension(number, terminal(all, rest)?))
}
