//! Writes recordings.

use std::collections::{BTreeMap, HashMap};
use std::fs::File;
use std::io;
use std::time::{Duration, Instant, SystemTime};

use base64::prelude::{Engine, BASE64_STANDARD};
use ft_transfer_area::transfer_area::{MAX_AREAS, MAX_EXTENSIONS};
use ft_transfer_area::{CameraFrame, FishX1Transfer, LoggedCycle, Statistics};
use mcap::records::{MessageHeader, Metadata};
use mcap::write::NoSeek;
use mcap::{McapError, McapResult};
use serde::Serialize;
use serde_json::Value;

use crate::format::{
    schema_of, topic, CycleMessage, ImageMessage, LogMessage, RecordedEvent, RecordedStatistics,
    Timestamp, Transfer, CAMERA, CYCLE, ERROR, EVENTS, FORMAT, HEAD, HEAD_FORMAT, HEAD_STARTED,
    INFO, LOG, NO_TIME, STATISTICS, TRANSFER, WARNING,
};
use crate::output::{options, without_index, Output};
use crate::part::{parts, Part};
use crate::under_way::UnderWay;

type Mcap = mcap::Writer<NoSeek<Output>>;

/// A file that is being written.
pub(crate) struct Writer {
    mcap: Mcap,
    output: Output,
    /// The bytes that the index of the file may take in memory, and about how many it takes.
    index_limit: usize,
    index: usize,
    clock: WallClock,
    parts: Vec<Part>,
    /// By area, and by part in its order; empty for an extension that has not taken part.
    channels: [Vec<PartChannel>; MAX_AREAS],
    /// By topic.
    others: HashMap<&'static str, u16>,
    /// All of them in the order of their ids.
    described: Vec<Description>,
    sequence: u32,
    /// Kept, so that a cycle needs no new memory.
    numbers: Vec<i32>,
    message: Vec<u8>,
    /// Whether something was written since the last flush.
    has_news: bool,
    /// How long the messages of the chunk are until now.
    in_chunk: usize,
    /// Whether the next cycle is the first one of its chunk.
    begins_chunk: bool,
    /// What has happened to the transfer that runs, as far as the next part needs it.
    under_way: UnderWay,
}

/// A chunk is not longer than this and one entry, however much comes in half a second.
const CHUNK: usize = 768 << 10;

/// When the index of a file takes more memory than this, the file gets none.
const INDEX: usize = 32 << 20;
/// About how much an entry of the index takes, and for each channel in its chunk (measured with 9 and 57 channels).
const INDEX_ENTRY: usize = 160;
const INDEX_CHANNEL: usize = 32;

/// What is said of a clock that a file has no number for: its times are nanoseconds since 1970, in 64 bits.
const AFTER_LAST_TIME: &str =
    "the clock of this computer is after the year 2554, and a recording has no such times";

/// What a file says of a channel.
struct Description {
    topic: String,
    schema_name: String,
    schema: String,
}

impl Description {
    fn add_to(&self, mcap: &mut Mcap) -> McapResult<u16> {
        let Self { topic, schema_name, schema } = self;
        let schema = mcap.add_schema(schema_name, "jsonschema", schema.as_bytes())?;
        mcap.add_channel(schema, topic, "json", &BTreeMap::new())
    }
}

/// The channel of a part of an area.
struct PartChannel {
    id: u16,
    /// What was written last.
    last: Vec<i32>,
}

/// Turns the program's times into those of the file.
struct WallClock {
    began: Instant,
    began_ns: u64,
}

impl WallClock {
    fn now() -> Self {
        let since_1970 = SystemTime::UNIX_EPOCH.elapsed().unwrap_or_default();
        Self { began: Instant::now(), began_ns: nanos(since_1970) }
    }

    /// An error when it is after the last time that a file can have.
    fn check(&self) -> McapResult<()> {
        match self.began_ns {
            NO_TIME => Err(McapError::Io(io::Error::other(AFTER_LAST_TIME))),
            _ => Ok(()),
        }
    }

    /// With this beginning.
    fn since(time: Instant) -> Self {
        Self { began: time, began_ns: Self::now().ns(time) }
    }

    /// No cycle is before the beginning. In lock-step the first ones may be: their clock is that of the transfer.
    fn reach_back_to(&mut self, time: Instant) {
        self.began = self.began.min(time);
    }

