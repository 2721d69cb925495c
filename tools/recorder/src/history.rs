//! The last cycles, in memory: what a recording begins with that is started later.

mod kept;

use std::collections::VecDeque;
use std::io;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, Weak};
use std::time::{Duration, Instant};

use crossbeam_channel::{unbounded, Receiver, Sender, TryRecvError};
use ft_transfer_area::transfer_area::{MAX_AREAS, MAX_EXTENSIONS};
use ft_transfer_area::{
    CycleLog, EventKind, Events, FishX1Transfer, LoggedCycle, TimedEvent, TransferAreaComHandler,
    TransferAreas,
};

use self::kept::{Before, Kept, KeptCycle, What};
use crate::error::Error;
use crate::feed::{Fed, FedEntry};
use crate::format::Transfer;
use crate::part::PARTS;
use crate::under_way::{Missed, UnderWay};

/// How many bytes of messages about transfers have room beside the rest.
const OF_TRANSFERS: usize = 64 << 10;
/// How many cycles of a handler wait for the next [`History::take_in`]: about two and a half seconds. They take 2.5 MB.
const WAITING: usize = 250;

/// The last cycles of a handler, or what a program hands in, in memory. So a recording that somebody starts when
/// something has happened has that, too: see [`Recorder::follow`](crate::Recorder::follow).
///
/// Of a cycle it keeps only what differs from the cycle before. At 100 cycles a second, a minute of a controller
/// whose inputs change takes about 2 MB, with eight extensions on which all changes about 8 MB.
///
/// ```
/// use std::time::{Duration, Instant};
///
/// use ft_transfer_area::{FishX1Transfer, LoggedCycle};
/// use ft_transfer_area_recorder::{History, Options, Recorder, Transfer};
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// # let folder = tempfile::tempdir()?;
/// # let path = folder.path().join("run.mcap");
/// let mut history = History::new(Duration::from_secs(60), 16 << 20);
/// history.cycle(&LoggedCycle::new(1, &[FishX1Transfer::default()]));
/// // Somebody wants a recording.
/// let recorder = Recorder::follow(&path, history.follow(), Options::default())?;
/// history.cycle(&LoggedCycle::new(2, &[FishX1Transfer::default()]));
/// history.unfollow();
/// assert_eq!(recorder.finish()?.cycles, 2);
/// # Ok(())
/// # }
/// ```
#[derive(Debug)]
pub struct History {
    time: Duration,
    room: usize,
    handler: Option<(CycleLog, Events)>,
    /// Of that handler.
    transfer: Option<TransferAreas>,
    kept: VecDeque<Arc<Kept>>,
    /// What they take.
    bytes: usize,
    /// As they were before the first of them.
    before: Before,
    /// The numbers of the newest cycle, by area and part.
    newest: Vec<Vec<i32>>,
    follower: Option<Follower>,
    /// Its other end, or that of the one before.
    followed: Weak<()>,
}

/// What a history had, and all that it gets from then on, on its way to
/// [`Recorder::follow`](crate::Recorder::follow).
#[derive(Debug)]
pub struct Follow {
    before: Before,
    since: Instant,
    kept: Receiver<Arc<Kept>>,
    waiting: Arc<AtomicUsize>,
    lost: Arc<AtomicU64>,
    /// What the recorder ends when the program leaves without its `finish`.
    transfer: Option<TransferAreas>,
    is_there: Arc<()>,
}

/// The way to a recorder. What waits in it is bounded by the room of the history.
#[derive(Debug)]
struct Follower {
    sender: Sender<Arc<Kept>>,
    waiting: Arc<AtomicUsize>,
    lost: Arc<AtomicU64>,
    /// How many were lost since the last entry.
    lost_since: u64,
    /// Cycles were lost, so the next one needs more than what differs from them.
    needs_whole: bool,
    missed: Missed,
}

impl History {
    /// Keeps what the program hands in: for this time, as long as it takes no more than so many bytes.
    pub fn new(time: Duration, room: usize) -> Self {
        let areas = vec![FishX1Transfer::default(); MAX_AREAS];
        Self {
            time,
            room,
            handler: None,
            transfer: None,
            kept: VecDeque::new(),
            bytes: 0,
            before: Before { areas, under_way: UnderWay::default() },
            newest: vec![Vec::new(); MAX_AREAS * PARTS.len()],
            follower: None,
            followed: Weak::new(),
        }
    }

