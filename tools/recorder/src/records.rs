//! The records of a file. No length that a file announces is trusted: memory is taken only for what is there.

use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};

use mcap::records::op;
use mcap::MAGIC;

use crate::source::Source;

/// No record of a recording is longer. A chunk holds half a second, with a picture of 1280×720 in each frame.
const LONGEST: u64 = 64 << 20;

/// Kind and length of a record.
const RECORD_HEAD: usize = 1 + 8;

/// How chunks of a recording are packed.
const LZ4: &str = "lz4";

/// The head of a chunk without this name: times, size, checksum, the length of the name, the length of what is packed.
const CHUNK_HEAD: u64 = 8 + 8 + 8 + 4 + 4 + 8;

/// How many bytes tell whether a chunk begins there.
const TELLING: usize = RECORD_HEAD + CHUNK_HEAD as usize + LZ4.len();

/// The length of the record at the end of the data.
const DATA_END: u64 = 4;

/// The records of a file, one after the other, also those in chunks. What is damaged is left out.
pub(crate) struct Records<R> {
    source: Source<R>,
    place: Place,
    chunk: Chunk,
    /// How many chunks were passed, with this one.
    passed: u64,
    /// As many are left out, if that is more.
    left_out: u64,
}

/// Which part of the file is read.
#[derive(Clone, Copy, PartialEq)]
enum Place {
    Beginning,
    Data,
    /// Behind the data, where the index is.
    Summary,
}

/// What comes next in a file.
pub(crate) enum Found {
    /// A record: its kind, and what is in it.
    Record(u8, Vec<u8>),
    /// So many bytes can't be read, for this reason.
    Damaged { bytes: u64, cause: String },
    /// Nothing more.
    End { is_cut_off: bool },
}

impl Records<File> {
    /// The file, at its beginning.
    pub(crate) fn rewound(&self) -> io::Result<File> {
        let mut file = self.source.file().try_clone()?;
        file.rewind().map_err(|cause| {
            let why = "it can be read only once, as a pipe; write it to a file first";
            io::Error::new(cause.kind(), why)
        })?;
        Ok(file)
    }

    /// Shows the channels wherever they can be read: behind the data, or in the data of a file without an index. What
    /// comes next is as before.
    pub(crate) fn for_each_channel(&self, see: impl FnMut(&[u8])) -> io::Result<()> {
        let mut file = self.source.file();
        let next = file.stream_position()?;
        let seen = Records::of(self.rewound()?).show_channels(see);
        file.seek(SeekFrom::Start(next))?;
        seen
    }
}

impl<R: Read> Records<R> {
    pub(crate) fn of(file: R) -> Self {
        let (source, chunk) = (Source::of(file), Chunk::default());
        Self { source, place: Place::Beginning, chunk, passed: 0, left_out: 0 }
    }

    /// The number of the chunk that is read, from 1.
    pub(crate) fn chunk(&self) -> u64 {
        self.passed
    }

    /// Leaves out all before the chunk with this number.
    pub(crate) fn skip_to(&mut self, chunk: u64) {
        if self.passed < chunk {
            self.left_out = chunk - 1;
            self.chunk = Chunk::default();
        }
    }

    /// The next record.
    pub(crate) fn next(&mut self) -> io::Result<Found> {
        loop {
            match self.chunk.next() {
                Some(Ok((opcode, data))) => return Ok(Found::Record(opcode, data)),
                Some(Err(cause)) => {
                    return Ok(Found::Damaged { bytes: self.leave_chunk(), cause });
                }
                None => {}
            }
            match self.next_of_file()? {
                Found::Record(op::CHUNK, data) => {
                    self.passed += 1;
                    if self.passed <= self.left_out {
                        continue;
                    }
                    match Chunk::of(&data) {
                        Ok(chunk) => self.chunk = chunk,
                        Err(cause) => {
                            let bytes = (RECORD_HEAD + data.len()) as u64;
                            return Ok(Found::Damaged { bytes, cause });
                        }
                    }
                }
                other => return Ok(other),
            }
        }
    }

