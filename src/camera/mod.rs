//! Camera frames: from the controller to a channel, and from there to pictures.

mod bits;
mod control;
mod decode;
mod frame;
mod huffman;
mod repair;
mod stream;

use std::time::Duration;

pub(crate) use control::CameraControl;
pub use decode::Picture;
pub use frame::CameraFrame;
#[cfg(feature = "__fuzzing")]
pub use stream::read_frames;
pub(crate) use stream::CameraStream;

use crate::error::Error;
use crate::wire::StartCameraOnline;

/// The most frames that a channel may hold.
const MAX_CHANNEL_FRAMES: usize = 1000;

/// Frequency of the mains behind the lamps, so that the picture does not flicker.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum PowerLine {
    /// Left to the camera.
    Auto,
    /// 50 Hz, as in Europe. The kit's default.
    #[default]
    Hz50,
    /// 60 Hz, as in North America.
    Hz60,
}

/// What to ask of the camera and of the stream of its frames.
///
/// The kit was tested with 160×120 at 60 frames per second, 320×240 at 30 and 640×480 at 15. A
/// camera may deliver another size than asked for; the frames tell which.
///
/// ```
/// use ft_transfer_area::{CameraOptions, PowerLine};
///
/// let options = CameraOptions {
///     width: 640,
///     height: 480,
///     power_line: PowerLine::Hz60,
///     ..CameraOptions::default()
/// };
/// assert_eq!(options.framerate, 15);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
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
    /// dropped. They may take [`max_frame_size`](Self::max_frame_size) each.
    pub channel_frames: usize,
    /// How long connecting to the camera server may take. Default 5 s; the server starts within
    /// 1 to 2 s, and until then connecting is tried again and again.
    pub start_limit: Duration,
    /// How long a frame may take to come in. Default 5 s.
    pub frame_limit: Duration,
    /// The most bytes of JPEG that a frame may have. Default 16 MiB.
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
    /// The command that asks for this. Errs when an option is out of its range.
    pub(crate) fn command(&self) -> Result<StartCameraOnline, Error> {
        for (what, given, most) in [
            ("camera's width", self.width.into(), u16::MAX.into()),
            ("camera's height", self.height.into(), u16::MAX.into()),
            ("camera's framerate", self.framerate.into(), u16::MAX.into()),
            ("camera's channel_frames", self.channel_frames, MAX_CHANNEL_FRAMES),
        ] {
            Error::check_range(what, given, 1..=most as i64)?;
        }
        let power_line_frequency = match self.power_line {
            PowerLine::Auto => 0,
            PowerLine::Hz50 => 50,
            PowerLine::Hz60 => 60,
        };
        Ok(StartCameraOnline {
            width: self.width.into(),
            height: self.height.into(),
            framerate: self.framerate.into(),
            power_line_frequency,
        })
    }
}

/// Figures of a camera's stream, from its start on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct CameraStatistics {
    /// Frames that have come in.
    pub frames: u64,
    /// Frames of those that were dropped because the channel was full of newer ones.
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
    fn the_frequency_of_the_mains_is_told_in_hertz() {
        for (power_line, expected) in
            [(PowerLine::Auto, 0), (PowerLine::Hz50, 50), (PowerLine::Hz60, 60)]
        {
            let options = CameraOptions { power_line, ..CameraOptions::default() };
            assert_eq!(options.command().unwrap().power_line_frequency, expected);
        }
    }
}
