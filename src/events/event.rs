//! The events, and their kinds.

use std::net::SocketAddr;
use std::time::{Duration, Instant};

use crate::error::Error;
use crate::firmware::FirmwareVersion;
use crate::terminals::{Counter, Input, Motor};
use crate::tx::IrDevice;

/// What has happened, known from a response or from the state of the transfer. Later versions may add kinds,
/// and fields to each.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Event {
    /// A digital input has changed.
    ///
    /// The input has to be configured as digital, and with the same configuration, for this response and the
    /// previous one. So there is no such event for the first response of a transfer, or for the first one
    /// after a new configuration.
    #[doc(alias = "tCbUniInputDigChanged")]
    #[non_exhaustive]
    InputChanged {
        /// Index of the area.
        area: usize,
        /// The input.
        input: Input,
        /// Whether it now reports 1.
        pressed: bool,
    },
    /// A counter has another value than in the previous response of the same transfer: pulses were
    /// counted, or it was reset.
    #[doc(alias = "tCbCount")]
    #[non_exhaustive]
    CounterChanged {
        /// Index of the area.
        area: usize,
        /// The counter.
        counter: Counter,
        /// Its pulses since the last reset.
        count: u16,
    },
    /// The counter reset that was sent last is done, as in
    /// [`cnt_resetted`](crate::transfer_area::InputValues::cnt_resetted).
    #[doc(alias = "tCbCntResetReady")]
    #[doc(alias = "SetCBCounterResetted")]
    #[non_exhaustive]
    CounterReset {
        /// Index of the area.
        area: usize,
        /// The counter.
        counter: Counter,
        /// The id of the reset.
        #[doc(alias = "messageId")]
        command_id: u16,
    },
    /// A motor has reached the end of its distance: the command that was sent last has a distance and is
    /// done. Once for each command. Leaving the extended mode is not such a command.
    #[doc(alias = "tCbMotorReached")]
    #[doc(alias = "SetCBMotorExReached")]
    #[non_exhaustive]
    MotorReached {
        /// Index of the area.
        area: usize,
        /// The motor. In a synchronised group each motor has its own event.
        motor: Motor,
        /// The value of its counter.
        position: u16,
        /// The id of the command.
        #[doc(alias = "messageId")]
        command_id: u16,
    },
    /// A motor should turn, and its counter has not changed for the [limit that the program has
    /// set](crate::TransferAreas::set_stall_limit) for it: it is blocked, or its encoder or its cable is not
    /// connected.
    ///
    /// Once for each standstill. A new one begins after a pulse, or when the motor is started again, in the
    /// other direction or by another command.
    #[non_exhaustive]
    MotorStalled {
        /// Index of the area.
        area: usize,
        /// The motor.
        motor: Motor,
        /// The value of its counter.
        position: u16,
    },
    /// A joystick of an infrared remote was moved since the previous response of the same transfer.
    ///
    /// Each remote gives two events, one as [`IrDevice::Any`] and one for its switch setting.
    #[doc(alias = "tCbTaJoyStick")]
    #[non_exhaustive]
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
    /// An extension was connected or disconnected since the previous response of the same transfer. (The maker's
    /// firmware 4.7.0, measured under emulation, looks for extensions only when a transfer begins.) While it
    /// is disconnected, its inputs keep their last values.
    #[doc(alias = "SetCBRoboExtState")]
    #[non_exhaustive]
    ExtensionChanged {
        /// The extension, 1..=8. This is also the index of its area, if the handler has that area.
        extension: usize,
        /// Whether it is now connected.
        alive: bool,
    },
    /// The connection was lost and is being re-established: all outputs in the areas are 0 and all commands
    /// forgotten. Motors may go on until the connection is back.
    ///
    /// Only in a transfer that [reconnects](crate::TransferAreaComHandlerBuilder::reconnect).
    #[non_exhaustive]
    ConnectionLost {
        /// What went wrong with it.
        error: Error,
    },
    /// A lost connection was re-established. Another controller than before may answer at the same address.
    #[non_exhaustive]
    ConnectionRestored {
        /// How long it was lost.
        after: Duration,
        /// The name of the controller that answers now.
        device_name: String,
        /// The version of its firmware.
        firmware: FirmwareVersion,
        /// Its address and port, as the operating system has connected to it: a name may have several addresses. `None` if
        /// that can't say it.
        address: Option<SocketAddr>,
    },
    /// The [watchdog](crate::TransferAreaComHandlerBuilder::watchdog) has expired: all outputs are 0 until
    /// a call has returned [`Error::WatchdogExpired`].
    #[non_exhaustive]
    WatchdogExpired {
        /// For how long the program has shown no sign of life.
        limit: Duration,
    },
    /// The transfer has ended, and its motors are stopped if a last exchange has arrived. Comes to every listener.
    #[non_exhaustive]
    TransferEnded {
        /// The error that ended it; `None` when it was ended by the program.
        error: Option<Error>,
    },
}

/// An event, and when it came.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct TimedEvent {
    /// What has happened.
    pub event: Event,
    /// The number of the response that it comes from, as
    /// [`TransferAreaGuard::cycle`](crate::TransferAreaGuard::cycle) counts. For an event that comes from no
    /// response, such as a lost connection: the number of the last response before it.
    pub cycle: u64,
    /// When that response came in; for an event that comes from no response, when it happened.
    pub arrived: Instant,
}

