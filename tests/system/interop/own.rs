//! This crate's handler in the same scenarios.

use std::time::Instant;

use ft_transfer_area::transfer_area::{UniConfig, LOCAL_IO};
use ft_transfer_area::{FishX1Transfer, TransferAreaComHandler};
use serde_json::Value;

use super::Exchange;
use crate::program::{Program, DEADLINE};

/// A handler that is online.
pub(crate) struct Own {
    pub(crate) handler: TransferAreaComHandler,
    pub(crate) areas: usize,
}

impl Own {
    pub(crate) fn begin(program: &Program, exchange: Exchange) -> Self {
        let areas = exchange.areas();
        let builder = program.handler().areas(areas).mode(exchange.mode());
        let handler = builder.build().unwrap();
        for area in handler.areas().lock().iter_mut() {
            *area.config.motor = [1; 4];
        }
        handler.begin_transfer().unwrap();
        Self { handler, areas }
    }

    pub(crate) fn end(self) {
        self.handler.end_transfer().unwrap();
    }

    /// The results for each area, one after the other.
    pub(crate) fn each(&self, f: impl Fn(&Self, usize) -> Value) -> Value {
        (0..self.areas).map(|area| f(self, area)).collect()
    }

    /// Sets the inputs to these modes, pairs of `mode` and `digital`.
    pub(crate) fn configure(&self, area: usize, inputs: [(u8, u8); 8]) {
        let mut areas = self.handler.areas().lock();
        areas[area].config.uni =
            inputs.map(|(mode, digital)| UniConfig { mode, digital, dummy: [0; 2] }).into();
        areas[area].raise_config_id();
    }

    /// Changes an area's outputs in one exchange, and waits until it is over.
    pub(crate) fn together(&self, area: usize, change: impl FnOnce(&mut FishX1Transfer)) {
        change(&mut self.handler.areas().lock()[area]);
        self.cycles(2);
    }

    /// Waits for cycles until the condition holds.
    pub(crate) fn until(&self, mut condition: impl FnMut(&[FishX1Transfer]) -> bool) {
        let begin = Instant::now();
        while !condition(&self.handler.areas().wait_cycle().unwrap()) {
            assert!(begin.elapsed() < DEADLINE, "waited too long");
        }
    }

    /// Waits for `count` exchanges; the second one begins after this call.
    pub(crate) fn cycles(&self, count: usize) {
        for _ in 0..count {
            self.handler.areas().wait_cycle().unwrap();
        }
    }

    /// Reads an area.
    pub(crate) fn look<R>(&self, area: usize, f: impl FnOnce(&FishX1Transfer) -> R) -> R {
        f(&self.handler.areas().lock()[area])
    }

    /// Reads the master's area, which has the remotes and the sounds.
    pub(crate) fn master<R>(&self, f: impl FnOnce(&FishX1Transfer) -> R) -> R {
        self.look(LOCAL_IO, f)
    }
}
