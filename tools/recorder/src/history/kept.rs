//! What a history keeps of an entry.

use std::time::Instant;

use ft_transfer_area::transfer_area::MAX_EXTENSIONS;
use ft_transfer_area::{FishX1Transfer, LoggedCycle, Statistics};

use crate::format::{RecordedEvent, Transfer, LONGEST_TEXT};
use crate::part::PARTS;
use crate::under_way::UnderWay;

/// What is known before the first entry.
#[derive(Clone, Debug)]
pub(super) struct Before {
    pub(super) areas: Vec<FishX1Transfer>,
    pub(super) under_way: UnderWay,
}

/// An entry, before which this number was lost.
#[derive(Debug)]
pub(super) struct Kept {
    pub(super) at: Instant,
    pub(super) lost: u64,
    pub(super) what: What,
}

#[derive(Debug)]
pub(super) enum What {
    Cycle(KeptCycle),
    Transfer(Transfer),
    Event(RecordedEvent),
}

/// A cycle, as what is different from the one before.
#[derive(Clone, Debug)]
pub(super) struct KeptCycle {
    pub(super) number: u64,
    pub(super) first: bool,
    pub(super) statistics: Statistics,
    pub(super) areas: usize,
    pub(super) alive: [u8; MAX_EXTENSIONS],
    /// The parts that differ, as their places in `newest` of the history.
    pub(super) parts: Box<[u16]>,
    /// Their numbers, one part after the other.
    pub(super) numbers: Box<[i32]>,
}

impl Kept {
    pub(super) fn bytes(&self) -> usize {
        let more = match &self.what {
            What::Cycle(cycle) => size_of_val(&*cycle.parts) + size_of_val(&*cycle.numbers),
            // Names, or an error.
            What::Transfer(_) => 3 * LONGEST_TEXT,
            What::Event(_) => 256,
        };
        // With what the pointers to it and the memory management take.
        size_of::<Self>() + more + 64
    }
}

impl KeptCycle {
    /// Makes these areas those of the cycle.
    pub(super) fn apply(&self, areas: &mut [FishX1Transfer]) {
        let mut numbers = &*self.numbers;
        for place in &self.parts {
            let (area, part) =
                (usize::from(*place) / PARTS.len(), usize::from(*place) % PARTS.len());
            let part = &PARTS[part];
            let (own, rest) = numbers.split_at(part.fields.len().min(numbers.len()));
            part.write(own, &mut areas[area]);
            numbers = rest;
        }
        areas[0].state.io_slave_alive = self.alive;
    }

    /// The same with all parts, whose numbers these are.
    pub(super) fn whole(&self, newest: &[Vec<i32>]) -> Self {
        let places = self.areas * PARTS.len();
        Self {
            parts: (0..places as u16).collect(),
            numbers: newest[..places].concat().into(),
            ..self.clone()
        }
    }

    pub(super) fn logged(&self, arrived: Instant, areas: &[FishX1Transfer]) -> LoggedCycle {
        let mut cycle = LoggedCycle::new(self.number, &areas[..self.areas]);
        (cycle.arrived, cycle.first, cycle.statistics) = (arrived, self.first, self.statistics);
        cycle
    }
}

impl Before {
    pub(super) fn take(&mut self, entry: &Kept) {
        match &entry.what {
            What::Cycle(cycle) => {
                cycle.apply(&mut self.areas);
                self.under_way.count(cycle.statistics);
            }
            What::Transfer(message) => self.under_way.take(message),
            What::Event(_) => {}
        }
    }
}
