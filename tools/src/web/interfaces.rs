//! The addresses of this computer in its networks.

use std::net::IpAddr;

/// Those by which others may reach it: of networks that are up, without this computer's own and those that others make
/// up for themselves. Those of private networks come first.
pub(super) fn addresses() -> Vec<IpAddr> {
    let mut addresses = system::addresses();
    addresses.retain(|address| is_for_others(*address));
    addresses.sort_by_key(|address| !is_private(*address));
    addresses.dedup();
    addresses
}

fn is_for_others(address: IpAddr) -> bool {
    match address {
        IpAddr::V4(ip) => !ip.is_loopback() && !ip.is_unspecified(),
        // A link has a scope, which no browser knows.
        IpAddr::V6(_) => false,
    }
}

fn is_private(address: IpAddr) -> bool {
    matches!(address, IpAddr::V4(ip) if ip.is_private())
}

#[cfg(unix)]
mod system {
    use std::net::IpAddr;

    use nix::ifaddrs::getifaddrs;
    use nix::net::if_::InterfaceFlags;

    pub(super) fn addresses() -> Vec<IpAddr> {
        let all = getifaddrs().into_iter().flatten();
        let up = all.filter(|one| one.flags.contains(InterfaceFlags::IFF_UP));
        up.filter_map(|one| Some(one.address?.as_sockaddr_in()?.ip().into())).collect()
    }
}

#[cfg(not(unix))]
mod system {
    use std::env;
    use std::net::{IpAddr, ToSocketAddrs};

    /// Those that its own name has.
    pub(super) fn addresses() -> Vec<IpAddr> {
        let name = env::var("COMPUTERNAME").unwrap_or_default();
        let found = (name.as_str(), 0).to_socket_addrs();
        found.into_iter().flatten().map(|address| address.ip()).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_addresses_for_others_count() {
        for (address, right) in
            [("192.168.1.5", true), ("169.254.3.4", true), ("127.0.0.1", false), ("::1", false)]
        {
            assert_eq!(is_for_others(address.parse().unwrap()), right, "{address}");
        }
        assert!(addresses().into_iter().all(is_for_others));
    }
}
