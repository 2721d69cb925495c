//! The simulated TXT of a check, and its exchanges.

use std::net::SocketAddr;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use ft_transfer_area_simulator::world::World;
use ft_transfer_area_simulator::{Machine, SimulatedTxt};

use super::moment::Moment;
use crate::web;

/// How many exchanges are kept: those of half an hour. A check takes a minute or two.
const KEPT: usize = 180_000;

/// The exchanges since the start of a check.
#[derive(Clone, Default)]
pub(super) struct Log(Arc<Mutex<Kept>>);

#[derive(Default)]
pub(super) struct Kept {
    pub(super) moments: Vec<Moment>,
    /// Whether there is a check.
    is_on: bool,
}

impl Log {
    /// Keeps the present exchange, during a check. To be called with each one.
    pub(super) fn keep(&self, machine: &Machine) {
        let mut kept = self.lock();
        if kept.is_on && kept.moments.len() < KEPT {
            let moment = Moment::of(machine, kept.moments.last());
            kept.moments.push(moment);
        }
    }

    pub(super) fn begin(&self, is_on: bool) {
        *self.lock() = Kept { moments: Vec::new(), is_on };
    }

    pub(super) fn len(&self) -> usize {
        self.lock().moments.len()
    }

    pub(super) fn lock(&self) -> MutexGuard<'_, Kept> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The simulated TXT of a check.
#[derive(Clone)]
pub(super) struct Txt {
    pub(super) txts: Arc<Vec<(String, SimulatedTxt)>>,
    pub(super) log: Log,
}

impl Txt {
    pub(super) fn txt(&self) -> &SimulatedTxt {
        &self.txts[0].1
    }

    /// Where programs connect to.
    pub(super) fn address(&self) -> String {
        let address = self.txt().address();
        SocketAddr::new(web::reachable(address.ip()), address.port()).to_string()
    }

    pub(super) fn port(&self) -> u16 {
        self.txt().port()
    }

    pub(super) fn is_online(&self) -> bool {
        self.txt().with_machine(|machine| machine.online())
    }

    pub(super) fn set_world(&self, world: &World) -> anyhow::Result<()> {
        Ok(self.txt().with_machine(|machine| machine.set_world(world))?)
    }
}