    fn ns(&self, time: Instant) -> u64 {
        // One of the two differences is 0.
        let before = nanos(self.began.saturating_duration_since(time));
        let after = nanos(time.saturating_duration_since(self.began));
        self.began_ns.saturating_sub(before).saturating_add(after)
    }
}

fn nanos(time: Duration) -> u64 {
    u64::try_from(time.as_nanos()).unwrap_or(NO_TIME)
}

fn not_recorded(entries: u64) -> String {
    format!("{entries} entries before this are missing: disk or computer was too slow")
}

fn millis(time: Duration) -> f64 {
    time.as_micros() as f64 / 1e3
}

impl Writer {
    /// An error when no file could have the times of now.
    pub(crate) fn check_clock() -> McapResult<()> {
        WallClock::now().check()
    }

    /// Writes the head into a new file.
    pub(crate) fn new(file: File) -> McapResult<Self> {
        Self::beginning(file, WallClock::now())
    }

    /// What goes on in another file, from this time on. So much was lost before.
    pub(crate) fn next_part(&self, file: File, since: Instant, lost: Losses) -> McapResult<Self> {
        Self::within(file, since, &self.under_way, lost)
    }

    /// Writes the head into a new file that begins at this time, within a transfer to which this has happened. The
    /// statistics go on from those before.
    pub(crate) fn within(
        file: File,
        since: Instant,
        under_way: &UnderWay,
        lost: Losses,
    ) -> McapResult<Self> {
        let mut writer = Self::beginning(file, WallClock::since(since))?;
        under_way.messages().iter().try_for_each(|message| writer.transfer(since, message))?;
        if let Some(statistics) = under_way.statistics() {
            writer.under_way.count(*statistics);
            writer.statistics(since, statistics, lost)?;
        }
        Ok(writer)
    }

    fn beginning(file: File, clock: WallClock) -> McapResult<Self> {
        clock.check()?;
        let output = Output::new(file);
        let mut mcap = options().create(NoSeek::new(output.clone()))?;
        let head = [
            (HEAD_FORMAT.to_owned(), FORMAT.to_string()),
            (HEAD_STARTED.to_owned(), clock.began_ns.to_string()),
        ];
        mcap.write_metadata(&Metadata { name: HEAD.to_owned(), metadata: head.into() })?;
        let mut writer = Self {
            mcap,
            output,
            index_limit: INDEX,
            index: 0,
            clock,
            parts: parts(),
            channels: Default::default(),
            others: HashMap::new(),
            described: Vec::new(),
            sequence: 0,
            numbers: Vec::new(),
            message: Vec::new(),
            has_news: false,
            in_chunk: 0,
            begins_chunk: true,
            under_way: UnderWay::default(),
        };
        for topic in [CYCLE, TRANSFER, EVENTS, STATISTICS, LOG] {
            writer.add_topic(topic)?;
        }
        writer.has_news = true;
        writer.flush()?;
        Ok(writer)
    }

    fn add_channel(&mut self, topic: &str, schema: (&str, Value)) -> McapResult<u16> {
        let (name, schema) = (schema.0.to_owned(), schema.1.to_string());
        let described = Description { topic: topic.to_owned(), schema_name: name, schema };
        let id = described.add_to(&mut self.mcap)?;
        self.described.push(described);
        Ok(id)
    }

    fn add_topic(&mut self, topic: &'static str) -> McapResult<u16> {
        let id = self.add_channel(topic, schema_of(topic))?;
        self.others.insert(topic, id);
        Ok(id)
    }

    /// The channels of an area's parts.
    fn add_area(&mut self, area: usize) -> McapResult<()> {
        for index in 0..self.parts.len() {
            let part = &self.parts[index];
            let (topic, name) = (topic(area, part.name), format!("ft.{}", part.name));
            let schema = part.schema();
            let id = self.add_channel(&topic, (&name, schema))?;
            self.channels[area].push(PartChannel { id, last: Vec::new() });
        }
        Ok(())
    }

    /// Writes `self.message`.
    fn put(&mut self, channel_id: u16, ns: u64) -> McapResult<()> {
        self.sequence = self.sequence.wrapping_add(1);
        self.has_news = true;
        self.in_chunk += self.message.len();
        let sequence = self.sequence;
        let header = MessageHeader { channel_id, sequence, log_time: ns, publish_time: ns };
        self.mcap.write_to_known_channel(&header, &self.message)
    }

