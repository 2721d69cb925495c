//! `txt watch`: looks at what a program and a controller say to each other, and passes it on.
//!
//! The relay passes the bytes on, in a thread of its own, and keeps a copy. All that looks at them has a second
//! thread: it reads the copies, and passes what they mean to the page, the recording and the changes.

mod changes;
mod decode;
mod driven;
mod halt;
mod order;
mod packet;
mod passage;
pub(crate) mod ports;
mod record;
mod relay;
mod tap;

use std::collections::BTreeSet;
use std::env;
use std::ffi::OsString;
use std::io;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::process::{ExitCode, ExitStatus, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::Arc;
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{bail, ensure, Context};
use crossbeam_channel::{select, Receiver};
use ft_transfer_area::PORT;

use self::changes::Changes;
use self::decode::Decoder;
use self::record::Record;
use self::relay::Relay;
use self::tap::Pieces;
use crate::gate::Gate;
use crate::interrupt::{self, Driving};
use crate::panel::pages::{self, Watched};
use crate::program::{Program, Reads, MARK};
use crate::recording::in_parts::InParts;
use crate::recording::output::{incomplete, Output};
use crate::seen::{
    forgotten, halted, ignored, missed, no_answer, not_understood, refused, Farewell, Followed,
    Happened, Line, Seen, FAREWELL_UNANSWERED,
};
use crate::web::browser::Opening;
use crate::{lines, names, print};

/// How often the copies are looked at. To be woken by each would cost the relay more than the copy.
const LOOK: Duration = Duration::from_millis(5);

/// How often to look whether the program that was started still runs.
const PROGRAM_LOOK: Duration = Duration::from_millis(20);
/// How long that program may go on after Ctrl-C, which it gets, too. Then it has another second to end.
const FAREWELL: Duration = Duration::from_secs(1);
/// The same where another `txt` has started this one, whose keeper kills it after a second: its controller is stopped
/// before.
const FAREWELL_INSIDE: Duration = Duration::from_millis(300);

const AFTER: &str = "\
Let your program connect to 127.0.0.1 instead of the controller: ftrobopy, ROBO Pro, the kit's
programs and those of this library. Every byte is passed on as it is, in both directions, and
the page shows what the bytes mean. The page drives nothing; it can disconnect the program.

The camera is one port after the main port, and I2C two, on both sides. When a program that is
online is killed, disconnects or is silent for 4.5 s, and with Ctrl-C, all outputs go off.

After -- comes a program to start. Its last argument is the address for it, which is also in the
variables TXT_ADDRESS and FT_TXT_HOST. txt watch ends with it, with its exit status.

Examples:
  txt watch 192.168.7.2                          the program uses 127.0.0.1
  txt watch 192.168.7.2 --record run.mcap        and records what it does
  txt watch 192.168.7.2 --json --no-page         prints each change as a line of JSON
  txt watch 192.168.7.2 --no-page -- python3 run.py";

/// See what another program and a controller say to each other
#[derive(clap::Args)]
#[command(after_help = AFTER)]
pub(crate) struct Args {
    /// The controller: an address or a name, with a port if it is not 65000, or auto
    #[arg(default_value = "auto")]
    host: String,
    /// Main port for the program, up to 65533; 0: any three in a row
    #[arg(long, value_name = "N", default_value_t = PORT)]
    port: u16,
    /// Record what passes into this MCAP file
    #[arg(long, value_name = "FILE")]
    record: Option<PathBuf>,
    /// Replace a file that is there already, when a program has begun to drive
    #[arg(long, requires = "record")]
    force: bool,
    #[command(flatten)]
    in_parts: InParts,
    /// Print each change as a line of JSON; what PROGRAM prints goes to the standard error then
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    names: names::File,
    /// Serve no page
    #[arg(long)]
    no_page: bool,
    /// Do not open the browser
    #[arg(long)]
    no_browser: bool,
    /// Do not switch the outputs off when a program is gone that was online
    #[arg(long)]
    leave_outputs: bool,
    /// A program to start, and its arguments
    #[arg(last = true)]
    program: Vec<OsString>,
}

pub(crate) fn run(args: Args) -> anyhow::Result<ExitCode> {
    let interrupted = interrupt::receiver_for_driving()?;
    // A paused terminal must not hold up what passes.
    lines::never_wait()?;
    let names = args.names.read()?;
    let recorded = args.record.clone();
    ensure!(recorded.is_some() || !args.in_parts.is_wanted(), "--parts needs --record FILE");
    let output = args
        .record
        .map(|path| Output::new(path, args.force, args.in_parts.is_wanted()))
        .transpose()?;
    let reader = output.as_ref().map(|it| it.wait_for_reader(&interrupted)).transpose()?;
    let controller = ports::controller(&args.host)?;
    let listeners = ports::listen(args.port)?;
    ports::check_apart(&listeners, controller)?;
    let main = listeners[0].local_addr()?;
    // Without a page nobody can ask for a file later.
    let (record, button) = match output {
        Some(output) => Some(Record::start(output, args.in_parts.options(), controller)?).unzip(),
        None if args.no_page => (None, None),
        None => Some(Record::keep(controller)).unzip(),
    };
    drop(reader);
    let gate = Arc::<Gate>::default();
    let mut _opening = Opening::default();
    let (page, watched) = if args.no_page {
        (None, None)
    } else {
        let (url, watched, opening) =
            pages::watch(&controller.to_string(), names.clone(), &gate, button, !args.no_browser)?;
        _opening = opening;
        (Some(url), Some(watched))
    };
    let changes = args.json.then(|| Changes::start(names)).transpose()?;

    let (main_name, controller_name) = (main.to_string(), controller.to_string());
    match &changes {
        Some(changes) => changes.begin(&main_name, &controller_name, page.as_deref()),
        None if args.program.is_empty() => {
            // A paused terminal shows it later.
            let seen =
                interrupt::in_time(move || announce(&main_name, &controller_name, page.as_deref()));
            seen.unwrap_or(Ok(()))?;
        }
        // What is printed is the program's.
        None => page.iter().for_each(|url| lines::print(&format!("page {url}"))),
    }
    let driving = Driving::begin();
    let (tap, pieces) = tap::tap();
    let relay = Relay::start(listeners, controller, tap, args.leave_outputs, gate)?;
    let ending = Arc::new(AtomicBool::new(false));
    let looker = Looker {
        pieces,
        decoder: Decoder::default(),
        watched,
        record,
        changes,
        notes: Notes::default(),
        awake: Awake::default(),
    };
    let looks = thread::Builder::new().name("looker".to_owned()).spawn({
        let ending = Arc::clone(&ending);
        move || looker.run(&ending)
    })?;
    let mut program = None;
    let passed = if args.program.is_empty() {
        wait(&interrupted, &relay).map(|()| ExitCode::SUCCESS)
    } else {
        start(&args.program, main, args.json)
            .and_then(|started| accompany(program.insert(started), &interrupted, &relay))
            .inspect(|_| tell_of_another_way(&relay, main, controller))
    };
    // The connections end first: then a controller can serve others, and nothing moves.
    drop(relay);
    // It may take seconds.
    drop(program);
    ending.store(true, Ordering::Relaxed);
    drop(driving);
    let looked = interrupt::in_time(move || looks.join());
    let code = passed?;
    match (looked, recorded) {
        (Some(Ok(done)), _) => done.map(|()| code),
        (None, Some(path)) => bail!(incomplete(&path.display().to_string())),
        _ => bail!("what has passed at the end was not looked at"),
    }
}

/// Waits for Ctrl-C.
fn wait(interrupted: &Receiver<()>, relay: &Relay) -> anyhow::Result<()> {
    select! {
        recv(interrupted) -> done => Ok(done?),
        recv(relay.failure) -> error => Err(error?).context(NOT_PASSED),
    }
}

fn start(words: &[OsString], main: SocketAddr, json: bool) -> anyhow::Result<Program> {
    // Lines of both would stand in one another, and a reader who pauses would hold up the program.
    let stdout = if json { io::stderr().into() } else { Stdio::inherit() };
    // Not all programs take an address with a port.
    Program::start(words, &address_text(main), Reads::OurInput, stdout)
}

/// With its port, unless that is the usual one.
fn address_text(address: SocketAddr) -> String {
    if address.port() == PORT {
        address.ip().to_string()
    } else {
        address.to_string()
    }
}

/// Waits until a program has ended. Ctrl-C ends it, too.
fn accompany(
    program: &mut Program,
    interrupted: &Receiver<()>,
    relay: &Relay,
) -> anyhow::Result<ExitCode> {
    let is_inside = env::var_os(MARK).is_some();
    let farewell = if is_inside { FAREWELL_INSIDE } else { FAREWELL };
    let mut ends_at = None;
    loop {
        if let Some(status) = program.ended()? {
            return Ok(code(status));
        }
        if ends_at.is_some_and(|at| at <= Instant::now()) || interrupt::is_again() {
            return Ok(ExitCode::FAILURE);
        }
        select! {
            recv(interrupted) -> done => {
                done?;
                program.interrupt();
                ends_at = ends_at.or(Some(Instant::now() + farewell));
            }
            recv(relay.failure) -> error => return Err(error?).context(NOT_PASSED),
            default(PROGRAM_LOOK) => {}
        }
    }
}

/// A program that has the controller's own address drives past this one.
fn tell_of_another_way(relay: &Relay, main: SocketAddr, controller: SocketAddr) {
    if !relay.has_come() {
        let controller = address_text(controller);
        log::warn!(
            "no program has connected to {main}: one that drives {controller} itself is not watched, and its motors may \
             go on; txt stop {controller} switches them off"
        );
    }
}

/// The exit status of a program as that of this one. Windows has longer ones.
fn code(status: ExitStatus) -> ExitCode {
    if status.code().is_none() {
        log::warn!("the program was ended: {status}");
    }
    let code = status.code().and_then(|code| u8::try_from(code).ok());
    code.map_or(ExitCode::FAILURE, ExitCode::from)
}

const NOT_PASSED: &str = "nothing could be passed on any more";

/// Says where the program has to connect to.
fn announce(main: &str, controller: &str, page: Option<&str>) -> anyhow::Result<()> {
    print::line(format_args!("main {main}"))?;
    print::line(format_args!("controller {controller}"))?;
    page.map_or(Ok(()), |url| print::line(format_args!("page {url}")))
}

/// Looks at what has passed.
struct Looker {
    pieces: Pieces,
    decoder: Decoder,
    watched: Option<Watched>,
    record: Option<Record>,
    changes: Option<Changes>,
    notes: Notes,
    awake: Awake,
}

impl Looker {
    fn run(mut self, ending: &AtomicBool) -> anyhow::Result<()> {
        loop {
            // What has passed until the end is looked at, too.
            let is_last = ending.load(Ordering::Relaxed);
            self.look();
            if is_last {
                break;
            }
            thread::sleep(LOOK);
        }
        if let Some(changes) = self.changes {
            changes.finish();
        }
        self.record.map_or(Ok(()), Record::finish)
    }

    fn look(&mut self) {
        let Self { pieces, decoder, watched, record, changes, notes, awake } = self;
        let mut report = |seen: Seen| {
            notes.take(&seen);
            if let Some(watched) = watched {
                watched.take(&seen);
                watched.publish_when_due();
            }
            if let Some(record) = record {
                record.take(&seen);
            }
            if let Some(changes) = changes {
                changes.take(&seen);
            }
        };
        while let Some(piece) = pieces.next() {
            decoder.take(piece, &mut report);
        }
        let now = Instant::now();
        if awake.hears_silence(now) {
            decoder.look(now, &mut report);
        }
        if let Some(record) = record {
            record.look();
        }
        if let Some(watched) = watched {
            watched.publish_when_due();
        }
    }
}

/// Whether this process ran lately. When it stood still, such as a computer that slept, responses lie unread.
#[derive(Default)]
struct Awake {
    looked: Option<Instant>,
    /// When it went on.
    since: Option<Instant>,
}

impl Awake {
    /// How long no look means that it stood still, and then how long the relay has for what lies unread.
    const STILL: Duration = Duration::from_millis(500);

    /// Whether what has not come until now was not sent either.
    fn hears_silence(&mut self, now: Instant) -> bool {
        let looked = self.looked.replace(now);
        if looked.is_some_and(|it| now.saturating_duration_since(it) >= Self::STILL) {
            self.since = Some(now);
        }
        self.since.is_none_or(|it| now.saturating_duration_since(it) >= Self::STILL)
    }
}

/// Says on stderr what a user has to know.
#[derive(Default)]
struct Notes {
    /// On which connections the controller has refused the last attempt, also of other connections to the main port:
    /// programs try again and again.
    refused: [[bool; 2]; 3],
    /// What is told once of each open connection.
    told: BTreeSet<(u64, Once)>,
    followed: Followed,
}

#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Once {
    Unknown,
    Ignored,
    LeftOut,
}

