//! What a log of all cycles has.

use std::net::SocketAddr;
use std::time::Instant;

use super::event::TimedEvent;
use crate::error::Error;
use crate::exchange::{Inputs, Outgoing, SentConfigs};
use crate::firmware::FirmwareVersion;
use crate::statistics::Statistics;
use crate::transfer_area::{
    Config, FishX1Transfer, InputValues, OutputValues, State, TxtInputs, TxtInputs2, TxtOutputs,
    IZ_COUNTER, IZ_MOTOR, MAX_AREAS,
};

/// An entry of a [`CycleLog`](crate::CycleLog).
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct LogEntry {
    /// How many entries were lost directly before this one, because the channel was full. The newest beginning, gap or
    /// end among them may follow as this entry.
    pub lost: u64,
    /// What has happened.
    pub what: Logged,
}

/// What a [`LogEntry`] has.
#[derive(Clone, Debug)]
#[non_exhaustive]
#[allow(clippy::large_enum_variant, reason = "cycles are by value, so that none of them allocates")]
pub enum Logged {
    /// A transfer has begun, or runs already when the log is made; that it is in a gap then follows.
    Began(LoggedBeginning),
    /// A request was sent, and its response came in.
    Cycle(LoggedCycle),
    /// What comes from no response: [`ConnectionLost`](crate::Event::ConnectionLost),
    /// [`ConnectionRestored`](crate::Event::ConnectionRestored),
    /// [`WatchdogExpired`](crate::Event::WatchdogExpired) or
    /// [`TransferEnded`](crate::Event::TransferEnded).
    Event(TimedEvent),
    /// A transfer could not begin.
    #[non_exhaustive]
    Failed {
        /// When.
        at: Instant,
        /// Why.
        error: Error,
    },
}

/// The beginning of a transfer.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct LoggedBeginning {
    /// When it began.
    pub at: Instant,
    /// The name of the controller.
    pub device_name: String,
    /// The version of its firmware.
    pub firmware: FirmwareVersion,
    /// Its address, with the main port.
    pub address: Option<SocketAddr>,
    /// How many areas the handler has.
    pub areas: usize,
}

/// One cycle: a request, and the response to it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct LoggedCycle {
    /// Its number in its transfer, from 1, as
    /// [`TransferAreaGuard::cycle`](crate::TransferAreaGuard::cycle) counts.
    pub number: u64,
    /// When the response came in.
    pub arrived: Instant,
    /// Whether it is the first of its connection.
    pub first: bool,
    /// The statistics with this response.
    pub statistics: Statistics,
    count: usize,
    areas: [LoggedArea; MAX_AREAS],
}

/// The parts of an area that are exchanged.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct LoggedArea {
    state: State,
    config: Config,
    input: InputValues,
    output: OutputValues,
    txt_inputs: TxtInputs,
    txt_outputs: TxtOutputs,
    txt_inputs2: TxtInputs2,
}

impl From<&FishX1Transfer> for LoggedArea {
    fn from(area: &FishX1Transfer) -> Self {
        let FishX1Transfer { state, config, input, output, .. } = *area;
        let FishX1Transfer { txt_inputs, txt_outputs, txt_inputs2, .. } = *area;
        Self { state, config, input, output, txt_inputs, txt_outputs, txt_inputs2 }
    }
}

impl From<&LoggedArea> for FishX1Transfer {
    fn from(area: &LoggedArea) -> Self {
        let LoggedArea { state, config, input, output, txt_inputs, txt_outputs, txt_inputs2 } =
            *area;
        let new = Self::default();
        Self { state, config, input, output, txt_inputs, txt_outputs, txt_inputs2, ..new }
    }
}

impl LoggedCycle {
    /// The areas: the outputs as they were sent, the configurations that were sent last, the inputs as they came in. The
    /// rest is as in a new area. So are the inputs of an extension that has not yet taken part on this connection, the
    /// timers, and the flags [`cnt_resetted`](crate::transfer_area::InputValues::cnt_resetted) and
    /// [`motor_ex_reached`](crate::transfer_area::InputValues::motor_ex_reached), which belong to the
    /// program.
    ///
    /// After a lost connection a handler hides from the program that a command which was cut off is done. Here it
    /// is what the controller reports.
    pub fn areas(&self) -> Vec<FishX1Transfer> {
        self.areas[..self.count].iter().map(FishX1Transfer::from).collect()
    }

    /// A cycle with these areas, to test what a program does with it. It arrived now, as the first of its
    /// connection. More than 9 areas are left out.
    pub fn new(number: u64, areas: &[FishX1Transfer]) -> Self {
        let mut cycle = Self {
            number,
            arrived: Instant::now(),
            first: true,
            statistics: Statistics::default(),
            count: areas.len().min(MAX_AREAS),
            areas: [LoggedArea::default(); MAX_AREAS],
        };
        cycle.areas.iter_mut().zip(areas).for_each(|(logged, area)| *logged = area.into());
        cycle
    }

    /// The areas of a request, without their inputs; those come from the response. Configurations are those that were
    /// sent last: an area has one that was not sent when the program has not raised its id.
    pub(crate) fn exchanged(
        number: u64,
        arrived: Instant,
        first: bool,
        statistics: Statistics,
        (sent, configs): (&[Outgoing], &SentConfigs),
        inputs: &Inputs,
    ) -> Self {
        let mut areas = [FishX1Transfer::default(); MAX_AREAS];
        let areas = &mut areas[..sent.len().min(MAX_AREAS)];
        for ((area, sent), config) in areas.iter_mut().zip(sent).zip(configs) {
            area.state.id = sent.state.id;
            if let Some(update) = config {
                // It was the area's, which has eight bits.
                area.state.config_id = update.config_id as u8;
                area.config = update.config;
            }
            area.output = sent.output;
            area.output.duty = sent.output.sent_duty();
            area.txt_outputs = sent.txt_outputs;
        }
        inputs.apply(areas);
        for area in &mut *areas {
            *area.input.cnt_resetted = [0; IZ_COUNTER];
            *area.input.motor_ex_reached = [0; IZ_MOTOR];
        }
        Self { arrived, first, statistics, ..Self::new(number, areas) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn outputs_are_logged_as_they_are_sent() {
        let mut sent = [Outgoing::default()];
        *sent[0].output.duty = [-1, 0, 1, 512, 513, i16::MAX, i16::MIN, 256];
        let cycle = LoggedCycle::exchanged(
            1,
            Instant::now(),
            true,
            Statistics::default(),
            (&sent, &[None; MAX_AREAS]),
            &Inputs::default(),
        );
        assert_eq!(cycle.areas()[0].output.duty, [0, 0, 1, 512, 512, 512, 0, 256]);
        assert_eq!(cycle.areas()[0].input.uni, [0; 8], "no input has come in");
    }
}
