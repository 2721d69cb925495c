//! What a correct client does not do, but the simulated TXT accepts.

use std::collections::VecDeque;
use std::fmt;
use std::mem;

use ft_transfer_area::transfer_area::{Config, DUTY_MAX};
use ft_transfer_area::wire::{CommandId, ExchangeData};

use crate::machine::journal::{notice, Name};

/// How many sentences are remembered.
const SENTENCES_KEPT: usize = 100;

/// What the firmware does then.
const ENDS: &str = "; the program of a real TXT would have ended, and been away for two seconds";

/// Something that a correct client does not do. Controllers are given by index; the master is 0.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Oddity {
    /// An exchange came before this controller's configuration.
    NotConfigured { controller: usize },
    /// An exchange had extensions that the response before did not have.
    NotOffered { mask: u16, offered: u16 },
    /// A duty that no output can have.
    Duty { controller: usize, output: usize, duty: i16 },
    /// A motor of the world got a duty for both directions. Where none is plugged in, these are two lamps or
    /// valves: not all programs configure them as single outputs.
    BothWays { controller: usize, motor: usize, duty: [i16; 2] },
    /// Compressed data went on after the last word.
    SurplusData,
    /// A command came before the response to the one before.
    SentAhead(CommandId),
    /// A command that belongs to online mode came when there is none.
    NotOnline(CommandId),
    /// A command came in pieces.
    InPieces,
    /// StartOnline came while the I2C server of the session before is there.
    StartedTooSoon,
    /// A compressed exchange had fewer words than it says.
    TooFewWords,
    /// StartCameraOnline came a second time.
    CameraStartedTwice,
    /// The camera was stopped while its client was connected, and is started again.
    CameraLeftOpen,
    /// An I2C client came outside the time in which the firmware accepts one.
    I2cUnexpected,
    /// A command needs the count of a motor of the world that can't be counted.
    Uncounted { controller: usize, motor: usize, encoder: Encoder, task: Task },
}

/// Whether a motor output of the world can be counted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Encoder {
    /// Its motor has an encoder.
    Present,
    /// Its motor has none.
    Missing,
    /// It has no motor.
    NoMotor,
}

/// A task that needs a motor's count. Other motors are given by index.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Task {
    Distance,
    Follow { leader: usize },
    Lead { follower: usize },
}

impl fmt::Display for Oddity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotConfigured { controller } => {
                write!(f, "an exchange came before any UpdateConfig for {}", Name(*controller))
            }
            Self::NotOffered { mask, offered } => write!(
                f,
                "an exchange had extension mask {mask:#06x}, though the response before allowed \
                 {offered:#06x} only"
            ),
            Self::Duty { controller, output, duty } => {
                let (name, number) = (Name(*controller), output + 1);
                write!(f, "O{number} of {name} got duty {duty}, which is not 0..={DUTY_MAX}")
            }
            Self::BothWays { controller, motor, duty: [forward, backward] } => {
                let (name, number) = (Name(*controller), motor + 1);
                write!(f, "M{number} of {name} got duty {forward} and {backward} at the same time")
            }
            Self::SurplusData => {
                f.write_str("an exchange had whole bytes of data after the last word")
            }
            Self::SentAhead(command) => {
                write!(f, "{command} came before the response to the command before it")
            }
            Self::NotOnline(command) => write!(f, "{command} came outside online mode"),
            Self::InPieces => f.write_str(
                "a command came in pieces; a real TXT would have closed the connection",
            ),
            Self::StartedTooSoon => write!(
                f,
                "StartOnline came less than 5 s after the one before, and no I2C client had come and gone{ENDS}"
            ),
            Self::TooFewWords => write!(f, "an exchange had fewer words than its mask says{ENDS}"),
            Self::CameraStartedTwice => write!(f, "StartCameraOnline came twice{ENDS}"),
            Self::CameraLeftOpen => write!(
                f,
                "the camera was stopped while its client was connected, and started again{ENDS}"
            ),
            Self::I2cUnexpected => f.write_str(
                "an I2C client came that is not the first one in the 5 s after StartOnline; a real TXT would have \
                 refused it",
            ),
            Self::Uncounted { controller, motor, encoder, task } => {
                let (name, number) = (Name(*controller), motor + 1);
                match encoder {
                    Encoder::NoMotor => write!(f, "there is no motor on M{number} of {name}, so ")?,
                    Encoder::Missing | Encoder::Present => {
                        write!(f, "M{number} of {name} has no encoder, so ")?;
                    }
                }
                match task {
                    Task::Distance => f.write_str("its distance never ends"),
                    Task::Follow { leader } => write!(f, "it can't follow M{}", leader + 1),
                    Task::Lead { follower } => write!(f, "M{} can't follow it", follower + 1),
                }
            }
        }
    }
}