impl Notes {
    fn take(&mut self, seen: &Seen) {
        self.followed.take(seen);
        let is_other = seen.line == Line::Main && self.followed.is_other(seen);
        // The page shows nothing of it.
        let whose = match seen.line {
            Line::Main if is_other => format!("another connection ({}): ", seen.connection),
            Line::Main => String::new(),
            Line::Camera | Line::I2c => format!("connection {}: ", seen.connection),
        };
        // Lines with the same words would be told once a minute, and each of these is about motors.
        let motors_of = || match is_other {
            true => whose.clone(),
            false => format!("connection {}: ", seen.connection),
        };
        let was_refused = &mut self.refused[seen.line.index()][usize::from(is_other)];
        match &seen.what {
            Happened::Refused(error) if !*was_refused => {
                *was_refused = true;
                log::warn!("{whose}{}", refused(seen.line, error));
            }
            Happened::NotUnderstood { side, why } => {
                let text = match is_other {
                    true => format!("{} is not understood: {why}", side.name()),
                    false => not_understood(seen.line, *side, why),
                };
                log::warn!("{whose}{text}");
            }
            Happened::Unknown(unknown) if self.told.insert((seen.connection, Once::Unknown)) => {
                log::warn!(
                    "{whose}{unknown}; it is passed on, and more of them are not shown here"
                );
            }
            Happened::Ignored { controller }
                if self.told.insert((seen.connection, Once::Ignored)) =>
            {
                log::warn!("{whose}{}; more of them are not shown here", ignored(controller));
            }
            Happened::NoAnswer { command, since } => {
                let missing = no_answer(*command, seen.at.saturating_duration_since(*since));
                log::warn!("{}{missing}", motors_of());
            }
            Happened::Unanswered(them)
                if them.forgotten > 0 && self.told.insert((seen.connection, Once::LeftOut)) =>
            {
                log::warn!("{whose}{}, and perhaps more", forgotten(them.forgotten));
            }
            Happened::Missed => log::warn!("{whose}{}", missed(seen.line)),
            Happened::Halted { gone, error: None } => {
                log::warn!("{}{}", motors_of(), halted(*gone, None))
            }
            // Motors may go on: no warning takes the room of these.
            Happened::Halted { gone, error } => {
                log::error!("{}{}", motors_of(), halted(*gone, error.as_ref()))
            }
            Happened::Offline(Farewell::Unanswered) => {
                log::error!("{}{FAREWELL_UNANSWERED}", motors_of());
            }
            Happened::Command(_) | Happened::Cycle(_) | Happened::Picture(_) | Happened::I2c(_) => {
                *was_refused = false
            }
            Happened::Closed => self.told.retain(|(connection, _)| *connection != seen.connection),
            Happened::Refused(_)
            | Happened::Connected(_)
            | Happened::Controller { .. }
            | Happened::Online
            | Happened::Offline(Farewell::Answered | Farewell::Missing)
            | Happened::Ignored { .. }
            | Happened::Unknown(_)
            | Happened::Unanswered(_) => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_is_missing_right_after_this_process_stood_still() {
        let mut awake = Awake::default();
        let begin = Instant::now();
        let mut hears = |millis| awake.hears_silence(begin + Duration::from_millis(millis));
        assert_eq!([0, 5, 400].map(&mut hears), [true; 3]);
        // Three seconds, as under SIGSTOP.
        assert_eq!([3400, 3405, 3899].map(&mut hears), [false; 3]);
        assert_eq!([3900, 3905].map(&mut hears), [true; 2]);
    }
}