    fn put_json(
        &mut self,
        topic: &'static str,
        at: Instant,
        message: &impl Serialize,
    ) -> McapResult<()> {
        let id = match self.others.get(topic) {
            Some(id) => *id,
            None => self.add_topic(topic)?,
        };
        self.message.clear();
        serde_json::to_writer(&mut self.message, message)
            .map_err(|error| McapError::Io(error.into()))?;
        self.put(id, self.clock.ns(at))
    }

    fn put_log(&mut self, at: Instant, level: u8, message: String) -> McapResult<()> {
        let timestamp = Timestamp::new(self.clock.ns(at));
        let log = LogMessage { timestamp, level, message, name: "transfer", file: "", line: 0 };
        self.put_json(LOG, at, &log)
    }

    /// A cycle, before which this number of entries was lost.
    pub(crate) fn cycle(&mut self, cycle: &LoggedCycle, lost: u64) -> McapResult<()> {
        self.keep_chunk_short()?;
        self.clock.reach_back_to(cycle.arrived);
        let ns = self.clock.ns(cycle.arrived);
        if lost > 0 {
            self.put_log(cycle.arrived, WARNING, not_recorded(lost))?;
        }
        let areas = cycle.areas();
        let alive = areas.first().map_or([0; MAX_EXTENSIONS], |area| area.state.io_slave_alive);
        for (area, values) in areas.iter().enumerate() {
            if self.channels[area].is_empty() {
                // An extension is in the file from the first cycle on in which it takes part.
                if area.checked_sub(1).is_some_and(|extension| alive[extension] == 0) {
                    continue;
                }
                self.add_area(area)?;
            }
            self.area(area, values, ns)?;
        }
        self.begins_chunk = false;
        self.under_way.count(cycle.statistics);
        let extensions = (0..MAX_EXTENSIONS)
            .filter(|extension| alive[*extension] != 0)
            .fold(0, |mask, extension| mask | 1 << extension);
        let since_last = if cycle.first { Duration::ZERO } else { cycle.statistics.last_cycle };
        let message = CycleMessage {
            cycle: cycle.number,
            cycle_ms: millis(since_last),
            first: cycle.first.into(),
            areas: areas.len(),
            extensions,
            lost,
        };
        self.put_json(CYCLE, cycle.arrived, &message)
    }

    /// The parts of an area, those that have not changed only if they are in every cycle, or if they may be needed to
    /// read this chunk without those before it.
    fn area(&mut self, area: usize, values: &FishX1Transfer, ns: u64) -> McapResult<()> {
        for index in 0..self.parts.len() {
            let part = &self.parts[index];
            part.read(values, &mut self.numbers);
            let channel = &mut self.channels[area][index];
            let is_needed = part.each_cycle || self.begins_chunk;
            if !is_needed && channel.last == self.numbers {
                continue;
            }
            channel.last.clone_from(&self.numbers);
            let id = channel.id;
            part.encode(&self.numbers, &mut self.message);
            self.put(id, ns)?;
        }
        Ok(())
    }

    /// What has happened to a transfer, for programs and as a line for people.
    pub(crate) fn transfer(&mut self, at: Instant, message: &Transfer) -> McapResult<()> {
        let (level, text) = match message {
            Transfer::Began { device_name, .. } => {
                (INFO, format!("the transfer with {device_name} begins"))
            }
            Transfer::Failed(why) => (ERROR, format!("a transfer could not begin: {}", why.error)),
            Transfer::Lost(why) => (WARNING, format!("the connection is lost: {}", why.error)),
            Transfer::Restored { after_ms, device_name, .. } => {
                let after = *after_ms as f64 / 1e3;
                let text = format!(
                    "the connection was re-established after {after:.2} s, with {device_name}"
                );
                (INFO, text)
            }
            Transfer::WatchdogExpired { limit_ms } => {
                let limit = *limit_ms as f64 / 1e3;
                (ERROR, format!("the watchdog has stopped the motors after {limit} s"))
            }
            Transfer::NotRecorded { entries } => (WARNING, not_recorded(*entries)),
            Transfer::Ended => (INFO, "the transfer has ended".to_owned()),
            Transfer::EndedBy(why) => (ERROR, format!("the transfer has ended: {}", why.error)),
        };
        self.keep_chunk_short()?;
        self.under_way.take(message);
        // A time before the file began would confuse those who look for its beginning.
        let at = at.max(self.clock.began);
        self.put_json(TRANSFER, at, message)?;
        self.put_log(at, level, text)
    }

