//! The controller's firmware version.

use std::fmt;

/// A firmware version of the TXT, such as 4.1.6.
///
/// The controller reports it as one number with a byte per part: `0x0401_0600` is 4.1.6
/// (the kit's document, section QueryStatus). A newer version is the greater one.
///
/// ```
/// use ft_transfer_area::FirmwareVersion;
///
/// let version = FirmwareVersion::new(4, 6, 6);
/// assert_eq!((version.to_string(), format!("{version:?}")), ("4.6.6".into(), "4.6.6".into()));
/// assert!(version > FirmwareVersion::OLDEST_SUPPORTED);
/// assert_eq!(FirmwareVersion::from_code(0x0401_0600), FirmwareVersion::new(4, 1, 6));
/// ```
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct FirmwareVersion(u32);

impl FirmwareVersion {
    /// The oldest firmware that this crate supports: 4.1.6, for which the kit was published.
    pub const OLDEST_SUPPORTED: Self = Self::new(4, 1, 6);

    /// The first firmware whose compressed exchange carries the microphone values (4.2.4).
    pub const WITH_MICROPHONE: Self = Self::new(4, 2, 4);

    /// The version `major.minor.patch`.
    pub const fn new(major: u8, minor: u8, patch: u8) -> Self {
        Self(u32::from_be_bytes([major, minor, patch, 0]))
    }

    /// The version for the number that the controller reports.
    pub const fn from_code(code: u32) -> Self {
        Self(code)
    }

    /// The number that the controller reports for this version.
    #[doc(alias = "m_version")]
    pub const fn code(self) -> u32 {
        self.0
    }
}

/// The same as its [`Display`](fmt::Display) form, `4.6.6`.
impl fmt::Debug for FirmwareVersion {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

impl fmt::Display for FirmwareVersion {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [major, minor, patch, build] = self.0.to_be_bytes();
        write!(f, "{major}.{minor}.{patch}")?;
        if build != 0 {
            write!(f, ".{build}")?;
        }
        Ok(())
    }
}
