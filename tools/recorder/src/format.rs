//! What is in a file: its head, its topics and its messages.

use std::net::SocketAddr;
use std::time::Duration;

use ft_transfer_area::{Event, LoggedBeginning, TimedEvent, PORT};
use serde::{Deserialize, Serialize};
use serde_json::{json, Value};

/// The newest version of the format. It changes when an older reader would read something wrong.
pub(crate) const FORMAT: u32 = 1;
/// The MCAP profile of a recording.
pub(crate) const PROFILE: &str = "ft-transfer-area";
/// The name of the metadata record, which is the first record after the header.
pub(crate) const HEAD: &str = "recording";
pub(crate) const HEAD_FORMAT: &str = "format";
/// When it was started, in nanoseconds since 1970.
pub(crate) const HEAD_STARTED: &str = "started_ns";
/// In place of a time that has more nanoseconds since 1970, as after the year 2554.
pub(crate) const NO_TIME: u64 = u64::MAX;

pub(crate) const CYCLE: &str = "/cycle";
pub(crate) const TRANSFER: &str = "/transfer";
pub(crate) const EVENTS: &str = "/events";
pub(crate) const STATISTICS: &str = "/statistics";
pub(crate) const LOG: &str = "/log";
pub(crate) const CAMERA: &str = "/camera";

/// The name of the controller with this index: `TXT`, `E1` to `E8`.
pub(crate) fn controller(area: usize) -> String {
    if area == 0 {
        "TXT".to_owned()
    } else {
        format!("E{area}")
    }
}

/// The topic of a part of a controller.
pub(crate) fn topic(area: usize, part: &str) -> String {
    format!("/{}/{part}", controller(area))
}

/// One cycle. It follows the parts of all its areas.
#[derive(Debug, Deserialize, Serialize)]
pub(crate) struct CycleMessage {
    pub(crate) cycle: u64,
    /// The time since the last response of this connection; 0 for its first.
    pub(crate) cycle_ms: f64,
    /// 1 for the first of its connection.
    pub(crate) first: u8,
    pub(crate) areas: usize,
    /// The extensions that took part, bit 0 the first.
    pub(crate) extensions: u16,
    /// Entries that were lost directly before.
    pub(crate) lost: u64,
}

/// How long each text of a [`Transfer`] may be, in bytes.
pub(crate) const LONGEST_TEXT: usize = 1024;

/// What has happened to a transfer. Texts are recorded up to 1 KiB each.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(tag = "what", rename_all = "snake_case")]
#[non_exhaustive]
pub enum Transfer {
    /// It has begun, or was running when the recording was started.
    Began {
        /// The name of the controller.
        device_name: String,
        /// The version of its firmware, as `4.6.6`. It is empty, as the name, when the controller was not asked.
        firmware: String,
        /// Its address, with the port unless that is 65000; empty if it is not known.
        address: String,
        /// How many areas the handler has.
        areas: usize,
    },
    /// It could not begin.
    Failed(Failure),
    /// The connection was lost and is being re-established.
    Lost(Failure),
    /// The connection is re-established.
    Restored {
        /// After this time in ms.
        after_ms: u64,
        /// The name of the controller that answers now, which may be another one; empty in an older file.
        #[serde(default)]
        device_name: String,
        /// The version of its firmware; empty in an older file.
        #[serde(default)]
        firmware: String,
        /// Its address, as in `Began`; empty in an older file.
        #[serde(default)]
        address: String,
    },
    /// The watchdog has stopped the motors.
    WatchdogExpired {
        /// Its limit in ms.
        limit_ms: u64,
    },
    /// Entries before this are missing, because the disk was too slow. Of those directly before a cycle, the cycle
    /// says it: [`Cycle::lost`](crate::Cycle::lost).
    NotRecorded {
        /// How many.
        entries: u64,
    },
    /// It was ended by the program.
    Ended,
    /// It was ended by an error.
    EndedBy(Failure),
}

impl Transfer {
    fn texts(&mut self) -> Vec<&mut String> {
        match self {
            Self::Began { device_name, firmware, address, .. }
            | Self::Restored { device_name, firmware, address, .. } => {
                vec![device_name, firmware, address]
            }
            Self::Failed(why) | Self::Lost(why) | Self::EndedBy(why) => vec![&mut why.error],
            Self::WatchdogExpired { .. } | Self::NotRecorded { .. } | Self::Ended => Vec::new(),
        }
    }

