//! The transfer area, which a background thread exchanges with the controller.

mod builder;
mod camera;
mod com_handler;
mod events;
mod long_guard;
#[cfg(all(test, shuttle))]
mod model;
mod parts;
mod program;
mod settings;
mod shared;
mod state;
#[cfg(not(all(test, shuttle)))]
mod stop;
mod sync;
mod transfer;

pub use builder::TransferAreaComHandlerBuilder;
pub use com_handler::TransferAreaComHandler;
pub use events::{CycleLog, Events};
pub use program::area::TransferAreas;
pub use program::guard::TransferAreaGuard;
#[cfg(not(all(test, shuttle)))]
pub use stop::stop_controller;
