//! A file of which parts are damaged gives all that is right, and says what is missing.

use std::fs;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::time::Duration;

use ft_transfer_area::transfer_area::{InputMode, UniConfig, LOCAL_IO};
use ft_transfer_area::tx::Motor;
use ft_transfer_area::TransferAreaComHandler;
use ft_transfer_area_recorder::{Damage, Entry, Options, Recorded, Recorder, Recording};
use ft_transfer_area_simulator::SimulatedTxt;
use tempfile::TempDir;

use crate::recording::folder;

const CHUNK: u8 = 6;
const DATA_END: u8 = 15;

/// A recording, and where its chunks are.
struct Sample {
    folder: TempDir,
    whole: Vec<u8>,
    entries: Vec<String>,
    chunks: Vec<Range<usize>>,
    data_end: usize,
}

/// What was read of a file.
struct Read {
    entries: Vec<Entry>,
    damage: Option<Damage>,
    is_cut_off: bool,
}

fn read(path: &Path) -> Read {
    let mut recording = Recording::open(path).unwrap();
    let entries = recording.by_ref().map(|entry| entry.unwrap()).collect();
    Read { entries, damage: recording.damage().cloned(), is_cut_off: recording.is_cut_off() }
}

/// Words for entries, and no words for what is missing.
fn words(entries: &[Entry]) -> Vec<String> {
    let known = entries.iter().filter(|entry| !matches!(entry.what, Recorded::Missing));
    known.map(|entry| format!("{entry:?}")).collect()
}

impl Sample {
    /// Records for two seconds, in which four chunks are written. What is recorded only when it changes has changed
    /// in the first one.
    fn new() -> Self {
        let folder = folder();
        let path = folder.path().join("run.mcap");
        let txt = SimulatedTxt::builder().pace(Duration::from_millis(5)).start().unwrap();
        let handler = TransferAreaComHandler::builder(txt.address().to_string()).build().unwrap();
        let recorder = Recorder::start(&handler, &path, Options::default().capacity(5000)).unwrap();
        handler.areas().lock()[LOCAL_IO].config.uni[0] = UniConfig::analog(InputMode::Voltage);
        handler.begin_transfer().unwrap();
        for cycle in 0..400 {
            let mut areas = handler.areas().wait_cycle().unwrap();
            areas[LOCAL_IO].output.duty[1] = cycle;
            if cycle == 20 {
                areas[LOCAL_IO].output.distance[0] = 7;
                areas[LOCAL_IO].raise_motor_ex_cmd_id(Motor::M1);
            }
        }
        handler.end_transfer().unwrap();
        assert_eq!(recorder.finish().unwrap().lost, 0);
        let whole = fs::read(&path).unwrap();
        let found = read(&path);
        assert!(found.damage.is_none() && !found.is_cut_off);
        let (chunks, data_end) = places(&whole);
        assert!(chunks.len() > 3, "{chunks:?}");
        Self { folder, whole, entries: words(&found.entries), chunks, data_end }
    }

    fn path(&self) -> PathBuf {
        self.folder.path().join("damaged.mcap")
    }

    /// Reads the file with a change. What is read was in the whole file, in this order.
    #[track_caller]
    fn read_with(&self, what: &str, change: impl FnOnce(&mut Vec<u8>)) -> Read {
        let mut bytes = self.whole.clone();
        change(&mut bytes);
        fs::write(self.path(), bytes).unwrap();
        let found = read(&self.path());
        let mut all = self.entries.iter();
        for entry in words(&found.entries) {
            assert!(all.any(|one| *one == entry), "{what}: {entry} was not recorded here");
        }
        found
    }

    /// How many entries are missing.
    fn missing(&self, found: &Read) -> usize {
        self.entries.len() - words(&found.entries).len()
    }
}

/// Where chunks are in a file, and where its data end.
fn places(file: &[u8]) -> (Vec<Range<usize>>, usize) {
    let (mut chunks, mut at) = (Vec::new(), 8);
    loop {
        let length = u64::from_le_bytes(file[at + 1..at + 9].try_into().unwrap()) as usize;
        match file[at] {
            CHUNK => chunks.push(at..at + 9 + length),
            DATA_END => return (chunks, at),
            _ => {}
        }
        at += 9 + length;
    }
}

#[test]
fn of_a_damaged_chunk_all_others_are_read_with_the_right_values() {
    let sample = Sample::new();
    let last = sample.chunks.len() - 1;
    let mut all_missing = 0;
    for (number, chunk) in sample.chunks.iter().enumerate() {
        let middle = chunk.start + chunk.len() / 2;
        let found = sample.read_with("the middle of a chunk", |bytes| bytes[middle] ^= 0x55);
        let missing = sample.missing(&found);
        let damage = found.damage.unwrap();
        assert_eq!((damage.parts, damage.bytes), (1, chunk.len() as u64), "{damage}");
        assert!(!found.is_cut_off, "{number}");
        // The first chunk has only the names of channels, which are at the end of the file, too.
        assert_eq!(missing > 0, number > 0, "{number}: {missing} of {}", sample.entries.len());
        assert_eq!(damage.before.is_some(), number < last, "{damage:?}");
        assert!(damage.before.is_none_or(|before| before > damage.after || number == 0));
        all_missing += missing;
    }
    assert_eq!(all_missing, sample.entries.len(), "each entry is in one chunk");
}