    /// With the beginnings of texts that are too long.
    pub(crate) fn cut(mut self) -> Self {
        for text in self.texts() {
            let is_end = |end: &usize| text.is_char_boundary(*end);
            let end = (0..=text.len().min(LONGEST_TEXT)).rev().find(is_end);
            text.truncate(end.unwrap_or(0));
            text.shrink_to_fit();
        }
        self
    }
}

/// With its port, unless that is the usual one.
fn address_text(address: SocketAddr) -> String {
    if address.port() == PORT {
        address.ip().to_string()
    } else {
        address.to_string()
    }
}

impl From<&LoggedBeginning> for Transfer {
    fn from(began: &LoggedBeginning) -> Self {
        Self::Began {
            device_name: began.device_name.clone(),
            firmware: began.firmware.to_string(),
            address: began.address.map(address_text).unwrap_or_default(),
            areas: began.areas,
        }
    }
}

impl Transfer {
    /// What an event tells that comes from no response; `None` for any other.
    pub(crate) fn of_event(event: &Event) -> Option<Self> {
        let millis = |time: &Duration| u64::try_from(time.as_millis()).unwrap_or(u64::MAX);
        Some(match event {
            Event::ConnectionLost { error, .. } => Self::Lost(Failure::from(error)),
            Event::ConnectionRestored { after, device_name, firmware, address, .. } => {
                Self::Restored {
                    after_ms: millis(after),
                    device_name: device_name.clone(),
                    firmware: firmware.to_string(),
                    address: address.map(address_text).unwrap_or_default(),
                }
            }
            Event::WatchdogExpired { limit, .. } => {
                Self::WatchdogExpired { limit_ms: millis(limit) }
            }
            Event::TransferEnded { error: Some(error), .. } => Self::EndedBy(Failure::from(error)),
            Event::TransferEnded { .. } => Self::Ended,
            _ => return None,
        })
    }
}

/// An error of a transfer.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize, Serialize)]
pub struct Failure {
    /// What kind of error it is.
    pub kind: FailureKind,
    /// What it says.
    pub error: String,
}

/// Kinds of errors, by what the controller did.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum FailureKind {
    /// It did not answer in time.
    NoAnswer,
    /// It sent something wrong.
    WrongData,
    /// The connection has ended.
    Closed,
    /// Anything else, such as a panic of the program.
    #[serde(other)]
    Other,
}

impl From<&ft_transfer_area::Error> for Failure {
    fn from(error: &ft_transfer_area::Error) -> Self {
        use ft_transfer_area::Error::*;

        let kind = match error {
            NoAnswer { .. } => FailureKind::NoAnswer,
            WrongId { .. }
            | WrongSize { .. }
            | TooLarge { .. }
            | DataEndsEarly { .. }
            | WrongCrc { .. } => FailureKind::WrongData,
            ConnectionClosed { .. } | Io { .. } | ReconnectFailed { .. } => FailureKind::Closed,
            _ => FailureKind::Other,
        };
        Self { kind, error: format!("{error:#}") }
    }
}

/// An event, as it was reported to listeners.
#[derive(Clone, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
#[non_exhaustive]
pub struct RecordedEvent {
    /// Its kind, as `InputChanged`.
    pub event: String,
    /// `TXT`, `E1` to `E8`.
    pub controller: String,
    /// What has changed, as `I1`; empty for an extension.
    pub terminal: String,
    /// Its new value, its position, or the id of its command.
    pub value: i64,
    /// Of a joystick: backwards to forward. Its `value` is left to right.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub y: Option<i64>,
    /// The cycle of its response.
    pub cycle: u64,
}

impl From<&TimedEvent> for RecordedEvent {
    fn from(reported: &TimedEvent) -> Self {
        let mut message = Self {
            event: reported.event.kind().name().to_owned(),
            cycle: reported.cycle,
            ..Self::default()
        };
        if let Some(details) = reported.event.details() {
            message.controller = controller(details.area);
            message.terminal = details.terminal;
            (message.value, message.y) = (details.value, details.y);
        }
        message
    }
}

