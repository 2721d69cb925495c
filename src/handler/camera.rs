//! The handler's camera.

use std::sync::Arc;
use std::time::Duration;

use crossbeam_channel::Receiver;

use crate::camera::{CameraFrame, CameraOptions, CameraServer, CameraStatistics, CameraStream};
use crate::client::Endpoint;
use crate::error::Error;
use crate::handler::com_handler::TransferAreaComHandler;
use crate::handler::parts::camera_work::CameraCommand;
use crate::handler::settings::Settings;
use crate::handler::sync::MutexGuard;

/// How long after its time limit the transfer thread may notice that the connection is lost.
const NOTICE: Duration = Duration::from_secs(1);

/// The time in which a thread starts or stops the camera, one after another. The transfer thread knows of those that wait
/// for their turn, too.
struct Turn<'a> {
    handler: &'a TransferAreaComHandler,
    stream: MutexGuard<'a, Option<CameraStream>>,
}

impl<'a> Turn<'a> {
    fn new(handler: &'a TransferAreaComHandler) -> Self {
        handler.areas().shared().come_to_camera();
        Self { handler, stream: handler.camera.lock() }
    }
}

impl Drop for Turn<'_> {
    fn drop(&mut self) {
        self.handler.areas().shared().leave_camera();
    }
}

impl TransferAreaComHandler {
    /// Starts the camera and returns the channel in which its frames come in.
    ///
    /// The command goes to the controller between two exchanges. Blocks until that is done: for about a second, in
    /// which exchanges go on, and while a lost connection is re-established. It may be called under a guard and in a
    /// cycle hook, which then has the areas for so long that the motors stop.
    ///
    /// The second is between StopCameraOnline, which is sent first, and StartCameraOnline: a camera that a killed
    /// program has left on ends then. With two cameras, the program of the maker's firmware 4.7.0 (measured under
    /// emulation) ends when they stop.
    ///
    /// The frames come over a connection of their own, read by a thread of their own. Connecting is tried
    /// once before the command, for 300 ms at most, as the TXT 4.0 needs it, and repeatedly after the
    /// command, because a TXT needs 1 to 2 s to start its camera server. Each frame is acknowledged as soon
    /// as it is read, even if the program is slow: when the channel is full, the oldest frame in it is
    /// dropped and counted, so a slow program gets the newest ones. Dropping the receiver does not stop the
    /// camera.
    ///
    /// The channel ends when the stream does: by [`stop_camera`](Self::stop_camera), with the
    /// transfer, or by an error, which [`camera_error`](Self::camera_error) returns. The transfer
    /// goes on after an error of the camera, and the camera can be started again. A transfer that
    /// [reconnects](crate::TransferAreaComHandlerBuilder::reconnect) starts it again by itself after a gap,
    /// and the channel goes on. What waits in the channel when the gap begins is dropped and counted: it is of before, and
    /// another controller may answer after it.
    ///
    /// ```
    /// # use ft_transfer_area::{CameraOptions, Error, TransferAreaComHandler};
    /// fn save_a_picture(handler: &TransferAreaComHandler) -> Result<(), Error> {
    ///     let frames = handler.start_camera(CameraOptions::default())?;
    ///     if let Ok(frame) = frames.recv() {
    ///         let _ = std::fs::write("picture.jpg", frame.jpeg()?);
    ///     }
    ///     handler.camera_error().map_or(Ok(()), Err)
    /// }
    /// ```
    ///
    /// # Errors
    ///
    /// [`Error::NotStarted`] without a transfer, [`Error::CameraAlreadyStarted`] while frames come
    /// in, [`Error::OutOfRange`] when an option is out of its range, [`Error::ThreadNotStarted`], or the error
    /// that ended the transfer.
    #[doc(alias = "StartCamera")]
    pub fn start_camera(&self, options: CameraOptions) -> Result<Receiver<CameraFrame>, Error> {
        let command = options.command()?;
        let shared = self.areas().shared();
        shared.state().transfer.check_running()?;
        let mut camera = Turn::new(self);
        let camera = &mut camera.stream;
        if camera.as_ref().is_some_and(|stream| !stream.is_finished()) {
            return Err(Error::CameraAlreadyStarted);
        }
        // A stream that failed has left the controller's server running.
        self.stop(camera)?;
        // A transfer is running, so there was a connection.
        let host = self.controller().and_then(|controller| controller.address);
        let host = host.ok_or(Error::NotStarted)?;
        let Settings { network, camera_port, reconnect, limits, .. } = self.settings();
        let server = CameraServer::before_start(Endpoint::at(*network, host, *camera_port));
        shared.run_command(CameraCommand::Start(command))?;
        // The main connection shows a lost network within its limit for reading.
        let gap_limit = reconnect.map_or(Duration::ZERO, |_| limits.read + NOTICE);
        let (stream, frames) = CameraStream::start(server, options, gap_limit)?;
        shared.set_camera(Arc::clone(stream.control()));
        **camera = Some(stream);
        Ok(frames)
    }

    /// Stops the camera and ends its channel; frames in it can still be received.
    ///
    /// Blocks as [`start_camera`](Self::start_camera) does. Does nothing when the camera was
    /// never started, or has ended with its transfer.
    ///
    /// # Errors
    ///
    /// The error that ended the transfer meanwhile.
    #[doc(alias = "StopCamera")]
    pub fn stop_camera(&self) -> Result<(), Error> {
        self.stop(&mut Turn::new(self).stream)
    }

    fn stop(&self, stream: &mut Option<CameraStream>) -> Result<(), Error> {
        if let Some(stream) = stream {
            stream.stop();
        }
        let shared = self.areas().shared();
        let is_started = shared.state().camera.is_started();
        if is_started {
            shared.run_command(CameraCommand::Stop)?;
        }
        Ok(())
    }

    /// The error that ended the camera's stream; `None` while it goes on, and when it was stopped
    /// or ended with the transfer. A controller that disappears ends both, in any order. Does not block, even
    /// while another thread starts or stops the camera.
    pub fn camera_error(&self) -> Option<Error> {
        self.areas().shared().state().camera.stream.clone().and_then(|stream| stream.error())
    }

    /// Statistics of the camera's stream, the current or the last one. Does not block, even while another
    /// thread starts or stops the camera.
    pub fn camera_statistics(&self) -> CameraStatistics {
        let stream = self.areas().shared().state().camera.stream.clone();
        stream.map(|stream| stream.statistics()).unwrap_or_default()
    }
}
