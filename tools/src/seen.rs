//! What has happened on the connections between a program and a controller, for everything that reports it.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::io;
use std::net::SocketAddr;
use std::time::{Duration, Instant};

use ft_transfer_area::transfer_area::{CounterConfig, UniConfig};
use ft_transfer_area::wire::CommandId;
use ft_transfer_area::{CameraFrame, FirmwareVersion, FishX1Transfer};

/// What a connection is for, in the order of the ports.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Line {
    Main,
    Camera,
    I2c,
}

impl Line {
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Main => "main",
            Self::Camera => "camera",
            Self::I2c => "i2c",
        }
    }

    /// Its distance from the main port.
    pub(crate) fn index(self) -> usize {
        self as usize
    }
}

/// Who has sent something.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Side {
    Program,
    Controller,
}

impl Side {
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Program => "program",
            Self::Controller => "controller",
        }
    }
}

/// Name and firmware, as the controller has said them on each open connection. A program need not ask for them, and the
/// next connection may be to another controller.
#[derive(Debug, Default)]
pub(crate) struct Controllers(BTreeMap<u64, (String, String)>);

impl Controllers {
    pub(crate) fn take(&mut self, seen: &Seen) {
        match &seen.what {
            Happened::Controller { name, firmware } => {
                self.0.insert(seen.connection, (name.clone(), firmware.to_string()));
            }
            Happened::Closed => drop(self.0.remove(&seen.connection)),
            _ => {}
        }
    }

    /// `None` when the program of this connection has not asked.
    pub(crate) fn of(&self, connection: u64) -> Option<(String, String)> {
        self.0.get(&connection).cloned()
    }
}

/// Which connection to the main port a page and a recording follow: the one that has gone online last.
#[derive(Debug, Default)]
pub(crate) struct Followed {
    drives: Option<u64>,
    /// The one that has gone online last; 0 before that.
    last: u64,
    /// Open ones that were online while another one went online.
    displaced: BTreeSet<u64>,
}

impl Followed {
    /// Takes in what has happened on the main port.
    pub(crate) fn take(&mut self, seen: &Seen) {
        let connection = seen.connection;
        match seen.what {
            Happened::Online => {
                self.displaced.extend(self.drives);
                self.displaced.remove(&connection);
                (self.drives, self.last) = (Some(connection), connection);
            }
            Happened::Offline(_) => {
                self.drives.take_if(|drives| *drives == connection);
            }
            Happened::Closed => {
                self.displaced.remove(&connection);
            }
            _ => {}
        }
    }

    /// The one that is online.
    pub(crate) fn driving(&self) -> Option<u64> {
        self.drives
    }

    /// Whether a program is online.
    pub(crate) fn drives(&self) -> bool {
        self.drives.is_some()
    }

    /// Whether this is about another connection. While none drives, that is one that another program has displaced; only
    /// what becomes of its motors counts then. That motors may go on always counts.
    pub(crate) fn is_other(&self, seen: &Seen) -> bool {
        let connection = seen.connection;
        match (self.drives, &seen.what) {
            (_, Happened::Halted { error: Some(_), .. }) | (None, Happened::Halted { .. }) => false,
            (Some(number), _) => number != connection,
            (None, _) => self.displaced.contains(&connection),
        }
    }

    /// Whether a connection to camera or I2C is older than that of the program: then it is another program's, and perhaps
    /// to another controller.
    pub(crate) fn is_older(&self, other: &Seen) -> bool {
        other.connection < self.last
    }
}

/// How long a program that is online and its controller may be silent. The maker's firmware closes the connection after 5 s, and then
/// nothing can be sent on it.
pub(crate) const SILENCE: Duration = Duration::from_millis(4500);

/// Why the outputs have to be switched off.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Gone {
    /// The program has closed its connection, or was killed.
    Closed,
    Reset,
    Silent,
    /// The controller has ended the connection.
    Lost,
    /// The controller has not answered the program's StopOnline.
    Unanswered,
    /// `txt watch` itself ends.
    Watch,
    /// Somebody has disconnected it on the page.
    Page,
}

impl Gone {
    /// For programs.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Closed => "closed",
            Self::Reset => "reset",
            Self::Silent => "silent",
            Self::Lost => "lost",
            Self::Unanswered => "unanswered",
            Self::Watch => "watch_ends",
            Self::Page => "disconnected",
        }
    }
}

impl fmt::Display for Gone {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Closed => {
                f.write_str("the program has closed its connection while it was online")
            }
            Self::Reset => f.write_str("the program's connection broke while it was online"),
            Self::Silent => {
                let seconds = SILENCE.as_secs_f64();
                write!(f, "the program was online, and neither it nor the controller said anything for {seconds} s")
            }
            Self::Lost => {
                f.write_str("the controller has ended the connection of a program that was online")
            }
            Self::Unanswered => {
                f.write_str("the controller has not answered the program's StopOnline")
            }
            Self::Watch => f.write_str("txt watch ends while a program is online"),
            Self::Page => f.write_str("the program was disconnected on the page of txt watch"),
        }
    }
}

