//! The hold that other threads have on the camera's stream.

use std::net::{Shutdown, SocketAddr, TcpStream};
use std::time::Duration;

use parking_lot::{Condvar, Mutex};

use super::CameraStatistics;
use crate::error::Error;

/// Steers a stream's thread, and tells how it fares.
#[derive(Debug)]
pub(crate) struct CameraControl {
    state: Mutex<State>,
    /// That the stream is to stop, or that its server has changed.
    changed: Condvar,
}

#[derive(Debug, Default)]
struct State {
    stopping: bool,
    finished: bool,
    /// Where the frames come from; `None` while there is a gap.
    server: Option<SocketAddr>,
    /// How often that was changed.
    changes: u64,
    /// The connection, by which a thread that reads is woken.
    connection: Option<TcpStream>,
    /// Why the stream has ended.
    error: Option<Error>,
    statistics: CameraStatistics,
}

/// A camera server, until it is changed for another or started anew.
#[derive(Clone, Copy, Debug)]
pub(super) struct Server {
    pub(super) address: SocketAddr,
    number: u64,
}

/// What other threads do.
impl CameraControl {
    pub(super) fn new(address: SocketAddr) -> Self {
        let state = State { server: Some(address), ..State::default() };
        Self { state: Mutex::new(state), changed: Condvar::new() }
    }

    /// Makes the thread end soon. Does not block.
    pub(crate) fn stop(&self) {
        let mut state = self.state.lock();
        state.stopping = true;
        state.disconnect();
        self.changed.notify_all();
    }

    /// Begins a gap, because the main connection was lost and its camera server with it: the
    /// stream's connection is closed, and the thread waits for [`resume`](Self::resume) or
    /// [`stop`](Self::stop), however long that takes. Does not block.
    ///
    /// Does nothing when the stream has ended before.
    pub(crate) fn pause(&self) {
        self.change(None);
    }

    /// Ends a gap, when the camera server was started again: the thread connects to it, for which
    /// it has the limit for the start anew. Frames come in on the same channel, and their sequence
    /// numbers go on. Does not block.
    ///
    /// Does nothing when the stream has ended before.
    pub(crate) fn resume(&self, address: SocketAddr) {
        self.change(Some(address));
    }

    /// Why the stream has ended, unless it was stopped or goes on.
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

    fn change(&self, server: Option<SocketAddr>) {
        let mut state = self.state.lock();
        state.server = server;
        state.changes += 1;
        state.disconnect();
        self.changed.notify_all();
    }
}

/// What the stream's own thread does.
impl CameraControl {
    /// The server to read from. Blocks while there is a gap; `None` when the stream is to stop.
    pub(super) fn server(&self) -> Option<Server> {
        let mut state = self.state.lock();
        self.changed.wait_while(&mut state, |state| !state.stopping && state.server.is_none());
        if state.stopping {
            return None;
        }
        state.server.map(|address| Server { address, number: state.changes })
    }

    /// Waits so long, or until this is no longer the server to read from; returns whether it is
    /// not.
    pub(super) fn wait_for_change(&self, server: Server, time: Duration) -> bool {
        let mut state = self.state.lock();
        self.changed.wait_while_for(&mut state, |state| !state.has_left(server), time);
        state.has_left(server)
    }

    /// Lets others close the connection to this server, or closes it when it is of no use any more.
    pub(super) fn keep(&self, connection: TcpStream, server: Server) {
        let mut state = self.state.lock();
        state.connection = Some(connection);
        if state.has_left(server) {
            state.disconnect();
        }
    }

    /// Lets go of a connection that has failed.
    pub(super) fn let_go(&self) {
        self.state.lock().connection = None;
    }

    #[cfg(test)]
    pub(super) fn is_connected(&self) -> bool {
        self.state.lock().connection.is_some()
    }

    /// Counts a frame that has come in, and those that were dropped for it.
    pub(super) fn count_frame(&self, dropped: u64) {
        let mut state = self.state.lock();
        state.statistics.frames += 1;
        state.statistics.dropped += dropped;
    }

    /// Notes that the stream has ended; returns why, unless it was stopped.
    pub(super) fn finish(&self, result: Result<(), Error>) -> Option<Error> {
        let mut state = self.state.lock();
        state.connection = None;
        state.finished = true;
        state.error = result.err().filter(|_| !state.stopping);
        state.error.clone()
    }
}

impl State {
    fn disconnect(&mut self) {
        if let Some(connection) = self.connection.take() {
            // It may be closed already.
            let _ = connection.shutdown(Shutdown::Both);
        }
    }

    /// Whether the stream is to stop, or to read from another server than this one.
    fn has_left(&self, server: Server) -> bool {
        self.stopping || self.changes != server.number
    }
}
