//! Events: what responses and the transfer's end tell, on channels.

mod listeners;
mod watch;

use std::fmt;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::Arc;
use std::time::Duration;

use crossbeam_channel::{Iter, Receiver, RecvError, RecvTimeoutError};

pub(super) use listeners::Listeners;
pub(super) use watch::Comparison;

use super::shared::Shared;
use super::{TransferArea, TransferAreaComHandler};
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
    TransferEnded,
}

impl EventKind {
    /// All of them.
    pub const ALL: [Self; 7] = [
        Self::InputChanged,
        Self::CounterChanged,
        Self::CounterReset,
        Self::MotorReached,
        Self::JoystickMoved,
        Self::ExtensionChanged,
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
            Self::TransferEnded { .. } => EventKind::TransferEnded,
        }
    }
}

/// A set of kinds of events.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct KindSet(u8);

impl KindSet {
    pub(super) fn is_empty(self) -> bool {
        self.0 == 0
    }

    fn contains(self, kind: EventKind) -> bool {
        self.0 & 1 << kind as u8 != 0
    }

    fn union(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}

impl FromIterator<EventKind> for KindSet {
    fn from_iter<T: IntoIterator<Item = EventKind>>(kinds: T) -> Self {
        Self(kinds.into_iter().fold(0, |set, kind| set | 1 << kind as u8))
    }
}

/// Events of the kinds that were subscribed to, in the order in which they happened; made by
/// [`TransferAreaComHandler::events`].
///
/// The subscription outlasts a transfer's end and is there for the next one. The channel ends when
/// the handler is dropped, so that a loop over it ends. Dropping this unsubscribes.
///
/// ```
/// use std::thread;
///
/// use ft_transfer_area::tx::Input;
/// use ft_transfer_area::{Error, Event, EventKind, TransferAreaComHandler};
///
/// fn print_switches(handler: &TransferAreaComHandler) -> Result<(), Error> {
///     let events = handler.events(&[EventKind::InputChanged, EventKind::TransferEnded], 100)?;
///     thread::spawn(move || {
///         for event in &events {
///             match event {
///                 Event::InputChanged { input: Input::I1, pressed: true, .. } => println!("I1!"),
///                 Event::TransferEnded { error: Some(error) } => println!("{error}"),
///                 _ => {}
///             }
///         }
///         println!("{} events were lost", events.lost());
///     });
///     Ok(())
/// }
/// ```
pub struct Events {
    receiver: Receiver<Event>,
    lost: Arc<AtomicU64>,
    shared: Arc<Shared>,
}

impl Events {
    /// The most events that a channel can be made to hold.
    pub const MAX_CAPACITY: usize = 65_536;

    /// The channel itself, for `select!`, for waiting in other ways, and for other threads.
    pub fn receiver(&self) -> &Receiver<Event> {
        &self.receiver
    }

    /// The next event. Blocks until there is one.
    ///
    /// # Errors
    ///
    /// When the handler was dropped and all events have been received.
    pub fn recv(&self) -> Result<Event, RecvError> {
        self.receiver.recv()
    }

    /// The next event. Blocks up to `limit`.
    ///
    /// # Errors
    ///
    /// When there was none in time, or the handler was dropped and all events have been received.
    pub fn recv_timeout(&self, limit: Duration) -> Result<Event, RecvTimeoutError> {
        self.receiver.recv_timeout(limit)
    }

    /// How many events were dropped so far because the channel was full.
    pub fn lost(&self) -> u64 {
        self.lost.load(Ordering::Relaxed)
    }
}

/// Each step blocks until there is an event; the end comes when the handler was dropped.
impl<'a> IntoIterator for &'a Events {
    type Item = Event;
    type IntoIter = Iter<'a, Event>;

    fn into_iter(self) -> Self::IntoIter {
        self.receiver.iter()
    }
}

impl fmt::Debug for Events {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { receiver, lost, .. } = self;
        f.debug_struct("Events")
            .field("receiver", receiver)
            .field("lost", lost)
            .finish_non_exhaustive()
    }
}

impl Drop for Events {
    fn drop(&mut self) {
        self.shared.unsubscribe(&self.lost);
    }
}

impl TransferArea {
    /// Subscribes to events of these kinds, on a channel that holds up to `capacity` of them,
    /// 1..=[`Events::MAX_CAPACITY`]. Takes what FtTxtLib's callbacks told; see [`Event`].
    ///
    /// An event is told when what a response or the end of the transfer says differs from what was
    /// known when this was called. It comes after that is in the areas: a listener that locks them
    /// finds it there, and what it writes goes out in the next request when it does so within the
    /// reaction window. Threads in [`wait_cycle`](Self::wait_cycle) that are done sooner end
    /// that sooner, so a listener that is to answer at once had better wait there.
    ///
    /// The transfer thread does not wait for a listener. While the channel is full, new events are
    /// dropped and [counted](Events::lost); those in it stay, in order. For
    /// [`Event::TransferEnded`] there is one more place, so that it comes even then, unless that of
    /// an earlier transfer is still in it.
    ///
    /// There is nothing to be had from a handle whose handler is gone: the channel has ended.
    ///
    /// # Errors
    ///
    /// [`Error::OutOfRange`] for the capacity.
    #[doc(alias = "SetFtCbJoyStick")]
    pub fn events(&self, kinds: &[EventKind], capacity: usize) -> Result<Events, Error> {
        Error::check_range("capacity for events", capacity, 1..=Events::MAX_CAPACITY as i64)?;
        Ok(self.shared().subscribe(kinds.iter().copied().collect(), capacity))
    }
}

impl TransferAreaComHandler {
    /// Subscribes to events. See [`TransferArea::events`].
    ///
    /// # Errors
    ///
    /// [`Error::OutOfRange`] for the capacity.
    #[doc(alias = "SetFtCbJoyStick")]
    pub fn events(&self, kinds: &[EventKind], capacity: usize) -> Result<Events, Error> {
        self.area.events(kinds, capacity)
    }
}
