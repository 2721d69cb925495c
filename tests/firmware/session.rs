//! Golden sessions: text files that say what a client sends and what a controller answers.
//!
//! `tests/vectors/firmware/README.md` describes the files. The same code drives the simulated TXT and the maker's
//! firmware, so that neither can be read more kindly than the other.

use std::collections::HashMap;
use std::io::{ErrorKind, Read, Write};
use std::net::{IpAddr, Shutdown, SocketAddr, TcpStream};
use std::ops::Range;
use std::path::Path;
use std::time::{Duration, Instant};
use std::{fs, thread};

/// How long anything may take that has no time of its own.
const LIMIT: f64 = 10.0;

/// After this time without another byte a recorded answer is over.
const QUIET: Duration = Duration::from_millis(150);

/// How long an exchange of `keep` and `until` takes at least: the controller's pace, also where there is none.
const PACE: Duration = Duration::from_millis(5);

/// Where a controller is.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Controller {
    pub(crate) ip: IpAddr,
    pub(crate) main: u16,
    pub(crate) camera: u16,
    pub(crate) i2c: u16,
}

impl Controller {
    pub(crate) fn connect(&self, port: &str) -> Result<TcpStream, String> {
        let number = match port {
            "main" => self.main,
            "camera" => self.camera,
            "i2c" => self.i2c,
            other => return Err(format!("{other} is no port")),
        };
        let address = SocketAddr::new(self.ip, number);
        let stream = TcpStream::connect_timeout(&address, Duration::from_secs(2));
        let stream = stream.map_err(|error| format!("{port}: {error}"))?;
        stream.set_nodelay(true).map_err(|error| error.to_string())?;
        Ok(stream)
    }

    /// Whether the program of the controller answers a QueryStatus on a new connection.
    pub(crate) fn answers(&self) -> bool {
        let Ok(mut stream) = self.connect("main") else { return false };
        let wait = Some(Duration::from_millis(500));
        let asked = stream.set_read_timeout(wait).is_ok()
            && stream.write_all(&0xDC21_219A_u32.to_le_bytes()).is_ok();
        asked && stream.read_exact(&mut [0; 24]).is_ok()
    }
}

/// What a session does with the I/O board and what is plugged in there.
pub(crate) trait Board {
    /// Carries out a command of a `board` line, and gives its answer; `None` when it can't.
    fn command(&mut self, command: &str) -> Option<String>;
}

/// How a session ended.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Outcome {
    /// As the file says.
    Same,
    /// A command for the board could not be carried out.
    Skipped,
}

/// The packets that have names.
pub(crate) struct Packets(HashMap<String, String>);

impl Packets {
    pub(crate) fn load(path: &Path) -> Result<Self, String> {
        let text =
            fs::read_to_string(path).map_err(|error| format!("{}: {error}", path.display()))?;
        let named = content(&text).filter_map(|line| line.split_once('='));
        Ok(Self(named.map(|(name, bytes)| (name.trim().into(), bytes.trim().into())).collect()))
    }

    /// The bytes of these words; `None` for a byte that may have any value.
    fn bytes(&self, words: &str) -> Result<Vec<Option<u8>>, String> {
        let mut bytes = Vec::new();
        for word in words.split_whitespace() {
            if let Some(named) = self.0.get(word) {
                bytes.extend(self.bytes(named)?);
                continue;
            }
            let (part, times) = match word.split_once('*') {
                Some((part, times)) => {
                    (part, times.parse().map_err(|_| format!("{word} is no packet"))?)
                }
                None => (word, 1),
            };
            let part = part_bytes(part).ok_or_else(|| format!("{word} is no packet"))?;
            bytes.extend(part.repeat(times));
        }
        Ok(bytes)
    }

    fn exact(&self, words: &str) -> Result<Vec<u8>, String> {
        let bytes: Option<Vec<u8>> = self.bytes(words)?.into_iter().collect();
        bytes.ok_or_else(|| format!("{words} has no exact bytes"))
    }
}

/// The bytes of hexadecimal digits, or of `=512`, a number of 16 bits.
fn part_bytes(part: &str) -> Option<Vec<Option<u8>>> {
    if let Some(number) = part.strip_prefix('=') {
        let number: i32 = number.parse().ok()?;
        return Some((number as u16).to_le_bytes().map(Some).to_vec());
    }
    let digits: Vec<char> = part.chars().collect();
    let byte = |pair: &[char]| match pair {
        ['?', '?'] => Some(None),
        [high, low] => Some(Some((high.to_digit(16)? * 16 + low.to_digit(16)?) as u8)),
        _ => None,
    };
    digits.chunks(2).map(byte).collect()
}

