//! Attaches a recording to a handler.

use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use crossbeam_channel::{bounded, Receiver, RecvTimeoutError, Sender, TryRecvError, TrySendError};
use ft_transfer_area::notices;
use ft_transfer_area::{
    CameraFrame, CycleLog, EventKind, Events, IoError, LogEntry, LoggedCycle, Statistics,
    TimedEvent, TransferAreaComHandler, TransferAreas,
};
use log::Level;
use mcap::{McapError, McapResult};

use crate::error::Error;
use crate::feed::{Fed, FedEntry, Feed};
use crate::file;
use crate::format::Transfer;
use crate::history::Follow;
use crate::parts::Parts;
use crate::target::Target;
use crate::under_way::UnderWay;
use crate::writer::Losses;

/// How often the recorder looks for new entries.
const LOOK: Duration = Duration::from_millis(10);

/// How often everything is handed to the operating system, and the statistics are written; these also at the end of a
/// transfer.
const FLUSH: Duration = Duration::from_millis(500);
const STATISTICS: Duration = Duration::from_secs(1);

/// How long the beginning and the end of a recording may take. A disk that takes nothing for so long stands still.
const DISK_LIMIT: Duration = Duration::from_secs(5);

/// How long the end waits for a logger that blocks.
const LAST_LINES: Duration = Duration::from_millis(100);

/// How many names wait for the disk.
const RENAMES: usize = 16;

/// How many pictures wait for the disk, and how many bytes they may have.
const FRAMES: usize = 32;
const FRAME_BYTES: usize = 64 << 20;

/// How a recording is made.
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub struct Options {
    /// How many cycles wait for a slow disk before the next ones are lost; the default 500 is about five seconds,
    /// and takes 5 MB. Fewer than 10 may lose cycles on a fast disk, too.
    pub capacity: usize,
    /// Into several files; `None`, the default, for one.
    pub parts: Option<Parts>,
}

impl Default for Options {
    fn default() -> Self {
        Self { capacity: 500, parts: None }
    }
}

impl Options {
    /// With this number of cycles that wait for a slow disk, 1..=[`CycleLog::MAX_CAPACITY`].
    #[must_use]
    pub fn capacity(self, capacity: usize) -> Self {
        Self { capacity, ..self }
    }

    /// Into several files.
    #[must_use]
    pub fn parts(self, parts: Parts) -> Self {
        Self { parts: Some(parts), ..self }
    }
}

/// What a recording has so far, or in all.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct Totals {
    /// Cycles in the file.
    pub cycles: u64,
    /// Entries, most of them cycles, that were lost because the disk was too slow.
    pub lost: u64,
    /// Pictures of the camera in the file.
    pub frames: u64,
    /// Pictures that were lost because the disk was too slow.
    pub lost_frames: u64,
    /// About how large the file is; of a recording in parts, the newest one.
    pub bytes: u64,
}

/// How many recordings may wait for files that take nothing. Each has a thread until its file does.
const BEGINNINGS: usize = 64;

/// How many begin now.
static BEGIN: AtomicUsize = AtomicUsize::new(0);

/// A recording that begins, and is counted here.
struct Beginning(&'static AtomicUsize);

impl Beginning {
    fn new(count: &'static AtomicUsize) -> Result<Self, IoError> {
        // Dropped, it counts no more.
        let this = Self(count);
        match count.fetch_add(1, Ordering::Relaxed) {
            0..BEGINNINGS => Ok(this),
            _ => Err(io::Error::new(
                io::ErrorKind::WouldBlock,
                format!("{BEGINNINGS} earlier recordings still wait for files that take nothing"),
            )
            .into()),
        }
    }
}

impl Drop for Beginning {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::Relaxed);
    }
}

