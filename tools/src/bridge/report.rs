//! What a bridge publishes about itself, and lines for the person at the screen.

use std::collections::BTreeMap;
use std::time::Duration;

use ft_transfer_area::{Event, EventKind};
use serde::Serialize;

use super::broker::random;
use crate::lines;
use crate::print::clean;

/// The events that the bridge publishes: changes of inputs as values, the others as [`PublishedEvent`].
pub(crate) const TOLD: [EventKind; 5] = [
    EventKind::InputChanged,
    EventKind::CounterReset,
    EventKind::MotorReached,
    EventKind::MotorStalled,
    EventKind::ConnectionRestored,
];

/// The events that it does not publish: values and its own state say the same.
const NOT_TOLD: [EventKind; 6] = [
    EventKind::CounterChanged,
    EventKind::JoystickMoved,
    EventKind::ExtensionChanged,
    EventKind::ConnectionLost,
    EventKind::WatchdogExpired,
    EventKind::TransferEnded,
];

/// A new kind has to be put into one of the two.
const _: () = assert!(TOLD.len() + NOT_TOLD.len() == EventKind::ALL.len());

/// The state of a bridge, as the payload of its topic.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(crate) struct State {
    pub(crate) state: Stage,
    /// Why it is not online.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) reason: Option<String>,
    /// The address of the controller.
    pub(crate) host: String,
    /// The name that its owner gave it, when it has answered.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) device: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) firmware: Option<String>,
    /// What people call the terminals, by their topics.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub(crate) names: BTreeMap<String, String>,
    /// A number for each bridge, to distinguish two of the same name.
    pub(crate) bridge: String,
}

impl State {
    /// Of a bridge that has just been started.
    pub(crate) fn at_start(host: &str, names: &BTreeMap<String, String>) -> Self {
        Self {
            state: Stage::Ended,
            reason: Some("the bridge has just been started".to_owned()),
            host: host.to_owned(),
            device: None,
            firmware: None,
            names: names.clone(),
            bridge: format!("{:016x}", random()),
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Stage {
    /// Inputs come in, and commands are carried out.
    Online,
    /// The connection to the controller was lost and is being re-established.
    Gap,
    /// There is no connection to the controller; the bridge tries again.
    Ended,
    /// The bridge has ended, or has lost the broker.
    Gone,
}

/// Something that has happened once.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "event", rename_all = "snake_case")]
pub(crate) enum PublishedEvent {
    MotorReached {
        motor: String,
        position: u16,
    },
    /// It should turn, and its counter does not change.
    MotorStalled {
        motor: String,
        position: u16,
    },
    CounterReset {
        counter: String,
    },
    /// The bridge has stopped all motors.
    Stopped {
        reason: String,
    },
    /// The controller was away for this time.
    Restored {
        after_ms: u64,
    },
    /// More changes came than could be published.
    Lost {
        changes: u64,
    },
}

/// Whether somebody controls the machine.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub(crate) struct Master {
    pub(crate) alive: bool,
}

/// The answer to a command that was not carried out.
#[derive(Debug, Serialize)]
pub(crate) struct Complaint<'a> {
    pub(crate) topic: &'a str,
    pub(crate) error: &'a str,
}

impl PublishedEvent {
    /// What is published for an event of the transfer; `None` for what is published in another way.
    pub(crate) fn new(event: &Event) -> Option<Self> {
        Some(match event {
            Event::MotorReached { area, motor, position, .. } => {
                Self::MotorReached { motor: place(*area, motor), position: *position }
            }
            Event::MotorStalled { area, motor, position, .. } => {
                Self::MotorStalled { motor: place(*area, motor), position: *position }
            }
            Event::CounterReset { area, counter, .. } => {
                Self::CounterReset { counter: place(*area, counter) }
            }
            Event::ConnectionRestored { after, .. } => Self::Restored { after_ms: millis(*after) },
            _ => return None,
        })
    }
}

/// A terminal as in topics: `M1`, `ext1/M1`.
fn place(area: usize, terminal: impl std::fmt::Display) -> String {
    match area {
        0 => terminal.to_string(),
        _ => format!("ext{area}/{terminal}"),
    }
}

fn millis(duration: Duration) -> u64 {
    u64::try_from(duration.as_millis()).unwrap_or(u64::MAX)
}

/// The JSON text of what cannot fail to have one.
pub(crate) fn json(payload: &impl Serialize) -> String {
    serde_json::to_string(payload).unwrap_or_default()
}

/// Prints a line about one controller. What others have sent may be in it, and makes no lines of its own.
pub(crate) fn say(name: &str, line: &str) {
    lines::print(&format!("{name}: {}", clean(line)));
}
