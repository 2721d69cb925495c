//! A controller's address as people write it: a host, with or without a port.

use std::net::{IpAddr, SocketAddr};
use std::num::NonZeroU16;

use crate::error::Error;

/// The host and the port in `given`; `port` if there is none in it.
///
/// A numeric IPv6 address has colons itself, so it needs brackets when a port follows.
pub(crate) fn host_and_port(given: &str, port: u16) -> Result<(&str, u16), Error> {
    let bad = || Error::BadAddress { given: given.to_owned() };
    let (host, behind) = match given.strip_prefix('[') {
        Some(rest) => rest.split_once(']').ok_or_else(bad)?,
        None if given.matches(':').count() == 1 => given.split_at(given.find(':').ok_or_else(bad)?),
        None => (given, ""),
    };
    if host.is_empty() {
        return Err(bad());
    }
    if behind.is_empty() {
        return Ok((host, port));
    }
    let own_port = behind.strip_prefix(':').and_then(|text| text.parse::<NonZeroU16>().ok());
    Ok((host, own_port.ok_or_else(bad)?.get()))
}

/// The host of an address, which [`numeric`] takes. A link-local one of IPv6 leads nowhere without its interface.
pub(super) fn host_of(address: SocketAddr) -> String {
    match address {
        SocketAddr::V6(v6) if v6.scope_id() != 0 => format!("{}%{}", v6.ip(), v6.scope_id()),
        SocketAddr::V4(_) | SocketAddr::V6(_) => address.ip().to_string(),
    }
}

/// The address of a host that is written in numbers, also that of its interface.
pub(super) fn numeric(host: &str, port: u16) -> Option<SocketAddr> {
    let plain = host.parse::<IpAddr>().map(|ip| (ip, port).into());
    plain.or_else(|_| format!("[{host}]:{port}").parse()).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_port_after_the_host_is_used() {
        for (given, host) in [
            ("192.168.7.2:65010", "192.168.7.2"),
            ("txt.local:65010", "txt.local"),
            ("[::1]:65010", "::1"),
            ("[fe80::1%eth0]:65010", "fe80::1%eth0"),
        ] {
            assert_eq!(host_and_port(given, 65_000), Ok((host, 65_010)));
        }
    }

    #[test]
    fn the_host_of_an_address_keeps_its_interface() {
        for (address, host) in [
            ("192.168.7.2:4000", "192.168.7.2"),
            ("[2001:db8::7]:4000", "2001:db8::7"),
            ("[fe80::1%3]:4000", "fe80::1%3"),
        ] {
            let address: SocketAddr = address.parse().unwrap();
            assert_eq!(host_of(address), host);
            let mut other = address;
            other.set_port(4001);
            assert_eq!(numeric(host, 4001), Some(other));
        }
        for name in ["fe80::1%eth0", "txt", "", "::1]:4000", "192.168.7.2%3"] {
            assert_eq!(numeric(name, 4001), None, "{name}");
        }
    }

    #[test]
    fn without_a_port_it_is_the_usual_one() {
        for (given, host) in [
            ("192.168.7.2", "192.168.7.2"),
            ("txt", "txt"),
            ("::1", "::1"),
            ("fe80::1%eth0", "fe80::1%eth0"),
            ("[::1]", "::1"),
        ] {
            assert_eq!(host_and_port(given, 65_000), Ok((host, 65_000)));
        }
    }

    #[test]
    fn a_bad_address_is_in_the_error_as_it_was_given() {
        for given in [
            "",
            ":65000",
            "[]:65000",
            "[::1",
            "[::1]65000",
            "txt:",
            "txt:65k",
            "txt:0",
            "txt:65536",
            "txt:-1",
            "http://192.168.7.2",
        ] {
            let error = host_and_port(given, 65_000).unwrap_err();
            assert_eq!(error, Error::BadAddress { given: given.to_owned() });
            assert!(error.to_string().contains("192.168.7.2:65000"), "{error}");
        }
    }
}
