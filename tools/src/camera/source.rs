//! Where the pictures come from.

use anyhow::{anyhow, Context};
use crossbeam_channel::{select, Receiver};
use ft_transfer_area::{CameraFrame, CameraOptions, Error, TransferAreaComHandler};
use ft_transfer_area_simulator::world::World;
use ft_transfer_area_simulator::SimulatedTxt;

/// A started camera. Dropping it ends the transfer.
pub(super) struct Source {
    handler: TransferAreaComHandler,
    frames: Receiver<CameraFrame>,
    /// Ends after the handler.
    _simulated: Option<SimulatedTxt>,
}

/// What comes next.
pub(super) enum Next {
    /// A picture as JPEG.
    Picture(Vec<u8>),
    /// A picture that can't be repaired.
    Damaged,
    /// Ctrl-C.
    Interrupted,
}

impl Source {
    /// Starts the camera of this controller, or of a simulated TXT.
    pub(super) fn start(host: Option<String>, options: CameraOptions) -> anyhow::Result<Self> {
        let simulated = match host {
            Some(_) => None,
            None => Some(SimulatedTxt::builder().world(World::default()).start()?),
        };
        let simulated_at = simulated.as_ref().map(|txt| txt.address().to_string());
        let host = host.or(simulated_at).unwrap_or_default();
        let handler = TransferAreaComHandler::builder(host).build()?;
        handler.begin_transfer()?;
        let frames = handler.start_camera(options)?;
        Ok(Self { handler, frames, _simulated: simulated })
    }

    /// Waits for the next picture or Ctrl-C. An error says why no more pictures come.
    pub(super) fn next(&self, interrupted: &Receiver<()>) -> anyhow::Result<Next> {
        select! {
            recv(interrupted) -> _ => Ok(Next::Interrupted),
            recv(self.frames) -> frame => match frame {
                Ok(frame) => Ok(match frame.jpeg() {
                    Ok(jpeg) => Next::Picture(jpeg.into_owned()),
                    Err(error) => {
                        log::warn!("picture {}: {error:#}", frame.sequence);
                        Next::Damaged
                    }
                }),
                Err(_) => Err(self.why_ended()),
            },
        }
    }

    /// Whose camera it is.
    pub(super) fn title(&self) -> String {
        let name = self.handler.device_name();
        let address = self.handler.address().map(|address| address.to_string());
        let parts: Vec<String> = [name, address].into_iter().flatten().collect();
        format!("{}: camera", parts.join(" at "))
    }

    /// How many pictures were lost because they were not taken in time.
    pub(super) fn dropped(&self) -> u64 {
        self.handler.camera_statistics().dropped
    }

    fn why_ended(&self) -> anyhow::Error {
        // A controller that disappears ends camera and transfer in any order, so the transfer gets time to
        // notice: half a second, if its responses go on.
        if let Some(error) = (0..50).find_map(|_| self.handler.areas().wait_cycle().err()) {
            return anyhow!(error).context("the connection is lost");
        }
        match self.handler.camera_error() {
            Some(error @ (Error::ConnectionRefused { .. } | Error::NoAnswer { .. })) => {
                anyhow!(error)
                    .context("no picture comes; is the camera plugged into the TXT's USB socket?")
            }
            Some(error) => anyhow!(error).context("the camera has stopped"),
            None => anyhow!("the camera has stopped"),
        }
    }

    /// Ends the transfer.
    pub(super) fn end(&self) -> anyhow::Result<()> {
        self.handler.end_transfer().context("the transfer did not end well")
    }
}