    /// Whether a transfer runs, as far as it is known here.
    pub(crate) fn is_under_way(&self) -> bool {
        !self.under_way.messages().is_empty()
    }

    /// Whether the connection of the transfer is lost.
    pub(crate) fn is_in_gap(&self) -> bool {
        matches!(self.under_way.messages().last(), Some(Transfer::Lost(_)))
    }

    /// An event of a response, of whatever kind.
    pub(crate) fn event(&mut self, at: Instant, message: &RecordedEvent) -> McapResult<()> {
        self.keep_chunk_short()?;
        self.put_json(EVENTS, at, message)
    }

    pub(crate) fn statistics(
        &mut self,
        at: Instant,
        statistics: &Statistics,
        lost: Losses,
    ) -> McapResult<()> {
        let message = RecordedStatistics {
            cycles: statistics.cycles,
            late_reactions: statistics.late_reactions,
            gaps: statistics.gaps,
            config_updates: statistics.config_updates,
            shortest_cycle_ms: millis(statistics.shortest_cycle),
            longest_cycle_ms: millis(statistics.longest_cycle),
            lost_entries: lost.entries,
            lost_events: lost.events,
            lost_frames: lost.frames,
        };
        self.put_json(STATISTICS, at, &message)
    }

    /// A picture; returns whether it is one. A damaged one is only reported.
    pub(crate) fn frame(&mut self, frame: &CameraFrame) -> McapResult<bool> {
        let jpeg = match frame.jpeg() {
            Ok(jpeg) => jpeg,
            Err(error) => {
                let text = format!("a picture of the camera is damaged: {error}");
                return self.put_log(frame.arrived, WARNING, text).map(|()| false);
            }
        };
        self.keep_chunk_short()?;
        let image = ImageMessage {
            timestamp: Timestamp::new(self.clock.ns(frame.arrived)),
            frame_id: "camera".to_owned(),
            data: BASE64_STANDARD.encode(jpeg),
            format: "jpeg".to_owned(),
        };
        self.put_json(CAMERA, frame.arrived, &image).map(|()| true)
    }

    fn keep_chunk_short(&mut self) -> McapResult<()> {
        if self.in_chunk > CHUNK {
            self.flush()?;
        }
        Ok(())
    }

    /// Hands everything to the operating system, and begins a new chunk.
    pub(crate) fn flush(&mut self) -> McapResult<()> {
        if std::mem::take(&mut self.has_news) {
            (self.in_chunk, self.begins_chunk) = (0, true);
            self.mcap.flush()?;
            self.index += INDEX_ENTRY + INDEX_CHANNEL * self.described.len();
            if self.index > self.index_limit {
                self.forget_index()?;
            }
        }
        Ok(())
    }

    /// Goes on in the same file without an index of what was written: a part of one would hide the rest from those who
    /// read with it. The crate gives back its memory only with its writer.
    fn forget_index(&mut self) -> McapResult<()> {
        let next = self.output.muted(|output| without_index().create(NoSeek::new(output)))?;
        // Without `into_inner`, it would end the file.
        drop(std::mem::replace(&mut self.mcap, next).into_inner());
        self.index = 0;
        // In the same order, they get the same ids.
        self.described.iter().try_for_each(|channel| channel.add_to(&mut self.mcap).map(drop))
    }

    /// About how large the file is.
    pub(crate) fn bytes(&self) -> u64 {
        self.output.written()
    }

    /// Writes the index at the end of the file; returns how large it is.
    pub(crate) fn finish(mut self) -> McapResult<u64> {
        self.mcap.finish()?;
        // The index, too.
        std::io::Write::flush(&mut self.output)?;
        Ok(self.output.written())
    }
}

