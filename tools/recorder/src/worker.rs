//! The thread that writes a recording.

use std::io;
use std::path::PathBuf;
use std::sync::atomic::Ordering;
use std::sync::{Arc, PoisonError};
use std::time::{Duration, Instant};

use crossbeam_channel::{Receiver, RecvTimeoutError, Sender, TryRecvError};
use ft_transfer_area::notices;
use ft_transfer_area::{CameraFrame, IoError, LogEntry, LoggedCycle, Statistics};
use log::Level;
use mcap::{McapError, McapResult};

use crate::feed::{Fed, FedEntry};
use crate::file;
use crate::format::Transfer;
use crate::origin::{Arrival, Origin};
use crate::state::State;
use crate::target::Target;
use crate::writer::Losses;

/// How often the recorder looks for new entries.
pub(crate) const LOOK: Duration = Duration::from_millis(10);

/// How often everything is handed to the operating system, and the statistics are written; these also at the end of a
/// transfer.
const FLUSH: Duration = Duration::from_millis(500);
const STATISTICS: Duration = Duration::from_secs(1);

/// How long the end waits for a logger that blocks.
const LAST_LINES: Duration = Duration::from_millis(100);

/// The name that the thread is to give the file.
pub(crate) struct Rename {
    pub(crate) to: PathBuf,
    /// Nobody waits for it any more then.
    pub(crate) until: Instant,
    pub(crate) done: Sender<io::Result<()>>,
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

/// The recorder's thread.
pub(crate) struct Worker {
    origin: Origin,
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

/// All that the thread does when its file has taken the beginning, or has not.
pub(crate) fn work(
    target: McapResult<Target>,
    begin: &Sender<McapResult<PathBuf>>,
    handed: &Receiver<Worker>,
) {
    // Both fail when nobody waits for it any more.
    match target {
        Ok(target) => {
            let _ = begin.send(Ok(target.newest().to_owned()));
            match handed.recv() {
                Ok(worker) => worker.run(target),
                Err(_) => target.discard(),
            }
        }
        Err(error) => drop(begin.send(Err(error))),
    }
}

impl Worker {
    pub(crate) fn new(
        origin: Origin,
        begin_at: Instant,
        frames: Receiver<CameraFrame>,
        renames: Receiver<Rename>,
        state: Arc<State>,
    ) -> Self {
        let (reported, unreported) = (None, None);
        Self { origin, frames, renames, state, flushed: begin_at, reported, unreported }
    }

    fn run(mut self, mut file: Target) {
        let done = self.record_until_stopped(&mut file).and_then(|()| file.writer.finish());
        match done {
            Ok(bytes) => {
                self.state.bytes.store(bytes, Ordering::Relaxed);
                let Self { origin, renames, state, .. } = self;
                drop(origin);
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
        for _ in 0..=self.origin.waiting() {
            match self.origin.next() {
                Ok(Arrival::Logged(entry)) => self.logged(file, entry)?,
                Ok(Arrival::Fed(entry)) => self.fed(file, &entry)?,
                Ok(Arrival::Kept(entry)) => self.kept(file, &entry)?,
                Err(TryRecvError::Empty) => break,
                Err(TryRecvError::Disconnected) => goes_on = false,
            }
        }
        while let Some(reported) = self.origin.next_event() {
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
        let (entries, events) = self.origin.lost();
        let frames = self.state.lost_frames.load(Ordering::Relaxed);
        Losses { entries, events, frames }
    }
}

/// A limit for the size of files makes an error of a write by this thread, not the end of the program.
pub(crate) fn block_size_signal() {
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
pub(crate) fn cause(error: McapError) -> IoError {
    match error {
        McapError::Io(error) => error.into(),
        other => io::Error::other(other).into(),
    }
}
