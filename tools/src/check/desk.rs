//! A pupil's place in a lesson: a simulated TXT with its machine, and the check of programs that are started elsewhere.

use std::collections::BTreeSet;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use serde_json::{json, Value};

use super::examine;
use super::lesson::{Lesson, LESSONS};
use super::report::{Phase, Report};
use super::txt::Txt;
use crate::names::Names;
use crate::panel::course::{Both, Course, Progress};
use crate::panel::pages::Simulated;

/// How often to look whether the program before has ended.
const LOOK: Duration = Duration::from_millis(50);

/// A pupil's place.
pub(crate) struct Desk {
    txt: Txt,
    /// What people call it.
    label: String,
    report: Report,
    /// Whether the present check should end.
    ends: AtomicBool,
    state: Mutex<State>,
}

struct State {
    lesson: &'static Lesson,
    /// Whether there is a check, or one that has yet to end.
    is_checking: bool,
    passed: BTreeSet<u8>,
    /// Verdicts since the last lesson was passed.
    failed: u32,
    /// What was wrong last, and when; `None` if that was before the start.
    wrong: Option<(Both, Option<Instant>)>,
}

impl Desk {
    pub(super) fn new(lesson: &'static Lesson, txt: Txt, label: String) -> Self {
        let state =
            State { lesson, is_checking: false, passed: BTreeSet::new(), failed: 0, wrong: None };
        Self {
            txt,
            label,
            report: Report::new(None, Names::default()),
            ends: AtomicBool::new(false),
            state: Mutex::new(state),
        }
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Waits for the next program and checks it.
    fn run(&self) {
        let lesson = self.lock().lesson;
        let is_over = || self.ends.load(Ordering::Relaxed);
        self.report.begin(Phase::Waiting, None);
        // The steps are those of a program from its beginning on.
        while self.txt.is_online() && !is_over() {
            thread::sleep(LOOK);
        }
        let verdict = examine::guest(lesson, &self.txt, &self.report, &is_over);
        let mut state = self.lock();
        match verdict {
            _ if is_over() => self.report.begin(Phase::Idle, None),
            Ok(None) => {
                state.passed.insert(lesson.number);
                (state.failed, state.wrong) = (0, None);
            }
            Ok(Some(wrong)) => {
                state.failed += 1;
                state.wrong = Some((wrong.both(), Some(Instant::now())));
            }
            Err(error) => log::error!("lesson {} can't be checked: {error:#}", lesson.number),
        }
        state.is_checking = false;
    }
}

/// A place whose check runs in a thread of its own.
#[derive(Clone)]
pub(crate) struct Shared(pub(super) Arc<Desk>);

impl Shared {
    /// Where programs connect to.
    pub(crate) fn address(&self) -> String {
        self.0.txt.address()
    }

    /// Their port.
    pub(crate) fn port(&self) -> u16 {
        self.0.txt.port()
    }

    pub(crate) fn progress(&self) -> Option<Progress> {
        Course::progress(self)
    }

    pub(crate) fn course(&self) -> Arc<dyn Course> {
        Arc::new(self.clone())
    }

    /// Its simulated TXT for a page.
    pub(crate) fn simulated(&self) -> anyhow::Result<Simulated> {
        let Desk { txt, label, .. } = &*self.0;
        let world = self.0.lock().lesson.read_world()?;
        let label = Some(label.clone()).filter(|label| !label.is_empty());
        Ok(Simulated::of_course(Arc::clone(&txt.txts), world, label, self.course()))
    }

    /// Goes on where the pupil was: at this lesson, with these ones passed, and so many verdicts since then, of which
    /// the last one said this.
    pub(crate) fn go_on(
        &self,
        lesson: u8,
        passed: impl IntoIterator<Item = u8>,
        failed: u32,
        wrong: &str,
    ) {
        if lesson != self.0.lock().lesson.number && self.go_to(lesson).is_err() {
            log::warn!("there is no lesson {lesson}, so the first one begins");
        }
        let mut state = self.0.lock();
        state.passed.extend(passed);
        state.failed = failed;
        // It was kept in one language.
        let both = Both { en: wrong.to_owned(), de: wrong.to_owned() };
        state.wrong = Some((both, None)).filter(|_| !wrong.is_empty());
    }
}

impl Course for Shared {
    fn state(&self) -> Value {
        let desk = &self.0;
        let state = desk.lock();
        let mut value = lesson_json(state.lesson);
        value["check"] = desk.report.json();
        value["may_check"] = json!(true);
        value["checking"] = json!(state.is_checking);
        value["passed"] = json!(state.passed);
        value["address"] = json!(desk.txt.address());
        value
    }

    fn progress(&self) -> Option<Progress> {
        let desk = &self.0;
        let state = desk.lock();
        let wrong = state.wrong.as_ref();
        Some(Progress {
            lesson: state.lesson.number,
            phase: desk.report.phase().name(),
            passed: state.passed.iter().copied().collect(),
            failed: state.failed,
            wrong: wrong.map(|(wrong, _)| wrong.clone()),
            wrong_ago: wrong.and_then(|(_, at)| Some((*at)?.elapsed().as_secs())),
        })
    }

    fn check(&self, begins: bool) -> Result<(), &'static str> {
        let desk = &self.0;
        if !begins {
            desk.ends.store(true, Ordering::Relaxed);
            return Ok(());
        }
        let mut state = desk.lock();
        if state.is_checking {
            return Err("a check is running");
        }
        desk.ends.store(false, Ordering::Relaxed);
        let checks = Arc::clone(desk);
        let started =
            thread::Builder::new().name(String::from("check")).spawn(move || checks.run());
        state.is_checking = started.is_ok();
        started.map(|_| ()).map_err(|_| "the operating system could not start a thread")
    }

    fn go_to(&self, number: u8) -> Result<(), &'static str> {
        let lesson = LESSONS.iter().find(|lesson| lesson.number == number);
        let lesson = lesson.ok_or("there is no such lesson")?;
        let world = lesson.read_world().map_err(|_| "the lesson has no machine")?;
        let desk = &self.0;
        desk.ends.store(true, Ordering::Relaxed);
        let mut state = desk.lock();
        state.lesson = lesson;
        state.failed = 0;
        desk.txt.set_world(&world).map_err(|_| "the machine can't be changed")?;
        desk.report.begin(Phase::Idle, None);
        Ok(())
    }
}

/// A check that is only shown: its program was started by `txt check`.
pub(super) struct Shown {
    pub(super) lesson: &'static Lesson,
    pub(super) report: Arc<Report>,
}

impl Course for Shown {
    fn state(&self) -> Value {
        let mut value = lesson_json(self.lesson);
        value["check"] = self.report.json();
        value["may_check"] = json!(false);
        value
    }

    fn progress(&self) -> Option<Progress> {
        None
    }

    fn check(&self, _: bool) -> Result<(), &'static str> {
        Err("this page only shows a check")
    }

    fn go_to(&self, _: u8) -> Result<(), &'static str> {
        Err("this page only shows a check")
    }
}

/// What a page shows of a lesson.
fn lesson_json(lesson: &Lesson) -> Value {
    json!({
        "number": lesson.number,
        "count": LESSONS.len(),
        "title": lesson.title.json(),
        "task": lesson.task(),
    })
}
