//! What several tests need: a handler for a simulated TXT, and a record of the requests it got.

use std::sync::{Arc, Mutex};
use std::time::Duration;

use ft_transfer_area::wire::ExchangeData;
use ft_transfer_area::{TransferAreaComHandler, TransferAreaComHandlerBuilder};
use ft_transfer_area_simulator::{Machine, SimulatedTxt, SimulatedTxtBuilder};

#[path = "../ports/mod.rs"]
mod ports;
pub(crate) use ports::unused_ports;

/// Longer than any wait on a busy machine; only a test that fails waits this long.
pub(crate) const DEADLINE: Duration = Duration::from_secs(30);

/// A simulated TXT that answers as fast as it can and never closes an idle connection.
pub(crate) fn unpaced() -> SimulatedTxtBuilder {
    SimulatedTxt::builder().pace(Duration::ZERO).idle_limit(Duration::from_secs(3600))
}

/// The same for one session, in which it ends and refuses where the maker's firmware does.
pub(crate) fn strict() -> SimulatedTxtBuilder {
    unpaced().strict(true)
}

/// Settings for a handler of this simulated TXT.
pub(crate) fn handler_for(txt: &SimulatedTxt) -> TransferAreaComHandlerBuilder {
    // A panic of a hook takes long when a backtrace is printed.
    TransferAreaComHandler::builder(txt.address())
}

/// Waits until the condition holds for the simulated machine.
pub(crate) fn wait_until(txt: &SimulatedTxt, what: &str, condition: impl FnMut(&Machine) -> bool) {
    assert!(txt.wait_until(condition, DEADLINE), "{what} did not happen");
}

/// Checks that the client has done nothing that a correct client does not do.
pub(crate) fn check_client(txt: &SimulatedTxt) {
    let oddities: Vec<String> =
        txt.with_machine(|machine| machine.oddities().map(str::to_owned).collect());
    assert!(oddities.is_empty(), "{oddities:?}");
}

/// The master's outputs in every exchange that a simulated TXT saw.
#[derive(Clone, Default)]
pub(crate) struct Record(Arc<Mutex<Vec<ExchangeData>>>);

impl Record {
    pub(crate) fn note(&self, machine: &Machine) {
        self.0.lock().unwrap().push(machine.controllers[0].outputs);
    }

    pub(crate) fn outputs(&self) -> Vec<ExchangeData> {
        self.0.lock().unwrap().clone()
    }

    pub(crate) fn last(&self) -> ExchangeData {
        *self.0.lock().unwrap().last().expect("no exchange was seen")
    }
}
