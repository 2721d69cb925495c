//! The address of a broker.

use anyhow::Context;

/// `HOST`, `HOST:PORT`, `[::1]:PORT`, each also behind `mqtt://`.
pub(super) fn host_and_port(address: &str) -> anyhow::Result<(String, u16)> {
    let given = address.strip_prefix("mqtt://").unwrap_or(address).trim_end_matches('/');
    let wrong = || {
        format!(
            "{address:?} is not a broker's address; write just the host, such as 192.168.1.5, or a host \
             and a port, such as 192.168.1.5:1883 or [::1]:1883"
        )
    };
    let (host, port) = match given.rsplit_once(':') {
        Some((host, port)) if !host.contains(':') || host.ends_with(']') => (host, Some(port)),
        Some(_) if !given.starts_with('[') => anyhow::bail!(wrong()),
        _ => (given, None),
    };
    let allowed = |c: char| c.is_alphanumeric() || ".-_:[]".contains(c);
    if host.is_empty() || !host.chars().all(allowed) {
        anyhow::bail!(wrong());
    }
    let port = port.map_or(Ok(1883), str::parse).with_context(wrong)?;
    anyhow::ensure!(port > 0, wrong());
    Ok((host.to_owned(), port))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_address_is_a_host_with_or_without_a_port() {
        let found = |address| host_and_port(address).map_err(|error| error.to_string());
        for (address, host, port) in [
            ("broker", "broker", 1883),
            ("192.168.1.5:1884", "192.168.1.5", 1884),
            ("mqtt://broker/", "broker", 1883),
            ("[::1]", "[::1]", 1883),
            ("[::1]:7", "[::1]", 7),
        ] {
            assert_eq!(found(address), Ok((host.to_owned(), port)), "{address}");
        }
        let wrong = ["", ":1883", "broker:", "broker:0", "broker:70000", "::1", "mqtts://b", "a b"];
        for address in wrong {
            let error = found(address).unwrap_err();
            assert!(error.contains("is not a broker's address"), "{address}: {error}");
        }
    }
}
