//! The camera: its stream, and what the transfer thread has to send for it.

use std::sync::Arc;

use crate::camera::CameraControl;
use crate::client::Endpoint;
use crate::wire::StartCameraOnline;

/// A command that the transfer thread sends between two exchanges.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum CameraCommand {
    Start(StartCameraOnline),
    Stop,
}

/// What the transfer thread has to do for the camera now.
#[derive(Clone, Debug)]
pub(crate) enum CameraTask {
    /// The program's command.
    Send(CameraCommand),
    /// After a gap: the server at this address is to be started like this again.
    Restart(StartCameraOnline, Endpoint),
}

/// The camera of a transfer.
#[derive(Debug, Default)]
pub(crate) struct CameraWork {
    /// The program's command, until it is done.
    command: Option<CameraCommand>,
    /// How the controller's camera server was started, while it is running.
    started: Option<StartCameraOnline>,
    /// After a gap, where the server is to be started again.
    restart_at: Option<Endpoint>,
    /// The current stream of frames, or the last one.
    stream: Option<Arc<CameraControl>>,
}

impl CameraWork {
    /// A transfer begins or has ended: its controller has no camera running.
    pub(crate) fn reset(&mut self) {
        (self.command, self.started, self.restart_at) = (None, None, None);
    }

    pub(crate) fn command(&mut self, command: CameraCommand) {
        self.command = Some(command);
    }

    /// Whether the program waits for its command to be sent.
    pub(crate) fn has_command(&self) -> bool {
        self.command.is_some()
    }

    /// After a gap the camera comes first.
    pub(crate) fn task(&self) -> Option<CameraTask> {
        let restart = self.started.zip(self.restart_at.clone());
        let restart = restart.map(|(start, server)| CameraTask::Restart(start, server));
        restart.or_else(|| self.command.map(CameraTask::Send))
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

    /// The server was started again.
    pub(crate) fn is_restarted(&mut self) {
        self.restart_at = None;
    }

    /// There is another connection, whose controller has its camera's server here.
    pub(crate) fn restart_at(&mut self, server: Option<Endpoint>) {
        self.restart_at = server;
    }

    /// Whether the program has started the controller's server.
    pub(crate) fn is_started(&self) -> bool {
        self.started.is_some()
    }

    /// Whether the controller's server runs.
    pub(crate) fn is_running(&self) -> bool {
        self.started.is_some() && self.restart_at.is_none()
    }

    pub(crate) fn stream(&self) -> Option<Arc<CameraControl>> {
        self.stream.clone()
    }

    /// The program has another stream.
    pub(crate) fn set_stream(&mut self, stream: Arc<CameraControl>) {
        self.stream = Some(stream);
    }
}