/// What has happened, and when.
#[derive(Debug)]
pub(crate) struct Seen {
    pub(crate) at: Instant,
    pub(crate) line: Line,
    /// The number of the connection: there may be several to one port, and only one of them drives.
    pub(crate) connection: u64,
    pub(crate) what: Happened,
}

#[derive(Debug)]
pub(crate) enum Happened {
    /// A program has connected, from this address.
    Connected(SocketAddr),
    /// The controller refuses the connection.
    Refused(io::Error),
    /// The connection is closed, by whichever side.
    Closed,
    /// The controller has said what it is.
    Controller {
        name: String,
        firmware: FirmwareVersion,
    },
    /// The program has sent a command that is not an exchange.
    Command(CommandId),
    /// Online mode has begun.
    Online,
    /// The program has gone while it drove, and all outputs were switched off, or the error says why not.
    Halted {
        gone: Gone,
        error: Option<io::Error>,
    },
    /// Online mode has ended.
    Offline(Farewell),
    Cycle(Box<Cycle>),
    Picture(CameraFrame),
    I2c(I2cExchange),
    /// The program has sent another configuration with the id of the last one, which a controller does not take.
    Ignored {
        /// `TXT`, `E1` to `E8`.
        controller: String,
    },
    /// What this side has sent is no packet of the kit. It was passed on.
    Unknown(Unknown),
    /// A command got no response for [`NO_ANSWER`], or others were answered instead.
    NoAnswer {
        command: CommandId,
        /// When it was sent.
        since: Instant,
    },
    /// Exchanges of the program have no answer, so that nobody knows which outputs the controller has.
    Unanswered(Box<UnansweredExchanges>),
    /// What this side has sent can't be understood. It was passed on.
    NotUnderstood {
        side: Side,
        why: String,
    },
    /// This computer was too busy to look at all that has passed on this connection.
    Missed,
}

/// How a program has ended online mode.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Farewell {
    /// The controller has answered StopOnline.
    Answered,
    /// StopOnline was sent. Whether the controller has received it, and what came before it, nobody knows.
    Unanswered,
    /// StopOnline was not sent.
    #[default]
    Missing,
}

impl Farewell {
    /// For programs.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Answered => "answered",
            Self::Unanswered => "unanswered",
            Self::Missing => "missing",
        }
    }
}

/// [`Farewell::Unanswered`] as a sentence for people.
pub(crate) const FAREWELL_UNANSWERED: &str =
    "the controller has not answered StopOnline, so nobody knows whether it has received it: motors may go on";

/// Bytes that are no packet of the kit, as far as they came at once.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Unknown {
    pub(crate) side: Side,
    /// What they begin with.
    pub(crate) id: u32,
    pub(crate) bytes: usize,
}

impl fmt::Display for Unknown {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { side, id, bytes } = self;
        match side {
            Side::Program => write!(f, "unknown command {id:#010x}, {bytes} bytes"),
            Side::Controller => write!(f, "unknown response {id:#010x}, {bytes} bytes"),
        }
    }
}

/// What the program has sent beyond the last answer.
#[derive(Debug)]
pub(crate) struct UnansweredExchanges {
    /// How many there are now.
    pub(crate) exchanges: u64,
    /// How many since online mode began are not shown one by one, because too many had no answer.
    pub(crate) forgotten: u64,
    /// The outputs that were sent last, and the inputs that were received last.
    pub(crate) areas: Vec<FishX1Transfer>,
}

/// Exchanges without an answer as a sentence for people.
pub(crate) fn unanswered(exchanges: u64) -> String {
    format!("{exchanges} exchanges have no answer: the outputs shown are those that were sent last")
}

/// Exchanges that are not shown as a sentence for people.
pub(crate) fn forgotten(count: u64) -> String {
    format!(
        "more than {KEPT_MAX} commands had no answer at once, so {count} exchanges are left out"
    )
}

/// A response that comes after this time comes no more. StopOnline takes a second.
pub(crate) const NO_ANSWER: Duration = Duration::from_secs(2);
/// How many commands without a response are kept, with what they have sent. Each client that is known sends them in turn.
pub(crate) const KEPT_MAX: usize = 64;

/// A configuration that the controller does not take as a sentence for people.
pub(crate) fn ignored(controller: &str) -> String {
    format!("UpdateConfig with an unchanged id for {controller}: the controller ignores it")
}

/// A missing response as a sentence for people.
pub(crate) fn no_answer(command: CommandId, waited: Duration) -> String {
    format!("no answer to {command} for {:.1} s", waited.as_secs_f64())
}

/// A connection that the controller does not accept as a sentence for people.
pub(crate) fn refused(line: Line, error: &io::Error) -> String {
    format!("the controller refuses the {} connection: {error:#}", line.name())
}

