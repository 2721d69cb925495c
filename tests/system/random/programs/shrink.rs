//! Makes a program that fails smaller.

use std::fmt;
use std::str::FromStr;
use std::time::{Duration, Instant};

use super::batch::{self, Outcome};
use super::name::Name;
use super::plan::Plan;

/// How often a program runs to learn how often it fails.
pub(crate) const REPEATS: usize = 20;

/// Something that is left out of a program. Numbers are those of what is left so far.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Edit {
    Thread(usize),
    Group(usize, usize),
    Call(usize, usize, usize),
    /// One of the settings of a handler and its controller.
    Setting(usize, usize),
}

/// How many settings can be left out.
const SETTINGS: usize = 8;

impl Edit {
    /// Does it; `false` if there is no such thing.
    pub(crate) fn apply(&self, plan: &mut Plan) -> bool {
        match *self {
            Self::Thread(thread) => leave_out(&mut plan.threads, thread),
            Self::Group(thread, group) => {
                plan.threads.get_mut(thread).is_some_and(|groups| leave_out(groups, group))
            }
            Self::Call(thread, group, call) => {
                let group = plan.threads.get_mut(thread).and_then(|groups| groups.get_mut(group));
                group.is_some_and(|calls| leave_out(calls, call))
            }
            Self::Setting(which, setting) => {
                let Some(setup) = plan.setups.get_mut(which) else { return false };
                let before = format!("{setup:?}");
                match setting {
                    0 => setup.network = None,
                    1 => setup.faults.clear(),
                    2 => setup.watchdog_ms = None,
                    3 => setup.reconnect_ms = None,
                    4 => setup.lock_step = false,
                    5 => setup.extension = false,
                    6 => setup.simple = false,
                    _ => setup.listens = false,
                }
                before != format!("{setup:?}")
            }
        }
    }

    /// All that can be left out, large things first.
    fn all(plan: &Plan) -> Vec<Self> {
        let threads = (0..plan.threads.len()).map(Self::Thread);
        let groups = plan.threads.iter().enumerate().flat_map(|(thread, groups)| {
            (0..groups.len()).map(move |group| Self::Group(thread, group))
        });
        let calls = plan.threads.iter().enumerate().flat_map(|(thread, groups)| {
            groups.iter().enumerate().flat_map(move |(group, calls)| {
                (0..calls.len()).map(move |call| Self::Call(thread, group, call))
            })
        });
        let settings = (0..plan.setups.len())
            .flat_map(|which| (0..SETTINGS).map(move |setting| Self::Setting(which, setting)));
        // From the end, so that the numbers of the others stay.
        let mut all: Vec<Self> = calls.rev().collect();
        all.splice(0..0, settings);
        all.splice(0..0, groups.rev());
        all.splice(0..0, threads.rev());
        all
    }
}

fn leave_out<T>(list: &mut Vec<T>, index: usize) -> bool {
    let exists = index < list.len();
    if exists {
        list.remove(index);
    }
    exists
}

impl fmt::Display for Edit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Thread(thread) => write!(f, "t{thread}"),
            Self::Group(thread, group) => write!(f, "g{thread}.{group}"),
            Self::Call(thread, group, call) => write!(f, "c{thread}.{group}.{call}"),
            Self::Setting(which, setting) => write!(f, "s{which}.{setting}"),
        }
    }
}

impl FromStr for Edit {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || format!("{text} is nothing that can be left out");
        let numbers = text.get(1..).ok_or_else(wrong)?.split('.').map(str::parse);
        let numbers: Vec<usize> = numbers.collect::<Result<_, _>>().map_err(|_| wrong())?;
        match (&text[..1], &*numbers) {
            ("t", &[thread]) => Ok(Self::Thread(thread)),
            ("g", &[thread, group]) => Ok(Self::Group(thread, group)),
            ("c", &[thread, group, call]) => Ok(Self::Call(thread, group, call)),
            ("s", &[which, setting]) => Ok(Self::Setting(which, setting)),
            _ => Err(wrong()),
        }
    }
}

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

/// The smallest program found within the limit that still fails in the same way.
pub(crate) fn shrink(failure: Outcome, limit: Duration) -> Outcome {
    let begin = Instant::now();
    let (_, failures) = repeat(&failure.name, REPEATS);
    // It depends on the threads' luck whether it fails.
    let tries = (3 * REPEATS / failures.max(1)).clamp(3, 2 * REPEATS);
    let kind = kind(&failure.said);
    let mut smallest = failure;
    loop {
        let before = smallest.name.clone();
        for edit in Edit::all(&before.plan()) {
            let mut name = smallest.name.clone();
            if begin.elapsed() > limit || !edit.apply(&mut name.plan()) {
                continue;
            }
            name.edits.push(edit);
            let found = repeat(&name, tries).0.filter(|found| self::kind(&found.said) == kind);
            smallest = found.unwrap_or(smallest);
        }
        if smallest.name == before || begin.elapsed() > limit {
            return smallest;
        }
    }
}

/// What kind of mistake it is: the words without numbers and names.
fn kind(said: &str) -> String {
    let letters = said.chars().filter(|letter| letter.is_alphabetic() || *letter == ' ');
    letters.take(40).collect()
}
