//! Which controller a program talks to, without a change in the program.

use std::collections::HashMap;
use std::env;
use std::ffi::{OsStr, OsString};
use std::sync::OnceLock;

use ft_transfer_area::{TransferAreaComHandler, TransferAreaComHandlerBuilder, TransferMode, PORT};

/// The environment variable that replaces the host that a program names.
const VARIABLE: &str = "FT_TXT_HOST";
/// The environment variable that chooses the exchange: `simple`, or else the one that the program uses.
const MODE: &str = "FT_TXT_MODE";

/// What the kits' classes talk to when a program names nothing.
const KITS_HOST: &str = "192.168.7.2";

/// What `FT_TXT_HOST` says; `None` when it is not set.
pub(crate) fn from_environment() -> Option<String> {
    variable(VARIABLE)
}

/// What an environment variable says; `None` when it is empty or not set. One that the program has removed, as by
/// clearing its environment, says what it did at the beginning.
pub(crate) fn variable(name: &str) -> Option<String> {
    // A host that is not UTF-8 is found nowhere: without it, another controller would be driven.
    let value = variable_as_it_is(name)?.to_string_lossy().into_owned();
    Some(value.trim().to_owned()).filter(|value| !value.is_empty())
}

/// The same for the name of a folder, which may be in any encoding.
pub(crate) fn variable_as_it_is(name: &str) -> Option<OsString> {
    let at_first = || AT_FIRST.get()?.get(OsStr::new(name)).cloned();
    env::var_os(name).or_else(at_first).filter(|value| !value.is_empty())
}

/// What the variables of this library said when it was loaded: that is how `tx_run` tells it which controller to drive, and
/// where to note what is to be stopped. Programs clear their environment, or write a title over it.
static AT_FIRST: OnceLock<HashMap<OsString, OsString>> = OnceLock::new();

#[cfg(target_os = "linux")]
#[used]
#[link_section = ".init_array"]
static KEEP_VARIABLES: extern "C" fn() = keep_variables;

#[cfg(target_os = "linux")]
extern "C" fn keep_variables() {
    let is_ours = |name: &OsString| name.as_encoded_bytes().starts_with(b"FT_TXT_");
    AT_FIRST.get_or_init(|| env::vars_os().filter(|(name, _)| is_ours(name)).collect());
}

/// What `FT_TXT_HOST` says, or `auto`: for programs that name no host.
pub(crate) fn or_auto() -> String {
    from_environment().unwrap_or_else(|| "auto".to_owned())
}

/// Whether the only controller is meant that answers, whichever that is.
pub(crate) fn is_auto(host: &str) -> bool {
    host.split(':').next().is_some_and(|name| name.eq_ignore_ascii_case("auto"))
}

/// The host and the port that a program gives a kit's class.
pub(crate) fn of_kit(host: Option<&str>, port: Option<&str>) -> String {
    with_port(host.unwrap_or(KITS_HOST), port.unwrap_or_default())
}

/// The exchange for a program that uses `mode`: the server program for the TXT 4.0 knows the simple one only.
pub(crate) fn mode_for(mode: TransferMode) -> TransferMode {
    match variable(MODE) {
        Some(name) if name.eq_ignore_ascii_case("simple") => TransferMode::Simple,
        _ => mode,
    }
}

/// A handler for a controller. It connects to I2C when a transfer begins, also two ports behind another main port than
/// the usual one: the maker's firmware accepts this connection only in the first 5 s, and programs come later.
pub(crate) fn handler(host: &str) -> TransferAreaComHandlerBuilder {
    let builder = TransferAreaComHandler::builder(host);
    match port_of(host).unwrap_or(PORT).checked_add(2) {
        Some(port) => builder.i2c_port(port),
        // Building refuses such a main port.
        None => builder,
    }
}

/// A host and a port that a program gives as texts, as one text.
fn with_port(host: &str, port: &str) -> String {
    let (host, port) = (host.trim(), port.trim());
    if port.is_empty() || port.parse() == Ok(PORT) || port_of(host).is_some() {
        host.to_owned()
    } else if host.contains(':') && !host.starts_with('[') {
        format!("[{host}]:{port}")
    } else {
        format!("{host}:{port}")
    }
}

/// Whether two texts are the same host and port.
pub(crate) fn is_same(one: &str, other: &str) -> bool {
    let usual = format!(":{PORT}");
    let [one, other] = [one, other].map(|host| host.strip_suffix(&usual).unwrap_or(host));
    one.eq_ignore_ascii_case(other)
}

/// The port of the camera: the one after that of the main connection.
pub(crate) fn camera_port(host: &str) -> u16 {
    port_of(host).unwrap_or(PORT).saturating_add(1)
}

fn port_of(host: &str) -> Option<u16> {
    let (name, port) = host.rsplit_once(':')?;
    // Further colons are those of an IPv6 address, which has brackets when a port follows.
    let is_one = !name.contains(':') || name.ends_with(']');
    port.parse().ok().filter(|_| is_one)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_port_follows_its_host() {
        assert_eq!(with_port("192.168.7.2", "65000"), "192.168.7.2");
        assert_eq!(with_port("192.168.7.2", "7"), "192.168.7.2:7");
        assert_eq!(with_port("txt:9", "7"), "txt:9");
        assert_eq!(with_port("fe80::1", "7"), "[fe80::1]:7");
        assert_eq!(with_port("txt", "seven"), "txt:seven");
    }

    #[test]
    fn a_main_port_that_leaves_no_room_for_the_others_is_refused() {
        assert!(handler("txt:65533").build().is_ok());
        assert!(handler("txt:65534").build().is_err());
    }

    #[test]
    fn the_usual_port_makes_no_other_host() {
        assert!(is_same("txt:65000", "TXT") && is_same("txt:7", "txt:7"));
        assert!(!is_same("txt:7", "txt") && !is_same("txt", "other"));
    }

    #[test]
    fn the_port_of_the_camera_follows_the_main_one() {
        assert_eq!(camera_port("auto"), 65_001);
        assert_eq!(camera_port("10.0.0.7:4000"), 4001);
        assert_eq!(camera_port("[::1]:4000"), 4001);
        assert_eq!(camera_port("fe80::1"), 65_001);
    }
}