/// Records a handler into a file, in a thread of its own.
///
/// It records from now on, through the beginnings and ends of transfers, until [`finish`](Self::finish) or the
/// end of the handler. A transfer never waits for it. A relative path is one of the program's present folder, at each new
/// part and name, too: give an absolute one to a program that changes its folder.
///
/// **A program that drops it without `finish` leaves**, by a panic or an early return: the transfer ends, with all
/// motors stopped, and then the file is finished as in `finish`. An error is only logged.
/// That is so with [`start`](Self::start), and with [`follow`](Self::follow) of the history of a handler; one that is
/// [`fed`](Self::fed) knows no handler, and its end may take as long as `finish`.
///
/// ```
/// use ft_transfer_area_simulator::SimulatedTxt;
/// use ft_transfer_area::prelude::*;
/// use ft_transfer_area_recorder::{Options, Recorder};
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// # let folder = tempfile::tempdir()?;
/// # let path = folder.path().join("run.mcap");
/// let txt = SimulatedTxt::builder().start()?;
/// let handler = TransferAreaComHandler::builder(txt.address().to_string()).build()?;
/// let areas = handler.areas();
/// let recorder = Recorder::start(&handler, &path, Options::default())?;
/// handler.begin_transfer()?;
/// areas.wait_cycle()?[0].output.duty[O1] = 512;
/// handler.end_transfer()?;
/// let recorded = recorder.finish()?;
/// assert!(recorded.cycles >= 2);
/// assert_eq!(recorded.lost, 0);
/// # Ok(())
/// # }
/// ```
#[derive(Debug)]
pub struct Recorder {
    path: PathBuf,
    is_in_parts: bool,
    state: Arc<State>,
    /// What to end when the program leaves without `finish`.
    transfer: Option<TransferAreas>,
    /// To the thread; dropped to end it.
    renames: Option<Sender<Rename>>,
    renaming: Option<Renaming>,
    /// Has an end when the thread has ended.
    ended: Receiver<()>,
    thread: Option<JoinHandle<()>>,
    frames: FrameSink,
}

/// The name that the thread is to give the file.
struct Rename {
    to: PathBuf,
    /// Nobody waits for it any more then.
    until: Instant,
    done: Sender<io::Result<()>>,
}

/// What the program knows of it.
#[derive(Debug)]
struct Renaming {
    to: PathBuf,
    until: Instant,
    done: Receiver<io::Result<()>>,
}

/// Takes the camera's pictures into a recording. Cheap to clone, for the thread that gets them.
#[derive(Clone, Debug)]
pub struct FrameSink {
    sender: Sender<CameraFrame>,
    state: Arc<State>,
}

/// What the recorder's thread and the program share.
#[derive(Debug, Default)]
struct State {
    /// The file, of several the newest.
    path: Mutex<PathBuf>,
    recorded: Mutex<Totals>,
    /// How many bytes the file has.
    bytes: AtomicU64,
    lost_frames: AtomicU64,
    /// The bytes of the pictures that wait.
    frame_bytes: AtomicUsize,
    failure: Mutex<Option<IoError>>,
}

