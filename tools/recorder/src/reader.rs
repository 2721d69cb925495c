//! Reads recordings.

use std::collections::HashMap;
use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use base64::prelude::{Engine, BASE64_STANDARD};
use ft_transfer_area::transfer_area::{MAX_AREAS, MAX_EXTENSIONS};
use ft_transfer_area::FishX1Transfer;
use mcap::records::op;
use serde::de::DeserializeOwned;

use crate::damage::Damage;
use crate::error::Error;
use crate::format::{
    topic, CycleMessage, ImageMessage, RecordedEvent, RecordedStatistics, Transfer, CAMERA, CYCLE,
    EVENTS, FORMAT, HEAD, HEAD_FORMAT, HEAD_STARTED, NO_TIME, PROFILE, STATISTICS, TRANSFER,
};
use crate::part::{self, parts, Part};
use crate::records::{self, Found, Records};

/// A recording, read from its beginning to its end.
///
/// It is an iterator over its entries, in the order in which they were recorded, and needs little memory however
/// long the recording is. A file that is cut off gives what was written before, as
/// [`is_cut_off`](Self::is_cut_off) says afterwards; one that is damaged gives what is right, and
/// [`damage`](Self::damage) says what is missing.
///
/// ```no_run
/// use ft_transfer_area_recorder::{Error, Recorded, Recording};
///
/// fn print(path: &str) -> Result<(), Error> {
///     for entry in Recording::open(path)? {
///         let entry = entry?;
///         if let Recorded::Cycle(cycle) = entry.what {
///             println!("{:.3} s: I1 is {}", entry.at.as_secs_f64(), cycle.areas[0].input.uni[0]);
///         }
///     }
///     Ok(())
/// }
/// ```
pub struct Recording {
    path: PathBuf,
    records: Records<File>,
    started: u64,
    parts: Vec<Part>,
    /// By the id of the channel.
    channels: HashMap<u16, Channel>,
    /// The areas as of the parts that were read last.
    areas: Vec<FishX1Transfer>,
    has_cut_off: bool,
    damage: Option<Damage>,
    /// Whether the channels that are missing were looked for in the rest of the file.
    has_looked_ahead: bool,
    /// Of the last entry.
    last: Duration,
    at_end: bool,
}

/// A place in a recording, to come back to: the piece, of at most half a second, in which an entry was written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Place(u64);

/// An entry of a recording.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Entry {
    /// The time since the recording was started. 0 for what was before.
    pub at: Duration,
    /// What has happened.
    pub what: Recorded,
}

/// What an [`Entry`] has.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub enum Recorded {
    /// A request was sent, and its response came in.
    Cycle(Cycle),
    /// What has happened to the transfer.
    Transfer(Transfer),
    /// An event.
    Event(RecordedEvent),
    /// What was counted, once a second.
    Statistics(RecordedStatistics),
    /// A picture of the camera: JPEG.
    Picture(Vec<u8>),
    /// What comes next is damaged and left out. The time is that of the entry before.
    Missing,
}

/// One cycle.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Cycle {
    /// Its number in its transfer, from 1.
    pub number: u64,
    /// Whether it is the first of its connection.
    pub first: bool,
    /// How many entries were lost directly before it.
    pub lost: u64,
    /// The time since the response before, on the same connection; 0 for the first.
    pub since_last: Duration,
    /// The outputs that were sent, and the inputs that came in. What is not recorded is as in a new area.
    pub areas: Vec<FishX1Transfer>,
}

impl Cycle {
    /// All values of a controller, 0 the master and 1 the first extension, in the order of
    /// [`value_names`](crate::value_names); `None` if the handler has no area for it.
    pub fn values(&self, area: usize) -> Option<Vec<i32>> {
        self.areas.get(area).map(part::values)
    }
}

#[derive(Clone, Copy, Debug)]
enum Channel {
    Part {
        area: usize,
        part: usize,
    },
    Cycle,
    Transfer,
    Events,
    Statistics,
    Camera,
    /// For people, or of a newer version.
    Other,
}

impl Recording {
    /// Opens a recording and reads its head.
    ///
    /// # Errors
    ///
    /// The file can't be read, is empty, or is something else.
    pub fn open(path: impl AsRef<Path>) -> Result<Self, Error> {
        let path = path.as_ref().to_owned();
        let file = File::open(&path).map_err(|cause| Error::Read { path: path.clone(), cause })?;
        Self::of(path, file)
    }

    /// Begins anew, with the file that was opened: another one may have its name by now.
    ///
    /// # Errors
    ///
    /// The file can't be read again, as a pipe.
    pub fn rewind(&mut self) -> Result<(), Error> {
        let file = self.records.rewound().map_err(|cause| self.unreadable(cause))?;
        let again = Self::of(self.path.clone(), file)?;
        // A place behind their descriptions may be next.
        let channels = std::mem::take(&mut self.channels);
        *self = Self { channels, ..again };
        Ok(())
    }