impl Oddity {
    /// Whether only one of the two is noted in an online session.
    fn is_like(&self, other: &Self) -> bool {
        let motor = |oddity: &Self| {
            let Self::Uncounted { controller, motor, .. } = oddity else { return None };
            Some((*controller, *motor))
        };
        mem::discriminant(self) == mem::discriminant(other) && motor(self) == motor(other)
    }
}

/// The oddities so far, and the state to notice them.
#[derive(Clone, Debug, Default)]
pub(crate) struct Oddities {
    /// The number of the client that is connected, from 1.
    client: u64,
    sentences: VecDeque<String>,
    /// Those that were noted in this online session.
    noted: Vec<Oddity>,
    /// The controllers that were configured in this online session, one bit each.
    configured: u16,
    /// How many exchanges came without a configuration.
    unconfigured: u32,
    /// The extensions that the next request may have.
    offered: u16,
    /// The extensions that the last request was allowed to have.
    offered_before: u16,
}

impl Oddities {
    /// The sentences, the oldest first.
    pub(crate) fn sentences(&self) -> impl DoubleEndedIterator<Item = &str> {
        self.sentences.iter().map(String::as_str)
    }

    /// Remembers an oddity, if it is the first of its kind in this online session. Each motor that
    /// can't be counted is a separate kind.
    pub(crate) fn note(&mut self, oddity: &Oddity) {
        if self.noted.iter().any(|noted| noted.is_like(oddity)) {
            return;
        }
        self.noted.push(oddity.clone());
        if matches!(oddity, Oddity::I2cUnexpected) {
            // Nobody says who he is at that port.
            notice!(Warn, "{oddity}");
        } else {
            notice!(Warn, "client {} is odd: {oddity}", self.client);
        }
        if self.sentences.len() == SENTENCES_KEPT {
            self.sentences.pop_front();
        }
        self.sentences.push_back(oddity.to_string());
    }

    /// Begins a new online session.
    pub(crate) fn begin_session(&mut self) {
        let sentences = mem::take(&mut self.sentences);
        *self = Self { client: self.client, sentences, ..Self::default() };
    }

    /// The client with this number is there.
    pub(crate) fn client_came(&mut self, number: u64) {
        self.client = number;
    }

    /// An UpdateConfig came, whether it was taken over or not.
    pub(crate) fn configured(&mut self, controller: usize) {
        // Higher indexes are in no exchange.
        if controller < u16::BITS as usize {
            self.configured |= 1 << controller;
        }
    }

    /// The extensions that a response had.
    pub(crate) fn offer(&mut self, mask: u16) {
        self.offered_before = mem::replace(&mut self.offered, mask);
    }

    /// The client may ignore the response. Then its last exchange has the extensions of the response
    /// before.
    pub(crate) fn doubt_offer(&mut self) {
        self.offered |= self.offered_before;
    }

    /// Checks the extensions in an exchange, at most 8, and whether it needs their configurations: one that switches an
    /// output on does. A client that only stops a controller has two others.
    pub(crate) fn check_mask(&mut self, mask: u16, drives: impl FnOnce() -> bool) {
        const STOPS: u32 = 2;
        let missing = (1 | mask << 1) & !self.configured;
        if missing != 0 {
            self.unconfigured = self.unconfigured.saturating_add(1);
            if self.unconfigured > STOPS || drives() {
                let controller = missing.trailing_zeros() as usize;
                self.note(&Oddity::NotConfigured { controller });
            }
        }
        let offered = self.offered;
        if mask & !offered != 0 {
            self.note(&Oddity::NotOffered { mask, offered });
        }
    }

