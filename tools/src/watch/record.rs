//! What passes, into a recording.

use std::net::SocketAddr;
use std::time::{Duration, Instant};

use anyhow::Context;
use ft_transfer_area::wire::CommandId;
use ft_transfer_area::{LoggedCycle, Statistics};
use ft_transfer_area_recorder::{
    Error, Failure, FailureKind, Feed, FrameSink, Options, Recorder, Totals, Transfer,
};

use super::changes::name;
use crate::lines;
use crate::recording::on_demand::{Button, Keeper, Shown, Trouble};
use crate::recording::output::{discard, end, Output};
use crate::seen::{
    forgotten, halted, no_answer, Controllers, Cycle, Farewell, Followed, Happened, Line, Seen,
    UnansweredExchanges, FAREWELL_UNANSWERED, MISSED,
};

/// How a transfer has ended that its program did not end.
const CLOSED: &str = "the connection was closed before the program went offline";

/// Of how many programs before is told during one transfer.
const LEFT_ON: usize = 8;

/// How a transfer ends.
#[derive(Clone, Copy)]
enum End {
    Offline(Farewell),
    /// Its program goes online again on the same connection. There was no answer to a StopOnline before.
    OnlineAgain,
    /// A program on another connection goes online. A controller has one client, so this one has lost it.
    OtherOnline,
}

/// Understands what is to be recorded.
pub(super) struct Record {
    into: Into,
    address: String,
    controllers: Controllers,
    /// The first cycle is still to come.
    begins: bool,
    /// Why what passes is not understood any more.
    unclear: Option<String>,
    /// How the controller was stopped after its program had gone.
    halted: Option<String>,
    /// What comes on other connections is not in the recording.
    followed: Followed,
    /// Motors of programs before that may go on, to be told when the transfer has ended.
    left_on: Vec<String>,
    /// A command of it without a response, and from when to when that was waited for.
    unanswered: Option<Unanswered>,
    /// What it has sent beyond the last answer, and what was left out.
    beyond: Beyond,
    statistics: Statistics,
}

/// Where it goes.
enum Into {
    File(ToFile),
    /// Until a page wants a file.
    Memory(Keeper),
}

/// A file from beginning to end.
struct ToFile {
    output: Output,
    recorder: Recorder,
    feed: Feed,
    frames: FrameSink,
    shown: Shown,
    /// The file is to get its place.
    is_renamed_soon: bool,
    /// An error was reported.
    failed: bool,
}

/// A command without a response.
struct Unanswered {
    command: CommandId,
    since: Instant,
    /// When the program went on.
    until: Option<Instant>,
    /// Cycles since then. A program that ends then may have stopped its motors first.
    cycles: u32,
}

impl Unanswered {
    fn seen(&self, ended: Instant) -> String {
        let until = self.until.unwrap_or(ended);
        no_answer(self.command, until.saturating_duration_since(self.since))
    }
}

/// What the recording has no cycles of.
#[derive(Default)]
struct Beyond {
    /// How many exchanges had no answer, and the outputs of the newest.
    exchanges: u64,
    outputs: Vec<String>,
    /// How many exchanges are not recorded, because too many had no answer.
    forgotten: u64,
}

impl Beyond {
    fn of(them: &UnansweredExchanges) -> Self {
        let mut outputs = Vec::new();
        for (index, area) in them.areas.iter().enumerate() {
            let duties = area.output.duty.iter().enumerate().filter(|(_, duty)| **duty != 0);
            outputs.extend(duties.map(|(at, duty)| format!("{} O{} {duty}", name(index), at + 1)));
        }
        Self { exchanges: them.exchanges, outputs, forgotten: them.forgotten }
    }

    /// The controller has gone on.
    fn answered(&mut self) {
        (self.exchanges, self.outputs) = Default::default();
    }

    fn text(self) -> Option<String> {
        let left_out = (self.forgotten > 0).then(|| forgotten(self.forgotten));
        let unanswered = (self.exchanges > 0).then(|| {
            let outputs = match &self.outputs[..] {
                [] => "all outputs at 0".to_owned(),
                outputs => outputs.join(", "),
            };
            format!("the last {} exchanges had no answer, the newest has {outputs}", self.exchanges)
        });
        let texts: Vec<_> = left_out.into_iter().chain(unanswered).collect();
        (!texts.is_empty()).then(|| texts.join("; "))
    }
}

impl End {
    fn name(self) -> &'static str {
        match self {
            Self::Offline(Farewell::Unanswered) => "the program ended: motors may go on",
            Self::Offline(Farewell::Answered | Farewell::Missing) => "the program ended",
            Self::OnlineAgain => "the program went online again while it was online",
            Self::OtherOnline => "a program on another connection went online",
        }
    }
}

impl Record {
    /// Into this file, and how pages learn of it.
    pub(super) fn start(
        output: Output,
        options: Options,
        address: SocketAddr,
    ) -> anyhow::Result<(Self, Button)> {
        let (recorder, feed) = Recorder::fed(output.first(), options)?;
        let (frames, shown) = (recorder.frames(), Shown::default());
        shown.begin(Instant::now(), Duration::ZERO);
        let button = Button::fixed(shown.clone());
        let file =
            ToFile { output, recorder, feed, frames, shown, is_renamed_soon: false, failed: false };
        Ok((Self::new(Into::File(file), address), button))
    }