    /// Where the last entry is.
    pub fn place(&self) -> Place {
        Place(self.records.chunk())
    }

    /// Leaves out what is before a place that was reached earlier, without looking into it: what is wrong there is not
    /// found. At the place, what comes first may be up to half a second older than the entry that was there. A place
    /// before the present one changes nothing, and `None` goes to the end.
    pub fn skip_to(&mut self, place: Option<Place>) {
        self.records.skip_to(place.map_or(u64::MAX, |place| place.0));
    }

    fn of(path: PathBuf, file: File) -> Result<Self, Error> {
        let mut recording = Self {
            path,
            records: Records::of(file),
            started: 0,
            parts: parts(),
            channels: HashMap::new(),
            areas: vec![FishX1Transfer::default(); MAX_AREAS],
            has_cut_off: false,
            damage: None,
            has_looked_ahead: false,
            last: Duration::ZERO,
            at_end: false,
        };
        recording.read_head()?;
        Ok(recording)
    }

    /// When it was started.
    pub fn started(&self) -> SystemTime {
        SystemTime::UNIX_EPOCH + Duration::from_nanos(self.started)
    }

    /// Whether the file ended early, as after the end of a program that was killed. Known when the iterator has
    /// ended.
    pub fn is_cut_off(&self) -> bool {
        self.has_cut_off
    }

    /// What is missing until now because the file is damaged. All of it is known when the iterator has ended.
    pub fn damage(&self) -> Option<&Damage> {
        self.damage.as_ref()
    }

    fn read_head(&mut self) -> Result<(), Error> {
        let path = self.path.clone();
        let no_head = || Error::Damaged { path: path.clone(), cause: "it has no head".to_owned() };
        let mut next = || match self.records.next() {
            Ok(Found::Record(opcode, data)) => Ok((opcode, data)),
            Ok(Found::Damaged { .. }) => Err(Error::NotMcap { path: path.clone() }),
            Ok(Found::End { .. }) => Err(Error::Empty { path: path.clone() }),
            Err(cause) => Err(Error::Read { path: path.clone(), cause }),
        };
        let (opcode, header) = next()?;
        match records::header(&header).filter(|_| opcode == op::HEADER) {
            Some((PROFILE, _)) => {}
            Some((_, library)) => {
                return Err(Error::OtherMcap { path, library: library.to_owned() });
            }
            None => return Err(no_head()),
        }
        let (opcode, head) = next()?;
        let head =
            records::metadata(&head).filter(|(name, _)| opcode == op::METADATA && *name == HEAD);
        let (_, values) = head.ok_or_else(no_head)?;
        let value =
            |wanted| values.iter().find(|(name, _)| *name == wanted).map_or("", |found| found.1);
        let format = value(HEAD_FORMAT);
        if !format.parse().is_ok_and(|format: u32| format <= FORMAT) {
            return Err(Error::Newer { path, format: format.to_owned() });
        }
        let started = value(HEAD_STARTED);
        self.started =
            started.parse().ok().filter(|started| *started != NO_TIME).ok_or_else(|| {
                let cause = format!(
                    "it was started {started:?} ns after 1970, which is no time up to the year 2554"
                );
                Error::Damaged { path: path.clone(), cause }
            })?;
        Ok(())
    }

    fn next_entry(&mut self) -> Result<Option<Entry>, Error> {
        loop {
            let found = self.records.next().map_err(|cause| self.unreadable(cause))?;
            let entry = match found {
                Found::Record(opcode, data) => self.take(opcode, &data),
                Found::Damaged { bytes, cause } => Err((bytes, cause)),
                Found::End { is_cut_off } => {
                    self.has_cut_off = is_cut_off;
                    return Ok(None);
                }
            };
            match entry {
                Ok(None) => {}
                Ok(Some(entry)) => {
                    self.last = entry.at;
                    if let Some(damage) = &mut self.damage {
                        damage.before.get_or_insert(entry.at);
                    }
                    return Ok(Some(entry));
                }
                Err((bytes, cause)) => {
                    Damage::add(&mut self.damage, bytes, cause, self.last);
                    return Ok(Some(Entry { at: self.last, what: Recorded::Missing }));
                }
            }
        }
    }

    /// The entry of a record, if it is one. If it makes no sense, the rest of its chunk is left out.
    fn take(&mut self, opcode: u8, data: &[u8]) -> Result<Option<Entry>, (u64, String)> {
        self.entry(opcode, data).map_err(|cause| (self.records.leave_chunk(), cause))
    }

    fn entry(&mut self, opcode: u8, data: &[u8]) -> Result<Option<Entry>, String> {
        let short = "a record is shorter than it says";
        match opcode {
            op::CHANNEL => {
                let (id, topic) = records::channel(data).ok_or(short)?;
                self.channels.insert(id, self.meaning(topic));
                Ok(None)
            }
            op::MESSAGE => {
                let (id, time, message) = records::message(data).ok_or(short)?;
                let channel = self.channel(id)?;
                let what = self.message(channel, message)?;
                let at = Duration::from_nanos(time.saturating_sub(self.started));
                Ok(what.map(|what| Entry { at, what }))
            }
            _ => Ok(None),
        }
    }

