//! Camera frames: from the controller to a channel, and from there to pictures.

mod bits;
mod control;
mod decode;
mod frame;
mod header;
mod huffman;
mod parser;
mod planes;
mod repair;
mod server;
mod start;
mod steps;
mod stream;
mod yuv;

use std::time::Duration;

pub(crate) use control::CameraControl;
pub use decode::Picture;
pub use frame::CameraFrame;
pub(crate) use server::CameraServer;
pub use stream::read_frames;
pub use stream::CameraStream;

use crate::client::LIMIT_RANGE;
use crate::error::Error;
use crate::wire::StartCameraOnline;

/// The most frames that a channel may hold.
const MAX_CHANNEL_FRAMES: usize = 1000;

/// Frequency of the mains, so that the picture does not flicker under lamps.
///
/// Exhaustive, because the protocol has a number for it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum PowerLine {
    /// The camera decides.
    Auto,
    /// 50 Hz, as in Europe. The kit's default.
    #[default]
    Hz50,
    /// 60 Hz, as in North America.
    Hz60,
    /// Any other number, as a program of the kit may send it. What the controller does with it is not known.
    Other(i32),
}

/// Settings of the camera and of the stream of its frames.
///
/// The kit was tested with 160×120 at 60 frames per second, 320×240 at 30 and 640×480 at 15. A
/// camera may deliver another size than requested; each frame contains its size.
///
/// ```
/// use ft_transfer_area::{CameraOptions, PowerLine};
///
/// let options = CameraOptions::default().size(640, 480).power_line(PowerLine::Hz60);
/// assert_eq!(options.framerate, 15);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct CameraOptions {
    /// Width of the picture in pixels, at least 1. Default 320.
    pub width: u16,
    /// Height of the picture in pixels, at least 1. Default 240.
    pub height: u16,
    /// Frames per second, at least 1. Default 15.
    pub framerate: u16,
    /// Frequency of the mains. Default 50 Hz.
    #[doc(alias = "powerlinefreq")]
    pub power_line: PowerLine,
    /// How many frames the channel holds, 1..=1000. Default 2. When one more comes, the oldest is
    /// dropped, so with 1 the channel holds only the newest frame. Each may take up to
    /// [`max_frame_size`](Self::max_frame_size) bytes.
    pub channel_frames: usize,
    /// How long connecting to the camera server may take, 1 ms to an hour. Default 5 s; the server starts within
    /// 1 to 2 s, and until then connecting is tried repeatedly.
    pub start_limit: Duration,
    /// How long a frame may take to come in, 1 ms to an hour. Default 5 s.
    pub frame_limit: Duration,
    /// The largest size of a frame's JPEG data, in bytes. Default 16 MiB.
    pub max_frame_size: usize,
}

impl Default for CameraOptions {
    fn default() -> Self {
        Self {
            width: 320,
            height: 240,
            framerate: 15,
            power_line: PowerLine::default(),
            channel_frames: 2,
            start_limit: Duration::from_secs(5),
            frame_limit: Duration::from_secs(5),
            max_frame_size: 16 << 20,
        }
    }
}

impl CameraOptions {
    /// Requests pictures of this size, in pixels.
    pub const fn size(self, width: u16, height: u16) -> Self {
        Self { width, height, ..self }
    }

    /// Requests this number of frames per second.
    pub const fn framerate(self, framerate: u16) -> Self {
        Self { framerate, ..self }
    }

    /// Sets the frequency of the mains.
    pub const fn power_line(self, power_line: PowerLine) -> Self {
        Self { power_line, ..self }
    }

    /// Sets how many frames the channel holds. With 1 it holds only the newest frame.
    pub const fn channel_frames(self, channel_frames: usize) -> Self {
        Self { channel_frames, ..self }
    }

    /// Sets how long connecting to the camera server may take.
    pub const fn start_limit(self, start_limit: Duration) -> Self {
        Self { start_limit, ..self }
    }

    /// Sets how long a frame may take to come in.
    pub const fn frame_limit(self, frame_limit: Duration) -> Self {
        Self { frame_limit, ..self }
    }

    /// Sets the largest size of a frame's JPEG data, in bytes.
    pub const fn max_frame_size(self, max_frame_size: usize) -> Self {
        Self { max_frame_size, ..self }
    }

    /// The command with these options. Returns an error when an option is out of its range.
    pub(crate) fn command(&self) -> Result<StartCameraOnline, Error> {
        for (what, given, most) in [
            ("camera's width", self.width.into(), u16::MAX.into()),
            ("camera's height", self.height.into(), u16::MAX.into()),
            ("camera's framerate", self.framerate.into(), u16::MAX.into()),
            ("camera's channel_frames", self.channel_frames, MAX_CHANNEL_FRAMES),
        ] {
            Error::check_range(what, given, 1..=most as i64)?;
        }
        Error::check_millis("camera's start_limit in ms", self.start_limit, LIMIT_RANGE)?;
        Error::check_millis("camera's frame_limit in ms", self.frame_limit, LIMIT_RANGE)?;
        let power_line_frequency = match self.power_line {
            PowerLine::Auto => 0,
            PowerLine::Hz50 => 50,
            PowerLine::Hz60 => 60,
            PowerLine::Other(frequency) => frequency,
        };
        Ok(StartCameraOnline {
            width: self.width.into(),
            height: self.height.into(),
            framerate: self.framerate.into(),
            power_line_frequency,
        })
    }
}

/// Statistics of a camera's stream since its start.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct CameraStatistics {
    /// Frames that have come in.
    pub frames: u64,
    /// How many of these were dropped because the channel was full and newer ones came, or waited in it when a gap began.
    pub dropped: u64,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_defaults_are_the_kits() {
        assert_eq!(
            CameraOptions::default().command(),
            Ok(StartCameraOnline {
                width: 320,
                height: 240,
                framerate: 15,
                power_line_frequency: 50
            })
        );
    }

    #[test]
    fn the_frequency_of_the_mains_is_sent_in_hertz() {
        for (power_line, expected) in [
            (PowerLine::Auto, 0),
            (PowerLine::Hz50, 50),
            (PowerLine::Hz60, 60),
            (PowerLine::Other(7), 7),
        ] {
            let options = CameraOptions { power_line, ..CameraOptions::default() };
            assert_eq!(options.command().unwrap().power_line_frequency, expected);
        }
    }
}