    /// Into memory, and how pages make a file of it.
    pub(super) fn keep(address: SocketAddr) -> (Self, Button) {
        let (keeper, button) = Keeper::new();
        (Self::new(Into::Memory(keeper), address), button)
    }

    fn new(into: Into, address: SocketAddr) -> Self {
        Self {
            into,
            address: super::address_text(address),
            controllers: Controllers::default(),
            begins: false,
            unclear: None,
            halted: None,
            followed: Followed::default(),
            left_on: Vec::new(),
            unanswered: None,
            beyond: Beyond::default(),
            statistics: Statistics::default(),
        }
    }

    pub(super) fn take(&mut self, seen: &Seen) {
        self.controllers.take(seen);
        match seen.line {
            Line::Main if !self.followed.is_other(seen) => self.of_main(seen),
            Line::Main if matches!(seen.what, Happened::Online) => {
                if self.followed.drives() {
                    self.ended(seen.at, End::OtherOnline);
                }
                self.of_main(seen);
            }
            Line::Main | Line::I2c => {}
            Line::Camera => {
                let picture = match &seen.what {
                    Happened::Picture(frame) if !self.followed.is_older(seen) => Some(frame),
                    _ => None,
                };
                match (picture, &self.into) {
                    (Some(frame), Into::File(file)) => file.frames.record(frame),
                    (Some(frame), Into::Memory(keeper)) => keeper.picture(frame),
                    (None, _) => {}
                }
            }
        }
        self.followed.take(seen);
        if !self.followed.drives() {
            self.tell_left_on(seen.at);
        }
    }

    /// Tells of motors of programs before.
    fn tell_left_on(&mut self, at: Instant) {
        for error in std::mem::take(&mut self.left_on) {
            let failure = Failure { kind: FailureKind::Other, error };
            self.into.transfer(at, Transfer::EndedBy(failure));
        }
    }

    /// What is to be done from time to time.
    pub(super) fn look(&mut self) {
        match &mut self.into {
            Into::File(file) => file.look(),
            Into::Memory(keeper) => keeper.look(),
        }
    }

    /// Of the connection that drives, or of any while none does.
    fn of_main(&mut self, seen: &Seen) {
        match &seen.what {
            Happened::Online => {
                if self.followed.driving() == Some(seen.connection) && !self.begins {
                    self.ended(seen.at, End::OnlineAgain);
                }
                self.begins = true;
                (self.unclear, self.halted, self.unanswered) = Default::default();
                self.statistics = Statistics::default();
                self.beyond = Beyond::default();
            }
            Happened::Cycle(cycle) => self.cycle(seen, cycle),
            Happened::NotUnderstood { side, why } => {
                self.unclear =
                    Some(format!("what the {} sent is not understood: {why}", side.name()));
            }
            Happened::Missed => self.unclear = Some(MISSED.to_owned()),
            Happened::NoAnswer { command, since } => {
                let (command, since) = (*command, *since);
                self.unanswered = Some(Unanswered { command, since, until: None, cycles: 0 });
            }
            Happened::Unanswered(them) => self.beyond = Beyond::of(them),
            Happened::Halted { gone, error } => {
                let text = halted(*gone, error.as_ref());
                if self.followed.driving() == Some(seen.connection) {
                    self.halted = Some(text);
                } else if !self.left_on.contains(&text) && self.left_on.len() < LEFT_ON {
                    // By a connection of its own, or of a program before.
                    self.left_on.push(text);
                }
            }
            Happened::Offline(farewell) => self.ended(seen.at, End::Offline(*farewell)),
            Happened::Command(_) => {
                if let Some(Unanswered { until, .. }) = &mut self.unanswered {
                    until.get_or_insert(seen.at);
                }
            }
            Happened::Connected(_)
            | Happened::Refused(_)
            | Happened::Closed
            | Happened::Controller { .. }
            | Happened::Ignored { .. }
            | Happened::Unknown(_)
            | Happened::Picture(_)
            | Happened::I2c(_) => {}
        }
    }

    /// The transfer has ended.
    fn ended(&mut self, at: Instant, end: End) {
        let connection = self.followed.driving();
        let beyond = std::mem::take(&mut self.beyond).text();
        let failed = |kind, error: String| {
            let error = [error].into_iter().chain(beyond.clone()).collect::<Vec<_>>().join("; ");
            Transfer::EndedBy(Failure { kind, error })
        };
        let unanswered = self.unanswered.take().map(|missing| missing.seen(at));
        let what = match (self.unclear.take(), unanswered, self.halted.take()) {
            (Some(error), _, _) => failed(FailureKind::WrongData, error),
            (None, Some(missing), halted) => {
                let then = halted.unwrap_or_else(|| end.name().to_owned());
                failed(FailureKind::NoAnswer, format!("{missing}, then {then}"))
            }
            (None, None, halted) => match end {
                End::Offline(Farewell::Answered) if beyond.is_none() => Transfer::Ended,
                End::Offline(Farewell::Answered) => {
                    failed(FailureKind::NoAnswer, end.name().to_owned())
                }
                End::Offline(Farewell::Unanswered) => {
                    failed(FailureKind::NoAnswer, FAREWELL_UNANSWERED.to_owned())
                }
                End::Offline(Farewell::Missing) => {
                    failed(FailureKind::Closed, halted.unwrap_or_else(|| CLOSED.to_owned()))
                }
                End::OnlineAgain | End::OtherOnline => {
                    failed(FailureKind::Other, halted.unwrap_or_else(|| end.name().to_owned()))
                }
            },
        };
        if self.begins {
            // Without a cycle there is nothing to tell of, unless it has gone wrong.
            if matches!(what, Transfer::Ended) {
                return self.begins = false;
            }
            self.begin(at, connection.unwrap_or_default(), 0);
        }
        self.into.transfer(at, what);
    }

