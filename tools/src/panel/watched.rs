//! A controller that another program drives through this one: it only looks.

use std::collections::VecDeque;
use std::io::ErrorKind;
use std::sync::Arc;
use std::time::{Duration, Instant};

use ft_transfer_area::FishX1Transfer;
use tokio::sync::watch;

use super::camera::Camera;
use super::common::Common;
use super::histogram::Histogram;
use super::problem::{Problem, REPLACED};
use super::state::{
    self, AnswerState, HostState, I2cState, Link, Newest, Phase, WatchedState, STATE_PERIOD,
};
use crate::commands::stop_all;
use crate::gate::Gate;
use crate::recording::on_demand::Button;
use crate::seen::{
    forgotten, halted, ignored, missed, no_answer, not_understood, refused, unanswered,
    unknown_area, Controllers, Cycle, Farewell, Followed, Gone, Happened, I2cExchange, Line, Seen,
    FAREWELL_UNANSWERED,
};

/// How long a page tells of a connection that has ended, unless it was that of the program.
const TOLD: Duration = Duration::from_secs(3);
/// Of how many answers the median is shown.
const ANSWERS: usize = 256;
/// From when on an answer is late: a controller sends its next response 10 ms after the last one.
const LATE: Duration = Duration::from_millis(10);

/// What a page shows of such a controller.
pub(crate) struct Watched {
    common: Arc<Common>,
    camera: Arc<Camera>,
    gate: Arc<Gate>,
    button: Option<Button>,
    publish: watch::Sender<Newest>,
    next_state: Instant,
    /// How many programs are connected.
    programs: usize,
    /// What happens on other connections to the same port is not shown.
    followed: Followed,
    /// The connection of which the camera's last picture is.
    pictures: u64,
    /// The connection of a program that is not understood.
    unclear: Option<u64>,
    said: Controllers,
    /// Counts the programs that are shown.
    program: u64,
    /// Name and firmware of the controller that is shown.
    controller: Option<(String, String)>,
    error: Option<Problem>,
    /// Of a controller that another one has replaced, and for which program that was told.
    replaced: Option<(Problem, u64)>,
    /// What is told of a connection that need not be the program's, where there is no error of the program.
    beside: Option<Beside>,
    /// None before the program's first exchange.
    areas: Vec<FishX1Transfer>,
    cycle_ms: f64,
    cycles: u64,
    late: u64,
    gaps: u64,
    /// How many exchanges were left out.
    forgotten: u64,
    histogram: Histogram,
    answers: Answers,
    /// Since the program went online.
    commands: u64,
    i2c: Option<I2cExchange>,
}

/// What is told of a connection beside.
struct Beside {
    error: Problem,
    of: (Line, u64),
    /// When it is no longer shown, because the connection has ended.
    until: Option<Instant>,
}

impl Watched {
    pub(super) fn new(
        common: Arc<Common>,
        camera: Arc<Camera>,
        gate: Arc<Gate>,
        button: Option<Button>,
        publish: watch::Sender<Newest>,
    ) -> Self {
        let mut watched = Self {
            common,
            camera,
            gate,
            button,
            publish,
            next_state: Instant::now(),
            programs: 0,
            followed: Followed::default(),
            pictures: 0,
            unclear: None,
            said: Controllers::default(),
            program: 0,
            controller: None,
            error: None,
            replaced: None,
            beside: None,
            areas: Vec::new(),
            cycle_ms: 0.0,
            cycles: 0,
            late: 0,
            gaps: 0,
            forgotten: 0,
            histogram: Histogram::default(),
            answers: Answers::default(),
            commands: 0,
            i2c: None,
        };
        // A page that comes before the first program sees a whole state, too.
        watched.publish();
        watched
    }