    /// Leaves out the rest of a chunk whose last record makes no sense: so many bytes.
    pub(crate) fn leave_chunk(&mut self) -> u64 {
        let chunk = std::mem::take(&mut self.chunk);
        (chunk.data.len() - chunk.last) as u64
    }

    fn show_channels(mut self, mut see: impl FnMut(&[u8])) -> io::Result<()> {
        loop {
            match self.next()? {
                Found::Record(op::CHANNEL, data) => see(&data),
                Found::Record(..) | Found::Damaged { .. } => {}
                Found::End { .. } => return Ok(()),
            }
        }
    }

    /// The next record that is not in a chunk, or a chunk whose head is right.
    fn next_of_file(&mut self) -> io::Result<Found> {
        if self.place == Place::Beginning {
            if self.source.ready(MAGIC.len())?.len() < MAGIC.len() {
                return Ok(Found::End { is_cut_off: true });
            }
            if !self.source.rest().starts_with(MAGIC) {
                return Ok(Found::Damaged { bytes: 0, cause: "it is no MCAP file".into() });
            }
            self.source.skip(MAGIC.len());
            self.place = Place::Data;
        }
        let head =
            self.source.ready(RECORD_HEAD)?.get(..RECORD_HEAD).and_then(|it| Fields(it).head());
        let Some((opcode, length)) = head else { return self.end() };
        let whole = match usize::try_from(length) {
            Ok(length) if length as u64 <= LONGEST => RECORD_HEAD + length,
            _ => return self.not_read("a record is longer than any of a recording"),
        };
        if self.source.ready(whole)?.len() < whole {
            return self.not_read("a record is longer than the file");
        }
        let data = &self.source.rest()[RECORD_HEAD..whole];
        match self.place {
            Place::Summary if opcode == op::FOOTER => return self.end(),
            Place::Summary => {}
            Place::Beginning | Place::Data => {
                if let Some(cause) = what_is_wrong(opcode, data) {
                    return self.search(cause);
                }
            }
        }
        let data = data.to_vec();
        self.source.skip(whole);
        if opcode == op::DATA_END {
            self.place = Place::Summary;
        }
        Ok(Found::Record(opcode, data))
    }

    /// A record that is not there as a whole: the file is cut off, unless it goes on behind it.
    fn not_read(&mut self, cause: &str) -> io::Result<Found> {
        if self.place == Place::Summary {
            return self.end();
        }
        self.search(cause)
    }

    /// Skips what can't be read, up to the next chunk or the end of the data.
    fn search(&mut self, cause: &str) -> io::Result<Found> {
        let begin = self.source.at();
        self.place = Place::Data;
        self.source.skip(1);
        loop {
            let rest = self.source.ready(TELLING)?;
            let places = (rest.len() + 1).saturating_sub(TELLING);
            let found = (0..places).find_map(|at| Some((at, plausible(&rest[at..])?)));
            self.source.skip(found.map_or(places, |(at, _)| at));
            let Some((_, length)) = found else {
                if self.source.is_at_end() {
                    return self.end_within(begin, cause);
                }
                continue;
            };
            if self.source.ready(length)?.len() >= length {
                return Ok(Found::Damaged { bytes: self.source.at() - begin, cause: cause.into() });
            }
            self.source.skip(1);
        }
    }

    /// The file has ended within what can't be read.
    fn end_within(&mut self, begin: u64, cause: &str) -> io::Result<Found> {
        self.source.skip(self.source.rest().len());
        if !self.source.has_ended_with(MAGIC) {
            return Ok(Found::End { is_cut_off: true });
        }
        self.place = Place::Summary;
        Ok(Found::Damaged { bytes: self.source.at() - begin, cause: cause.into() })
    }

    /// Reads to the end of the file, where the index tells nothing about what was recorded.
    fn end(&mut self) -> io::Result<Found> {
        if self.place == Place::Summary {
            while !self.source.ready(1)?.is_empty() {
                self.source.skip(self.source.rest().len());
            }
        }
        let is_cut_off = self.place != Place::Summary || !self.source.has_ended_with(MAGIC);
        Ok(Found::End { is_cut_off })
    }
}

