//! A pupil's place in a lesson: a simulated TXT with its machine, and the check of programs that are started elsewhere.

use std::collections::BTreeSet;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use ft_transfer_area_simulator::world::World;
use serde_json::{json, Value};

use super::examine;
use super::lesson::{Lesson, LESSONS};
use super::report::{Phase, Report};
use super::stage::Stage;
use super::txt::Txt;
use super::words::{Language, Words, Wrong};
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
    /// Whether the present check should end. Changed only with the state locked.
    ends: AtomicBool,
    state: Mutex<State>,
}

struct State {
    lesson: &'static Lesson,
    world: Arc<World>,
    /// Whether there is a check, or one that has yet to end.
    is_checking: bool,
    passed: BTreeSet<u8>,
    /// Verdicts since the last lesson was passed.
    failed: u32,
    /// What was wrong last, and when; `None` if that was before the start.
    wrong: Option<(Both, Option<Instant>)>,
}

impl Desk {
    /// With the machine of this lesson plugged in.
    pub(super) fn new(lesson: &'static Lesson, world: World, txt: Txt, label: String) -> Self {
        let state = State {
            lesson,
            world: Arc::new(world),
            is_checking: false,
            passed: BTreeSet::new(),
            failed: 0,
            wrong: None,
        };
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

    /// What lines in the log begin with.
    fn whose(&self) -> String {
        match self.label.as_str() {
            "" => String::new(),
            label => format!("{label}: "),
        }
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
        let verdict = self.examine(lesson, &is_over);
        let mut state = self.lock();
        match verdict {
            _ if is_over() => self.report.begin(Phase::Idle, None),
            Ok(None) => {
                state.passed.insert(lesson.number);
                (state.failed, state.wrong) = (0, None);
            }
            Ok(Some(wrong)) => {
                state.failed = state.failed.saturating_add(1);
                state.wrong = Some((wrong.both(), Some(Instant::now())));
            }
            Err(error) => {
                let whose = self.whose();
                log::error!("{whose}lesson {} can't be checked: {error:#}", lesson.number);
            }
        }
        state.is_checking = false;
    }

    /// Checks the next program, unless the pupil has gone to another lesson, whose machine is to stay.
    fn examine(
        &self,
        lesson: &'static Lesson,
        is_over: &dyn Fn() -> bool,
    ) -> anyhow::Result<Option<Wrong>> {
        let stage = {
            let state = self.lock();
            if is_over() {
                return Ok(None);
            }
            Stage::for_guest(self.txt.clone(), &state.world, &self.report, is_over)?
        };
        Ok(examine::guest(stage, lesson, &self.report))
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
    pub(crate) fn simulated(&self) -> Simulated {
        let Desk { txt, label, .. } = &*self.0;
        let label = Some(label.clone()).filter(|label| !label.is_empty());
        Simulated::of_course(Arc::clone(&txt.txts), label, self.course())
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
        let present = self.0.lock().lesson.number;
        if lesson != present && self.go_to(lesson).is_err() {
            let whose = self.0.whose();
            log::warn!("{whose}there is no lesson {lesson}, so lesson {present} begins");
            // What was wrong was in another lesson.
            self.0.lock().passed.extend(passed);
            return;
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
        value["whose"] = json!(desk.label);
        value
    }

    fn world(&self) -> Option<Arc<World>> {
        Some(Arc::clone(&self.0.lock().world))
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

    fn is_checking(&self) -> bool {
        self.0.lock().is_checking
    }

    fn check(&self, begins: bool) -> Result<(), &'static str> {
        let desk = &self.0;
        let mut state = desk.lock();
        if !begins {
            desk.ends.store(true, Ordering::Relaxed);
            return Ok(());
        }
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
        let mut state = desk.lock();
        desk.ends.store(true, Ordering::Relaxed);
        desk.txt.set_world(&world).map_err(|_| "the machine can't be changed")?;
        (state.lesson, state.world) = (lesson, Arc::new(world));
        // What was wrong was in the lesson before.
        (state.failed, state.wrong) = (0, None);
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

    fn world(&self) -> Option<Arc<World>> {
        None
    }

    fn progress(&self) -> Option<Progress> {
        None
    }

    fn is_checking(&self) -> bool {
        matches!(self.report.phase(), Phase::Waiting | Phase::Running)
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
        "program": Words::fixed(lesson.name_in(Language::En), lesson.name_in(Language::De)).json(),
        "task": lesson.task(),
    })
}

#[cfg(test)]
mod tests {
    use ft_transfer_area::tx::Input;
    use ft_transfer_area::TransferAreaComHandler;
    use ft_transfer_area_simulator::SimulatedTxt;

    use super::*;
    use crate::check;

    const LIMIT: Duration = Duration::from_secs(40);

    fn wait_for(what: &str, mut is_so: impl FnMut() -> bool) {
        let begin = Instant::now();
        while !is_so() {
            assert!(begin.elapsed() < LIMIT, "{what}");
            thread::sleep(LOOK);
        }
    }

    #[test]
    fn mistakes_of_a_lesson_that_is_not_there_are_not_those_of_the_first() {
        let desk = check::desk("1", SimulatedTxt::builder(), String::new()).unwrap();
        for (lesson, failed) in [(2, 7), (12, 0)] {
            desk.go_on(lesson, [1], 7, "M2 turns the wrong way.");
            let state = desk.0.lock();
            assert_eq!((state.failed, state.wrong.is_some()), (failed, failed > 0), "{lesson}");
            drop(state);
            desk.go_to(1).unwrap();
        }
    }

    #[test]
    fn a_check_that_waits_leaves_the_machine_of_the_next_lesson_alone() {
        let desk = check::desk("1", SimulatedTxt::builder(), String::new()).unwrap();
        let inputs = |desk: &Shared| {
            desk.0.txt.txt().with_machine(|machine| {
                let world = machine.world().unwrap();
                Input::ALL.map(|input| world.sensor(0, input).is_some())
            })
        };
        desk.go_to(9).unwrap();
        let of_next = inputs(&desk);
        desk.go_to(1).unwrap();
        assert_ne!(inputs(&desk), of_next);
        // The check waits until the program before has ended.
        let handler = TransferAreaComHandler::builder(desk.address()).build().unwrap();
        handler.begin_transfer().unwrap();
        desk.check(true).unwrap();
        wait_for("the check waits", || desk.progress().unwrap().phase == "waiting");
        desk.go_to(9).unwrap();
        wait_for("the check ends", || !desk.0.lock().is_checking);
        assert_eq!(inputs(&desk), of_next);
        assert_eq!(desk.progress().unwrap().lesson, 9);
    }

    #[test]
    fn what_was_wrong_in_a_lesson_is_not_told_of_the_next_one() {
        let desk = check::desk("1", SimulatedTxt::builder(), String::new()).unwrap();
        desk.go_on(1, [], 3, "The lamp is dark.");
        assert_eq!(desk.progress().unwrap().failed, 3);
        desk.go_to(2).unwrap();
        let progress = desk.progress().unwrap();
        assert_eq!((progress.lesson, progress.failed, progress.wrong), (2, 0, None));
    }
}
