//! Control a fischertechnik ROBOTICS TXT controller from a PC.

mod error;
mod exchange;
mod firmware;
pub mod transfer_area;
pub mod wire;

pub use error::Error;
pub use exchange::{Exchange, Inputs, TransferMode};
pub use firmware::FirmwareVersion;
pub use transfer_area::FishX1Transfer;