/// What is wrong with a record of the data, as far as its head tells.
fn what_is_wrong(opcode: u8, data: &[u8]) -> Option<&'static str> {
    let is_chunk = ChunkHead::of(data).is_some_and(|(head, _)| head.compression == LZ4);
    match opcode {
        op::CHUNK => {
            ChunkHead::of(data).is_none().then_some("a chunk has another length than it says")
        }
        // Another kind would hide all that is in it.
        _ if is_chunk => Some("a chunk has the kind of another record"),
        op::DATA_END => (data.len() as u64 != DATA_END).then_some("the end of the data is damaged"),
        op::HEADER | op::SCHEMA | op::CHANNEL | op::MESSAGE | op::MESSAGE_INDEX => None,
        op::ATTACHMENT | op::METADATA | 0x80.. => None,
        _ => Some("a record is of no known kind"),
    }
}

/// The length of the record that seems to begin here, if it is a chunk or the end of the data.
fn plausible(bytes: &[u8]) -> Option<usize> {
    let mut fields = Fields(bytes);
    let (opcode, length) = fields.head()?;
    let is_one = match opcode {
        op::CHUNK if length <= LONGEST => {
            let _times_size_and_crc = fields.bytes(8 + 8 + 8 + 4)?;
            let name = fields.u32()?;
            let is_known = name == 0 || name == 3 && fields.bytes(3)? == LZ4.as_bytes();
            is_known && fields.u64()? == length.checked_sub(CHUNK_HEAD + u64::from(name))?
        }
        op::DATA_END => length == DATA_END,
        _ => false,
    };
    is_one.then(|| RECORD_HEAD + length as usize)
}

/// The records of a chunk.
#[derive(Default)]
struct Chunk {
    data: Vec<u8>,
    /// Where the last record began.
    last: usize,
    /// Where the next record begins.
    at: usize,
}

impl Chunk {
    /// Unpacks a chunk.
    fn of(record: &[u8]) -> Result<Self, String> {
        let (head, packed) =
            ChunkHead::of(record).ok_or("a chunk has another length than it says")?;
        if head.size > LONGEST {
            return Err("a chunk is larger than any of a recording".into());
        }
        let data = match head.compression {
            "" => packed.to_vec(),
            LZ4 => unpack(packed, head.size)
                .map_err(|error| format!("a chunk can't be unpacked: {error}"))?,
            other => {
                return Err(format!("a chunk is packed with {other:?}, which is not known here"))
            }
        };
        if data.len() as u64 != head.size {
            return Err("a chunk has another length than it says".into());
        }
        if head.crc != 0 && crc32fast::hash(&data) != head.crc {
            return Err("a chunk has a wrong checksum".into());
        }
        Ok(Self { data, last: 0, at: 0 })
    }

    fn next(&mut self) -> Option<Result<(u8, Vec<u8>), String>> {
        let rest = &self.data[self.at..];
        if rest.is_empty() {
            return None;
        }
        self.last = self.at;
        let mut fields = Fields(rest);
        let Some((opcode, data)) = fields.record() else {
            return Some(Err("a record is longer than its chunk".to_owned()));
        };
        self.at = self.data.len() - fields.0.len();
        Some(Ok((opcode, data.to_vec())))
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
    /// The head of a chunk, and what is packed in it: all that follows.
    fn of(record: &'a [u8]) -> Option<(Self, &'a [u8])> {
        let mut fields = Fields(record);
        let _times = fields.bytes(16)?;
        let (size, crc, compression) = (fields.u64()?, fields.u32()?, fields.string()?);
        let packed = fields.u64()?;
        (packed == fields.0.len() as u64).then_some((Self { size, crc, compression }, fields.0))
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

    fn head(&mut self) -> Option<(u8, u64)> {
        let [opcode] = self.array()?;
        Some((opcode, self.u64()?))
    }

    fn record(&mut self) -> Option<(u8, &'a [u8])> {
        let (opcode, length) = self.head()?;
        Some((opcode, self.bytes(length)?))
    }
}
