//! A row of the table: what is promised, the tests that check it, and what they measured.

use std::fmt;
use std::panic::{catch_unwind, AssertUnwindSafe};
use std::sync::{mpsc, Arc, Mutex, PoisonError};
use std::thread;
use std::time::Duration;

use ft_transfer_area::Error;

/// Longer than anything takes on a busy machine. Only a test that fails waits this long.
pub(crate) const DEADLINE: Duration = Duration::from_secs(30);

/// How much longer than its limit something may take, because the machine is busy.
pub(crate) const MARGIN: Duration = Duration::from_secs(3);

/// A test that takes longer than this hangs.
const HANGS: Duration = Duration::from_secs(75);

/// What a program sees of a fault.
#[derive(Clone, Debug)]
pub(crate) enum Seen {
    /// All calls return as without the fault.
    Nothing,
    Error(Error),
    /// The same from a child process: the name of the error.
    Named(String),
}

impl From<Error> for Seen {
    fn from(error: Error) -> Self {
        Self::Error(error)
    }
}

impl Seen {
    /// Whether the table's text says this.
    pub(crate) fn is_told_by(&self, text: &str) -> bool {
        match self {
            Self::Nothing => text.starts_with("nothing"),
            Self::Error(error) => text.contains(&format!("`{}`", name_of(error))),
            Self::Named(name) => text.contains(&format!("`{name}`")),
        }
    }
}

/// The name of an error's variant, as in the table.
macro_rules! names {
    ($($name:ident)+) => {
        pub(crate) fn name_of(error: &Error) -> &'static str {
            match error {
                $(Error::$name { .. } => stringify!($name),)+
                other => panic!("no row of the table names this: {other}"),
            }
        }
    };
}

names! {
    AlreadyStarted ConnectFailed ConnectTimedOut ConnectionClosed ConnectionLost ConnectionRefused
    DataEndsEarly FirmwareTooOld FrameSize HostNotFound I2cNoDevice LookupTimedOut NoAnswer
    NotStarted
    ProgramPanicked ReconnectFailed ThreadNotStarted ThreadPanicked TooLarge WatchdogExpired WrongCrc
    WrongId WrongSize
}

/// What made the controller's duties 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum By {
    /// No duty ever reached it.
    NeverOn,
    /// An exchange with duty 0.
    Exchange,
    /// Nothing: the motor is on when the connection has ended. Perhaps the board has a watchdog.
    Board,
    /// Nothing: the motor goes on as the program wants.
    GoesOn,
}

impl fmt::Display for By {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::NeverOn => "never on",
            Self::Exchange => "an exchange",
            Self::Board => "nothing of ours",
            Self::GoesOn => "none: the motor goes on",
        })
    }
}

/// What a test found.
#[derive(Clone, Debug)]
pub(crate) struct Outcome {
    pub(crate) seen: Seen,
    /// From the fault until the program saw it.
    pub(crate) soon: Option<Duration>,
    pub(crate) by: By,
    /// From the fault until all duties were 0.
    pub(crate) stopped: Option<Duration>,
}

/// Why a test can't run on this machine.
#[derive(Debug)]
pub(crate) struct Skipped(pub(crate) String);

pub(crate) type Run = Box<dyn FnOnce() -> Result<Outcome, Skipped> + Send>;

/// What the tests of a row found.
pub(crate) type Findings = Arc<Mutex<Vec<Outcome>>>;

/// When the tests of a row run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Turn {
    /// First, because they take a long time.
    First,
    WithOthers,
    /// At the end and alone, because they would disturb others.
    Alone,
}

/// A line of the table.
pub(crate) struct Row {
    pub(crate) section: &'static str,
    pub(crate) fault: &'static str,
    pub(crate) place: &'static str,
    pub(crate) sees: &'static str,
    /// The limit for the time until the program sees it.
    pub(crate) limit: &'static str,
    pub(crate) by: &'static [By],
    /// The tests, each with the part of its name that differs within the row.
    pub(crate) tests: Vec<(String, Run)>,
    pub(crate) turn: Turn,
    pub(crate) findings: Findings,
}

