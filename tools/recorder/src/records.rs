//! The records of a file. No length that a file announces is trusted: memory is taken only for what is there.

use std::fs::File;
use std::io::{self, BufReader, Read};

use mcap::records::op;
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};
use mcap::McapError;

/// No record of a recording is longer. A chunk holds half a second, with a picture of 1280×720 in each frame.
const LONGEST: usize = 64 << 20;

/// How much is read at once, however long a record says that it is.
const PIECE: usize = 256 << 10;

/// The records of a file, one after the other, also those in chunks.
pub(crate) struct Records {
    file: BufReader<File>,
    outer: LinearReader,
    chunk: Chunk,
}

/// Why there is no next record.
pub(crate) enum Problem {
    /// The file can't be read.
    Io(io::Error),
    /// It ends within a record.
    CutOff,
    /// It is wrong in this way.
    Damaged(String),
}

impl Records {
    pub(crate) fn of(file: File) -> Self {
        let options =
            LinearReaderOptions::default().with_emit_chunks(true).with_record_length_limit(LONGEST);
        let outer = LinearReader::new_with_options(options);
        Self { file: BufReader::new(file), outer, chunk: Chunk::default() }
    }

    /// The next record: its kind and what is in it; `None` at the end.
    pub(crate) fn next(&mut self) -> Result<Option<(u8, Vec<u8>)>, Problem> {
        loop {
            if let Some(record) = self.chunk.next()? {
                return Ok(Some(record));
            }
            match self.next_of_file()? {
                Some((op::CHUNK, data)) => self.chunk = Chunk::of(&data)?,
                other => return Ok(other),
            }
        }
    }

    fn next_of_file(&mut self) -> Result<Option<(u8, Vec<u8>)>, Problem> {
        loop {
            let wanted = match self.outer.next_event() {
                None => return Ok(None),
                Some(Ok(LinearReadEvent::Record { data, opcode })) => {
                    return Ok(Some((opcode, data.to_vec())));
                }
                Some(Ok(LinearReadEvent::ReadRequest(wanted))) => wanted.min(PIECE),
                Some(Err(McapError::UnexpectedEof)) => return Err(Problem::CutOff),
                Some(Err(error)) => return Err(Problem::Damaged(error.to_string())),
            };
            let read = read_some(&mut self.file, self.outer.insert(wanted));
            self.outer.notify_read(read.map_err(Problem::Io)?);
        }
    }
}

/// The records of a chunk, all of which are there and right.
#[derive(Default)]
struct Chunk {
    data: Vec<u8>,
    /// Where the next record begins.
    at: usize,
}

impl Chunk {
    /// Unpacks a chunk.
    fn of(record: &[u8]) -> Result<Self, Problem> {
        let (head, packed) = ChunkHead::of(record)
            .ok_or_else(|| Problem::Damaged("a chunk is shorter than it says".to_owned()))?;
        if head.size > LONGEST as u64 {
            return Err(Problem::Damaged("a chunk is larger than any of a recording".to_owned()));
        }
        let data = match head.compression {
            "" => packed.to_vec(),
            "lz4" => unpack(packed, head.size)
                .map_err(|error| Problem::Damaged(format!("a chunk can't be unpacked: {error}")))?,
            other => {
                let cause = format!("a chunk is packed with {other:?}, which is not known here");
                return Err(Problem::Damaged(cause));
            }
        };
        if data.len() as u64 != head.size {
            return Err(Problem::Damaged("a chunk has another length than it says".to_owned()));
        }
        if head.crc != 0 && crc32fast::hash(&data) != head.crc {
            return Err(Problem::Damaged("a chunk has a wrong checksum".to_owned()));
        }
        Ok(Self { data, at: 0 })
    }

