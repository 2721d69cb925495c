//! Attaches a recording to a handler.

use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use crossbeam_channel::{bounded, Receiver, RecvTimeoutError, Sender, TrySendError};
use ft_transfer_area::{
    CycleLog, EventKind, Events, IoError, TransferAreaComHandler, TransferAreas,
};

use crate::beginning::Beginning;
use crate::error::Error;
use crate::feed::Feed;
use crate::frames::FrameSink;
use crate::history::Follow;
use crate::options::Options;
use crate::origin::Origin;
use crate::parts::Parts;
use crate::state::{State, Totals};
use crate::target::Target;
use crate::worker::{self, block_size_signal, cause, Rename, Worker};

/// How long the beginning and the end of a recording may take. A disk that takes nothing for so long stands still.
const DISK_LIMIT: Duration = Duration::from_secs(5);

/// How many names wait for the disk.
const RENAMES: usize = 16;

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

/// What the program knows of it.
#[derive(Debug)]
struct Renaming {
    to: PathBuf,
    until: Instant,
    done: Receiver<io::Result<()>>,
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
        let origin = Origin::Handler { log, events };
        let mut recorder = Self::record(path, options.parts, origin, DISK_LIMIT)?;
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
        let origin = Origin::Feed { entries, lost };
        let path = path.as_ref().to_owned();
        let recorder = Self::record(path, options.parts, origin, DISK_LIMIT)?;
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
        let mut recorder = Self::record(path, options.parts, Origin::History(follow), DISK_LIMIT)?;
        recorder.transfer = transfer;
        Ok(recorder)
    }

    fn record(
        path: PathBuf,
        parts: Option<Parts>,
        origin: Origin,
        limit: Duration,
    ) -> Result<Self, Error> {
        let state = Arc::new(State { path: Mutex::new(path.clone()), ..State::default() });
        let (sink, frames) = FrameSink::channel(Arc::clone(&state));
        let (rename, renames) = bounded(RENAMES);
        let (within, follows) = (origin.within(), origin.follows());
        let begin_at = within.as_ref().map_or_else(Instant::now, |(since, _)| *since);
        let worker = Worker::new(origin, begin_at, frames, renames, Arc::clone(&state));
        let failed = |cause| Error::Write { path: path.clone(), cause, cycles: 0 };
        let beginning = Beginning::begin().map_err(failed)?;
        let (begin, begun) = bounded(1);
        let (hand, handed) = bounded(1);
        let (end, ended) = bounded(0);
        let work = {
            let path = path.clone();
            move || {
                // Dropped at the end, whatever happens.
                let _end: Sender<()> = end;
                let _follows = follows;
                block_size_signal();
                let target = Target::create(path, parts, within);
                drop(beginning);
                worker::work(target, &begin, &handed);
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
        Ok(Self {
            path: begun.map_err(failed)?,
            is_in_parts: parts.is_some(),
            state,
            transfer: None,
            renames: Some(rename),
            renaming: None,
            ended,
            thread: Some(thread),
            frames: sink,
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::worker::LOOK;

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
        let origin = Origin::Feed { entries, lost: Arc::clone(&lost) };
        let error =
            Recorder::record(pipe.clone(), None, origin, Duration::from_millis(20)).unwrap_err();
        // Its thread waits on, without what comes in: the feed and this test have the rest.
        assert_eq!(Arc::strong_count(&lost), 2);
        assert!(format!("{error:#}").contains("has not taken the beginning"), "{error}");

        // A history knows of it until the disk goes on.
        let mut history = crate::History::new(Duration::from_secs(1), 1000);
        let origin = Origin::History(history.follow());
        let limit = Duration::from_millis(20);
        assert!(Recorder::record(pipe.clone(), None, origin, limit).is_err());
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
        use ft_transfer_area::{FishX1Transfer, LoggedCycle};

        use crate::Transfer;

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
