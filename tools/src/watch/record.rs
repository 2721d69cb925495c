//! What passes, into a recording.

use std::net::IpAddr;
use std::time::Duration;

use anyhow::Context;
use ft_transfer_area::{LoggedCycle, Statistics};
use ft_transfer_area_recorder::{
    Failure, FailureKind, Feed, FrameSink, Options, Recorder, Totals, Transfer,
};

use crate::lines;
use crate::recording::output::{discard, Output};
use crate::told::{halted, Cycle, Happened, Line, Told, MISSED};

/// Writes a recording.
pub(super) struct Record {
    output: Output,
    recorder: Recorder,
    feed: Feed,
    frames: FrameSink,
    address: String,
    /// What the controller has said of itself, until the first cycle.
    begins: Option<(String, String)>,
    /// Why what passes is not understood any more.
    unclear: Option<String>,
    /// How the controller was stopped after its program had gone.
    halted: Option<String>,
    is_online: bool,
    statistics: Statistics,
    /// An error was reported.
    failed: bool,
}

impl Record {
    pub(super) fn start(output: Output, address: IpAddr) -> anyhow::Result<Self> {
        let (recorder, feed) = Recorder::fed(output.first(), Options::default())?;
        let frames = recorder.frames();
        Ok(Self {
            output,
            recorder,
            feed,
            frames,
            address: address.to_string(),
            begins: None,
            unclear: None,
            halted: None,
            is_online: false,
            statistics: Statistics::default(),
            failed: false,
        })
    }

    pub(super) fn take(&mut self, told: &Told) {
        match &told.what {
            Happened::Online { name, firmware } => {
                self.begins = Some((name.clone(), firmware.to_string()));
                self.is_online = true;
                (self.unclear, self.halted) = (None, None);
                self.statistics = Statistics::default();
            }
            Happened::Cycle(cycle) => self.cycle(told, cycle),
            // The transfer does not end with the camera or I2C.
            Happened::NotUnderstood { side, why } if told.line == Line::Main => {
                self.unclear =
                    Some(format!("what the {} sent is not understood: {why}", side.name()));
            }
            Happened::Missed if told.line == Line::Main => self.unclear = Some(MISSED.to_owned()),
            Happened::Halted { gone, error } => {
                let error = halted(*gone, error.as_ref());
                if self.is_online {
                    self.halted = Some(error);
                } else {
                    // By a connection of its own.
                    let failure = Failure { kind: FailureKind::Other, error };
                    self.feed.transfer(told.at, Transfer::EndedBy(failure));
                }
            }
            Happened::Offline { by_program } => {
                self.is_online = false;
                let closed = "the connection was closed before the program went offline";
                let what = match self.unclear.take() {
                    Some(error) => {
                        Transfer::EndedBy(Failure { kind: FailureKind::WrongData, error })
                    }
                    None if *by_program => Transfer::Ended,
                    None => Transfer::EndedBy(Failure {
                        kind: FailureKind::Closed,
                        error: self.halted.take().unwrap_or_else(|| closed.to_owned()),
                    }),
                };
                self.feed.transfer(told.at, what);
            }
            Happened::Picture(frame) => self.frames.record(frame),
            Happened::Connected(_)
            | Happened::Refused(_)
            | Happened::Closed
            | Happened::Controller { .. }
            | Happened::Command(_)
            | Happened::I2c(_)
            | Happened::NotUnderstood { .. }
            | Happened::Missed => {}
        }
        if let Some(error) = self.recorder.error() {
            if !std::mem::replace(&mut self.failed, true) {
                log::warn!("{error}; everything is passed on as before");
            }
        }
    }

    fn cycle(&mut self, told: &Told, cycle: &Cycle) {
        if let Some((device_name, firmware)) = self.begins.take() {
            let (address, areas) = (self.address.clone(), cycle.areas.len());
            let began = Transfer::Began { device_name, firmware, address, areas };
            self.feed.transfer(told.at, began);
            if let Err(error) = self.output.begun(&mut self.recorder) {
                let path = self.recorder.path().display();
                log::warn!("{error}; the recording goes on as {path}");
            }
        }
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
        logged.arrived = told.at;
        logged.first = cycle.number == 1;
        logged.statistics = *statistics;
        self.feed.cycle(logged);
    }

    /// Ends the file, and says what is in it.
    pub(super) fn finish(self) -> anyhow::Result<()> {
        if self.output.is_beside() {
            discard(self.recorder);
            let path = self.output.path().display();
            lines::print(&format!("no program has driven: {path} is as it was"));
            return Ok(());
        }
        let path = self.recorder.path().to_owned();
        let Totals { cycles, lost, frames, .. } =
            self.recorder.finish().context("the recording is not whole")?;
        lines::print(&format!(
            "{}: {cycles} cycles, {lost} lost, {frames} pictures",
            path.display()
        ));
        Ok(())
    }
}