    /// Takes in what has happened.
    pub(crate) fn take(&mut self, seen: &Seen) {
        match seen.line {
            Line::Main => self.of_main(seen),
            Line::Camera => self.of_camera(seen),
            Line::I2c => {
                let is_own = self.followed.drives() && !self.followed.is_older(seen);
                if let (Happened::I2c(exchange), true) = (&seen.what, is_own) {
                    self.i2c = Some(exchange.clone());
                }
            }
        }
        let is_other = seen.line == Line::Main && self.followed.is_other(seen);
        // Nothing that others say hides that motors may go on.
        let warns = self.error.as_ref().is_some_and(|error| MOTORS_MAY_GO_ON.contains(&error.code));
        let is_hidden = is_other || (warns && !matches!(seen.what, Happened::Halted { .. }));
        let of = (seen.line, seen.connection);
        if let Some(error) = problem(seen).filter(|_| !is_hidden) {
            let is_own = error.code != UNKNOWN || self.followed.drives();
            match seen.line {
                Line::Main if error.code == REPLACED => self.replaced = Some((error, self.program)),
                Line::Main if is_own => self.error = Some(error),
                _ => self.beside = Some(Beside { error, of, until: None }),
            }
        }
        // One that is refused ends at once.
        if let (Happened::Closed, Some(beside)) = (&seen.what, &mut self.beside) {
            if beside.of == of {
                beside.until = Some(seen.at + TOLD);
            }
        }
    }

    fn of_main(&mut self, seen: &Seen) {
        let is_shown = !self.followed.is_other(seen);
        self.said.take(seen);
        match &seen.what {
            Happened::Connected(_) => self.programs += 1,
            Happened::Closed => {
                self.programs = self.programs.saturating_sub(1);
                self.unclear.take_if(|number| *number == seen.connection);
            }
            Happened::Online => {
                self.controller = self.said.of(seen.connection);
                let halted = self.error.take_if(|error| error.code == HALTED);
                (self.error, self.unclear) = (None, None);
                // Whoever stops what the program has left goes online at once.
                let (of, until) = ((seen.line, seen.connection), Some(seen.at + TOLD));
                self.beside = halted.map(|error| Beside { error, of, until });
                self.forget();
                // Told to the next program, too.
                self.replaced.take_if(|(_, told)| *told + 1 < self.program);
                // StartOnline.
                self.commands = 1;
            }
            Happened::Offline(farewell) => {
                self.gaps += u64::from(*farewell != Farewell::Answered);
                if is_shown {
                    self.histogram.interrupt();
                }
            }
            // What follows is only about the connection that drives.
            _ if !is_shown => {}
            Happened::Controller { .. } => {
                // It is there again.
                self.error.take_if(|error| error.code == REFUSED);
                let controller = self.said.of(seen.connection);
                // The program before was connected to another one.
                if !self.followed.drives() && self.controller != controller {
                    self.forget();
                }
                self.controller = controller;
            }
            Happened::Command(_) => self.commands += u64::from(self.followed.drives()),
            Happened::Cycle(cycle) => self.cycle(seen.at, cycle),
            Happened::Unanswered(them) => {
                self.areas.clone_from(&them.areas);
                self.forgotten = them.forgotten;
            }
            Happened::NotUnderstood { .. } | Happened::Missed => {
                self.unclear = Some(seen.connection);
            }
            // Perhaps by a connection of its own, whose exchange is not shown.
            Happened::Halted { error: None, .. } => stop_all(&mut self.areas),
            Happened::Refused(_)
            | Happened::Halted { .. }
            | Happened::Ignored { .. }
            | Happened::Unknown(_)
            | Happened::NoAnswer { .. }
            | Happened::Picture(_)
            | Happened::I2c(_) => {}
        }
        self.followed.take(seen);
    }

    /// Nothing of the program before is shown any more.
    fn forget(&mut self) {
        self.program += 1;
        (self.histogram, self.answers) = Default::default();
        (self.cycles, self.late, self.forgotten, self.commands) = Default::default();
        (self.areas, self.cycle_ms, self.i2c) = Default::default();
        self.camera.switched(false);
    }