    /// The channel with this id. When the part of the file is damaged that says what it is, what follows does.
    fn channel(&mut self, id: u16) -> Result<Channel, String> {
        if self.damage.is_some() && !self.has_looked_ahead && !self.channels.contains_key(&id) {
            self.has_looked_ahead = true;
            // The first one of each id, however many there are.
            let mut found = self.channels.clone();
            // What can be read only once has none to offer.
            let _ = self.records.for_each_channel(|record| {
                if let Some((id, topic)) = records::channel(record) {
                    found.entry(id).or_insert_with(|| self.meaning(topic));
                }
            });
            self.channels = found;
        }
        match self.channels.get(&id) {
            Some(channel) => Ok(*channel),
            None if self.damage.is_some() => Err("what its values are is in a damaged part".into()),
            None => Ok(Channel::Other),
        }
    }

    fn unreadable(&self, cause: io::Error) -> Error {
        Error::Read { path: self.path.clone(), cause }
    }

    fn meaning(&self, name: &str) -> Channel {
        match name {
            CYCLE => Channel::Cycle,
            TRANSFER => Channel::Transfer,
            EVENTS => Channel::Events,
            STATISTICS => Channel::Statistics,
            CAMERA => Channel::Camera,
            _ => {
                let all = (0..MAX_AREAS)
                    .flat_map(|area| (0..self.parts.len()).map(move |part| (area, part)));
                let mut found =
                    all.filter(|(area, part)| topic(*area, self.parts[*part].name) == name);
                found.next().map_or(Channel::Other, |(area, part)| Channel::Part { area, part })
            }
        }
    }

    /// Takes in a message; `None` when the entry is not complete yet, or is not for programs.
    fn message(&mut self, channel: Channel, data: &[u8]) -> Result<Option<Recorded>, String> {
        Ok(match channel {
            Channel::Part { area, part } => {
                let part = &self.parts[part];
                let numbers = part.decode(data).map_err(|error| error.to_string())?;
                part.write(&numbers, &mut self.areas[area]);
                None
            }
            Channel::Cycle => Some(Recorded::Cycle(self.as_cycle(&parse_short(data)?))),
            Channel::Transfer => Some(Recorded::Transfer(parse_short(data)?)),
            Channel::Events => Some(Recorded::Event(parse_short(data)?)),
            Channel::Statistics => Some(Recorded::Statistics(parse_short(data)?)),
            Channel::Camera => {
                let image: ImageMessage = parse(data)?;
                let jpeg = BASE64_STANDARD.decode(image.data).map_err(|error| error.to_string())?;
                Some(Recorded::Picture(jpeg))
            }
            Channel::Other => None,
        })
    }

    fn as_cycle(&self, message: &CycleMessage) -> Cycle {
        let mut areas = self.areas[..message.areas.clamp(1, MAX_AREAS)].to_vec();
        for (id, area) in (0..).zip(&mut areas) {
            area.state.id = id;
        }
        for extension in 0..MAX_EXTENSIONS {
            let alive = message.extensions >> extension & 1;
            areas[0].state.io_slave_alive[extension] = u8::from(alive != 0);
        }
        let since_last = Duration::try_from_secs_f64(message.cycle_ms / 1e3).unwrap_or_default();
        let CycleMessage { cycle: number, first, lost, .. } = *message;
        Cycle { number, first: first != 0, lost, since_last, areas }
    }
}

/// A message that no recorder makes longer: who reads a file keeps some of them.
fn parse_short<T: DeserializeOwned>(data: &[u8]) -> Result<T, String> {
    const MOST: usize = 64 << 10;
    match data.len() {
        ..=MOST => parse(data),
        length => Err(format!("a message has {length} bytes")),
    }
}

fn parse<T: DeserializeOwned>(data: &[u8]) -> Result<T, String> {
    serde_json::from_slice(data).map_err(|error| error.to_string())
}

impl Iterator for Recording {
    type Item = Result<Entry, Error>;

    fn next(&mut self) -> Option<Result<Entry, Error>> {
        if self.at_end {
            return None;
        }
        let entry = self.next_entry().transpose();
        // After an error nothing can be read.
        self.at_end = !matches!(entry, Some(Ok(_)));
        entry
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_text_that_no_recorder_writes_is_not_kept() {
        let message = |length| {
            let error = "x".repeat(length);
            format!(r#"{{"what":"ended_by","kind":"other","error":"{error}"}}"#)
        };
        assert!(parse_short::<Transfer>(message(60_000).as_bytes()).is_ok());
        let long = parse_short::<Transfer>(message(1 << 20).as_bytes()).unwrap_err();
        assert!(long.contains("bytes"), "{long}");
    }
}
