//! Controllers that were found, and addresses without one.

use std::fmt;
use std::net::{IpAddr, SocketAddr};

use crate::firmware::FirmwareVersion;

/// How a controller is connected, as far as its address shows it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum ConnectionKind {
    /// The USB cable: 192.168.7.2.
    Usb,
    /// The controller's own Wi-Fi: 192.168.8.2.
    Wifi,
    /// Bluetooth: 192.168.9.2.
    Bluetooth,
    /// The program runs on the same machine: on the controller itself, or with a simulated TXT on the PC.
    SameMachine,
    /// Any other address, such as that of a controller in a home network.
    Network,
}

impl ConnectionKind {
    pub(crate) fn of(address: IpAddr) -> Self {
        match address {
            IpAddr::V4(address) => match address.octets() {
                [192, 168, 7, 2] => Self::Usb,
                [192, 168, 8, 2] => Self::Wifi,
                [192, 168, 9, 2] => Self::Bluetooth,
                [127, ..] => Self::SameMachine,
                _ => Self::Network,
            },
            IpAddr::V6(address) if address.is_loopback() => Self::SameMachine,
            IpAddr::V6(_) => Self::Network,
        }
    }
}

impl fmt::Display for ConnectionKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Usb => "USB",
            Self::Wifi => "Wi-Fi",
            Self::Bluetooth => "Bluetooth",
            Self::SameMachine => "this machine",
            Self::Network => "network",
        })
    }
}

/// A controller that answered, see [`find_controllers`](crate::find_controllers).
///
/// One that answers serves no other program at that moment. A controller does not say whether a camera is
/// plugged in: it answers the camera's start in the same way, and then no picture comes.
///
/// Its `address` is what [`builder`](crate::TransferAreaComHandler::builder) takes. It prints as
/// `ROBO TXT with firmware 4.6.6 at 192.168.7.2:65000 (USB)`.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct FoundController {
    /// Where it answered: its IP address and the port of the main connection.
    pub address: SocketAddr,
    /// How it is connected.
    pub connection: ConnectionKind,
    /// The name that its owner gave it.
    pub name: String,
    /// The version of its firmware.
    pub firmware: FirmwareVersion,
}

impl fmt::Display for FoundController {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { address, connection, name, firmware } = self;
        write!(f, "{name} with firmware {firmware} at {address} ({connection})")
    }
}

/// What a search has found, see [`find_controllers`](crate::find_controllers): each in the order of the addresses.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct FoundControllers {
    /// The controllers that answered; at least one.
    pub controllers: Vec<FoundController>,
    /// The addresses where none answered.
    pub others: Vec<TriedAddress>,
}

/// An address at which no controller answered, and what happened there.
///
/// It prints as `192.168.7.2:65000 (USB): no answer within 1s`.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct TriedAddress {
    /// The address as it was given.
    pub address: String,
    /// How a controller would be connected there.
    pub connection: ConnectionKind,
    /// What happened, as text.
    pub outcome: String,
    /// Whether something accepted the connection, but did not answer or closed it. A controller that another
    /// program uses does not answer; so may any other server.
    pub perhaps_in_use: bool,
}

impl fmt::Display for TriedAddress {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ({}): {}", self.address, self.connection, self.outcome)
    }
}
