//! The transfer area, which a background thread exchanges with the controller.

mod area;
mod area_lock;
mod builder;
mod camera;
mod clock;
mod com_handler;
mod command;
mod cycle;
mod events;
mod guard;
mod hand_over;
mod handshake;
mod hook;
mod hook_slot;
mod i2c;
mod interruptions;
mod long_guard;
#[cfg(all(test, shuttle))]
mod model;
mod panic_check;
#[cfg(all(test, not(shuttle)))]
mod peer;
mod program_side;
mod reconnect;
mod response_wait;
mod settings;
mod shared;
mod state;
mod statistics;
mod subscribe;
mod sync;
mod taken;
mod thread;
mod thread_slot;
mod transfer_side;
mod unfinished;
mod wait;
mod wait_any;
mod watchdog;
mod window;

pub use area::TransferArea;
pub use builder::TransferAreaComHandlerBuilder;
pub use com_handler::TransferAreaComHandler;
pub use events::{
    CycleLog, Event, EventKind, Events, Joystick, LogEntry, Logged, LoggedBeginning, LoggedCycle,
    TimedEvent,
};
pub use guard::TransferAreaGuard;
pub use statistics::Statistics;