    fn next(&mut self) -> Result<Option<(u8, Vec<u8>)>, Problem> {
        let rest = &self.data[self.at..];
        if rest.is_empty() {
            return Ok(None);
        }
        let mut fields = Fields(rest);
        let (opcode, data) = fields
            .record()
            .ok_or_else(|| Problem::Damaged("a record is longer than its chunk".to_owned()))?;
        self.at = self.data.len() - fields.0.len();
        Ok(Some((opcode, data.to_vec())))
    }
}

/// The bytes of a chunk, and at most one more than it should have.
fn unpack(packed: &[u8], size: u64) -> io::Result<Vec<u8>> {
    let mut data = Vec::new();
    lz4::Decoder::new(packed)?.take(size + 1).read_to_end(&mut data)?;
    Ok(data)
}

struct ChunkHead<'a> {
    /// When it is unpacked.
    size: u64,
    /// 0 if there is none.
    crc: u32,
    compression: &'a str,
}

impl<'a> ChunkHead<'a> {
    /// The head of a chunk, and what is packed in it.
    fn of(record: &'a [u8]) -> Option<(Self, &'a [u8])> {
        let mut fields = Fields(record);
        let _times = fields.bytes(16)?;
        let (size, crc, compression) = (fields.u64()?, fields.u32()?, fields.string()?);
        let packed = fields.u64()?;
        Some((Self { size, crc, compression }, fields.bytes(packed)?))
    }
}

/// The profile of a header, and which library has written it.
pub(crate) fn header(record: &[u8]) -> Option<(&str, &str)> {
    let mut fields = Fields(record);
    Some((fields.string()?, fields.string()?))
}

/// The name of a metadata record, and its values by name.
pub(crate) fn metadata(record: &[u8]) -> Option<(&str, Vec<(&str, &str)>)> {
    let mut fields = Fields(record);
    let name = fields.string()?;
    let length = fields.u32()?;
    let mut values = Fields(fields.bytes(length.into())?);
    let mut found = Vec::new();
    while !values.0.is_empty() {
        found.push((values.string()?, values.string()?));
    }
    Some((name, found))
}

/// The id and the topic of a channel.
pub(crate) fn channel(record: &[u8]) -> Option<(u16, &str)> {
    let mut fields = Fields(record);
    let id = fields.u16()?;
    let _schema = fields.u16()?;
    Some((id, fields.string()?))
}

/// The channel of a message, its time in nanoseconds, and what it says.
pub(crate) fn message(record: &[u8]) -> Option<(u16, u64, &[u8])> {
    let mut fields = Fields(record);
    let channel = fields.u16()?;
    let _sequence = fields.u32()?;
    let at = fields.u64()?;
    let _published = fields.u64()?;
    Some((channel, at, fields.0))
}

/// The fields of a record, as far as it goes.
struct Fields<'a>(&'a [u8]);

impl<'a> Fields<'a> {
    fn bytes(&mut self, count: u64) -> Option<&'a [u8]> {
        let (taken, rest) = self.0.split_at_checked(usize::try_from(count).ok()?)?;
        self.0 = rest;
        Some(taken)
    }

    fn array<const N: usize>(&mut self) -> Option<[u8; N]> {
        self.bytes(N as u64)?.try_into().ok()
    }

    fn u16(&mut self) -> Option<u16> {
        self.array().map(u16::from_le_bytes)
    }

    fn u32(&mut self) -> Option<u32> {
        self.array().map(u32::from_le_bytes)
    }

    fn u64(&mut self) -> Option<u64> {
        self.array().map(u64::from_le_bytes)
    }

    fn string(&mut self) -> Option<&'a str> {
        let length = self.u32()?;
        std::str::from_utf8(self.bytes(length.into())?).ok()
    }

    fn record(&mut self) -> Option<(u8, &'a [u8])> {
        let [opcode] = self.array()?;
        let length = self.u64()?;
        Some((opcode, self.bytes(length)?))
    }
}

/// Reads at least a byte unless the file has ended.
fn read_some(file: &mut impl Read, buffer: &mut [u8]) -> io::Result<usize> {
    loop {
        match file.read(buffer) {
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            done => return done,
        }
    }
}
