//! How other threads control the camera's stream.

use std::time::Duration;

use crossbeam_channel::{Receiver, Sender, TrySendError};
use parking_lot::{Condvar, Mutex, MutexGuard};

use super::server::CameraServer;
use super::{CameraFrame, CameraStatistics};
use crate::client::{Close, Endpoint, Transport};
use crate::error::Error;

/// Controls a stream's thread, and has its state.
#[derive(Debug)]
pub(crate) struct CameraControl {
    state: Mutex<State>,
    /// The channel's other end, to take frames out.
    waiting: Receiver<CameraFrame>,
    /// The stream is to stop, or its server has changed.
    changed: Condvar,
}

#[derive(Debug, Default)]
struct State {
    stopping: bool,
    finished: bool,
    /// Where the frames come from; `None` while there is a gap.
    server: Option<Endpoint>,
    /// The connection that was made before the server was started, until the thread takes it.
    early: Option<Box<dyn Transport>>,
    /// In a gap: the server that is to be started again.
    next: Next,
    /// How often the server was changed.
    changes: u64,
    /// Ends the connection, and the thread's waits on it.
    closer: Option<Box<dyn Close>>,
    /// Why the stream has ended.
    error: Option<Error>,
    statistics: CameraStatistics,
}

/// How far the thread is with the connection to a server that is to be started.
#[derive(Debug, Default)]
enum Next {
    #[default]
    None,
    Wanted(Endpoint),
    Connecting,
    Tried(CameraServer),
}

/// A camera server, until it is replaced by another or started again.
#[derive(Debug)]
pub(super) struct Server {
    pub(super) endpoint: Endpoint,
    number: u64,
}

/// What other threads do.
impl CameraControl {
    pub(super) fn new(server: CameraServer, waiting: Receiver<CameraFrame>) -> Self {
        let CameraServer { endpoint, early } = server;
        let state = State { server: Some(endpoint), early, ..State::default() };
        Self { state: Mutex::new(state), waiting, changed: Condvar::new() }
    }

    /// Makes the thread end soon. Does not block.
    pub(crate) fn stop(&self) {
        let mut state = self.state.lock();
        state.stopping = true;
        state.disconnect();
        self.changed.notify_all();
    }

    /// Begins a gap, because the main connection was lost and its camera server with it: the
    /// stream's connection is closed, frames in the channel are dropped, and the thread waits without a limit for
    /// [`resume`](Self::resume) or [`stop`](Self::stop). Does not block.
    ///
    /// Does nothing when the stream has already ended.
    pub(crate) fn pause(&self) {
        self.change(None);
        // Of before, and perhaps another controller answers now. Those of a stream that has ended stay.
        let mut state = self.state.lock();
        if !state.stopping && !state.finished {
            state.statistics.dropped += self.waiting.try_iter().count() as u64;
        }
    }

    /// Ends a gap, when the camera server was started again: the thread connects to it, again within the
    /// limit for the start. Frames come in on the same channel, and their sequence numbers continue. Does not
    /// block.
    ///
    /// Does nothing when the stream has already ended.
    pub(crate) fn resume(&self, server: CameraServer) {
        self.change(Some(server));
    }

    /// In a gap: the server that the next command starts, when the thread has tried to connect to it, as
    /// [`CameraServer::before_start`]. `None` until then. Does not block.
    pub(crate) fn prepare(&self, endpoint: &Endpoint) -> Option<CameraServer> {
        let mut state = self.state.lock();
        if state.stopping || state.finished {
            return Some(CameraServer::not_connected(endpoint.clone()));
        }
        match std::mem::take(&mut state.next) {
            Next::Tried(server) => return Some(server),
            Next::None => state.next = Next::Wanted(endpoint.clone()),
            waits @ (Next::Wanted(_) | Next::Connecting) => state.next = waits,
        }
        self.changed.notify_all();
        None
    }

    /// The error that ended the stream; `None` if it was stopped or goes on.
    pub(crate) fn error(&self) -> Option<Error> {
        self.state.lock().error.clone()
    }

