//! Orders: what the page that drives has asked for, on its way to the thread that does it.

use crossbeam_channel::Sender;

use super::problem::Problem;
use super::reply::Reply;

/// A request, and where its answer goes.
pub(super) struct Order<T> {
    /// The lease under which it was given.
    pub(super) lease: u64,
    pub(super) request: T,
    pub(super) reply: Reply,
}

impl<T> Order<T> {
    /// Puts the order into the queue of its thread. If that is full, the order is not carried out.
    pub(super) fn send_to(self, queue: &Sender<Self>) {
        if let Err(full) = queue.try_send(self) {
            let text = "too many commands wait for this controller; this one was not carried out";
            full.into_inner().reply.send(Err(Problem::new("busy", text)));
        }
    }
}

pub(super) fn not_connected() -> Problem {
    Problem::new("not_connected", "the controller is not connected at present")
}

pub(super) fn only_looks() -> Problem {
    Problem::new("only_looks", "this page only looks: another program drives this controller")
}

pub(super) fn stopped() -> Problem {
    Problem::new("stopped", "the motors were stopped before this command was carried out")
}