    /// The same for all cycles of a handler. They come in with [`take_in`](Self::take_in), which has to be called
    /// several times a second.
    ///
    /// # Errors
    ///
    /// As [`cycle_log`](ft_transfer_area::TransferAreas::cycle_log).
    pub fn of(
        handler: &TransferAreaComHandler,
        time: Duration,
        room: usize,
    ) -> Result<Self, Error> {
        let refused = |error: ft_transfer_area::Error| Error::NotStarted {
            cause: io::Error::other(error).into(),
        };
        let log = handler.areas().cycle_log(WAITING).map_err(refused)?;
        // The log has the others.
        let kinds = EventKind::ALL.iter().copied().filter(|kind| kind.is_of_response());
        let kinds = kinds.collect::<Vec<_>>();
        let events = handler.areas().events(&kinds, 4 * WAITING).map_err(refused)?;
        let transfer = Some(handler.areas().clone());
        Ok(Self { handler: Some((log, events)), transfer, ..Self::new(time, room) })
    }

    /// Takes in what has come of the handler until now, and forgets what is too old. Does not wait.
    pub fn take_in(&mut self) {
        if let Some((log, events)) = self.handler.take() {
            let mut event = events.try_recv().ok();
            for _ in 0..log.receiver().len() {
                let Ok(entry) = log.try_recv() else { break };
                let Some(entry) = FedEntry::of_log(entry) else { continue };
                let at = entry.at();
                while let Some(earlier) = event.take_if(|event| event.arrived < at) {
                    self.event(&earlier);
                    event = events.try_recv().ok();
                }
                self.fed(entry);
            }
            while let Some(reported) = event {
                self.event(&reported);
                event = events.try_recv().ok();
            }
            self.handler = Some((log, events));
        }
        self.forget(Instant::now());
    }

    fn fed(&mut self, FedEntry { lost, what }: FedEntry) {
        match what {
            Fed::Cycle(cycle) => self.keep_cycle(&cycle, lost),
            Fed::Transfer { at, what } => self.keep(at, lost, What::Transfer(what)),
            Fed::Event { at, what } => self.keep(at, lost, What::Event(what)),
        }
    }

    /// Takes in a cycle.
    pub fn cycle(&mut self, cycle: &LoggedCycle) {
        self.keep_cycle(cycle, 0);
    }

    /// Takes in what has happened to a transfer.
    pub fn transfer(&mut self, at: Instant, what: Transfer) {
        self.keep(at, 0, What::Transfer(what.cut()));
    }

    fn event(&mut self, reported: &TimedEvent) {
        self.keep(reported.arrived, 0, What::Event(reported.into()));
    }

    fn keep_cycle(&mut self, cycle: &LoggedCycle, lost: u64) {
        let areas = cycle.areas();
        let (mut parts, mut numbers, mut read) = (Vec::new(), Vec::new(), Vec::new());
        for (place, newest) in self.newest.iter_mut().enumerate() {
            let Some(area) = areas.get(place / PARTS.len()) else { break };
            PARTS[place % PARTS.len()].read(area, &mut read);
            if *newest != read {
                newest.clone_from(&read);
                parts.push(place as u16);
                numbers.append(&mut read);
            }
        }
        let arrived = cycle.arrived;
        let kept = KeptCycle {
            number: cycle.number,
            first: cycle.first,
            statistics: cycle.statistics,
            areas: areas.len(),
            alive: areas.first().map_or([0; MAX_EXTENSIONS], |area| area.state.io_slave_alive),
            parts: parts.into(),
            numbers: numbers.into(),
        };
        self.keep(arrived, lost, What::Cycle(kept));
    }

    fn keep(&mut self, at: Instant, lost: u64, what: What) {
        let kept = Arc::new(Kept { at, lost, what });
        if let Some(mut follower) = self.follower.take() {
            follower.hand_on(&kept, self.room, &self.newest);
            self.follower = Some(follower);
        }
        self.bytes += kept.bytes();
        self.kept.push_back(kept);
        self.forget(at);
    }

    /// Forgets what is too old at this time, or has no room.
    fn forget(&mut self, now: Instant) {
        while let Some(oldest) = self.kept.front() {
            let age = now.saturating_duration_since(oldest.at);
            if age <= self.time && self.bytes <= self.room {
                return;
            }
            self.bytes -= oldest.bytes();
            self.before.take(oldest);
            self.kept.pop_front();
        }
    }

    /// What it has, and from now on all that it gets, for a recorder. There is one of these at a time: for one that
    /// was made before, nothing more comes.
    pub fn follow(&mut self) -> Follow {
        let now = Instant::now();
        self.forget(now);
        let (sender, kept) = unbounded();
        let (waiting, lost) = (Arc::default(), Arc::default());
        let follower = Follower {
            sender,
            waiting: Arc::clone(&waiting),
            lost: Arc::clone(&lost),
            lost_since: 0,
            needs_whole: false,
            missed: Missed::default(),
        };
        for entry in &self.kept {
            follower.lost.fetch_add(entry.lost, Ordering::Relaxed);
            // It fits, as it does here. The other end is there.
            follower.put(Arc::clone(entry));
        }
        self.follower = Some(follower);
        let since = self.kept.front().map_or(now, |oldest| oldest.at.min(now));
        let is_there = Arc::new(());
        self.followed = Arc::downgrade(&is_there);
        let before = self.before.clone();
        let transfer = self.transfer.clone();
        Follow { before, since, kept, waiting, lost, transfer, is_there }
    }

