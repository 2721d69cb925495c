//! Control a fischertechnik ROBOTICS TXT controller from a PC.

mod client;
mod error;
mod exchange;
mod firmware;
mod handler;
pub mod transfer_area;
pub mod wire;

pub use client::{TimeLimits, TxtClient, PORT};
pub use error::Error;
pub use exchange::{Exchange, Inputs, TransferMode};
pub use firmware::FirmwareVersion;
pub use handler::{
    Statistics, TransferArea, TransferAreaComHandler, TransferAreaComHandlerBuilder,
    TransferAreaGuard,
};
pub use transfer_area::FishX1Transfer;
