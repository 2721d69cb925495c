//! A recording that a page starts and stops. It begins with what came before.
//!
//! The keeper has the history; nothing of it waits for a disk. Each recording has a thread of its own for that.

use std::fs::File;
use std::path::Path;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};
use std::{io, thread};

use crossbeam_channel::{bounded, Receiver, RecvTimeoutError, Sender, TryRecvError};
use ft_transfer_area::{CameraFrame, TransferAreaComHandler};
use ft_transfer_area_recorder::file::is_at;
use ft_transfer_area_recorder::{Error, Follow, FrameSink, History, Options, Parts, Recorder};
use serde::Serialize;

use super::output::incomplete;

/// For how long what has come is kept, and how many bytes it may take.
const BEFORE: Duration = Duration::from_secs(60);
const ROOM: usize = 16 << 20;

/// How many clicks may wait.
const CLICKS: usize = 4;

/// How often what a handler has logged is looked at. What it logs meanwhile has room.
const LOOK: Duration = Duration::from_millis(100);

/// How often the size is looked at.
const SIZE: Duration = Duration::from_millis(200);

/// The files have this name and a number.
const FILE: &str = "run.mcap";

/// How long the end of the program waits for the disk.
const END: Duration = Duration::from_secs(2);

/// What pages know of a recording, and how they start and stop it.
#[derive(Clone)]
pub(crate) struct Button {
    /// `None`: it is recorded from beginning to end.
    clicks: Option<Sender<Click>>,
    shown: Shown,
}

enum Click {
    Start,
    Stop,
    /// The program ends. The other end goes when the file is written, or takes nothing.
    End(Sender<()>),
}

/// What there is to be recorded, and what records it.
pub(crate) struct Keeper {
    history: History,
    clicks: Receiver<Click>,
    shown: Shown,
    session: Option<Session>,
}

/// A recording that is being made, in its thread.
struct Session {
    /// Dropped to stop it.
    stop: Option<Sender<()>>,
    /// Has an end when it has one.
    ended: Receiver<()>,
}

/// What is shown of the newest recording.
#[derive(Clone, Default)]
pub(crate) struct Shown(Arc<Mutex<Newest>>);

#[derive(Default)]
struct Newest {
    phase: Phase,
    file: Option<String>,
    bytes: u64,
    /// When it was started, and when it was stopped.
    since: Option<Instant>,
    until: Option<Instant>,
    before: Duration,
    error: Option<Trouble>,
    frames: Option<FrameSink>,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Phase {
    #[default]
    Off,
    On,
    /// The end of the file is being written.
    Ending,
}

/// Why a recording can't be made: a code for pages, and a sentence.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub(crate) struct Trouble {
    code: &'static str,
    text: String,
}

/// The same for pages.
#[derive(Debug, Serialize)]
pub(crate) struct RecordingState {
    phase: Phase,
    /// Whether a page may start and stop it.
    by_page: bool,
    /// The name of the newest file; `None` before the first.
    file: Option<String>,
    bytes: u64,
    /// Since it was started, until it was stopped.
    seconds: u64,
    /// What it has from before that.
    before: u64,
    error: Option<Trouble>,
}

impl Button {
    /// For what is recorded from beginning to end.
    pub(crate) fn fixed(shown: Shown) -> Self {
        Self { clicks: None, shown }
    }

    /// Starts a recording or stops it; returns whether a page may do that. One that is on already goes on.
    pub(crate) fn click(&self, starts: bool) -> bool {
        let Some(clicks) = &self.clicks else { return false };
        // One that finds so many waiting is left out.
        let _ = clicks.try_send(if starts { Click::Start } else { Click::Stop });
        true
    }

    /// Ends the recording. What is returned has an end when that is done.
    pub(crate) fn end(&self) -> Receiver<()> {
        let (end, ended) = bounded(0);
        if let Some(clicks) = &self.clicks {
            // Without room, it does not end in time.
            let _ = clicks.send_timeout(Click::End(end), LOOK * 2);
        }
        ended
    }

    /// Records a picture of the camera, if a recording is on.
    pub(crate) fn picture(&self, frame: &CameraFrame) {
        self.shown.picture(frame);
    }

