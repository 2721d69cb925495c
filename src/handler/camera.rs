//! The handler's camera.

use std::sync::Arc;

use crossbeam_channel::Receiver;

use super::mail::Errand;
use super::TransferAreaComHandler;
use crate::camera::{CameraFrame, CameraOptions, CameraStatistics, CameraStream};
use crate::error::Error;

impl TransferAreaComHandler {
    /// Starts the camera and returns the channel in which its frames come in.
    ///
    /// The command goes to the controller between two exchanges; blocks until that is done, so for
    /// one or two of them and their reaction windows.
    /// The frames come over a connection and a thread of their own. The server needs 1 to 2 s
    /// before the first one. Each frame is acknowledged as soon as it is read, whatever the
    /// consumer does: when the channel is full, the oldest frame in it is dropped and counted, so
    /// a slow consumer gets the newest ones. Dropping the receiver does not stop the camera.
    ///
    /// The channel ends when the stream does: by [`stop_camera`](Self::stop_camera), with the
    /// transfer, or by an error, for which ask [`camera_error`](Self::camera_error). The transfer
    /// goes on after an error of the camera, and the camera can be started again.
    ///
    /// ```
    /// # use ft_transfer_area::{CameraOptions, Error, TransferAreaComHandler};
    /// fn save_a_picture(handler: &mut TransferAreaComHandler) -> Result<(), Error> {
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
    /// in, [`Error::OutOfRange`] when an option is out of its range, [`Error::Thread`], or the error
    /// that ended the transfer.
    #[doc(alias = "StartCamera")]
    pub fn start_camera(&mut self, options: CameraOptions) -> Result<Receiver<CameraFrame>, Error> {
        let command = options.command()?;
        self.area.shared().check_running()?;
        if self.camera.as_ref().is_some_and(|camera| !camera.is_finished()) {
            return Err(Error::CameraAlreadyStarted);
        }
        // A stream that failed has left the controller's server running.
        self.stop_camera()?;
        self.area.shared().run_errand(Errand::StartCamera(command))?;
        self.camera_server_started = true;
        let port = self.settings.camera_port.unwrap_or(self.settings.port.wrapping_add(1));
        // A transfer is running, so there was a connection.
        let host = self.address.ok_or(Error::NotStarted)?;
        let (camera, frames) = CameraStream::start((host, port).into(), options, None)?;
        self.area.shared().set_camera(Arc::clone(camera.control()));
        self.camera = Some(camera);
        Ok(frames)
    }

    /// Stops the camera and ends its channel; frames in it can still be received.
    ///
    /// Blocks for one or two exchanges and their reaction windows. Does nothing when the camera was
    /// never started, or has ended with its transfer.
    ///
    /// # Errors
    ///
    /// The error that ended the transfer meanwhile.
    #[doc(alias = "StopCamera")]
    pub fn stop_camera(&mut self) -> Result<(), Error> {
        if let Some(camera) = &mut self.camera {
            camera.join();
        }
        let shared = self.area.shared();
        if std::mem::take(&mut self.camera_server_started) && shared.is_running() {
            shared.run_errand(Errand::StopCamera)?;
        }
        Ok(())
    }

    /// The error that ended the camera's stream; `None` while it goes on, and when it was stopped
    /// or ended with the transfer. A controller that goes away ends both, whichever is first.
    pub fn camera_error(&self) -> Option<Error> {
        self.camera.as_ref().and_then(|camera| camera.control().error())
    }

    /// Figures of the camera's stream, the present or the last one.
    pub fn camera_statistics(&self) -> CameraStatistics {
        self.camera.as_ref().map(|camera| camera.control().statistics()).unwrap_or_default()
    }
}
