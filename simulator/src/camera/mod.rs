//! The camera: whether it is started, its picture, and the server that sends it.

#[cfg(test)]
mod annex_k;
mod connection;
mod frame;
pub(super) mod server;
mod test_card;

use std::sync::Arc;
use std::time::Duration;

pub use connection::CameraConnection;
pub(super) use connection::{ClientFinder, Clients};
use ft_transfer_area::wire::StartCameraOnline;

use crate::machine::journal::notice;

/// The greatest width and height in pixels.
const SIZE_MAX: u16 = 4096;

/// The rate when none is asked for, in frames per second.
const DEFAULT_RATE: u32 = 15;

/// The camera as the main connection sees it.
#[derive(Clone, Debug, Default)]
pub(super) struct Camera {
    run: Option<CameraRun>,
    /// What it sends instead of its test card.
    pub(super) picture: Option<Arc<[u8]>>,
    /// How often it was started.
    starts: u64,
    /// Whether this start has had a client, or waits for none any more.
    had_client: bool,
    /// Whether StopCameraOnline came after the last start.
    is_stopped: bool,
    /// Whether the start before was stopped by it while its client was connected.
    is_left_open: bool,
    /// Frames sent so far.
    pub(super) frames: u64,
    /// Acknowledgements received so far.
    pub(super) acknowledgements: u64,
}

/// One start of the camera by StartCameraOnline.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct CameraRun {
    /// A number that no other start has.
    number: u64,
    /// The requested settings.
    pub(super) settings: StartCameraOnline,
    /// What the camera delivers.
    format: Format,
    /// When the command came in, by the machine's clock.
    pub(super) since: Duration,
}

impl Camera {
    /// Starts the camera, in place of an earlier start; an impossible size stops it.
    pub(super) fn start(&mut self, settings: StartCameraOnline, now: Duration) {
        self.stop();
        let Some(format) = Format::of(&settings) else {
            let StartCameraOnline { width, height, .. } = settings;
            notice!(Warn, "the camera has no pictures of {width} × {height} and does not start");
            return;
        };
        notice!(Info, "the camera starts: {format:?}");
        self.starts += 1;
        self.is_stopped = false;
        self.had_client = false;
        self.is_left_open = false;
        self.run = Some(CameraRun { number: self.starts, settings, format, since: now });
    }

    pub(super) fn had_client(&self) -> bool {
        self.had_client
    }

    pub(super) fn note_client(&mut self) {
        self.had_client = true;
    }

    pub(super) fn is_left_open(&self) -> bool {
        self.is_left_open
    }

    /// Its client was connected when it was stopped.
    pub(super) fn leave_open(&mut self) {
        self.is_left_open = self.is_stopped;
    }

    /// A new session begins, or the program of the controller ends.
    pub(super) fn forget(&mut self) {
        self.stop();
        (self.is_stopped, self.is_left_open) = (false, false);
    }

    /// StopCameraOnline stops it.
    pub(super) fn stop_by_command(&mut self) {
        self.stop();
        self.is_stopped = true;
    }

    pub(super) fn stop(&mut self) {
        self.run = None;
    }

    pub(super) fn run(&self) -> Option<CameraRun> {
        self.run
    }
}

/// The pictures that the camera delivers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Format {
    /// Width in pixels, 1..=4096.
    width: u16,
    /// Height in pixels, 1..=4096.
    height: u16,
    /// Frames per second, at least 1.
    rate: u32,
}

impl Format {
    /// What is delivered for these settings; `None` for an impossible size.
    fn of(settings: &StartCameraOnline) -> Option<Self> {
        let side =
            |asked: i32| u16::try_from(asked).ok().filter(|pixels| (1..=SIZE_MAX).contains(pixels));
        let (width, height) = match (side(settings.width)?, side(settings.height)?) {
            // The kit's camera does not have this format and uses the nearest one.
            (1280, 960) => (1280, 720),
            size => size,
        };
        let rate = u32::try_from(settings.framerate).ok().filter(|rate| *rate > 0);
        Some(Self { width, height, rate: rate.unwrap_or(DEFAULT_RATE) })
    }

    /// The number of the newest frame after this time; the first is 0 and exists at the start.
    fn newest(&self, elapsed: Duration) -> u64 {
        let frames = elapsed.as_nanos() * u128::from(self.rate) / NANOS_PER_SECOND;
        u64::try_from(frames).unwrap_or(u64::MAX)
    }

    /// When the frame with this number is due.
    fn due(&self, number: u64) -> Duration {
        let nanos = (u128::from(number) * NANOS_PER_SECOND).div_ceil(u128::from(self.rate));
        Duration::from_nanos(u64::try_from(nanos).unwrap_or(u64::MAX))
    }
}

const NANOS_PER_SECOND: u128 = 1_000_000_000;

#[cfg(test)]
mod tests {
    use super::*;

    fn settings(width: i32, height: i32, framerate: i32) -> StartCameraOnline {
        StartCameraOnline { width, height, framerate, power_line_frequency: 50 }
    }

    #[test]
    fn the_size_is_the_one_asked_for_with_one_exception() {
        let delivered = |width, height| {
            Format::of(&settings(width, height, 30)).map(|format| (format.width, format.height))
        };
        for size @ (width, height) in [(1, 1), (320, 240), (1280, 720), (4096, 4096)] {
            assert_eq!(delivered(i32::from(width), i32::from(height)), Some(size));
        }
        assert_eq!(delivered(1280, 960), Some((1280, 720)));
        for (width, height) in [(0, 240), (320, -1), (4097, 240), (320, i32::MAX), (65_537, 240)] {
            assert_eq!(delivered(width, height), None);
        }
    }

    #[test]
    fn without_a_rate_there_are_15_frames_per_second() {
        for (asked, rate) in [(0, 15), (i32::MIN, 15), (1, 1), (60, 60), (i32::MAX, 0x7FFF_FFFF)] {
            assert_eq!(Format::of(&settings(320, 240, asked)).unwrap().rate, rate);
        }
    }

    #[test]
    fn a_frame_is_the_newest_from_when_it_is_due() {
        for rate in [1, 7, 15, 30, 60, 0x7FFF_FFFF] {
            let format = Format { width: 320, height: 240, rate };
            assert_eq!((format.newest(Duration::ZERO), format.due(0)), (0, Duration::ZERO));
            // The interval between frames can't be less than the resolution of the clock.
            for number in [1, 2, 14, 15, 16, 1000].map(|number| number * u64::from(rate / 60 + 1)) {
                let before = format.due(number).saturating_sub(Duration::from_nanos(1));
                assert!(format.newest(format.due(number)) >= number);
                assert!(format.newest(before) < number);
            }
        }
        let format = Format { width: 320, height: 240, rate: 15 };
        assert_eq!(format.newest(format.due(30)), 30);
        assert_eq!(format.due(30), Duration::from_secs(2));
        assert_eq!(format.newest(Duration::MAX), u64::MAX);
    }

    #[test]
    fn a_start_replaces_the_one_before_even_with_an_impossible_size() {
        let mut camera = Camera::default();
        camera.start(settings(320, 240, 15), Duration::ZERO);
        let first = camera.run().unwrap();
        camera.start(settings(640, 480, 15), Duration::ZERO);
        assert_eq!(camera.run().unwrap().settings, settings(640, 480, 15));
        assert_ne!(camera.run().unwrap(), first);
        camera.start(settings(0, 480, 15), Duration::ZERO);
        assert_eq!(camera.run(), None);
    }
}