    fn of_camera(&mut self, seen: &Seen) {
        match &seen.what {
            Happened::Picture(frame) if !self.followed.is_older(seen) => {
                self.pictures = seen.connection;
                self.camera.show(frame, || true);
            }
            // What comes then is not shown.
            Happened::Closed | Happened::NotUnderstood { .. } | Happened::Missed
                if self.pictures == seen.connection =>
            {
                self.camera.end();
            }
            _ => {}
        }
    }

    fn cycle(&mut self, at: Instant, cycle: &Cycle) {
        // It goes on.
        if self.error.take_if(|error| [NO_ANSWER, UNANSWERED].contains(&error.code)).is_some() {
            self.error = left_out(self.forgotten);
        }
        self.areas.clone_from(&cycle.areas);
        self.cycles = cycle.number;
        self.histogram.count(cycle.number, at);
        if let Some(since_last) = cycle.since_last {
            self.cycle_ms = millis(since_last);
        }
        if let Some(answer) = cycle.answer {
            self.answers.count(answer);
            self.late += u64::from(answer > LATE);
        }
    }

    /// Tells the pages, if it is time to do so.
    pub(crate) fn publish_when_due(&mut self) {
        let now = Instant::now();
        self.beside.take_if(|beside| beside.until.is_some_and(|until| until <= now));
        if now >= self.next_state {
            self.next_state = now + STATE_PERIOD;
            self.publish();
        }
    }

    fn phase(&self) -> Phase {
        if self.followed.drives() {
            Phase::Running
        } else if self.unclear.is_some() {
            Phase::Unclear
        } else if self.programs > 0 {
            Phase::Connecting
        } else {
            Phase::Idle
        }
    }

    fn publish(&mut self) {
        let phase = self.phase();
        let i2c = self.i2c.as_ref().map(|last| I2cState {
            device: last.device,
            written: first(&last.written),
            read: last.read.as_deref().map(first),
        });
        let (answer, commands, shut) = (self.answers.state(), self.commands, self.gate.is_shut());
        let replaced = self.replaced.as_ref().map(|(error, _)| error);
        let beside = replaced.or(self.beside.as_ref().map(|beside| &beside.error));
        let watched = WatchedState { program: self.program, answer, commands, i2c, shut, beside };
        let (name, firmware) = self.controller.clone().unzip();
        let areas = match &self.areas[..] {
            [] => state::areas(&[unknown_area()], false),
            areas => state::areas(areas, phase == Phase::Running),
        };
        let state = HostState {
            at: self.common.begin.elapsed().as_millis(),
            link: Link {
                phase,
                name,
                firmware,
                error: self.error.as_ref(),
                cycle_ms: self.cycle_ms,
                histogram: self.histogram.bins(),
                cycles: self.cycles,
                late: self.late,
                gaps: self.gaps,
            },
            areas,
            world: None,
            camera: self.camera.state(),
            i2c: false,
            watched: Some(watched),
            lesson: None,
            recording: self.button.as_ref().map(Button::state),
        };
        state.publish(&self.publish);
    }
}

/// The codes of what stays until a program goes online, or the controller is stopped.
const MOTORS_MAY_GO_ON: [&str; 2] = ["halt_failed", "stop_online_unanswered"];
/// The code of outputs that were switched off for a program that is gone.
const HALTED: &str = "halted";
/// The code of a missing response.
const NO_ANSWER: &str = "no_answer";
const UNKNOWN: &str = "unknown";
/// The code of a main connection that the controller does not accept.
const REFUSED: &str = "connect_failed";
/// The code of exchanges without an answer.
const UNANSWERED: &str = "unanswered";

/// That exchanges were left out, if some were.
fn left_out(count: u64) -> Option<Problem> {
    (count > 0).then(|| Problem::new("forgotten", forgotten(count)))
}

