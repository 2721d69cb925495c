//! Control a fischertechnik ROBOTICS TXT controller from a PC.

mod error;
mod firmware;
#[cfg(feature = "simulator")]
pub mod simulator;
pub mod transfer_area;
pub mod wire;

pub use error::Error;
pub use firmware::FirmwareVersion;
pub use transfer_area::FishX1Transfer;