/// The lines without their comments, which begin with a semicolon, and those that say something.
fn content(text: &str) -> impl Iterator<Item = &str> {
    text.lines().map(without_comment).filter(|line| !line.is_empty())
}

fn without_comment(line: &str) -> &str {
    line.split(';').next().unwrap_or_default().trim()
}

/// Carries out the session in this text. `recorded` gets each line, with what came instead of a question mark and the
/// time that it took.
pub(crate) fn run(
    text: &str,
    packets: &Packets,
    controller: Controller,
    board: &mut dyn Board,
    recorded: &mut Vec<String>,
) -> Result<Outcome, String> {
    let mut player =
        Player { packets, controller, board, peers: HashMap::new(), since: Instant::now() };
    for (number, line) in text.lines().enumerate() {
        let content = without_comment(line);
        if content.is_empty() {
            recorded.push(line.to_owned());
            continue;
        }
        match player
            .line(content)
            .map_err(|error| format!("line {}, {content}: {error}", number + 1))?
        {
            Done::Skipped => return Ok(Outcome::Skipped),
            Done::Now => recorded.push(line.to_owned()),
            Done::Came(lines) => recorded.extend(lines),
            Done::After(time) => recorded.push(format!("{content} ; {:.3}", time.as_secs_f64())),
        }
    }
    player.end()?;
    Ok(Outcome::Same)
}

enum Done {
    Skipped,
    Now,
    /// Something came this long after what was done last.
    After(Duration),
    /// These lines say what came.
    Came(Vec<String>),
}

struct Player<'a> {
    packets: &'a Packets,
    controller: Controller,
    board: &'a mut dyn Board,
    peers: HashMap<String, Peer>,
    /// When something was done last that may have an answer.
    since: Instant,
}

impl Player<'_> {
    fn line(&mut self, line: &str) -> Result<Done, String> {
        let (first, rest) = line.split_once(' ').unwrap_or((line, ""));
        let rest = rest.trim();
        match first {
            "open" => {
                let (name, port) = rest.split_once(' ').ok_or("open NAME PORT")?;
                self.since = Instant::now();
                self.peers.insert(name.into(), Peer::new(self.controller.connect(port)?)?);
                Ok(Done::Now)
            }
            "refused" => match self.controller.connect(rest) {
                Ok(_) => Err("is accepted".into()),
                Err(_) => Ok(Done::Now),
            },
            "wait" => {
                thread::sleep(seconds(rest)?);
                Ok(Done::Now)
            }
            "back" => self.back(rest),
            "board" => self.board(rest),
            peer => self.of_peer(peer, rest),
        }
    }

    /// Waits until the controller's program answers again.
    fn back(&mut self, band: &str) -> Result<Done, String> {
        let band = Band::parse(band)?;
        while !self.controller.answers() {
            if self.since.elapsed() > band.latest() {
                return Err("does not answer".into());
            }
            thread::sleep(Duration::from_millis(50));
        }
        band.check(self.since.elapsed())
    }

    fn board(&mut self, rest: &str) -> Result<Done, String> {
        let (command, expected) = rest.split_once(" is ").unwrap_or((rest, ""));
        let Some(answer) = self.board.command(command) else { return Ok(Done::Skipped) };
        match expected {
            "" => Ok(Done::Now),
            "?" => Ok(Done::Came(vec![format!("board {command} is {answer}")])),
            expected if expected == answer => Ok(Done::Now),
            expected => Err(format!("is {answer}, not {expected}")),
        }
    }

    fn of_peer(&mut self, name: &str, line: &str) -> Result<Done, String> {
        let peer = self.peers.get_mut(name).ok_or_else(|| format!("{name} is not open"))?;
        let (what, rest) = line.split_once(' ').unwrap_or((line, ""));
        let (bytes, band) = rest.split_once("within").unwrap_or((rest, ""));
        match what {
            ">" => {
                peer.quiet().map_err(|error| format!("before it: {error}"))?;
                self.since = Instant::now();
                // A connection that the controller has closed is noticed by what is expected next.
                let _ = peer.stream.write_all(&self.packets.exact(bytes)?);
                Ok(Done::Now)
            }
            "<" => {
                let band = Band::parse(band)?;
                let expected = self.packets.bytes(bytes)?;
                peer.read(expected.len(), self.since + band.latest())?;
                peer.take(&expected)?;
                band.check(self.since.elapsed())
            }
            "?" => {
                let limit = if rest.is_empty() { Duration::from_secs(1) } else { seconds(rest)? };
                let lines = peer.record(limit)?;
                let after = |at: Instant| at.saturating_duration_since(self.since).as_secs_f64();
                let shown =
                    lines.iter().map(|(line, at)| format!("{name} {line} ; {:.3}", after(*at)));
                Ok(Done::Came(shown.collect()))
            }
            "inputs" => {
                let header = self.packets.bytes("e6543b6f ??*12")?;
                peer.packet(&header, 4..8, self.since + Band::parse(band)?.latest())?;
                Ok(Done::Now)
            }
            "frame" => {
                let band = Band::parse(band)?;
                let header = self.packets.bytes(&format!("{bytes} ??*4"))?;
                peer.packet(&header, 16..20, self.since + band.latest())?;
                band.check(self.since.elapsed())
            }
            "closed" => {
                let band = Band::parse(band)?;
                peer.closed(self.since + band.latest())?;
                band.check(self.since.elapsed())
            }
            "silent" => peer.silent(seconds(rest)?).map(|()| Done::Now),
            "end" => {
                self.since = Instant::now();
                let ended = peer.stream.shutdown(Shutdown::Write);
                ended.map(|()| Done::Now).map_err(|error| error.to_string())
            }
            "drop" => {
                self.since = Instant::now();
                self.peers.remove(name);
                Ok(Done::Now)
            }
            "keep" | "until" => {
                let (request, response) =
                    bytes.split_once('<').ok_or("REQUEST < RESPONSE is missing")?;
                let request = self.packets.exact(request)?;
                let response = self.packets.bytes(response)?;
                let band = Band::parse(band)?;
                self.since = Instant::now();
                peer.exchange(&request, &response, what == "until", &band)?;
                if what == "keep" {
                    return Ok(Done::Now);
                }
                band.check(self.since.elapsed())
            }
            other => Err(format!("{other} is nothing that a connection does")),
        }
    }

    /// Checks that nothing is left.
    fn end(&mut self) -> Result<(), String> {
        self.peers
            .iter_mut()
            .try_for_each(|(name, peer)| peer.quiet().map_err(|error| format!("{name}: {error}")))
    }
}