/// What is wrong, if this says that something is.
fn problem(seen: &Seen) -> Option<Problem> {
    let (code, text) = match &seen.what {
        Happened::Refused(error) => {
            let code = match seen.line {
                Line::Main => REFUSED,
                Line::Camera => "camera_refused",
                Line::I2c => "i2c_refused",
            };
            (code, refused(seen.line, error))
        }
        Happened::Halted { gone, error } => {
            let code = match (error, gone) {
                (Some(error), _) if error.kind() == ErrorKind::Other => REPLACED,
                (Some(_), _) => "halt_failed",
                (None, Gone::Page) => "disconnected",
                (None, _) => HALTED,
            };
            (code, halted(*gone, error.as_ref()))
        }
        Happened::Offline(Farewell::Unanswered) => {
            ("stop_online_unanswered", FAREWELL_UNANSWERED.to_owned())
        }
        Happened::Ignored { controller } => ("ignored", ignored(controller)),
        Happened::Unknown(unknown) => (UNKNOWN, format!("{unknown}; it is passed on")),
        Happened::NoAnswer { command, since } => {
            (NO_ANSWER, no_answer(*command, seen.at.saturating_duration_since(*since)))
        }
        Happened::Unanswered(them) if them.exchanges == 0 => return left_out(them.forgotten),
        Happened::Unanswered(them) => {
            let left_out = left_out(them.forgotten).map(|left_out| left_out.text);
            let texts = std::iter::once(unanswered(them.exchanges)).chain(left_out);
            (UNANSWERED, texts.collect::<Vec<_>>().join("; "))
        }
        Happened::NotUnderstood { side, why } => {
            ("not_understood", not_understood(seen.line, *side, why))
        }
        Happened::Missed => ("missed", missed(seen.line)),
        Happened::Connected(_)
        | Happened::Closed
        | Happened::Controller { .. }
        | Happened::Command(_)
        | Happened::Online
        | Happened::Offline(Farewell::Answered | Farewell::Missing)
        | Happened::Cycle(_)
        | Happened::Picture(_)
        | Happened::I2c(_) => return None,
    };
    Some(Problem::new(code, text))
}

/// The last answers.
#[derive(Default)]
struct Answers {
    last: VecDeque<Duration>,
    longest: Duration,
}

impl Answers {
    fn count(&mut self, answer: Duration) {
        if self.last.len() == ANSWERS {
            self.last.pop_front();
        }
        self.last.push_back(answer);
        self.longest = self.longest.max(answer);
    }

    fn state(&self) -> Option<AnswerState> {
        let last = *self.last.back()?;
        let mut sorted: Vec<_> = self.last.iter().copied().collect();
        sorted.sort_unstable();
        let median = sorted[sorted.len() / 2];
        Some(AnswerState {
            last: millis(last),
            median: millis(median),
            longest: millis(self.longest),
        })
    }
}

/// Milliseconds, to the microsecond.
fn millis(time: Duration) -> f64 {
    time.as_micros() as f64 / 1e3
}

/// What a page shows of the bytes of I2C: a state with all of them could be longer than what may wait for a page.
fn first(bytes: &[u8]) -> Vec<u8> {
    /// A controller answers no more at once.
    const SHOWN: usize = 1024;
    bytes[..bytes.len().min(SHOWN)].to_vec()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_connection_that_is_refused_is_named() {
        let refused = |line| {
            let error = std::io::ErrorKind::ConnectionRefused.into();
            let (at, what) = (Instant::now(), Happened::Refused(error));
            problem(&Seen { at, line, connection: 1, what }).unwrap()
        };
        for (line, code) in [(Line::Camera, "camera_refused"), (Line::I2c, "i2c_refused")] {
            let Problem { code: told, text, .. } = refused(line);
            assert!(text.contains(&format!("the {} connection", line.name())), "{text}");
            assert_eq!(told, code);
        }
        assert_eq!(refused(Line::Main).code, "connect_failed");
    }

    #[test]
    fn the_median_is_that_of_the_last_answers_and_the_longest_that_of_all() {
        let mut answers = Answers::default();
        assert_eq!(answers.state(), None);
        answers.count(Duration::from_millis(70));
        (0..ANSWERS).for_each(|_| answers.count(Duration::from_micros(1500)));
        let state = AnswerState { last: 1.5, median: 1.5, longest: 70.0 };
        assert_eq!(answers.state(), Some(state));
    }
}
