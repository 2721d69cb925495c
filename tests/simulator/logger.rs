//! Who waits for a logger that blocks, as on a terminal after Ctrl-S, and for a script.

use std::sync::mpsc;
use std::sync::{Condvar, Mutex};

use ft_transfer_area::wire::{ExchangeData, ExchangeDataResponse};
use ft_transfer_area_simulator::world::World;
use ft_transfer_area_simulator::Machine;

use crate::wire_client::{Client, LIMIT};
use crate::{drops_in_time, unpaced};

/// The end of a line that no other test causes. The logger blocks at it.
const BLOCKS: &str = "O1 of the master got duty 1234, which is not 0..=512";

static LOGGER: Logger = Logger { state: Mutex::new(State::Free), changed: Condvar::new() };

/// Whether a thread is blocked.
struct Logger {
    state: Mutex<State>,
    changed: Condvar,
}

#[derive(Clone, Copy, PartialEq)]
enum State {
    /// None is.
    Free,
    /// A thread is blocked.
    Blocked,
}

impl Logger {
    fn set(&self, state: State) {
        *self.state.lock().unwrap() = state;
        self.changed.notify_all();
    }

    fn wait_until_blocked(&self) {
        let state = self.state.lock().unwrap();
        let waits = |state: &mut State| *state != State::Blocked;
        let (_state, waited) = self.changed.wait_timeout_while(state, LIMIT, waits).unwrap();
        assert!(!waited.timed_out(), "the line does not come");
    }
}

impl log::Log for Logger {
    fn enabled(&self, _: &log::Metadata<'_>) -> bool {
        true
    }

    fn log(&self, record: &log::Record<'_>) {
        let line = record.args().to_string();
        if line.ends_with(BLOCKS) {
            self.set(State::Blocked);
            let state = self.state.lock().unwrap();
            drop(self.changed.wait_while(state, |state| *state == State::Blocked).unwrap());
        }
    }

    fn flush(&self) {}
}

/// Ends the block, even if the test fails.
struct Unblock;

impl Drop for Unblock {
    fn drop(&mut self) {
        LOGGER.set(State::Free);
    }
}

#[test]
fn a_logger_that_blocks_holds_up_no_simulated_txt() {
    log::set_logger(&LOGGER).unwrap();
    log::set_max_level(log::LevelFilter::Warn);
    let txt = unpaced().extensions(7).world(World::new()).start().unwrap();
    let mut client = Client::online(&txt);
    let duty = [1234, 0, 0, 0, 0, 0, 0, 0];
    let unblock = Unblock;
    client.send_exchange(&ExchangeData { duty, ..ExchangeData::default() });
    LOGGER.wait_until_blocked();
    client.receive(ExchangeDataResponse::LEN);
    // Nor a program that causes a line.
    let outputs = ExchangeData {
        distance: [0, 0, 9, 0],
        motor_command_id: [0, 0, 1, 0],
        ..ExchangeData::default()
    };
    txt.with_machine(|machine| machine.set_outputs(7, outputs));
    client.exchange(&ExchangeData::default());
    drops_in_time(txt);
    drop(unblock);
}

#[test]
fn a_script_that_does_not_return_holds_up_no_end() {
    let (runs, running) = mpsc::channel();
    let (goes_on, may_go_on) = mpsc::channel::<()>();
    let script = move |_: &mut Machine| {
        let _ = runs.send(());
        let _ = may_go_on.recv();
    };
    let txt = unpaced().on_exchange(script).start().unwrap();
    let mut client = Client::online(&txt);
    client.send_exchange(&ExchangeData::default());
    running.recv_timeout(LIMIT).unwrap();
    drops_in_time(txt);
    drop(goes_on);
}
