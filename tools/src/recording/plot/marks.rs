//! What is unusual in what is drawn.

use std::collections::BTreeMap;

use ft_transfer_area_recorder::Entry;

use super::super::clock::Clock;
use super::super::unusual::{Kind, Moment, Unusual, LISTED};

#[derive(Default)]
pub(super) struct Marks {
    unusual: Unusual,
    moments: Vec<Moment>,
    /// How many of each kind are in the picture.
    counts: BTreeMap<Kind, u64>,
}

impl Marks {
    /// Looks at an entry. The numbers are those of the whole recording, so it has to see all from the beginning.
    pub(super) fn look(&mut self, entry: &Entry, is_wanted: bool) {
        for moment in self.unusual.look(entry.at, &entry.what) {
            if !is_wanted {
                continue;
            }
            let count = self.counts.entry(moment.kind).or_default();
            *count += 1;
            if *count <= LISTED {
                self.moments.push(moment);
            }
        }
    }

    /// When they are, with their numbers.
    pub(super) fn places(&self) -> Vec<(f64, Option<usize>)> {
        self.moments.iter().map(|moment| (moment.at.as_secs_f64(), moment.number)).collect()
    }

    pub(super) fn moments(&self) -> &[Moment] {
        &self.moments
    }

    /// Whether there are more than those.
    pub(super) fn are_some_left_out(&self) -> bool {
        self.counts.values().any(|count| *count > LISTED)
    }

    pub(super) fn lines(&self, clock: &Clock) -> Vec<String> {
        let line = |moment: &Moment| {
            let number = moment.number.map_or(String::new(), |number| format!(" {number}"));
            let (time, seconds) = (clock.of_day(moment.at), moment.at.as_secs_f64());
            format!("unusual{number}: {time} ({seconds:.2} s): {}", moment.what.en)
        };
        let lines = self.moments.iter().map(line);
        let more = self.counts.iter().filter(|(_, count)| **count > LISTED);
        let more = more
            .map(|(kind, count)| format!("unusual: {} in all in this part", kind.counted(*count)));
        lines.chain(more).collect()
    }
}