/// What is not understood as a sentence for people.
pub(crate) fn not_understood(line: Line, side: Side, why: &str) -> String {
    let what = match line {
        Line::Main => "no cycles are shown until a program goes online anew",
        Line::Camera | Line::I2c => "nothing more of it is shown",
    };
    let (line, side) = (line.name(), side.name());
    format!(
        "what the {side} sent on the {line} connection can't be understood, so {what}; it is passed on all the same: {why}"
    )
}

/// A stopped controller as a sentence for people.
pub(crate) fn halted(gone: Gone, error: Option<&io::Error>) -> String {
    match error {
        None => format!("{gone}: all outputs of the controller were switched off"),
        Some(error) => format!(
            "{gone}, and the controller can't be made to switch its outputs off ({error:#}): motors may go on"
        ),
    }
}

/// Why nothing more of a connection is reported.
pub(crate) const MISSED: &str = "this computer is too busy to look at all that passes";

/// The same as a sentence for people.
pub(crate) fn missed(line: Line) -> String {
    let line = line.name();
    format!("{MISSED}: nothing more of this {line} connection is shown, and everything is passed on all the same")
}

/// The area of a controller of which nothing is known yet: it has the configuration of a program before, so a mode is a
/// number that is none. The kind of a motor output means nothing to a controller.
pub(crate) fn unknown_area() -> FishX1Transfer {
    const UNKNOWN: u8 = u8::MAX;
    let mut area = FishX1Transfer::default();
    area.config.uni = [UniConfig { mode: UNKNOWN, digital: 0, dummy: [0; 2] }; 8].into();
    area.config.cnt = [CounterConfig { mode: UNKNOWN, dummy: [0; 3] }; 4].into();
    area
}

/// One exchange.
#[derive(Debug)]
pub(crate) struct Cycle {
    /// Its number since online mode began, from 1.
    pub(crate) number: u64,
    /// The time since the response before; `None` for the first.
    pub(crate) since_last: Option<Duration>,
    /// How long the program took from the response before to this request; `None` for the first.
    pub(crate) answer: Option<Duration>,
    /// How many configurations were sent since online mode began.
    pub(crate) config_updates: u64,
    /// The configurations that the controller has, as far as they are [known](unknown_area), the outputs of the request,
    /// the inputs of the response.
    pub(crate) areas: Vec<FishX1Transfer>,
}

/// A request to an I2C device, and its answer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct I2cExchange {
    pub(crate) device: u32,
    pub(crate) written: Vec<u8>,
    /// `None` when no device has answered.
    pub(crate) read: Option<Vec<u8>>,
}

#[cfg(test)]
mod tests {
    use super::*;

    fn seen(connection: u64, what: Happened) -> Seen {
        Seen { line: Line::Main, connection, at: Instant::now(), what }
    }

    const OFFLINE: Happened = Happened::Offline(Farewell::Answered);

    #[test]
    fn what_an_older_connection_goes_on_with_is_not_followed() {
        let mut followed = Followed::default();
        let is_other =
            |followed: &Followed, connection, what| followed.is_other(&seen(connection, what));
        assert!(!is_other(&followed, 1, Happened::Missed), "nobody was online");
        followed.take(&seen(1, Happened::Online));
        assert!(is_other(&followed, 2, Happened::Missed));
        followed.take(&seen(2, Happened::Online));
        assert!(is_other(&followed, 1, Happened::Missed));
        followed.take(&seen(1, OFFLINE));
        assert!(followed.drives(), "it is the other one that drives");
        followed.take(&seen(2, OFFLINE));
        assert!(is_other(&followed, 1, Happened::Missed), "that program has lost its controller");
        let halted = Happened::Halted { gone: Gone::Closed, error: None };
        assert!(!is_other(&followed, 1, halted), "its motors are stopped");
        assert!(!is_other(&followed, 2, Happened::Missed));
        assert!(!is_other(&followed, 3, Happened::Missed), "it may go online");
        followed.take(&seen(1, Happened::Online));
        assert!(!is_other(&followed, 1, Happened::Missed));
    }

    #[test]
    fn a_program_that_another_one_has_displaced_is_another_one_whatever_its_number() {
        let mut followed = Followed::default();
        let is_other = |followed: &Followed, connection| {
            followed.is_other(&seen(connection, Happened::Missed))
        };
        followed.take(&seen(2, Happened::Online));
        followed.take(&seen(1, Happened::Online));
        assert!(is_other(&followed, 2) && !is_other(&followed, 1));
        followed.take(&seen(1, OFFLINE));
        assert!(is_other(&followed, 2) && !is_other(&followed, 1));
        // A program that was not online yet may be the next one, also when it has connected before.
        assert!(!is_other(&followed, 3) && !is_other(&followed, 0));
        followed.take(&seen(2, Happened::Online));
        followed.take(&seen(2, OFFLINE));
        assert!(!is_other(&followed, 2));
        followed.take(&seen(2, Happened::Online));
        followed.take(&seen(1, Happened::Online));
        followed.take(&seen(2, Happened::Closed));
        assert!(followed.displaced.is_empty());
    }
}
