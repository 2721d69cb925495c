//! Makes a program that fails smaller.

use std::time::{Duration, Instant};

use super::batch::{self, Outcome};
use super::name::Name;
use super::strategy;

/// How often each smaller program runs, because it depends on the threads' luck whether it fails.
const TRIES: usize = 6;

/// Runs a program several times at the same time; returns the first failure, and how many there were.
pub(crate) fn repeat(name: &Name, times: usize) -> (Option<Outcome>, usize) {
    let (mut first, mut failures) = (None, 0);
    batch::run(&vec![name.clone(); times], &mut |outcome| {
        if outcome.failed() {
            failures += 1;
            first.get_or_insert(outcome);
        }
    });
    (first, failures)
}

/// The smallest program found within the limit that still fails.
pub(crate) fn shrink(failure: Outcome, limit: Duration) -> Outcome {
    let begin = Instant::now();
    let mut smallest = failure;
    let mut name = smallest.name.clone();
    let mut tree = strategy::tree(name.seed, &name.steps);
    let mut goes_on = tree.simplify();
    name.steps.push('s');
    while goes_on && begin.elapsed() < limit {
        if let (Some(failure), _) = repeat(&name, TRIES) {
            smallest = failure;
            goes_on = tree.simplify();
            name.steps.push('s');
        } else {
            goes_on = tree.complicate();
            name.steps.push('c');
        }
    }
    smallest
}
