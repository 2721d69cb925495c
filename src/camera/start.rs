//! The camera of a program that exchanges by itself.

use std::time::Duration;

use crossbeam_channel::Receiver;

use super::server::CameraServer;
use super::stream::CameraStream;
use super::{CameraFrame, CameraOptions};
use crate::client::TxtClient;
use crate::error::Error;
use crate::wire::CommandId;

impl TxtClient {
    /// Starts the camera, and returns the stream of its frames and the channel in which they come in.
    ///
    /// The frames come over a connection of their own to `port`, which is 65001 for a real controller, read by
    /// a thread of their own. The stream ends when the thread can't go on, or with
    /// [`stop`](CameraStream::stop); then the channel ends, too. This client's other calls go on meanwhile,
    /// and the camera server runs until [`stop_camera_online`](Self::stop_camera_online). The rest is as for
    /// [`TransferAreaComHandler::start_camera`](crate::TransferAreaComHandler::start_camera).
    ///
    /// Blocks until the response; before that, connecting to the camera is tried once, for 300 ms at most.
    ///
    /// ```no_run
    /// use ft_transfer_area::{CameraOptions, TimeLimits, TxtClient, PORT};
    ///
    /// # fn main() -> Result<(), ft_transfer_area::Error> {
    /// let mut client = TxtClient::connect("192.168.7.2", TimeLimits::default())?;
    /// client.start_online()?;
    /// let (mut stream, frames) = client.start_camera(PORT + 1, CameraOptions::default())?;
    /// if let Ok(frame) = frames.recv() {
    ///     println!("a picture of {} bytes", frame.jpeg()?.len());
    /// }
    /// stream.stop();
    /// client.stop_camera_online()?;
    /// stream.error().map_or(Ok(()), Err)
    /// # }
    /// ```
    ///
    /// # Errors
    ///
    /// [`Error::OutOfRange`] when an option is out of its range, [`Error::ThreadNotStarted`],
    /// [`Error::NotOnline`] before [`start_online`](Self::start_online), and any error of talking
    /// to the controller.
    #[doc(alias = "StartCamera")]
    #[doc(alias = "GetCameraFrameJpeg")]
    pub fn start_camera(
        &mut self,
        port: u16,
        options: CameraOptions,
    ) -> Result<(CameraStream, Receiver<CameraFrame>), Error> {
        let command = options.command()?;
        self.online(CommandId::StartCameraOnline)?;
        let server = CameraServer::before_start(self.other_port(port));
        self.start_camera_online(&command)?;
        CameraStream::start(server, options, Duration::ZERO)
    }
}