impl State {
    fn path(&self) -> PathBuf {
        self.path.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    fn set_path(&self, path: &Path) {
        path.clone_into(&mut self.path.lock().unwrap_or_else(PoisonError::into_inner));
    }

    fn recorded(&self) -> Totals {
        let recorded = *self.recorded.lock().unwrap_or_else(PoisonError::into_inner);
        let lost_frames = self.lost_frames.load(Ordering::Relaxed);
        Totals { lost_frames, bytes: self.bytes.load(Ordering::Relaxed), ..recorded }
    }

    fn failure(&self) -> Option<IoError> {
        self.failure.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

impl FrameSink {
    /// Records a picture. Does not wait: if the disk is too slow, the picture is lost and counted.
    pub fn record(&self, frame: &CameraFrame) {
        let (state, size) = (&self.state, frame.data.len());
        let has_room = state.frame_bytes.fetch_add(size, Ordering::Relaxed) + size <= FRAME_BYTES;
        if !has_room || self.sender.try_send(frame.clone()).is_err() {
            state.frame_bytes.fetch_sub(size, Ordering::Relaxed);
            state.lost_frames.fetch_add(1, Ordering::Relaxed);
        }
    }
}

impl Recorder {
    /// Begins to record, into a new file in place of an earlier one: who reads that goes on reading it. To have all of a
    /// transfer, call it before `begin_transfer`. Blocks until the head of the file is written, for 5 s at most.
    ///
    /// # Errors
    ///
    /// The file can't be created, another recording is being written into it, or it takes nothing in these 5 s, as a pipe
    /// that nobody reads; the capacity is out of range, or the operating system has no more threads.
    pub fn start(
        handler: &TransferAreaComHandler,
        path: impl AsRef<Path>,
        options: Options,
    ) -> Result<Self, Error> {
        let path = path.as_ref().to_owned();
        let refused = |error: ft_transfer_area::Error| not_started(io::Error::other(error));
        let log = handler.areas().cycle_log(options.capacity).map_err(refused)?;
        // The log has the others.
        let kinds = EventKind::ALL.iter().copied().filter(|kind| kind.is_of_response());
        let capacity = (4 * options.capacity).min(Events::MAX_CAPACITY);
        let events =
            handler.areas().events(&kinds.collect::<Vec<_>>(), capacity).map_err(refused)?;
        let source = Source::Handler { log, events };
        let mut recorder = Self::record(path, options.parts, source, DISK_LIMIT)?;
        recorder.transfer = Some(handler.areas().clone());
        Ok(recorder)
    }

    /// Begins to record what the program hands in, into a new file in place of an earlier one: for a program that
    /// has no handler, such as one that looks at the connection of another one. Blocks as [`start`](Self::start).
    ///
    /// # Errors
    ///
    /// As with [`start`](Self::start).
    pub fn fed(path: impl AsRef<Path>, options: Options) -> Result<(Self, Feed), Error> {
        if !(1..=CycleLog::MAX_CAPACITY).contains(&options.capacity) {
            let most = CycleLog::MAX_CAPACITY;
            let sentence = format!("the capacity is {}, not 1 to {most}", options.capacity);
            return Err(not_started(io::Error::new(io::ErrorKind::InvalidInput, sentence)));
        }
        let (feed, entries, lost) = Feed::channel(options.capacity);
        let source = Source::Feed { entries, lost };
        let path = path.as_ref().to_owned();
        let recorder = Self::record(path, options.parts, source, DISK_LIMIT)?;
        Ok((recorder, feed))
    }

    /// Begins to record what a [`History`](crate::History) had, and what it gets from then on, until it hands on no
    /// more. The file begins with the oldest of it. Blocks as [`start`](Self::start).
    ///
    /// Instead of a number of cycles, as many bytes as the history has room for wait for a slow disk.
    ///
    /// When it is dropped without [`finish`](Self::finish), the transfer of the history's handler ends, unless it
    /// [only looks](Follow::that_only_looks).
    ///
    /// # Errors
    ///
    /// The file can't be created, another recording is being written into it, or it takes nothing in 5 s, or the
    /// operating system has no more threads.
    pub fn follow(
        path: impl AsRef<Path>,
        mut follow: Follow,
        options: Options,
    ) -> Result<Self, Error> {
        let path = path.as_ref().to_owned();
        let transfer = follow.take_transfer();
        let mut recorder = Self::record(path, options.parts, Source::History(follow), DISK_LIMIT)?;
        recorder.transfer = transfer;
        Ok(recorder)
    }

    fn record(
        path: PathBuf,
        parts: Option<Parts>,
        source: Source,
        limit: Duration,
    ) -> Result<Self, Error> {
        let (sender, frames) = bounded(FRAMES);
        let (rename, renames) = bounded(RENAMES);
        let state = Arc::new(State { path: Mutex::new(path.clone()), ..State::default() });
        let within = source.within();
        let begin_at = within.as_ref().map_or_else(Instant::now, |(since, _)| *since);
        let worker = Worker {
            source,
            frames,
            renames,
            state: Arc::clone(&state),
            flushed: begin_at,
            reported: None,
            unreported: None,
        };
        let beginning = Beginning::new(&BEGIN).map_err(|cause| Error::Write {
            path: path.clone(),
            cause,
            cycles: 0,
        })?;
        let (begin, begun) = bounded(1);
        let (hand, handed) = bounded(1);
        let (end, ended) = bounded(0);
        let follows = worker.source.follows();
        let work = {
            let path = path.clone();
            move || {
                // Dropped at the end, whatever happens.
                let _end: Sender<()> = end;
                let _follows = follows;
                block_size_signal();
                let target = Target::create(path, parts, within);
                drop(beginning);
                // Both fail when nobody waits for it any more.
                match target {
                    Ok(target) => {
                        let _ = begin.send(Ok(target.newest().to_owned()));
                        match handed.recv() {
                            Ok(worker) => Worker::run(worker, target),
                            Err(_) => target.discard(),
                        }
                    }
                    Err(error) => drop(begin.send(Err(error))),
                }
            }
        };
        let thread = std::thread::Builder::new()
            .name("recorder".to_owned())
            .spawn(work)
            .map_err(not_started)?;
        let begun = match begun.recv_timeout(limit) {
            Ok(begun) => begun.map_err(cause),
            Err(RecvTimeoutError::Timeout) => Err(stands_still("beginning", limit)),
            Err(RecvTimeoutError::Disconnected) => Err(panicked()),
        };
        // A file that takes nothing keeps its thread, but not what is to be recorded.
        let begun = begun.and_then(|file| {
            state.set_path(&file);
            hand.send(worker).map(|()| file).map_err(|_| panicked())
        });
        let path = begun.map_err(|cause| Error::Write { path, cause, cycles: 0 })?;
        let frames = FrameSink { sender, state: Arc::clone(&state) };
        Ok(Self {
            path,
            is_in_parts: parts.is_some(),
            state,
            transfer: None,
            renames: Some(rename),
            renaming: None,
            ended,
            thread: Some(thread),
            frames,
        })
    }

    /// The file; of a recording in parts the first one.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The file that is being written; of a recording in parts the newest one.
    pub fn newest(&self) -> PathBuf {
        self.state.path()
    }

    /// Gives the file another name while it is recorded, in place of a file that has this name already: so a program
    /// can record beside an earlier recording, and replace it when its transfer has begun. Both names have to be on
    /// the same disk. Blocks until what has come in so far is written and the file has the name, for 5 s at most.
    ///
    /// # Errors
    ///
    /// Another recording is being written into the file that has the name, the operating system refuses it, the disk
    /// takes nothing in these 5 s, 16 earlier names still wait for it, nothing more is recorded because of an
    /// [`error`](Self::error), or this is a recording in parts. The recording goes on under the name that it had.
    pub fn rename(&mut self, path: impl AsRef<Path>) -> Result<(), Error> {
        self.begin_rename(path)?;
        self.renamed(Duration::MAX).unwrap_or(Ok(()))
    }

    /// The same without waiting: [`renamed`](Self::renamed) says when it is done.
    ///
    /// # Errors
    ///
    /// This is a recording in parts, or 16 earlier names still wait for the disk.
    pub fn begin_rename(&mut self, path: impl AsRef<Path>) -> Result<(), Error> {
        self.begin_rename_within(path.as_ref(), DISK_LIMIT)
    }

    fn begin_rename_within(&mut self, path: &Path, limit: Duration) -> Result<(), Error> {
        let to = path.to_owned();
        if self.is_in_parts {
            let cause = io::Error::new(io::ErrorKind::InvalidInput, "parts keep their names");
            return Err(Error::Write { path: to, cause: cause.into(), cycles: 0 });
        }
        let until = Instant::now() + limit;
        let (sender, done) = bounded(1);
        let rename = Rename { to: to.clone(), until, done: sender };
        // Without a thread, the end of the other one says so.
        let sent = self.renames.as_ref().map_or(Ok(()), |renames| renames.try_send(rename));
        if matches!(sent, Err(TrySendError::Full(_))) {
            let cause =
                io::Error::new(io::ErrorKind::WouldBlock, "earlier names still wait for the disk");
            return Err(Error::Write { path: to, cause: cause.into(), cycles: 0 });
        }
        self.renaming = Some(Renaming { to, until, done });
        Ok(())
    }

    /// Whether the file has the name of the last [`begin_rename`](Self::begin_rename), for which it waits so long here.
    /// `None`: not yet, or this was said already.
    ///
    /// # Errors
    ///
    /// As with [`rename`](Self::rename).
    pub fn renamed(&mut self, wait: Duration) -> Option<Result<(), Error>> {
        let Renaming { until, done, .. } = self.renaming.as_ref()?;
        let wait = wait.min(until.saturating_duration_since(Instant::now()));
        let cause = match done.recv_timeout(wait) {
            Err(RecvTimeoutError::Timeout) if Instant::now() < *until => return None,
            Ok(Ok(())) => None,
            Ok(Err(cause)) => Some(cause.into()),
            Err(RecvTimeoutError::Timeout) => Some(stands_still("new name", DISK_LIMIT)),
            Err(RecvTimeoutError::Disconnected) => {
                Some(self.state.failure().unwrap_or_else(panicked))
            }
        };
        let path = self.renaming.take()?.to;
        Some(match cause {
            None => {
                self.path = path;
                Ok(())
            }
            Some(cause) => Err(Error::Write { path, cause, cycles: 0 }),
        })
    }

    /// What was recorded so far.
    pub fn recorded(&self) -> Totals {
        self.state.recorded()
    }

    /// Where to hand in the camera's pictures.
    pub fn frames(&self) -> FrameSink {
        self.frames.clone()
    }

    /// Why nothing more is recorded, as on a full disk; `None` while all is well.
    pub fn error(&self) -> Option<Error> {
        let cause = self.state.failure()?;
        Some(Error::Write { path: self.newest(), cause, cycles: self.state.recorded().cycles })
    }

    /// Writes what has come in so far, ends the file, and says what is in it. A transfer goes on. Blocks until this
    /// is done, for 5 s at most: then the thread that writes is left to a disk that stands still.
    ///
    /// # Errors
    ///
    /// A write has failed, now or before, or takes longer than the limit. What was written before can be read.
    pub fn finish(self) -> Result<Totals, Error> {
        self.finish_with_newest().map(|(totals, _)| totals)
    }

    /// The same, with the file that was written last: of a recording in parts, one may begin at the end.
    ///
    /// # Errors
    ///
    /// As with [`finish`](Self::finish).
    pub fn finish_with_newest(mut self) -> Result<(Totals, PathBuf), Error> {
        // The transfer goes on, unless this runs in a panic.
        self.transfer = None;
        self.end();
        self.error().map_or_else(|| Ok((self.state.recorded(), self.newest())), Err)
    }

    fn end(&mut self) {
        self.renames = None;
        let Some(thread) = self.thread.take() else { return };
        let failure = if self.ended.recv_timeout(DISK_LIMIT) == Err(RecvTimeoutError::Timeout) {
            Some(stands_still("end", DISK_LIMIT))
        } else {
            thread.join().is_err().then(panicked)
        };
        if let Some(error) = failure {
            let mut failure = self.state.failure.lock().unwrap_or_else(PoisonError::into_inner);
            failure.get_or_insert(error);
        }
    }
}

impl Drop for Recorder {
    fn drop(&mut self) {
        // The motors do not wait for the disk.
        if let Some(transfer) = self.transfer.take() {
            transfer.ask_to_end();
        }
        self.end();
    }
}

fn not_started(cause: io::Error) -> Error {
    Error::NotStarted { cause: cause.into() }
}

fn stands_still(what: &str, limit: Duration) -> IoError {
    let waited = format!("the disk has not taken the {what} of it in {limit:?}");
    io::Error::new(io::ErrorKind::TimedOut, waited).into()
}

fn panicked() -> IoError {
    io::Error::other("the recorder panicked").into()
}

/// A limit for the size of files makes an error of a write by this thread, not the end of the program.
fn block_size_signal() {
    #[cfg(unix)]
    {
        use nix::sys::signal::{SigSet, Signal};
        let mut signals = SigSet::empty();
        signals.add(Signal::SIGXFSZ);
        if let Err(error) = signals.thread_block() {
            let text =
                format_args!("a limit for the size of files would end this program: {error}");
            notices::leave(Level::Warn, module_path!(), text);
        }
    }
}

/// What went wrong, in the words of the operating system if it was that.
fn cause(error: McapError) -> IoError {
    match error {
        McapError::Io(error) => error.into(),
        other => io::Error::other(other).into(),
    }
}

/// Where the entries come from.
enum Source {
    Handler {
        log: CycleLog,
        events: Events,
    },
    Feed {
        entries: Receiver<FedEntry>,
        /// How many had no room.
        lost: Arc<AtomicU64>,
    },
    History(Follow),
}

/// The recorder's thread.
struct Worker {
    source: Source,
    frames: Receiver<CameraFrame>,
    /// Ends with the recorder.
    renames: Receiver<Rename>,
    state: Arc<State>,
    flushed: Instant,
    /// When the statistics were written last. With the first cycle they are, too: its transfer may run already.
    reported: Option<Instant>,
    /// Those since then, and when they were.
    unreported: Option<(Instant, Statistics)>,
}

impl Rename {
    /// Unless nobody waits for it any more.
    fn perform(&self, state: &State) {
        if Instant::now() >= self.until {
            return;
        }
        let done = file::rename(&state.path(), &self.to).inspect(|()| state.set_path(&self.to));
        let _ = self.done.send(done);
    }
}

impl Worker {
    fn run(mut self, mut file: Target) {
        let done = self.record_until_stopped(&mut file).and_then(|()| file.writer.finish());
        match done {
            Ok(bytes) => {
                self.state.bytes.store(bytes, Ordering::Relaxed);
                let Self { source, renames, state, .. } = self;
                drop(source);
                // The handler has ended before the recorder.
                renames.iter().for_each(|rename| rename.perform(&state));
            }
            Err(error) => {
                let cause = cause(error);
                let path = self.state.path();
                let text = format!("nothing more is recorded into {}: {cause}", path.display());
                *self.state.failure.lock().unwrap_or_else(PoisonError::into_inner) = Some(cause);
                notices::leave(Level::Error, module_path!(), format_args!("{text}"));
            }
        }
        notices::flush(LAST_LINES);
    }

    /// Records until the recorder or the handler ends, then what has come in until then.
    ///
    /// It looks from time to time and waits for no entry: waking it would cost the transfer more than the entry.
    fn record_until_stopped(&mut self, file: &mut Target) -> McapResult<()> {
        loop {
            let rename = self.renames.recv_timeout(LOOK);
            let before = self.lost().entries;
            let goes_on = self.take_all(file)?;
            if let Ok(rename) = &rename {
                // On a disk that stands still this waits, and not the new name, which could not be taken back.
                file.writer.flush()?;
                rename.perform(&self.state);
            }
            if matches!(rename, Err(RecvTimeoutError::Disconnected)) || !goes_on {
                self.report(file)?;
                // When nothing more comes, all that was lost is known.
                let lost = if goes_on { before } else { self.lost().entries };
                return self.tell_last_lost(file, lost);
            }
            self.flush_if_due(file, Instant::now())?;
        }
    }

    /// At the time of what comes next.
    fn flush_if_due(&mut self, file: &mut Target, now: Instant) -> McapResult<()> {
        if now.saturating_duration_since(self.flushed) >= FLUSH {
            file.writer.flush()?;
            file.delete_oldest();
            self.state.bytes.store(file.writer.bytes(), Ordering::Relaxed);
            self.flushed = now;
        }
        Ok(())
    }

    /// Records what has come in until now; returns whether more may come.
    fn take_all(&mut self, file: &mut Target) -> McapResult<bool> {
        let mut goes_on = true;
        // One more, to see the end.
        for _ in 0..=self.source.waiting() {
            match self.source.next() {
                Ok(Entry::Logged(entry)) => self.logged(file, entry)?,
                Ok(Entry::Fed(entry)) => self.fed(file, &entry)?,
                Ok(Entry::Kept(entry)) => self.kept(file, &entry)?,
                Err(TryRecvError::Empty) => break,
                Err(TryRecvError::Disconnected) => goes_on = false,
            }
        }
        while let Some(reported) = self.source.next_event() {
            file.writer.event(reported.arrived, &(&reported).into())?;
        }
        for _ in 0..self.frames.len() {
            if let Ok(frame) = self.frames.try_recv() {
                self.state.frame_bytes.fetch_sub(frame.data.len(), Ordering::Relaxed);
                self.frame(file, &frame)?;
            }
        }
        Ok(goes_on)
    }

    fn logged(&mut self, file: &mut Target, entry: LogEntry) -> McapResult<()> {
        let lost = entry.lost;
        match FedEntry::of_log(entry) {
            Some(entry) => self.fed(file, &entry),
            None => {
                self.count(false, lost);
                Ok(())
            }
        }
    }

    fn fed(&mut self, file: &mut Target, entry: &FedEntry) -> McapResult<()> {
        self.fed_at(file, entry, Instant::now())
    }

    /// What was before comes at once, so its own time counts.
    fn kept(&mut self, file: &mut Target, entry: &FedEntry) -> McapResult<()> {
        let at = entry.at();
        self.flush_if_due(file, at)?;
        self.fed_at(file, entry, at)
    }

    fn fed_at(&mut self, file: &mut Target, entry: &FedEntry, now: Instant) -> McapResult<()> {
        match &entry.what {
            Fed::Cycle(cycle) => self.cycle(file, cycle, entry.lost, now)?,
            Fed::Transfer { at, what } => {
                self.report(file)?;
                self.before_transfer(file, *at, entry.lost)?;
                file.writer.transfer(*at, what)?;
                if matches!(what, Transfer::Restored { .. }) {
                    self.begin_part(file, *at)?;
                }
            }
            Fed::Event { at, what } => {
                self.before_transfer(file, *at, entry.lost)?;
                file.writer.event(*at, what)?;
            }
        }
        self.count(matches!(entry.what, Fed::Cycle(_)), entry.lost);
        Ok(())
    }

    fn cycle(
        &mut self,
        file: &mut Target,
        cycle: &LoggedCycle,
        lost: u64,
        now: Instant,
    ) -> McapResult<()> {
        // Who answers after a gap comes directly behind the first cycle.
        if !(cycle.first && file.writer.is_in_gap()) {
            self.begin_part(file, cycle.arrived)?;
        }
        file.writer.cycle(cycle, lost)?;
        self.unreported = Some((cycle.arrived, cycle.statistics));
        let since = self.reported.map(|reported| now.saturating_duration_since(reported));
        if since.is_none_or(|since| since >= STATISTICS) {
            self.reported = Some(now);
            self.report(file)?;
        }
        Ok(())
    }

    /// Writes the statistics since the last time.
    fn report(&mut self, file: &mut Target) -> McapResult<()> {
        match self.unreported.take() {
            Some((at, statistics)) => file.writer.statistics(at, &statistics, self.lost()),
            None => Ok(()),
        }
    }

    /// What comes before an entry that is no cycle, with this number of lost ones before it.
    fn before_transfer(&mut self, file: &mut Target, at: Instant, lost: u64) -> McapResult<()> {
        // There may be any number of them without a cycle. A transfer that runs goes on in a new part with its cycles.
        if !file.writer.is_under_way() {
            self.begin_part(file, at)?;
        }
        match lost {
            0 => Ok(()),
            entries => file.writer.transfer(at, &Transfer::NotRecorded { entries }),
        }
    }

    /// Goes on in a new file if this one is full. It gets the statistics with which the next one begins, too.
    fn begin_part(&mut self, file: &mut Target, at: Instant) -> McapResult<()> {
        if file.is_full() {
            self.report(file)?;
            file.begin_part(at, self.lost())?;
            self.state.set_path(file.newest());
        }
        Ok(())
    }

    fn count(&self, is_cycle: bool, lost: u64) {
        let mut recorded = self.state.recorded.lock().unwrap_or_else(PoisonError::into_inner);
        recorded.cycles += u64::from(is_cycle);
        recorded.lost += lost;
    }

    /// Those after which nothing had room, of this number in all.
    fn tell_last_lost(&self, file: &mut Target, lost: u64) -> McapResult<()> {
        let mut recorded = self.state.recorded.lock().unwrap_or_else(PoisonError::into_inner);
        let entries = lost.saturating_sub(recorded.lost);
        recorded.lost += entries;
        drop(recorded);
        match entries {
            0 => Ok(()),
            entries => file.writer.transfer(Instant::now(), &Transfer::NotRecorded { entries }),
        }
    }

    fn frame(&mut self, file: &mut Target, frame: &CameraFrame) -> McapResult<()> {
        self.begin_part(file, frame.arrived)?;
        let is_in_file = file.writer.frame(frame)?;
        let mut recorded = self.state.recorded.lock().unwrap_or_else(PoisonError::into_inner);
        recorded.frames += u64::from(is_in_file);
        Ok(())
    }

    fn lost(&self) -> Losses {
        let (entries, events) = match &self.source {
            Source::Handler { log, events } => (log.lost(), events.lost()),
            Source::Feed { lost, .. } => (lost.load(Ordering::Relaxed), 0),
            Source::History(follow) => (follow.lost(), 0),
        };
        let frames = self.state.lost_frames.load(Ordering::Relaxed);
        Losses { entries, events, frames }
    }
}

/// An entry of a source.
#[allow(clippy::large_enum_variant, reason = "as in the log, so that none of them allocates")]
enum Entry {
    Logged(LogEntry),
    Fed(FedEntry),
    /// What may be from before.
    Kept(FedEntry),
}

impl Source {
    fn waiting(&self) -> usize {
        match self {
            Self::Handler { log, .. } => log.receiver().len(),
            Self::Feed { entries, .. } => entries.len(),
            Self::History(follow) => follow.waiting(),
        }
    }

    /// What a history knows its follower by.
    fn follows(&self) -> Option<Arc<()>> {
        match self {
            Self::Handler { .. } | Self::Feed { .. } => None,
            Self::History(follow) => Some(follow.is_there()),
        }
    }

    /// Since when there is something of a transfer that runs already, and what has happened to it.
    fn within(&self) -> Option<(Instant, UnderWay)> {
        match self {
            Self::Handler { .. } | Self::Feed { .. } => None,
            Self::History(follow) => Some((follow.since(), follow.under_way().clone())),
        }
    }

    fn next(&mut self) -> Result<Entry, TryRecvError> {
        match self {
            Self::Handler { log, .. } => log.try_recv().map(Entry::Logged),
            Self::Feed { entries, .. } => entries.try_recv().map(Entry::Fed),
            Self::History(follow) => follow.next().map(Entry::Kept),
        }
    }

    /// The next event of a response. Of a history it is an entry; a feed has none.
    fn next_event(&self) -> Option<TimedEvent> {
        match self {
            Self::Handler { events, .. } => events.try_recv().ok(),
            Self::Feed { .. } | Self::History(_) => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_that_wait_for_the_disk_have_a_bound_in_bytes() {
        let (sender, waiting) = bounded(FRAMES);
        let sink = FrameSink { sender, state: Arc::default() };
        let frame = CameraFrame::new(vec![0; FRAME_BYTES / 4]);
        for _ in 0..10 {
            sink.record(&frame);
        }
        assert_eq!((waiting.len(), sink.state.recorded().lost_frames), (4, 6));
    }

    #[test]
    fn a_feed_has_room_for_as_many_cycles_as_a_log() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.mcap");
        for capacity in [0, CycleLog::MAX_CAPACITY + 1, usize::MAX] {
            let fed = Recorder::fed(&path, Options::default().capacity(capacity));
            assert!(matches!(fed, Err(Error::NotStarted { .. })), "{capacity}");
        }
        assert!(!path.exists(), "an earlier file stays");
    }

    #[cfg(unix)]
    #[test]
    fn a_file_that_takes_nothing_at_the_beginning_is_an_error() {
        let folder = tempfile::tempdir().unwrap();
        let pipe = folder.path().join("pipe");
        // Without a reader it can't even be opened.
        nix::unistd::mkfifo(&pipe, nix::sys::stat::Mode::S_IRWXU).unwrap();
        let (_feed, entries, lost) = Feed::channel(1);
        let source = Source::Feed { entries, lost: Arc::clone(&lost) };
        let error =
            Recorder::record(pipe.clone(), None, source, Duration::from_millis(20)).unwrap_err();
        // Its thread waits on, without what comes in: the feed and this test have the rest.
        assert_eq!(Arc::strong_count(&lost), 2);
        assert!(format!("{error:#}").contains("has not taken the beginning"), "{error}");

        // A history knows of it until the disk goes on.
        let mut history = crate::History::new(Duration::from_secs(1), 1000);
        let source = Source::History(history.follow());
        let limit = Duration::from_millis(20);
        assert!(Recorder::record(pipe.clone(), None, source, limit).is_err());
        history.unfollow();
        assert!(history.is_followed());
        let _reader = std::fs::File::options().read(true).write(true).open(pipe).unwrap();
        let begin = Instant::now();
        while history.is_followed() {
            assert!(begin.elapsed() < Duration::from_secs(60));
            std::thread::sleep(LOOK);
        }
    }

    #[cfg(unix)]
    #[test]
    fn a_file_that_takes_nothing_gets_no_new_name_later() {
        use ft_transfer_area::FishX1Transfer;

        let folder = tempfile::tempdir().unwrap();
        let [pipe, path] = ["pipe", "run.mcap"].map(|name| folder.path().join(name));
        std::fs::write(&path, "the old one").unwrap();
        nix::unistd::mkfifo(&pipe, nix::sys::stat::Mode::S_IRWXU).unwrap();
        // Its other end.
        let both = std::fs::File::options().read(true).write(true).open(&pipe).unwrap();
        let (mut recorder, mut feed) =
            Recorder::fed(&pipe, Options::default().capacity(10)).unwrap();
        let mut reader = std::fs::File::open(&pipe).unwrap();
        drop(both);
        // What can't be compressed, and more than a pipe has room for.
        let mut word = 1_u32;
        let mut letter = || {
            word = word.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            char::from(b'a' + ((word >> 16) % 26) as u8)
        };
        for _ in 0..2000 {
            let error = (0..1000).map(|_| letter()).collect();
            let failure = crate::Failure { kind: crate::FailureKind::Other, error };
            feed.transfer(Instant::now(), Transfer::Failed(failure));
            std::thread::sleep(Duration::from_millis(1));
        }
        let mut cycle = |number| feed.cycle(LoggedCycle::new(number, &[FishX1Transfer::default()]));
        cycle(1);
        let begin = Instant::now();
        recorder.begin_rename_within(&path, Duration::from_millis(200)).unwrap();
        let renamed = recorder.renamed(Duration::ZERO);
        assert!(renamed.is_none(), "{renamed:?}");
        assert!(begin.elapsed() < Duration::from_millis(200), "it waits for nothing");
        let error = recorder.renamed(Duration::MAX).unwrap().unwrap_err();
        assert!(format!("{error:#}").contains("has not taken the new name"), "{error:#}");
        let mut more = (0..100).map(|_| recorder.begin_rename_within(&path, Duration::ZERO));
        let error = more.find_map(Result::err).expect("they do not wait without a limit");
        assert!(format!("{error:#}").contains("earlier names still wait"), "{error:#}");
        (2..=20).for_each(&mut cycle);
        let reads = std::thread::spawn(move || io::copy(&mut reader, &mut io::sink()).unwrap());
        assert_eq!(recorder.path(), pipe);
        let (totals, newest) = recorder.finish_with_newest().unwrap();
        assert_eq!(newest, pipe);
        assert!(totals.cycles < 20 && totals.cycles + totals.lost >= 20, "{totals:?}");
        reads.join().unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), b"the old one");
    }

    #[test]
    fn only_so_many_recordings_wait_for_files_that_take_nothing() {
        static COUNT: AtomicUsize = AtomicUsize::new(0);
        let all: Vec<_> = (0..BEGINNINGS).map(|_| Beginning::new(&COUNT).unwrap()).collect();
        let error = Beginning::new(&COUNT).err().unwrap();
        assert!(format!("{error:#}").contains("64 earlier recordings still wait"), "{error:#}");
        drop(all);
        assert!(Beginning::new(&COUNT).is_ok(), "they have begun");
    }

    #[test]
    fn a_finished_file_gets_another_name() {
        let folder = tempfile::tempdir().unwrap();
        let [path, other] = ["run.mcap", "other.mcap"].map(|name| folder.path().join(name));
        let (mut recorder, feed) = Recorder::fed(&path, Options::default()).unwrap();
        drop(feed);
        std::thread::sleep(LOOK * 5);
        recorder.rename(&other).unwrap();
        assert_eq!((recorder.path(), recorder.newest()), (&*other, other.clone()));
        recorder.finish().unwrap();
        assert!(other.exists() && !path.exists());
    }
}
