//! What a check tells: each step when it is over, and the verdict. On the terminal, and for a page.

use std::sync::{Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use serde_json::{json, Value};

use super::words::{Language, Words, Wrong};
use crate::names::Names;
use crate::print;

/// How many steps are kept. The longest check has 10 of them.
const STEPS_MAX: usize = 100;

/// How often to look whether a page has the verdict.
const LOOK: Duration = Duration::from_millis(20);

/// How far a check is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Phase {
    /// No program has been tried yet.
    Idle,
    /// The check waits for the program.
    Waiting,
    Running,
    Solved,
    Wrong,
}

impl Phase {
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Idle => "idle",
            Self::Waiting => "waiting",
            Self::Running => "running",
            Self::Solved => "solved",
            Self::Wrong => "wrong",
        }
    }
}

struct Step {
    words: Words,
    /// `None` while it is being tried.
    is_right: Option<bool>,
}

/// What was told of one lesson.
struct Told {
    phase: Phase,
    steps: Vec<Step>,
    /// Why the check has begun again.
    note: Option<Words>,
    wrong: Option<Wrong>,
    /// Whether a page has the verdict.
    is_seen: bool,
}

impl Told {
    fn begin(phase: Phase, note: Option<Words>) -> Self {
        Self { phase, steps: Vec::new(), note, wrong: None, is_seen: false }
    }
}

/// What is told, from the check to whoever looks.
pub(crate) struct Report {
    told: Mutex<Told>,
    /// The language of the lines on the terminal; `None` when there are none.
    printed: Option<Language>,
    /// What people call the terminals.
    names: Names,
}

impl Report {
    pub(super) fn new(printed: Option<Language>, names: Names) -> Self {
        Self { told: Mutex::new(Told::begin(Phase::Idle, None)), printed, names }
    }

    fn told(&self) -> MutexGuard<'_, Told> {
        self.told.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The check of a program begins, perhaps again.
    pub(super) fn begin(&self, phase: Phase, note: Option<Words>) {
        if let (Some(note), Some(language)) = (&note, self.printed) {
            print_line(note.text(language));
        }
        *self.told() = Told::begin(phase, note);
    }

    /// The program is there.
    pub(super) fn runs(&self) {
        self.told().phase = Phase::Running;
    }

    pub(super) fn step(&self, words: Words) {
        let words = words.named(&self.names);
        let steps = &mut self.told().steps;
        if steps.len() < STEPS_MAX {
            steps.push(Step { words, is_right: None });
        }
    }

    /// Tells how the present step went, if there is one.
    pub(super) fn end_step(&self, is_right: bool) {
        let mut told = self.told();
        let Some(step) = told.steps.last_mut().filter(|step| step.is_right.is_none()) else {
            return;
        };
        step.is_right = Some(is_right);
        let Some(language) = self.printed else { return };
        let sign = match (is_right, language) {
            (true, Language::En | Language::De) => "ok",
            (false, Language::En) => "wrong",
            (false, Language::De) => "falsch",
        };
        let line = format!("  {sign:6}  {}", step.words.text(language));
        drop(told);
        print_line(&line);
    }

    /// The verdict. Returns what is wrong as it is told.
    pub(super) fn end(&self, wrong: Option<Wrong>) -> Option<Wrong> {
        let wrong = wrong.map(|wrong| wrong.named(&self.names));
        self.end_step(wrong.is_none());
        let mut told = self.told();
        told.phase = if wrong.is_none() { Phase::Solved } else { Phase::Wrong };
        told.wrong.clone_from(&wrong);
        wrong
    }

    pub(crate) fn phase(&self) -> Phase {
        self.told().phase
    }

    /// Waits until a page has the verdict, if one looks.
    pub(super) fn wait_until_seen(&self, limit: Duration) {
        let deadline = Instant::now() + limit;
        while !self.told().is_seen && Instant::now() < deadline {
            thread::sleep(LOOK);
        }
    }

    /// All of it, in both languages.
    pub(crate) fn json(&self) -> Value {
        let mut told = self.told();
        told.is_seen = matches!(told.phase, Phase::Solved | Phase::Wrong);
        let step = |step: &Step| {
            let sign = match step.is_right {
                None => "now",
                Some(true) => "ok",
                Some(false) => "wrong",
            };
            json!({"words": step.words.json(), "sign": sign})
        };
        json!({
            "phase": told.phase.name(),
            "steps": told.steps.iter().map(step).collect::<Vec<_>>(),
            "note": told.note.as_ref().map(Words::json),
            "wrong": told.wrong.as_ref().map(Wrong::json),
        })
    }
}

/// What can't be printed is no reason to stop; the exit status says the result, too.
fn print_line(line: &str) {
    let _ = print::line(line);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_and_verdicts_have_the_names_of_terminals() {
        let names = Names::parse("[master]\nI3 = \"Klingel\"\nM1 = \"Tor\"").unwrap();
        let report = Report::new(None, names);
        report.step(Words::fixed("I3 opens", "I3 öffnet"));
        let wrong = Wrong::new("M1 is off.", "M1 steht.").hint("press I3", "Drück I3");
        let told = report.end(Some(wrong)).unwrap().text(Language::De);
        assert_eq!(told, "M1 (Tor) steht.\nTipp: Drück I3 (Klingel)");
        let json = report.json();
        assert_eq!(json["steps"][0]["words"]["en"], "I3 (Klingel) opens");
        assert_eq!(json["wrong"]["what"]["de"], "M1 (Tor) steht.");
    }
}