    pub(crate) fn state(&self) -> RecordingState {
        let newest = self.shown.lock();
        let since = newest.since.map(|since| {
            newest.until.unwrap_or_else(Instant::now).saturating_duration_since(since)
        });
        RecordingState {
            phase: newest.phase,
            by_page: self.clicks.is_some(),
            file: newest.file.clone(),
            bytes: newest.bytes,
            seconds: since.unwrap_or_default().as_secs(),
            before: newest.before.as_secs(),
            error: newest.error.clone(),
        }
    }
}

impl Shown {
    fn lock(&self) -> MutexGuard<'_, Newest> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn picture(&self, frame: &CameraFrame) {
        let frames = self.lock().frames.clone();
        if let Some(frames) = frames {
            frames.record(frame);
        }
    }

    /// A recording has begun.
    pub(crate) fn begin(&self, since: Instant, before: Duration) {
        let since = Some(since);
        *self.lock() = Newest { phase: Phase::On, since, before, ..Newest::default() };
    }

    /// What this recorder has done. Its file may still have another name than it will have.
    pub(crate) fn take(&self, recorder: &Recorder, path: &Path) {
        let name = path.file_name().map(|name| name.to_string_lossy().into_owned());
        let mut newest = self.lock();
        (newest.file, newest.bytes) = (name, recorder.recorded().bytes);
    }

    /// It goes on with another name than it should have.
    pub(crate) fn keeps_name(&self, text: String) {
        self.lock().error = Some(Trouble { code: "record_name", text });
    }

    fn stop(&self) {
        let mut newest = self.lock();
        newest.until.get_or_insert_with(Instant::now);
        newest.phase = Phase::Ending;
        newest.frames = None;
    }

    /// Nothing more of it is recorded.
    pub(crate) fn end(&self, error: Option<Trouble>) {
        let mut newest = self.lock();
        newest.phase = Phase::Off;
        newest.frames = None;
        newest.until.get_or_insert_with(Instant::now);
        newest.error = error;
    }

    fn refuse(&self, error: Trouble) {
        *self.lock() = Newest { error: Some(error), ..Newest::default() };
    }
}

impl Trouble {
    pub(crate) fn of(error: &Error) -> Self {
        Self { code: code(error), text: format!("{error:#}") }
    }

    /// Somebody has removed the file, or given it another name.
    fn of_removed(path: &Path) -> Self {
        Self { code: "record_gone", text: format!("{} is not there any more", path.display()) }
    }

    /// At the beginning there is no file yet.
    fn at_beginning(error: &Error) -> Self {
        let text = match error {
            Error::Write { cause, .. } => {
                format!("can't record in the folder where txt was started: {cause}")
            }
            other => format!("{other:#}"),
        };
        Self { code: code(error), text }
    }
}

fn code(error: &Error) -> &'static str {
    match error {
        Error::Write { cause, .. } => match cause.kind() {
            io::ErrorKind::StorageFull
            | io::ErrorKind::QuotaExceeded
            | io::ErrorKind::FileTooLarge => "record_full",
            io::ErrorKind::PermissionDenied | io::ErrorKind::ReadOnlyFilesystem => "record_denied",
            _ => "record_failed",
        },
        _ => "record_failed",
    }
}

impl Keeper {
    /// For what the program hands in.
    pub(crate) fn new() -> (Self, Button) {
        Self::with(History::new(BEFORE, ROOM))
    }

    fn with(history: History) -> (Self, Button) {
        let (sender, clicks) = bounded(CLICKS);
        let shown = Shown::default();
        let button = Button { clicks: Some(sender), shown: shown.clone() };
        (Self { history, clicks, shown, session: None }, button)
    }

    /// For all cycles of a handler, in a thread of its own.
    pub(crate) fn start(handler: &TransferAreaComHandler) -> anyhow::Result<Button> {
        let (keeper, button) = Self::with(History::of(handler, BEFORE, ROOM)?);
        thread::Builder::new().name("history".to_owned()).spawn(move || keeper.run())?;
        Ok(button)
    }

    fn run(mut self) {
        loop {
            let click = self.clicks.recv_timeout(LOOK);
            self.history.take_in();
            match click {
                Ok(Click::End(_end)) => return self.finish(),
                Ok(click) => self.obey(click),
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return,
            }
        }
    }

    pub(crate) fn history(&mut self) -> &mut History {
        &mut self.history
    }

    pub(crate) fn picture(&self, frame: &CameraFrame) {
        self.shown.picture(frame);
    }

