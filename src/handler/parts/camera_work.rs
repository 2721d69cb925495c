//! The camera: its stream, and what the transfer thread has to send for it.

use std::sync::Arc;

use crate::camera::CameraControl;
use crate::client::Endpoint;
use crate::handler::sync::ThreadId;
use crate::wire::StartCameraOnline;

/// A command that the transfer thread sends between two exchanges.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum CameraCommand {
    Start(StartCameraOnline),
    Stop,
}

/// What the transfer thread has to do for the camera now.
#[derive(Clone, Debug)]
pub(crate) struct CameraTask {
    pub(crate) command: CameraCommand,
    /// After a gap, where the server is to be started again; `None` for the program's command.
    pub(crate) restart_at: Option<Endpoint>,
}

/// The camera of a transfer.
#[derive(Debug, Default)]
pub(crate) struct CameraWork {
    /// The threads that start or stop the camera: one after another has its command, the others wait for that.
    callers: Vec<ThreadId>,
    /// The program's command, until it is done.
    command: Option<CameraCommand>,
    /// How the controller's camera server was started, while it is running.
    started: Option<StartCameraOnline>,
    /// After a gap, where the server is to be started again.
    pub(crate) restart_at: Option<Endpoint>,
    /// The current stream of frames, or the last one.
    pub(crate) stream: Option<Arc<CameraControl>>,
}

impl CameraWork {
    /// A transfer begins or has ended: its controller has no camera running.
    pub(crate) fn reset(&mut self) {
        (self.command, self.started, self.restart_at) = (None, None, None);
    }

    /// This thread begins to start or stop the camera.
    pub(crate) fn come(&mut self, thread: ThreadId) {
        self.callers.push(thread);
    }

    /// The thread has started or stopped the camera.
    pub(crate) fn go(&mut self, thread: ThreadId) {
        self.callers.retain(|caller| *caller != thread);
    }

    /// A thread of the program waits for a command from now on.
    pub(crate) fn ask(&mut self, command: CameraCommand) {
        self.command = Some(command);
    }

    /// Whether a thread waits for a command.
    pub(crate) fn is_asked(&self) -> bool {
        self.command.is_some()
    }

    /// Whether this thread waits for a command, its own or that of the thread before it.
    pub(crate) fn is_awaited_by(&self, thread: ThreadId) -> bool {
        self.is_asked() && self.callers.contains(&thread)
    }

    /// After a gap the camera comes first.
    pub(crate) fn task(&self) -> Option<CameraTask> {
        let restart = self.started.zip(self.restart_at.clone());
        let (command, restart_at) = match restart {
            Some((start, server)) => (CameraCommand::Start(start), Some(server)),
            None => (self.command?, None),
        };
        Some(CameraTask { command, restart_at })
    }

    /// The program's command is done.
    pub(crate) fn command_is_done(&mut self) {
        match self.command.take() {
            Some(CameraCommand::Start(start)) => self.started = Some(start),
            Some(CameraCommand::Stop) | None => self.started = None,
        }
        // A gap before this command has left nothing to start again.
        self.restart_at = None;
    }

    /// Whether the program has started the controller's server.
    pub(crate) fn is_started(&self) -> bool {
        self.started.is_some()
    }

    /// Whether the controller's server runs.
    pub(crate) fn is_running(&self) -> bool {
        self.started.is_some() && self.restart_at.is_none()
    }
}