/// What was lost so far because the disk was too slow.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Losses {
    pub(crate) entries: u64,
    pub(crate) events: u64,
    pub(crate) frames: u64,
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::path::Path;

    use mcap::{MessageStream, Summary};

    use super::*;
    use crate::{Recorded, Recording};

    const CHUNKS: u64 = 3000;
    const LIMIT: usize = 64 << 10;

    /// Records cycles into a chunk each; returns the most memory that it took beyond what the first ones take.
    fn record(path: &Path, index_limit: usize) -> u64 {
        let mut writer = Writer::new(File::create(path).unwrap()).unwrap();
        writer.index_limit = index_limit;
        let mut record = |numbers: std::ops::Range<u64>| {
            for number in numbers {
                let cycle = LoggedCycle::new(number, &[FishX1Transfer::default()]);
                writer.cycle(&cycle, 0).unwrap();
                writer.flush().unwrap();
            }
        };
        record(1..10);
        let taken = allocation_counter::measure(|| record(10..CHUNKS));
        writer.finish().unwrap();
        taken.bytes_max
    }

    #[test]
    fn a_time_without_a_number_is_refused_by_who_writes_and_who_reads() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.mcap");
        let beginning_at = |since_1970| {
            let clock = WallClock { began: Instant::now(), began_ns: nanos(since_1970) };
            Writer::beginning(File::create(&path).unwrap(), clock)
        };
        let year_2600 = Duration::from_secs(630 * 365 * 24 * 3600);
        let refused = format!("{:?}", beginning_at(year_2600).err().unwrap());
        assert!(refused.contains("after the year 2554"), "{refused}");

        let last = Duration::from_nanos(u64::MAX - 1);
        beginning_at(last).unwrap().finish().unwrap();
        assert_eq!(Recording::open(&path).unwrap().started(), SystemTime::UNIX_EPOCH + last);
        let text = fs::read(&path).unwrap();
        let number = last.as_nanos().to_string().into_bytes();
        let at = text.windows(number.len()).position(|window| window == number).unwrap();
        for other in ["18446744073709551615", "20000000000000000000", "                    "] {
            let mut other_text = text.clone();
            other_text[at..][..number.len()].copy_from_slice(other.as_bytes());
            fs::write(&path, other_text).unwrap();
            let refused = Recording::open(&path).err().unwrap().to_string();
            assert!(refused.contains("no time up to the year 2554"), "{refused}");
        }
    }

    fn has_all_cycles(path: &Path) -> bool {
        let mut recording = Recording::open(path).unwrap();
        let numbers = recording.by_ref().filter_map(|entry| match entry.unwrap().what {
            Recorded::Cycle(cycle) => Some(cycle.number),
            _ => None,
        });
        numbers.eq(1..CHUNKS) && !recording.is_cut_off()
    }

    #[test]
    fn however_long_a_recording_is_it_takes_no_more_memory() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("long.mcap");
        let taken = record(&path, LIMIT);
        assert!(taken < 6 * LIMIT as u64, "{taken} bytes");
        assert!(has_all_cycles(&path));

        // As others read it.
        let file = fs::read(&path).unwrap();
        assert!(Summary::read(&file).unwrap().is_none());
        let topics: Vec<_> = MessageStream::new(&file)
            .unwrap()
            .map(|one| one.unwrap().channel.topic.clone())
            .collect();
        for topic in [CYCLE, "/TXT/inputs", "/TXT/configuration"] {
            let count = topics.iter().filter(|one| *one == topic).count();
            assert_eq!(count as u64, CHUNKS - 1, "{topic}");
        }
    }

    #[test]
    fn a_recording_of_hours_has_an_index() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.mcap");
        record(&path, INDEX);
        let summary = Summary::read(&fs::read(&path).unwrap()).unwrap().unwrap();
        let topics: Vec<_> = summary.channels.values().map(|one| &*one.topic).collect();
        assert!(topics.contains(&"/TXT/inputs"), "{topics:?}");
        assert_eq!(summary.chunk_indexes.len() as u64, CHUNKS);
    }

    #[test]
    fn of_a_long_recording_whose_first_part_is_damaged_all_others_are_read() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("long.mcap");
        record(&path, LIMIT);
        let mut file = fs::read(&path).unwrap();
        // In the first chunk, of 2 kB, which has names of channels.
        file[400] ^= 0x55;
        fs::write(&path, file).unwrap();
        assert!(has_all_cycles(&path), "the first chunk has none");
    }
}
