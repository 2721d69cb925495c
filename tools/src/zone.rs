//! The time zone of this computer.

use std::env;
use std::ffi::OsStr;
use std::fs;
use std::sync::{LazyLock, Once};

use jiff::tz::TimeZone;
use jiff::{Timestamp, Zoned};

/// No file with a time zone is longer: those of a system have some kilobytes.
const LONGEST: u64 = 1 << 20;

/// Whether `TZ`, if it names a file, names one that may be read: it is read to its end, which a device may not have.
static IS_FIT: LazyLock<bool> =
    LazyLock::new(|| env::var_os("TZ").is_none_or(|name| is_fit(&name)));

/// The time zone, or UTC in place of one that is not read.
pub(crate) fn of_system() -> TimeZone {
    if *IS_FIT {
        TimeZone::system()
    } else {
        TimeZone::UTC
    }
}

/// Now, in this time zone.
pub(crate) fn now() -> Zoned {
    Timestamp::now().to_zoned(of_system())
}

/// Says once that a time zone is not read.
pub(crate) fn warn_if_not_read() {
    static WARNED: Once = Once::new();
    if !*IS_FIT {
        WARNED.call_once(|| {
            log::warn!(
                "TZ names a device, a pipe or a file of more than 1 MiB, so times are in UTC"
            );
        });
    }
}

fn is_fit(name: &OsStr) -> bool {
    // In any other encoding it is no name of a file for who reads it.
    let Some(name) = name.to_str() else { return true };
    let path = name.strip_prefix(':').unwrap_or(name);
    match fs::metadata(path) {
        Ok(found) => found.is_dir() || (found.is_file() && found.len() <= LONGEST),
        // It is the name of a zone, or a rule.
        Err(_) => true,
    }
}
