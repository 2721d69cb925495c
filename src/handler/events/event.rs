//! What can happen, and its kinds.

use std::time::Duration;

use crate::error::Error;
use crate::terminals::{Counter, Input, Motor};
use crate::tx::IrDevice;

/// What has happened, as told by a response or by the end of the transfer.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Event {
    /// A digital input has changed.
    ///
    /// A response tells of it when the input was configured as digital, and in the same way, for
    /// the response before; so neither the first response of a transfer nor the first by a new
    /// configuration does.
    #[doc(alias = "tCbUniInputDigChanged")]
    InputChanged {
        /// Index of the area.
        area: usize,
        /// The input.
        input: Input,
        /// Whether it reports 1 now.
        pressed: bool,
    },
    /// A counter has another value than in the response before, in the same transfer: pulses were
    /// counted, or it was reset.
    #[doc(alias = "tCbCount")]
    CounterChanged {
        /// Index of the area.
        area: usize,
        /// The counter.
        counter: Counter,
        /// Its pulses since the last reset.
        count: u16,
    },
    /// The counter reset that was sent last is done, as
    /// [`cnt_resetted`](crate::transfer_area::Input::cnt_resetted) tells.
    #[doc(alias = "tCbCntResetReady")]
    #[doc(alias = "SetCBCounterResetted")]
    CounterReset {
        /// Index of the area.
        area: usize,
        /// The counter.
        counter: Counter,
        /// The id of the reset.
        #[doc(alias = "messageId")]
        command_id: u16,
    },
    /// A motor has come to the end of its distance: the command that was sent last is done, and
    /// has one. Once for each command; leaving the extended mode is none.
    #[doc(alias = "tCbMotorReached")]
    #[doc(alias = "SetCBMotorExReached")]
    MotorReached {
        /// Index of the area.
        area: usize,
        /// The motor, of a synchronised group each for itself.
        motor: Motor,
        /// The value of its counter.
        position: u16,
        /// The id of the command.
        #[doc(alias = "messageId")]
        command_id: u16,
    },
    /// A joystick of an infrared remote was moved since the response before, in the same transfer.
    ///
    /// A remote is told of twice, as [`IrDevice::Any`] and by its switches.
    #[doc(alias = "tCbTaJoyStick")]
    JoystickMoved {
        /// Index of the area.
        area: usize,
        /// The remote.
        device: IrDevice,
        /// Which of its joysticks.
        joystick: Joystick,
        /// Left to right: −15..=15.
        x: i16,
        /// Backwards to forward: −15..=15.
        y: i16,
    },
    /// An extension has come or gone since the response before, in the same transfer. While it is
    /// gone its inputs keep their last values.
    #[doc(alias = "SetCBRoboExtState")]
    ExtensionChanged {
        /// The extension, 1..=8, which is the index of its area, if there is one for it.
        extension: usize,
        /// Whether it takes part now.
        alive: bool,
    },
    /// The connection was lost, and is made again: all outputs are 0 and all commands forgotten.
    ///
    /// Only of a transfer that [reconnects](crate::TransferAreaComHandlerBuilder::reconnect).
    ConnectionLost {
        /// What went wrong with it.
        error: Error,
    },
    /// A connection that was lost stands again.
    ConnectionRestored {
        /// How long it was lost.
        after: Duration,
    },
    /// The [watchdog](crate::TransferAreaComHandlerBuilder::watchdog) has expired: all outputs are 0, until
    /// the program has learned of it by a call.
    WatchdogExpired {
        /// For how long the program has shown no sign of life.
        limit: Duration,
    },
    /// The transfer has ended, its motors are stopped.
    TransferEnded {
        /// The error that ended it; `None` when it was ended by the program.
        error: Option<Error>,
    },
}

/// One of a remote's two joysticks.
#[doc(alias = "IrDevGroup")]
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Joystick {
    /// The left one.
    #[doc(alias = "JoystickLeft")]
    Left,
    /// The right one.
    #[doc(alias = "JoystickRight")]
    Right,
}

/// The kinds of [`Event`], by the same names.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the events of the same names say what they are")]
pub enum EventKind {
    InputChanged,
    CounterChanged,
    CounterReset,
    MotorReached,
    JoystickMoved,
    ExtensionChanged,
    ConnectionLost,
    ConnectionRestored,
    WatchdogExpired,
    TransferEnded,
}

impl EventKind {
    /// All of them.
    pub const ALL: [Self; 10] = [
        Self::InputChanged,
        Self::CounterChanged,
        Self::CounterReset,
        Self::MotorReached,
        Self::JoystickMoved,
        Self::ExtensionChanged,
        Self::ConnectionLost,
        Self::ConnectionRestored,
        Self::WatchdogExpired,
        Self::TransferEnded,
    ];
}

impl Event {
    /// The kind under which one subscribes to it.
    pub fn kind(&self) -> EventKind {
        match self {
            Self::InputChanged { .. } => EventKind::InputChanged,
            Self::CounterChanged { .. } => EventKind::CounterChanged,
            Self::CounterReset { .. } => EventKind::CounterReset,
            Self::MotorReached { .. } => EventKind::MotorReached,
            Self::JoystickMoved { .. } => EventKind::JoystickMoved,
            Self::ExtensionChanged { .. } => EventKind::ExtensionChanged,
            Self::ConnectionLost { .. } => EventKind::ConnectionLost,
            Self::ConnectionRestored { .. } => EventKind::ConnectionRestored,
            Self::WatchdogExpired { .. } => EventKind::WatchdogExpired,
            Self::TransferEnded { .. } => EventKind::TransferEnded,
        }
    }
}

/// A set of kinds of events.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(in crate::handler) struct KindSet(u16);

impl KindSet {
    pub(in crate::handler) fn is_empty(self) -> bool {
        self.0 == 0
    }

    pub(super) fn contains(self, kind: EventKind) -> bool {
        self.0 & 1 << kind as u8 != 0
    }

    pub(super) fn union(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}

impl FromIterator<EventKind> for KindSet {
    fn from_iter<T: IntoIterator<Item = EventKind>>(kinds: T) -> Self {
        Self(kinds.into_iter().fold(0, |set, kind| set | 1 << kind as u8))
    }
}