#[test]
fn a_place_is_reached_without_looking_at_what_is_before() {
    let mut sample = Sample::new();
    let whole = sample.folder.path().join("run.mcap");
    let mut recording = Recording::open(&whole).unwrap();
    let mut last = None;
    while let Some(entry) = recording.next() {
        entry.unwrap();
        last = Some(recording.place());
    }
    let middle = sample.chunks[2].start + sample.chunks[2].len() / 2;
    sample.whole[middle] ^= 0x55;
    fs::write(&whole, &sample.whole).unwrap();
    recording.rewind().unwrap();
    recording.skip_to(last);
    let entries: Vec<_> = recording.by_ref().map(|entry| entry.unwrap()).collect();
    assert!(recording.damage().is_none(), "{:?}", recording.damage());
    assert!(!entries.is_empty() && sample.entries.ends_with(&words(&entries)));

    recording.rewind().unwrap();
    recording.skip_to(None);
    assert!(recording.next().is_none());
    assert!(!recording.is_cut_off());
}

#[test]
fn wherever_a_byte_is_wrong_what_is_missing_is_told() {
    let sample = Sample::new();
    let chunk = sample.chunks[2].clone();
    // Each byte of the head of a chunk and of the end of the data, and some of all others behind the head of the file.
    let head = chunk.start..chunk.start + 52;
    let end = sample.data_end..sample.data_end + 13;
    let some = (sample.chunks[0].start..sample.whole.len()).step_by(sample.whole.len() / 20);
    for at in head.clone().chain(end).chain(some) {
        let change = if at % 2 == 0 { 0x01 } else { 0x80 };
        let what = format!("{at} of {}, {change}", sample.whole.len());
        let found = sample.read_with(&what, |bytes| bytes[at] ^= change);
        let missing = sample.missing(&found);
        assert!(missing == 0 || found.damage.is_some(), "{what}: {missing} entries");
        // The times of a chunk are told twice, and nobody needs them.
        if head.contains(&at) && !(9..25).contains(&(at - head.start)) {
            assert!(found.damage.is_some(), "{what}: byte {} of the chunk", at - head.start);
            let next = sample.entries.len() / 2;
            assert!(missing < next, "{what}: {missing} entries: only this chunk is missing");
        }
    }
}

#[test]
fn a_part_that_is_overwritten_ends_at_the_next_chunk() {
    let sample = Sample::new();
    let [first, second] = [1, 2].map(|number| sample.chunks[number].clone());
    for with in [0x00, 0x06, 0xFF] {
        let middles = first.start + 30..second.end - 30;
        let found = sample.read_with("two chunks", |bytes| bytes[middles.clone()].fill(with));
        let damage = found.damage.as_ref().unwrap();
        assert!(damage.bytes >= middles.len() as u64, "{damage}");
        assert!(words(&found.entries).last() == sample.entries.last(), "{with}: the rest is there");
        let said = damage.to_string();
        assert!(said.contains(" left out, between ") && said.ends_with(" s"), "{said}");
    }
    // Up to the end of the file, and up to where it is cut off.
    let at = sample.chunks[2].start;
    let found = sample.read_with("the end", |bytes| bytes[at..].fill(0));
    assert!(found.is_cut_off && sample.missing(&found) > 0);
    let end = sample.whole.len() - 8;
    let found = sample.read_with("all but the last bytes", |bytes| bytes[at..end].fill(0));
    let damage = found.damage.unwrap();
    assert!(!found.is_cut_off && damage.to_string().contains(" left out, after "), "{damage}");
}

#[test]
fn an_index_that_lies_changes_nothing() {
    let sample = Sample::new();
    let index = sample.data_end + 13..sample.whole.len() - 8;
    for with in [0x00, 0x06, 0xFF] {
        let found = sample.read_with("the index", |bytes| bytes[index.clone()].fill(with));
        assert_eq!((sample.missing(&found), found.damage), (0, None));
        assert!(!found.is_cut_off);
    }
    for at in index.step_by(301) {
        let found = sample.read_with("the index", |bytes| bytes[at] ^= 0x40);
        assert_eq!((sample.missing(&found), found.damage), (0, None), "{at}");
    }
    // With the names of the channels gone, and an index that does not have them, nothing is taken for something else.
    let first = sample.chunks[0].start + 60;
    let found = sample.read_with("the names of channels", |bytes| {
        bytes[first] ^= 0x55;
        bytes[sample.data_end + 13..].fill(0);
    });
    assert!(found.damage.unwrap().parts > 1);
}

/// A damaged file must not take more memory than a whole one.
#[test]
fn what_can_t_be_read_takes_little_memory() {
    let sample = Sample::new();
    let path = sample.path();
    let chunk = sample.chunks[1].start;
    let mut bytes = sample.whole[..chunk + 9].to_vec();
    // A length that is too long for a record, and one that is not.
    for length in [u64::MAX, 60 << 20] {
        bytes.truncate(chunk + 1);
        bytes.extend(length.to_le_bytes());
        bytes.extend(vec![0; 4 << 20]);
        bytes.extend(&sample.whole[chunk..]);
        fs::write(&path, &bytes).unwrap();
        let mut found = None;
        let taken = allocation_counter::measure(|| {
            let mut recording = Recording::open(&path).unwrap();
            let count = recording.by_ref().filter_map(Result::ok).count();
            found = Some((count, recording.damage().cloned()));
        });
        let (count, damage) = found.unwrap();
        assert_eq!(count, sample.entries.len() + 1, "all, and that something is missing");
        assert!(damage.unwrap().bytes > 4 << 20);
        assert!(taken.bytes_max < 96 << 20, "{} bytes", taken.bytes_max);
    }
}