    /// The transfer begins, if it is not in the file yet.
    fn begin(&mut self, at: Instant, connection: u64, areas: usize) {
        if !std::mem::take(&mut self.begins) {
            return;
        }
        let (device_name, firmware) = self.controllers.of(connection).unwrap_or_default();
        let address = self.address.clone();
        self.into.transfer(at, Transfer::Began { device_name, firmware, address, areas });
        if let Into::File(file) = &mut self.into {
            file.begun();
        }
    }

    fn cycle(&mut self, seen: &Seen, cycle: &Cycle) {
        if let Some(unanswered) = &mut self.unanswered {
            unanswered.until.get_or_insert(seen.at);
            unanswered.cycles += 1;
        }
        self.unanswered.take_if(|unanswered| unanswered.cycles > 1);
        self.beyond.answered();
        self.begin(seen.at, seen.connection, cycle.areas.len());
        let statistics = &mut self.statistics;
        statistics.cycles = cycle.number;
        statistics.config_updates = cycle.config_updates;
        if let Some(since_last) = cycle.since_last {
            let shortest = match statistics.shortest_cycle {
                Duration::ZERO => since_last,
                shortest => shortest.min(since_last),
            };
            statistics.last_cycle = since_last;
            statistics.shortest_cycle = shortest;
            statistics.longest_cycle = statistics.longest_cycle.max(since_last);
        }
        let mut logged = LoggedCycle::new(cycle.number, &cycle.areas);
        logged.arrived = seen.at;
        logged.first = cycle.number == 1;
        logged.statistics = *statistics;
        match &mut self.into {
            Into::File(file) => file.feed.cycle(logged),
            Into::Memory(keeper) => keeper.history().cycle(&logged),
        }
    }

    /// Ends the file, and says what is in it.
    pub(super) fn finish(mut self) -> anyhow::Result<()> {
        self.tell_left_on(Instant::now());
        match self.into {
            Into::File(file) => file.finish(),
            Into::Memory(keeper) => {
                keeper.finish();
                Ok(())
            }
        }
    }
}

impl Into {
    fn transfer(&mut self, at: Instant, what: Transfer) {
        match self {
            Self::File(file) => file.feed.transfer(at, what),
            Self::Memory(keeper) => keeper.history().transfer(at, what),
        }
    }
}

impl ToFile {
    /// The file takes its place, while what passes is looked at.
    fn begun(&mut self) {
        match self.output.begin(&mut self.recorder) {
            Ok(is_renamed_soon) => self.is_renamed_soon = is_renamed_soon,
            Err(error) => self.keeps_name(&error),
        }
    }

    /// Looks whether it has its place, and waits as long for that.
    fn look_for_name(&mut self, wait: Duration) {
        if let Some(renamed) = self.recorder.renamed(wait) {
            self.is_renamed_soon = false;
            if let Err(error) = renamed {
                self.keeps_name(&error);
            }
        }
    }

    fn keeps_name(&self, error: &Error) {
        let path = self.recorder.path().display();
        let text = format!("{error:#}; the recording goes on as {path}");
        log::warn!("{text}");
        self.shown.keeps_name(text);
    }

    fn look(&mut self) {
        if self.failed {
            return;
        }
        self.look_for_name(Duration::ZERO);
        let newest = self.recorder.newest();
        let is_beside = self.output.is_beside() || self.is_renamed_soon;
        let path = if is_beside { self.output.path() } else { &*newest };
        self.shown.take(&self.recorder, path);
        if let Some(error) = self.recorder.error() {
            self.failed = true;
            self.shown.end(Some(Trouble::of(&error)));
            log::warn!("{error:#}; everything is passed on as before");
        }
    }

    fn finish(mut self) -> anyhow::Result<()> {
        if self.output.is_beside() {
            discard(self.recorder);
            let path = self.output.path().display();
            lines::print(&format!("no program has driven: {path} is as it was"));
            return Ok(());
        }
        self.look_for_name(Duration::MAX);
        let (files, Totals { cycles, lost, frames, .. }) =
            end(self.recorder).context("the recording is not whole")?;
        lines::print(&format!("{files}: {cycles} cycles, {lost} lost, {frames} pictures"));
        self.output.ensure_is_there(&files)
    }
}