    /// Checks the outputs for a controller; without `config` there is no such controller. `has_motor` says
    /// whether a motor of the world is plugged in at a pair of outputs.
    pub(crate) fn check_outputs(
        &mut self,
        controller: usize,
        outputs: &ExchangeData,
        config: Option<&Config>,
        has_motor: impl Fn(usize) -> bool,
    ) {
        for (output, &duty) in outputs.duty.iter().enumerate() {
            if !(0..=DUTY_MAX).contains(&duty) {
                self.note(&Oddity::Duty { controller, output, duty });
            }
        }
        let Some(config) = config else { return };
        for (motor, pair) in outputs.duty.chunks_exact(2).enumerate() {
            let duty = [pair[0], pair[1]];
            if config.motor[motor] == 1 && !duty.contains(&0) && has_motor(motor) {
                self.note(&Oddity::BothWays { controller, motor, duty });
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sentences(oddities: &Oddities) -> Vec<&str> {
        oddities.sentences().collect()
    }

    /// An online session in which this many controllers are configured.
    fn session(configured: usize) -> Oddities {
        let mut oddities = Oddities::default();
        oddities.begin_session();
        (0..configured).for_each(|controller| oddities.configured(controller));
        oddities
    }

    fn duty(duty: [i16; 8]) -> ExchangeData {
        ExchangeData { duty, ..ExchangeData::default() }
    }

    #[test]
    fn every_controller_in_an_exchange_needs_a_configuration() {
        let mut oddities = session(2);
        oddities.configured(usize::MAX);
        oddities.offer(0b11);
        oddities.check_mask(0b01, || true);
        assert_eq!(oddities.sentences().count(), 0);
        oddities.check_mask(0b10, || true);
        let sentence = "an exchange came before any UpdateConfig for extension 2";
        assert_eq!(sentences(&oddities), [sentence]);
        oddities.begin_session();
        oddities.check_mask(0, || true);
        let second = "an exchange came before any UpdateConfig for the master";
        assert_eq!(sentences(&oddities), [sentence, second]);
    }

    #[test]
    fn an_exchange_has_only_extensions_of_the_response_before() {
        let mut oddities = session(9);
        oddities.check_mask(0, || true);
        oddities.offer(0b11);
        oddities.check_mask(0b11, || true);
        oddities.offer(0b10);
        oddities.check_mask(0b10, || true);
        assert_eq!(oddities.sentences().count(), 0);
        oddities.check_mask(0b11, || true);
        let sentence = "an exchange had extension mask 0x0003, though the response before allowed \
                        0x0002 only";
        assert_eq!(sentences(&oddities), [sentence]);
    }

    #[test]
    fn the_first_exchange_of_a_session_has_no_extensions() {
        let mut oddities = session(9);
        oddities.offer(0xFF);
        oddities.begin_session();
        (0..9).for_each(|controller| oddities.configured(controller));
        oddities.check_mask(1, || true);
        assert_eq!(oddities.sentences().count(), 1);
    }

    #[test]
    fn a_response_that_may_be_ignored_keeps_what_the_one_before_allowed() {
        let mut oddities = session(9);
        oddities.offer(0b01);
        oddities.offer(0b10);
        oddities.doubt_offer();
        oddities.check_mask(0b01, || true);
        oddities.check_mask(0b10, || true);
        assert_eq!(oddities.sentences().count(), 0);
        oddities.offer(0b10);
        oddities.check_mask(0b01, || true);
        assert_eq!(oddities.sentences().count(), 1);
    }

    #[test]
    fn a_duty_has_its_range() {
        for (odd, sentence) in [
            (-1, "O2 of extension 3 got duty -1, which is not 0..=512"),
            (513, "O2 of extension 3 got duty 513, which is not 0..=512"),
        ] {
            let mut oddities = session(9);
            let (config, motor) = (Config::default(), |_| true);
            oddities.check_outputs(3, &duty([0, 512, 1, 0, 0, 0, 0, 0]), Some(&config), motor);
            assert_eq!(oddities.sentences().count(), 0);
            oddities.check_outputs(3, &duty([0, odd, 0, 0, 0, 0, 0, 0]), None, motor);
            assert_eq!(sentences(&oddities), [sentence]);
        }
    }

    #[test]
    fn a_motor_that_is_plugged_in_is_not_turned_both_ways() {
        let mut oddities = session(9);
        let config = Config { motor: [1, 0, 1, 1].into(), ..Config::default() };
        let plugged_in = |motor| motor != 2;
        let mut check = |of| oddities.check_outputs(0, &duty(of), Some(&config), plugged_in);
        check([1, 0, 2, 3, 0, 4, 0, 0]);
        // Two lamps, though the configuration says a motor.
        check([0, 0, 0, 0, 512, 512, 0, 0]);
        assert_eq!(oddities.sentences().count(), 0);
        let mut check = |of| oddities.check_outputs(0, &duty(of), Some(&config), plugged_in);
        check([0, 0, 0, 0, 0, 0, 5, 6]);
        assert_eq!(sentences(&oddities), ["M4 of the master got duty 5 and 6 at the same time"]);
    }

    #[test]
    fn each_kind_is_noted_once_in_a_session_and_the_newest_hundred_are_kept() {
        let mut oddities = session(0);
        for session in 0..101 {
            oddities.begin_session();
            for duty in [-1 - session, -1000] {
                oddities.note(&Oddity::Duty { controller: 0, output: 0, duty });
            }
        }
        assert_eq!(oddities.sentences().count(), 100);
        let first = oddities.sentences().next().unwrap();
        assert!(first.contains("duty -2,"), "{first}");
        oddities.note(&Oddity::SurplusData);
        assert_eq!(oddities.sentences().next_back().unwrap(), Oddity::SurplusData.to_string());
    }
}
