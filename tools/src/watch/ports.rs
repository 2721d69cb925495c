//! The three ports: where programs come in, and where the controller is.

use std::io;
use std::net::{Ipv4Addr, SocketAddr};
use std::time::Duration;

use anyhow::{anyhow, bail, Context};
use ft_transfer_area::controller_address;
use mio::net::TcpListener;

use crate::seen::Line;

/// How often three free ports in a row are tried from a port that the system chooses.
const ATTEMPTS: usize = 50;
/// How long the search for a controller may take. A packet that is lost on Wi-Fi is sent again after a second.
const FIND_LIMIT: Duration = Duration::from_millis(1500);

/// The address of the controller's main port; that of its camera is the next one, and then comes I2C.
pub(crate) fn controller(host: &str) -> anyhow::Result<SocketAddr> {
    let address = controller_address(host, FIND_LIMIT)?;
    if address.port().checked_add(2).is_none() {
        bail!("the port of {host} has to be 1 to 65533: two more follow it");
    }
    Ok(address)
}

/// The address of one of a controller's ports.
pub(crate) fn behind(main: SocketAddr, line: Line) -> SocketAddr {
    // With all else of the address: a local one of IPv6 has a network interface. There is room, as `controller` has
    // checked.
    let mut address = main;
    address.set_port(main.port() + line.index() as u16);
    address
}

/// An error when the controller's ports are among these, so that it would pass on to itself.
pub(super) fn check_apart(
    listeners: &[TcpListener; 3],
    controller: SocketAddr,
) -> anyhow::Result<()> {
    let own: Vec<_> = listeners.iter().map(TcpListener::local_addr).collect::<Result<_, _>>()?;
    let lines = [Line::Main, Line::Camera, Line::I2c];
    let is_own = |line: &Line| own.contains(&behind(controller, *line));
    if lines.iter().any(is_own) {
        bail!(
            "nothing answers at {controller}, and txt watch listens there itself; start what is to be watched first, or \
             choose other ports with --port"
        );
    }
    Ok(())
}

/// Listens at this port and the two after it; 0 is any three in a row.
pub(super) fn listen(port: u16) -> anyhow::Result<[TcpListener; 3]> {
    if port > u16::MAX - 2 {
        bail!("--port has to be at most 65533: two more ports follow it");
    }
    if port != 0 {
        return listen_from(port).map_err(|error| match error.kind() {
            io::ErrorKind::AddrInUse => anyhow!(
                "a port from {port} to {} is taken by another program, such as a simulated TXT; \
                 choose others with --port",
                port + 2
            ),
            io::ErrorKind::PermissionDenied => anyhow!(
                "the system does not allow the ports {port} to {} ({error}); choose others with --port",
                port + 2
            ),
            _ => anyhow!("ports {port} to {} can't be opened ({error})", port + 2),
        });
    }
    let mut result = listen_from(0);
    for _ in 1..ATTEMPTS {
        if result.is_ok() {
            break;
        }
        result = listen_from(0);
    }
    result.context("three free ports in a row were not found; give one with --port")
}

fn listen_from(port: u16) -> io::Result<[TcpListener; 3]> {
    let open = |port| TcpListener::bind((Ipv4Addr::LOCALHOST, port).into());
    let main = open(port)?;
    let port = main.local_addr()?.port();
    let next = |distance| port.checked_add(distance).ok_or(io::ErrorKind::AddrInUse);
    Ok([main, open(next(1)?)?, open(next(2)?)?])
}

#[cfg(test)]
mod tests {
    use ft_transfer_area_simulator::SimulatedTxt;

    use super::*;

    #[test]
    fn every_way_to_write_an_address_is_understood_if_two_ports_can_follow() {
        for (given, address) in [
            ("192.168.7.2", "192.168.7.2:65000"),
            ("192.168.7.2:65010", "192.168.7.2:65010"),
            ("localhost:4000", "127.0.0.1:4000"),
            ("::1", "[::1]:65000"),
            ("[::1]", "[::1]:65000"),
            ("[::1]:65010", "[::1]:65010"),
        ] {
            assert_eq!(controller(given).unwrap(), address.parse().unwrap(), "{given}");
        }
        for given in ["", "192.168.7.2:", "192.168.7.2:x", "192.168.7.2:65534", "192.168.7.2:0"] {
            assert!(controller(given).is_err(), "{given}");
        }
        let txt = SimulatedTxt::builder().start().unwrap();
        for auto in ["auto", "AUTO"] {
            let given = format!("{auto}:{}", txt.port());
            assert_eq!(controller(&given).unwrap(), txt.address());
        }
    }

    #[test]
    fn the_ports_of_a_controller_are_in_its_network() {
        let main = controller("fe80::1%3").unwrap();
        assert_eq!(main, "[fe80::1%3]:65000".parse().unwrap());
        assert_eq!(behind(main, Line::Main), main);
        assert_eq!(behind(main, Line::I2c), "[fe80::1%3]:65002".parse().unwrap());
    }

    #[test]
    fn three_ports_follow_each_other() {
        let listeners = listen(0).unwrap();
        let ports = listeners.each_ref().map(|one| one.local_addr().unwrap().port());
        assert_eq!(ports, [ports[0], ports[0] + 1, ports[0] + 2]);
        let taken = listen(ports[1]).unwrap_err().to_string();
        assert!(taken.contains("--port"), "{taken}");
    }

    #[test]
    fn it_passes_nothing_on_to_itself() {
        let listeners = listen(0).unwrap();
        let main = listeners[0].local_addr().unwrap();
        for port in main.port() - 2..=main.port() + 2 {
            let error = check_apart(&listeners, SocketAddr::new(main.ip(), port)).unwrap_err();
            assert!(error.to_string().contains("listens there itself"), "{error}");
        }
        check_apart(&listeners, SocketAddr::new(main.ip(), main.port() - 3)).unwrap();
    }
}