    /// Does what pages want.
    pub(crate) fn look(&mut self) {
        self.history.take_in();
        while let Ok(click) = self.clicks.try_recv() {
            self.obey(click);
        }
    }

    fn obey(&mut self, click: Click) {
        let is_on = self.session.as_ref().is_some_and(Session::goes_on);
        match click {
            Click::Start if is_on => {}
            // A disk that stands still gets no second one.
            Click::Start if self.history.is_followed() => {
                let text = "the disk still takes nothing of the recording before";
                self.shown.refuse(Trouble { code: "record_stuck", text: text.to_owned() });
            }
            Click::Start => self.begin(),
            Click::Stop | Click::End(_) => self.stop(),
        }
    }

    fn begin(&mut self) {
        let now = Instant::now();
        let follow = self.history.follow().that_only_looks();
        self.shown.begin(now, now.saturating_duration_since(follow.since()));
        let (stop, stopped) = bounded(0);
        let (end, ended) = bounded(0);
        let shown = self.shown.clone();
        let work = move || {
            // Dropped at the end, whatever happens.
            let _end: Sender<()> = end;
            let recorded = record(follow, &stopped, &shown);
            shown.end(recorded.err());
        };
        match thread::Builder::new().name("recording".to_owned()).spawn(work) {
            Ok(_) => self.session = Some(Session { stop: Some(stop), ended }),
            Err(error) => {
                let text = format!("the operating system has no more threads: {error}");
                self.shown.refuse(Trouble { code: "record_failed", text });
            }
        }
    }

    /// What has come until now is recorded. Does not wait for it.
    fn stop(&mut self) {
        if let Some(session) = &mut self.session {
            self.history.unfollow();
            session.stop = None;
        }
    }

    /// Ends the file, as far as the disk takes it in time.
    pub(crate) fn finish(mut self) {
        self.stop();
        let Some(Session { ended, .. }) = self.session else { return };
        if ended.recv_timeout(END) == Err(RecvTimeoutError::Timeout) {
            let file = self.shown.lock().file.clone();
            log::warn!("{}", incomplete(&file.unwrap_or_else(|| FILE.to_owned())));
        }
    }
}

impl Session {
    fn goes_on(&self) -> bool {
        self.ended.try_recv() == Err(TryRecvError::Empty)
    }
}

/// Records until it is stopped or can't go on.
fn record(follow: Follow, stopped: &Receiver<()>, shown: &Shown) -> Result<(), Trouble> {
    // All in one file, which is a new one.
    let options = Options::default().parts(Parts::of_bytes(u64::MAX));
    let recorder =
        Recorder::follow(FILE, follow, options).map_err(|error| Trouble::at_beginning(&error))?;
    let path = recorder.newest();
    // Held open, so that the system gives no other file its number.
    let held = File::open(&path).ok();
    let is_there = || path.exists() && held.as_ref().is_none_or(|held| is_at(held, &path));
    shown.lock().frames = Some(recorder.frames());
    loop {
        shown.take(&recorder, &path);
        // What is written into a file without a name is lost at its end.
        let goes_on = recorder.error().is_none() && is_there();
        if !goes_on || stopped.recv_timeout(SIZE) != Err(RecvTimeoutError::Timeout) {
            break;
        }
    }
    shown.stop();
    let totals = recorder.finish().map_err(|error| Trouble::of(&error))?;
    if !is_there() {
        return Err(Trouble::of_removed(&path));
    }
    // With the index.
    shown.lock().bytes = totals.bytes;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_disk_that_still_stands_gets_no_second_recording() {
        let (mut keeper, button) = Keeper::new();
        let stands = keeper.history().follow();
        keeper.history().unfollow();
        assert!(button.click(true));
        keeper.look();
        let state = button.state();
        assert_eq!((state.phase, state.error.unwrap().code), (Phase::Off, "record_stuck"));
        assert!(keeper.session.is_none());
        drop(stands);
        assert!(!keeper.history().is_followed());
    }

    #[test]
    fn no_click_stops_or_starts_what_is_recorded_from_beginning_to_end() {
        let shown = Shown::default();
        shown.begin(Instant::now(), Duration::ZERO);
        let button = Button::fixed(shown);
        assert!(!button.click(false) && !button.click(true));
        assert_eq!((button.state().phase, button.state().by_page), (Phase::On, false));
    }
}