impl Row {
    pub(crate) fn new(section: &'static str, fault: &'static str, place: &'static str) -> Self {
        Self {
            section,
            fault,
            place,
            sees: "nothing",
            limit: "–",
            by: &[By::GoesOn],
            tests: Vec::new(),
            turn: Turn::WithOthers,
            findings: Findings::default(),
        }
    }

    /// The name of its tests.
    pub(crate) fn name(&self) -> String {
        let Self { section, fault, place, .. } = self;
        [*section, fault, place]
            .into_iter()
            .filter(|part| !part.is_empty())
            .collect::<Vec<_>>()
            .join(": ")
    }

    /// What the program sees, and within which limit.
    pub(crate) fn sees(mut self, sees: &'static str, limit: &'static str) -> Self {
        (self.sees, self.limit) = (sees, limit);
        self
    }

    /// One of these stops the motors.
    pub(crate) fn by(mut self, by: &'static [By]) -> Self {
        self.by = by;
        self
    }

    pub(crate) fn turn(mut self, turn: Turn) -> Self {
        self.turn = turn;
        self
    }

    pub(crate) fn test(
        self,
        run: impl FnOnce() -> Result<Outcome, Skipped> + Send + 'static,
    ) -> Self {
        self.test_at(String::new(), run)
    }

    pub(crate) fn test_at(
        mut self,
        place: String,
        run: impl FnOnce() -> Result<Outcome, Skipped> + Send + 'static,
    ) -> Self {
        self.tests.push((place, Box::new(run)));
        self
    }
}

/// The time in the text of a limit, such as 2.5 s in "the read limit (2 s) and 0.5 s".
fn time_in(limit: &str) -> Duration {
    let words: Vec<&str> = limit.split(|character| " ()".contains(character)).collect();
    let seconds = words.windows(2).filter(|pair| pair[1] == "s");
    Duration::from_secs_f64(seconds.filter_map(|pair| pair[0].parse::<f64>().ok()).sum())
}

/// What a row promises, for its tests to check.
#[derive(Clone)]
pub(crate) struct Promise {
    sees: &'static str,
    limit: &'static str,
    by: &'static [By],
    findings: Findings,
}

impl From<&Row> for Promise {
    fn from(row: &Row) -> Self {
        Self { sees: row.sees, limit: row.limit, by: row.by, findings: Arc::clone(&row.findings) }
    }
}

impl Promise {
    /// Runs a test of the row in its own thread, so that a test that hangs is noticed.
    pub(crate) fn check(&self, run: Run) -> Result<Result<(), Skipped>, String> {
        let (sender, receiver) = mpsc::channel();
        thread::spawn(move || {
            let _ = sender.send(catch_unwind(AssertUnwindSafe(run)));
        });
        let outcome = match receiver.recv_timeout(HANGS) {
            Err(_) => return Err(format!("it hangs: no result after {HANGS:?}")),
            Ok(Err(panic)) => return Err(panic_text(&*panic)),
            Ok(Ok(Err(skipped))) => return Ok(Err(skipped)),
            Ok(Ok(Ok(outcome))) => outcome,
        };
        if !outcome.seen.is_told_by(self.sees) {
            return Err(format!("the program sees {:?}, not {:?}", outcome.seen, self.sees));
        }
        let latest = time_in(self.limit) + MARGIN;
        if outcome.soon.is_some_and(|soon| soon > latest) {
            return Err(format!("it took {:?}, and the limit is {}", outcome.soon, self.limit));
        }
        if !self.by.contains(&outcome.by) {
            return Err(format!("the motors are stopped by {:?}, not {:?}", outcome.by, self.by));
        }
        self.findings.lock().unwrap_or_else(PoisonError::into_inner).push(outcome);
        Ok(Ok(()))
    }
}

/// The message of a panic.
pub(crate) fn panic_text(panic: &(dyn std::any::Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().map(|text| (*text).to_owned());
    text.or_else(|| panic.downcast_ref::<String>().cloned()).unwrap_or_else(|| "panic".to_owned())
}