    pub(crate) fn statistics(&self) -> CameraStatistics {
        self.state.lock().statistics
    }

    /// Whether no more frames will come.
    pub(super) fn is_finished(&self) -> bool {
        self.state.lock().finished
    }

    fn change(&self, server: Option<CameraServer>) {
        let mut state = self.state.lock();
        (state.server, state.early) = match server {
            Some(CameraServer { endpoint, early }) => (Some(endpoint), early),
            None => (None, None),
        };
        state.next = Next::None;
        state.changes += 1;
        state.disconnect();
        self.changed.notify_all();
    }
}

/// What the stream's own thread does.
impl CameraControl {
    /// The server to read from. Blocks while there is a gap, and then connects to the next one; `None` when the
    /// stream is to stop.
    pub(super) fn server(&self) -> Option<Server> {
        let mut state = self.state.lock();
        loop {
            let number = state.changes;
            if state.stopping {
                return None;
            }
            if let Some(endpoint) = state.server.clone() {
                return Some(Server { endpoint, number });
            }
            match std::mem::replace(&mut state.next, Next::Connecting) {
                Next::Wanted(endpoint) => {
                    let connect = || CameraServer::before_start(endpoint);
                    let next = MutexGuard::unlocked(&mut state, connect);
                    if state.changes == number {
                        state.next = Next::Tried(next);
                    }
                }
                other => {
                    state.next = other;
                    self.changed.wait(&mut state);
                }
            }
        }
    }

    /// The connection to this server that was made before it was started; returned only once.
    pub(super) fn take_early(&self, server: &Server) -> Option<Box<dyn Transport>> {
        let mut state = self.state.lock();
        if state.has_left(server) {
            return None;
        }
        state.early.take()
    }

    /// Waits for `time`, or until this is no longer the server to read from; returns whether it is no
    /// longer.
    pub(super) fn wait_for_change(&self, server: &Server, time: Duration) -> bool {
        let mut state = self.state.lock();
        self.changed.wait_while_for(&mut state, |state| !state.has_left(server), time);
        state.has_left(server)
    }

    /// Lets others close the connection to this server, or closes it when it is no longer needed.
    pub(super) fn keep(&self, closer: Box<dyn Close>, server: &Server) {
        let mut state = self.state.lock();
        state.closer = Some(closer);
        if state.has_left(server) {
            state.disconnect();
        }
    }

    /// Drops a connection that has failed.
    pub(super) fn let_go(&self) {
        self.state.lock().closer = None;
    }

    #[cfg(test)]
    pub(super) fn is_connected(&self) -> bool {
        self.state.lock().closer.is_some()
    }

    /// Puts a frame of this server into the channel, and drops the oldest one if there is no room; or this one, when it is
    /// of before a gap.
    pub(super) fn put(&self, sender: &Sender<CameraFrame>, frame: CameraFrame, server: &Server) {
        let mut state = self.state.lock();
        state.statistics.frames += 1;
        if state.has_left(server) {
            state.statistics.dropped += 1;
            return;
        }
        let mut frame = frame;
        while let Err(TrySendError::Full(back)) = sender.try_send(frame) {
            frame = back;
            // The program may have received it meanwhile.
            state.statistics.dropped += u64::from(self.waiting.try_recv().is_ok());
        }
    }

    /// Stores that the stream has ended; returns the error, unless it was stopped.
    pub(super) fn finish(&self, result: Result<(), Error>) -> Option<Error> {
        let mut state = self.state.lock();
        (state.closer, state.early) = (None, None);
        state.finished = true;
        state.error = result.err().filter(|_| !state.stopping);
        state.error.clone()
    }
}

impl State {
    fn disconnect(&mut self) {
        if let Some(closer) = self.closer.take() {
            closer.close();
        }
    }

    /// Whether the stream is to stop, or to read from another server than this one.
    fn has_left(&self, server: &Server) -> bool {
        self.stopping || self.changes != server.number
    }
}