/// One of a remote's two joysticks. A remote has only these two, so this enum is exhaustive.
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

/// Makes the kinds of events, each with the name of its event.
macro_rules! kinds {
    ($($kind:ident: of_response $of_response:literal),+ $(,)?) => {
        /// The kinds of [`Event`], with the same names. Later versions may add kinds.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        #[non_exhaustive]
        #[allow(missing_docs, reason = "the events of the same names say what they are")]
        pub enum EventKind {
            $($kind),+
        }

        impl EventKind {
            /// All of them.
            pub const ALL: &'static [Self] = &[$(Self::$kind),+];

            /// Its name, as `InputChanged`.
            pub const fn name(self) -> &'static str {
                match self {
                    $(Self::$kind => stringify!($kind)),+
                }
            }

            /// Whether such events come from responses. The others are about the transfer itself, and a
            /// [`CycleLog`](crate::CycleLog) has them, too.
            pub const fn is_of_response(self) -> bool {
                match self {
                    $(Self::$kind => $of_response),+
                }
            }
        }

        impl Event {
            /// The kind of this event, to subscribe to it.
            pub fn kind(&self) -> EventKind {
                match self {
                    $(Self::$kind { .. } => EventKind::$kind),+
                }
            }
        }
    };
}

kinds! {
    InputChanged: of_response true,
    CounterChanged: of_response true,
    CounterReset: of_response true,
    MotorReached: of_response true,
    MotorStalled: of_response true,
    JoystickMoved: of_response true,
    ExtensionChanged: of_response true,
    ConnectionLost: of_response false,
    ConnectionRestored: of_response false,
    WatchdogExpired: of_response false,
    TransferEnded: of_response false,
}

/// Where an event has happened, and with which value: the same for all kinds, for recorders and tables.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct EventDetails {
    /// Index of the area; of an extension that was connected or disconnected, its number.
    pub area: usize,
    /// What has changed, as `I1`, or `Any.Left` of a joystick; empty for a whole extension.
    pub terminal: String,
    /// Its new value, its position, or the id of its command; of a joystick, left to right.
    pub value: i64,
    /// Of a joystick: backwards to forward.
    pub y: Option<i64>,
}

impl Event {
    /// Where it has happened, and with which value; `None` for an event that comes from no response.
    pub fn details(&self) -> Option<EventDetails> {
        let (area, terminal, value, y) = match self {
            Self::InputChanged { area, input, pressed } => {
                (*area, input.to_string(), (*pressed).into(), None)
            }
            Self::CounterChanged { area, counter, count } => {
                (*area, counter.to_string(), (*count).into(), None)
            }
            Self::CounterReset { area, counter, command_id } => {
                (*area, counter.to_string(), (*command_id).into(), None)
            }
            Self::MotorReached { area, motor, position, command_id: _ }
            | Self::MotorStalled { area, motor, position } => {
                (*area, motor.to_string(), (*position).into(), None)
            }
            Self::JoystickMoved { area, device, joystick, x, y } => {
                (*area, format!("{device:?}.{joystick:?}"), (*x).into(), Some((*y).into()))
            }
            Self::ExtensionChanged { extension, alive } => {
                (*extension, String::new(), (*alive).into(), None)
            }
            Self::ConnectionLost { .. }
            | Self::ConnectionRestored { .. }
            | Self::WatchdogExpired { .. }
            | Self::TransferEnded { .. } => return None,
        };
        Some(EventDetails { area, terminal, value, y })
    }
}

/// A set of kinds of events.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct KindSet(u16);

impl KindSet {
    pub(crate) fn is_empty(self) -> bool {
        self.0 == 0
    }

    pub(crate) fn contains(self, kind: EventKind) -> bool {
        self.0 & 1 << kind as u8 != 0
    }

    pub(crate) fn union(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}

impl FromIterator<EventKind> for KindSet {
    fn from_iter<T: IntoIterator<Item = EventKind>>(kinds: T) -> Self {
        Self(kinds.into_iter().fold(0, |set, kind| set | 1 << kind as u8))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn events_of_responses_have_details_and_others_have_none() {
        let moved = Event::JoystickMoved {
            area: 1,
            device: IrDevice::OnOff,
            joystick: Joystick::Left,
            x: -15,
            y: 3,
        };
        let terminal = "OnOff.Left".to_owned();
        let details = EventDetails { area: 1, terminal, value: -15, y: Some(3) };
        assert_eq!(moved.details(), Some(details));
        let plugged = Event::ExtensionChanged { extension: 2, alive: true };
        let details = EventDetails { area: 2, terminal: String::new(), value: 1, y: None };
        assert_eq!(plugged.details(), Some(details));
        let ended = Event::TransferEnded { error: None };
        assert_eq!(ended.details(), None);
        assert_eq!((moved.kind().name(), ended.kind().name()), ("JoystickMoved", "TransferEnded"));
        for event in [moved, plugged, ended] {
            assert_eq!(event.kind().is_of_response(), event.details().is_some(), "{event:?}");
        }
    }
}
