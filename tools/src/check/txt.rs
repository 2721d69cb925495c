//! The simulated TXT of a check, and its exchanges.

use std::net::SocketAddr;
use std::ops::Range;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use ft_transfer_area::tx::Counter;
use ft_transfer_area_simulator::world::World;
use ft_transfer_area_simulator::{FaultKind, Machine, SimulatedTxt};

use super::moment::Moment;
use crate::web;

/// How many exchanges are kept: those of half an hour. A check takes a minute or two.
const KEPT: usize = 180_000;
/// By how much a late answer is late.
const LATE: Duration = Duration::from_millis(60);

/// The exchanges since the start of a check.
#[derive(Clone, Default)]
pub(super) struct Log(Arc<Mutex<Kept>>);

#[derive(Default)]
pub(super) struct Kept {
    pub(super) moments: Vec<Moment>,
    /// Whether there is a check.
    is_on: bool,
    /// Somebody starts the program elsewhere.
    waits_for_guest: bool,
    /// The answer with such a count of this counter comes late.
    late: Option<(Counter, Range<i16>)>,
}

impl Log {
    /// Keeps the present exchange, during a check. To be called with each one.
    pub(super) fn keep(&self, machine: &mut Machine) {
        let mut kept = self.lock();
        if kept.is_on && kept.moments.len() < KEPT {
            let moment = Moment::of(machine, kept.moments.last());
            // What only stops the controller, as `txt stop`, is not the guest that is waited for.
            let is_first = kept.waits_for_guest && kept.moments.is_empty();
            if is_first && moment.all_off() && !is_configured(machine) {
                return;
            }
            kept.moments.push(moment);
            let is_late = |(counter, counts): &(Counter, Range<i16>)| {
                counts.contains(&moment.count(*counter))
            };
            if kept.late.as_ref().is_some_and(is_late) {
                kept.late = None;
                machine.disturb(FaultKind::Delay(LATE));
            }
        }
    }

    pub(super) fn begin(&self, is_on: bool) {
        *self.lock() = Kept { is_on, ..Kept::default() };
    }

    pub(super) fn wait_for_guest(&self) {
        self.lock().waits_for_guest = true;
    }

    /// Lets the next answer with such a count come late, as on a real network, so that the program misses counts.
    pub(super) fn be_late(&self, counter: Counter, counts: Range<i16>) {
        self.lock().late = Some((counter, counts));
    }

    pub(super) fn len(&self) -> usize {
        self.lock().moments.len()
    }

    pub(super) fn lock(&self) -> MutexGuard<'_, Kept> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Whether the client has sent a configuration in this session, as programs do.
fn is_configured(machine: &Machine) -> bool {
    machine.controllers[0].config_id != 0
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

    /// The number of the connection that is served.
    pub(super) fn connection(&self) -> u64 {
        self.txt().with_machine(|machine| machine.connections())
    }

    pub(super) fn set_world(&self, world: &World) -> anyhow::Result<()> {
        Ok(self.txt().with_machine(|machine| machine.set_world(world))?)
    }
}