/// One connection, and what has arrived on it.
struct Peer {
    stream: TcpStream,
    arrived: Vec<u8>,
    is_closed: bool,
}

impl Peer {
    fn new(stream: TcpStream) -> Result<Self, String> {
        Ok(Self { stream, arrived: Vec::new(), is_closed: false })
    }

    /// Waits until bytes or the end arrive, at most until the deadline; `false` when it has passed.
    fn more(&mut self, deadline: Instant) -> Result<bool, String> {
        let left = deadline.saturating_duration_since(Instant::now()).max(Duration::from_millis(1));
        self.stream.set_read_timeout(Some(left)).map_err(|error| error.to_string())?;
        let mut buffer = [0; 4096];
        match self.stream.read(&mut buffer) {
            Ok(0) => self.is_closed = true,
            Ok(count) => self.arrived.extend(&buffer[..count]),
            Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => {
                return Ok(false);
            }
            // Closed with something unread. It makes no difference for a client.
            Err(_) => self.is_closed = true,
        }
        Ok(true)
    }

    fn read(&mut self, count: usize, deadline: Instant) -> Result<(), String> {
        while self.arrived.len() < count {
            if self.is_closed {
                return Err(format!("closed after {}", shown(&self.arrived)));
            }
            if !self.more(deadline)? {
                return Err(format!("only {} came", shown(&self.arrived)));
            }
        }
        Ok(())
    }

    /// Removes these bytes from what has arrived.
    fn take(&mut self, expected: &[Option<u8>]) -> Result<(), String> {
        let came: Vec<u8> = self.arrived.drain(..expected.len()).collect();
        if matches(&came, expected) {
            return Ok(());
        }
        Err(format!("{} came", shown(&came)))
    }

    /// Reads a header, and as many bytes as it says in this place.
    fn packet(
        &mut self,
        header: &[Option<u8>],
        size: Range<usize>,
        deadline: Instant,
    ) -> Result<(), String> {
        self.read(header.len(), deadline)?;
        let length =
            self.arrived[size].iter().rev().fold(0, |size, byte| size << 8 | usize::from(*byte));
        self.take(header)?;
        self.read(length, deadline)?;
        self.arrived.drain(..length);
        Ok(())
    }

    fn closed(&mut self, deadline: Instant) -> Result<(), String> {
        while !self.is_closed && self.arrived.is_empty() {
            if !self.more(deadline)? {
                return Err("stays open".into());
            }
        }
        if self.arrived.is_empty() {
            return Ok(());
        }
        Err(format!("{} came", shown(&self.arrived)))
    }