    /// Nothing more comes for the recorder: it records what it has got, and ends.
    pub fn unfollow(&mut self) {
        self.follower = None;
    }

    /// Whether the newest recorder that follows it is still there, perhaps because its disk stands still.
    pub fn is_followed(&self) -> bool {
        self.followed.strong_count() > 0
    }
}

impl Follower {
    /// Hands on the newest entry, with these numbers of all parts. It is lost when too much waits for the disk.
    fn hand_on(&mut self, kept: &Arc<Kept>, room: usize, newest: &[Vec<i32>]) {
        // With those that the handler's log had no room for.
        self.lost.fetch_add(kept.lost, Ordering::Relaxed);
        let is_repeated = self.repeat_missed(room);
        let is_transfer = matches!(kept.what, What::Transfer(_));
        let room = if is_transfer { room + OF_TRANSFERS } else { room };
        if !is_repeated || self.waiting.load(Ordering::Relaxed) + kept.bytes() > room {
            self.needs_whole |= matches!(kept.what, What::Cycle(_));
            self.lost_since += kept.lost + 1;
            self.lost.fetch_add(1, Ordering::Relaxed);
            if let What::Transfer(message) = &kept.what {
                self.missed.note(kept.at, message);
            }
            return;
        }
        if self.lost_since == 0 && !self.needs_whole {
            return self.put(Arc::clone(kept));
        }
        let what = match &kept.what {
            What::Cycle(cycle) => {
                self.needs_whole = false;
                What::Cycle(cycle.whole(newest))
            }
            What::Transfer(message) => What::Transfer(message.clone()),
            What::Event(message) => What::Event(message.clone()),
        };
        let lost = kept.lost + std::mem::take(&mut self.lost_since);
        self.put(Arc::new(Kept { at: kept.at, lost, what }));
    }

    /// Returns whether there was room for it.
    fn repeat_missed(&mut self, room: usize) -> bool {
        let Some((at, message)) = self.missed.get() else { return true };
        let kept = Kept { at, lost: self.lost_since, what: What::Transfer(message) };
        let waiting = self.waiting.load(Ordering::Relaxed);
        if waiting + kept.bytes() > room + OF_TRANSFERS {
            return false;
        }
        self.lost_since = 0;
        self.missed.clear();
        self.put(Arc::new(kept));
        true
    }

    fn put(&self, kept: Arc<Kept>) {
        self.waiting.fetch_add(kept.bytes(), Ordering::Relaxed);
        // A recorder that has ended on a full disk needs no more.
        let _ = self.sender.send(kept);
    }
}

impl Follow {
    /// When the first of it was: a recording begins there.
    pub fn since(&self) -> Instant {
        self.since
    }

    /// The same for a recorder that only looks: a transfer does not end when it is dropped without `finish`, also by a
    /// panic. For one in a thread of its own; one beside the handler would keep the motors on while its disk stands
    /// still.
    #[must_use]
    pub fn that_only_looks(self) -> Self {
        Self { transfer: None, ..self }
    }

    pub(crate) fn take_transfer(&mut self) -> Option<TransferAreas> {
        self.transfer.take()
    }

    /// Alive as long as the recorder or its thread.
    pub(crate) fn is_there(&self) -> Arc<()> {
        Arc::clone(&self.is_there)
    }

    /// What a file that begins then has to begin with.
    pub(crate) fn under_way(&self) -> &UnderWay {
        &self.before.under_way
    }

    pub(crate) fn waiting(&self) -> usize {
        self.kept.len()
    }

    pub(crate) fn lost(&self) -> u64 {
        self.lost.load(Ordering::Relaxed)
    }

    pub(crate) fn next(&mut self) -> Result<FedEntry, TryRecvError> {
        let kept = self.kept.try_recv()?;
        self.waiting.fetch_sub(kept.bytes(), Ordering::Relaxed);
        let areas = &mut self.before.areas;
        let (at, lost) = (kept.at, kept.lost);
        let what = match &kept.what {
            What::Cycle(cycle) => {
                cycle.apply(areas);
                Fed::Cycle(cycle.logged(at, areas))
            }
            What::Transfer(message) => Fed::Transfer { at, what: message.clone() },
            What::Event(message) => Fed::Event { at, what: message.clone() },
        };
        Ok(FedEntry { lost, what })
    }
}

#[cfg(test)]
mod tests;
