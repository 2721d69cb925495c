//! What a file announces is not trusted: memory is taken for what is there.

use std::fs;
use std::io::Write;
use std::path::Path;

use ft_transfer_area_recorder::{Error, Recorded, Recording};

use crate::recording::folder;

/// More than opening a file and one piece of it take, and far less than anything that is announced here.
const LITTLE: u64 = 2 << 20;

/// Too much for a small file, and allowed for a large one.
const MUCH: u64 = 60 << 20;

const MAGIC: &[u8] = b"\x89MCAP0\r\n";
const HEADER: u8 = 1;
const CHANNEL: u8 = 4;
const CHUNK: u8 = 6;
const METADATA: u8 = 12;

fn string(text: &str) -> Vec<u8> {
    [&(text.len() as u32).to_le_bytes(), text.as_bytes()].concat()
}

/// A string of 4 GB, without one of its bytes.
const ENDLESS: [u8; 4] = [0xFF; 4];

/// A record that announces this length.
fn announced(opcode: u8, length: u64, body: &[u8]) -> Vec<u8> {
    [&[opcode], &length.to_le_bytes()[..], body].concat()
}

fn record(opcode: u8, body: &[u8]) -> Vec<u8> {
    announced(opcode, body.len() as u64, body)
}

/// How a recording begins.
fn head() -> Vec<u8> {
    let header = [string("ft-transfer-area"), string("a test")].concat();
    let values = ["format", "1", "started_ns", "0"].map(string).concat();
    let metadata = [&string("recording")[..], &(values.len() as u32).to_le_bytes(), &values];
    [MAGIC, &record(HEADER, &header), &record(METADATA, &metadata.concat())].concat()
}

/// A chunk with this content, which announces this length of it.
fn chunk(compression: &str, size: u64, content: &[u8]) -> Vec<u8> {
    let sizes = [&[0; 16][..], &size.to_le_bytes(), &[0; 4], &string(compression)].concat();
    record(CHUNK, &[&sizes[..], &(content.len() as u64).to_le_bytes(), content].concat())
}

fn packed(content: &[u8]) -> Vec<u8> {
    let mut encoder = lz4::EncoderBuilder::new().build(Vec::new()).unwrap();
    encoder.write_all(content).unwrap();
    let (packed, done) = encoder.finish();
    done.unwrap();
    packed
}

/// What reading a file says, which takes little memory: why a part of it is left out, and whether it is cut off.
fn little(path: &Path, bytes: &[u8]) -> Result<(Option<String>, bool), Error> {
    fs::write(path, bytes).unwrap();
    let mut result = None;
    let taken = allocation_counter::measure(|| result = Some(read(path)));
    assert!(taken.bytes_max < LITTLE, "{} bytes for {}", taken.bytes_max, bytes.len());
    result.unwrap()
}

fn read(path: &Path) -> Result<(Option<String>, bool), Error> {
    let mut recording = Recording::open(path)?;
    let entries = recording.by_ref().collect::<Result<Vec<_>, _>>()?;
    assert!(entries.iter().all(|entry| matches!(entry.what, Recorded::Missing)));
    Ok((recording.damage().map(|damage| damage.cause.clone()), recording.is_cut_off()))
}

#[test]
fn a_file_of_33_bytes_takes_no_memory_for_what_it_announces() {
    let folder = folder();
    let path = folder.path().join("small.mcap");
    let header = record(HEADER, &[&ENDLESS[..], &[0; 12]].concat());
    let file = [MAGIC, &header].concat();
    assert_eq!(file.len(), 33);
    assert!(matches!(little(&path, &file), Err(Error::Damaged { .. })));
    for length in [MUCH, u64::MAX] {
        let file = [MAGIC, &announced(HEADER, length, &[0; 16])].concat();
        let found = little(&path, &file);
        assert!(matches!(found, Err(Error::Empty { .. } | Error::NotMcap { .. })), "{found:?}");
    }
    let metadata = [&string("recording")[..], &ENDLESS].concat();
    let header = [string("ft-transfer-area"), string("")].concat();
    let file = [MAGIC, &record(HEADER, &header), &record(METADATA, &metadata)].concat();
    assert!(matches!(little(&path, &file), Err(Error::Damaged { .. })));
}

#[test]
fn nor_does_a_chunk_for_what_it_or_a_record_in_it_announces() {
    let folder = folder();
    let path = folder.path().join("chunk.mcap");
    fs::write(&path, head()).unwrap();
    Recording::open(&path).expect("the head is right");

    let topic = record(CHANNEL, &[&[0; 4][..], &ENDLESS].concat());
    let long = announced(CHANNEL, MUCH, &[0; 4]);
    let mut endless = chunk("", 0, &[]);
    // The length of the name of the compression, behind kind and length of the record.
    endless[9 + 28..9 + 32].copy_from_slice(&ENDLESS);
    let length = |content: &[u8]| content.len() as u64;
    for (what, chunk, cause) in [
        ("its length", announced(CHUNK, MUCH, &[0; 40]), None),
        ("its content", chunk("lz4", MUCH, &packed(b"short")), Some("another length")),
        ("its content", chunk("lz4", u64::MAX, &packed(b"short")), Some("larger than any")),
        ("its content", chunk("", MUCH, b"short"), Some("another length")),
        ("its compression", endless, None),
        ("a record", chunk("", length(&long), &long), Some("longer than its chunk")),
        ("a record", chunk("lz4", length(&long), &packed(&long)), Some("longer than its chunk")),
        ("a topic", chunk("", length(&topic), &topic), Some("a record is shorter")),
        ("a topic", chunk("lz4", length(&topic), &packed(&topic)), Some("a record is shorter")),
        ("its packing", chunk("zstd", 9, b"something"), Some("packed with \"zstd\"")),
    ] {
        let found = little(&path, &[head(), chunk].concat());
        match (found, cause) {
            // Nothing follows that could be read, as in a file that is cut off.
            (Ok((None, true)), None) => {}
            (Ok((Some(said), true)), Some(cause)) => {
                assert!(said.contains(cause), "{what}: {said}");
            }
            (found, _) => panic!("{what}: {found:?}"),
        }
    }
}

/// Zeros are packed to a 255th of their length.
#[test]
fn a_chunk_that_grows_when_it_is_unpacked_takes_no_more_than_it_announces() {
    let folder = folder();
    let path = folder.path().join("zeros.mcap");
    let zeros = packed(&vec![0; 100 << 20]);
    assert!(zeros.len() < 1 << 20);
    for (announced, cause) in [(100 << 20, "larger than any"), (1000, "another length")] {
        let found = little(&path, &[head(), chunk("lz4", announced, &zeros)].concat()).unwrap();
        let said = found.0.unwrap();
        assert!(said.contains(cause), "{announced}: {said}");
    }
}