    fn silent(&mut self, time: Duration) -> Result<(), String> {
        let deadline = Instant::now() + time;
        while self.arrived.is_empty() && !self.is_closed {
            if !self.more(deadline)? {
                return Ok(());
            }
        }
        Err(if self.is_closed {
            "is closed".into()
        } else {
            format!("{} came", shown(&self.arrived))
        })
    }

    /// Checks that no bytes have arrived that nobody asked for.
    fn quiet(&mut self) -> Result<(), String> {
        while !self.is_closed && self.more(Instant::now())? {}
        if self.arrived.is_empty() {
            return Ok(());
        }
        Err(format!("{} came", shown(&self.arrived)))
    }

    /// Exchanges until the response is the expected one, or as long as it is, for the time of the band.
    fn exchange(
        &mut self,
        request: &[u8],
        response: &[Option<u8>],
        until: bool,
        band: &Band,
    ) -> Result<(), String> {
        let begin = Instant::now();
        loop {
            let sent = Instant::now();
            let _ = self.stream.write_all(request);
            self.read(response.len(), sent + Duration::from_secs_f64(LIMIT))?;
            let came: Vec<u8> = self.arrived.drain(..response.len()).collect();
            let is_expected = matches(&came, response);
            let is_over = begin.elapsed() > band.latest();
            match (until, is_expected) {
                (true, true) => return Ok(()),
                (false, true) if is_over => return Ok(()),
                (true, false) if !is_over => {}
                (false, true) => {}
                _ => return Err(format!("{} came", shown(&came))),
            }
            thread::sleep(PACE.saturating_sub(sent.elapsed()));
        }
    }

    /// What came, as lines, and when.
    fn record(&mut self, limit: Duration) -> Result<Vec<(String, Instant)>, String> {
        let deadline = Instant::now() + limit;
        while self.arrived.is_empty() && !self.is_closed {
            if !self.more(deadline)? {
                return Ok(vec![(format!("silent {}", limit.as_secs_f64()), Instant::now())]);
            }
        }
        let mut at = Instant::now();
        while !self.is_closed && self.more(Instant::now() + QUIET)? {
            if !self.is_closed {
                at = Instant::now();
            }
        }
        let mut lines = Vec::new();
        if !self.arrived.is_empty() {
            lines.push((format!("< {}", shown(&self.arrived)), at));
            self.arrived.clear();
        }
        if self.is_closed {
            lines.push(("closed".into(), Instant::now()));
        }
        Ok(lines)
    }
}

fn matches(came: &[u8], expected: &[Option<u8>]) -> bool {
    let same =
        |(came, expected): (&u8, &Option<u8>)| expected.is_none_or(|expected| expected == *came);
    came.len() == expected.len() && came.iter().zip(expected).all(same)
}

/// Bytes in words of four, with a number for more than three that are the same.
fn shown(bytes: &[u8]) -> String {
    let mut words: Vec<String> = Vec::new();
    let mut word = String::new();
    let mut rest = bytes;
    while let Some(first) = rest.first() {
        let same = rest.iter().take_while(|byte| *byte == first).count();
        if same > 4 {
            words.extend([std::mem::take(&mut word), format!("{first:02x}*{same}")]);
            rest = &rest[same..];
            continue;
        }
        word += &format!("{first:02x}");
        if word.len() == 8 {
            words.push(std::mem::take(&mut word));
        }
        rest = &rest[1..];
    }
    words.push(word);
    words.retain(|word| !word.is_empty());
    words.join(" ")
}

/// The times in s between which something has to come.
struct Band {
    from: f64,
    to: f64,
}

impl Band {
    /// `4..8`, or nothing.
    fn parse(text: &str) -> Result<Self, String> {
        let text = text.trim();
        if text.is_empty() {
            return Ok(Self { from: 0.0, to: LIMIT });
        }
        let number = |text: &str| text.parse().map_err(|_| format!("{text} is no time"));
        let (from, to) = text.split_once("..").ok_or_else(|| format!("{text} is no time"))?;
        Ok(Self { from: number(from)?, to: number(to)? })
    }

    fn latest(&self) -> Duration {
        Duration::from_secs_f64(self.to)
    }

    fn check(&self, time: Duration) -> Result<Done, String> {
        if time.as_secs_f64() < self.from {
            return Err(format!("already after {:.3} s", time.as_secs_f64()));
        }
        Ok(Done::After(time))
    }
}

fn seconds(text: &str) -> Result<Duration, String> {
    let time: f64 = text.parse().map_err(|_| format!("{text} is no time"))?;
    Duration::try_from_secs_f64(time).map_err(|error| error.to_string())
}