/// What was counted of the transfer until then, once a second. A file that begins within a transfer, such as the next part
/// of a recording, begins with those from before; older ones do not.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize, Serialize)]
#[serde(default)]
#[non_exhaustive]
pub struct RecordedStatistics {
    /// Responses of this transfer.
    pub cycles: u64,
    /// Reactions of the program whose outputs went out a request later, or more.
    pub late_reactions: u64,
    /// How often the connection was lost and re-established.
    pub gaps: u64,
    /// Configurations that were sent.
    pub config_updates: u64,
    /// The shortest time from one response to the next.
    pub shortest_cycle_ms: f64,
    /// The longest one.
    pub longest_cycle_ms: f64,
    /// Entries of this recording that were lost because the disk was too slow.
    pub lost_entries: u64,
    /// Events that were lost.
    pub lost_events: u64,
    /// Pictures that were lost.
    pub lost_frames: u64,
}

#[derive(Debug, Deserialize, Serialize)]
pub(crate) struct Timestamp {
    sec: u64,
    nsec: u32,
}

impl Timestamp {
    pub(crate) fn new(ns: u64) -> Self {
        let time = Duration::from_nanos(ns);
        Self { sec: time.as_secs(), nsec: time.subsec_nanos() }
    }
}

/// A `foxglove.Log`.
#[derive(Debug, Serialize)]
pub(crate) struct LogMessage<'a> {
    pub(crate) timestamp: Timestamp,
    pub(crate) level: u8,
    pub(crate) message: String,
    pub(crate) name: &'a str,
    pub(crate) file: &'a str,
    pub(crate) line: u32,
}

/// Levels of a `foxglove.Log`.
pub(crate) const INFO: u8 = 2;
pub(crate) const WARNING: u8 = 3;
pub(crate) const ERROR: u8 = 4;

/// A `foxglove.CompressedImage`.
#[derive(Debug, Deserialize, Serialize)]
pub(crate) struct ImageMessage {
    pub(crate) timestamp: Timestamp,
    pub(crate) frame_id: String,
    /// In base64.
    pub(crate) data: String,
    pub(crate) format: String,
}

/// The topics that no controller has: name of the schema, and the schema.
pub(crate) fn schema_of(topic: &str) -> (&'static str, Value) {
    let integer = || json!({ "type": "integer" });
    let number = || json!({ "type": "number" });
    let string = || json!({ "type": "string" });
    let time = || {
        json!({ "type": "object", "title": "time",
        "properties": { "sec": integer(), "nsec": integer() } })
    };
    let object = |properties: Value| json!({ "type": "object", "properties": properties });
    match topic {
        CYCLE => (
            "ft.Cycle",
            object(json!({ "cycle": integer(), "cycle_ms": number(), "first": integer(),
                "areas": integer(), "extensions": integer(), "lost": integer() })),
        ),
        TRANSFER => (
            "ft.Transfer",
            object(json!({ "what": string(), "device_name": string(), "firmware": string(),
                "address": string(), "areas": integer(), "kind": string(), "error": string(),
                "after_ms": integer(), "limit_ms": integer(), "entries": integer() })),
        ),
        EVENTS => (
            "ft.Event",
            object(json!({ "event": string(), "controller": string(), "terminal": string(),
                "value": integer(), "y": integer(), "cycle": integer() })),
        ),
        STATISTICS => (
            "ft.Statistics",
            object(json!({ "cycles": integer(), "late_reactions": integer(), "gaps": integer(),
                "config_updates": integer(), "shortest_cycle_ms": number(),
                "longest_cycle_ms": number(), "lost_entries": integer(),
                "lost_events": integer(), "lost_frames": integer() })),
        ),
        LOG => (
            "foxglove.Log",
            object(json!({ "timestamp": time(), "level": integer(), "message": string(),
                "name": string(), "file": string(), "line": integer() })),
        ),
        _ => (
            "foxglove.CompressedImage",
            object(json!({ "timestamp": time(), "frame_id": string(), "format": string(),
                "data": { "type": "string", "contentEncoding": "base64" } })),
        ),
    }
}
