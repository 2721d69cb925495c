//! Pictures of the camera for both kits.
#![allow(unreachable_pub, reason = "the linker exports it")]

use std::slice;
use std::time::{Duration, Instant};

use ft_transfer_area::channel::Receiver;
use ft_transfer_area::{CameraFrame, CameraOptions, Error, PowerLine};

use crate::ffi::guarded;
use crate::report;

/// Bytes after each picture that belong to the program, too: the kits' samples write the end marker there.
const SPARE: usize = 16;

/// How long a picture may take, with the camera's start before it.
const FRAME_LIMIT: Duration = Duration::from_secs(10);

/// The options for what both kits' `StartCamera` is given: width, height, frames per second, frequency of the
/// mains.
pub(crate) fn camera_options(settings: [i32; 4]) -> Result<CameraOptions, Error> {
    let what = ["camera's width", "camera's height", "camera's framerate"];
    for (what, given) in what.into_iter().zip(settings) {
        let (least, most) = (1, u16::MAX.into());
        if !(least..=most).contains(&i64::from(given)) {
            return Err(Error::OutOfRange { what, given: given.into(), least, most });
        }
    }
    let [width, height, framerate, power_line] = settings;
    let power_line = match power_line {
        0 => PowerLine::Auto,
        50 => PowerLine::Hz50,
        60 => PowerLine::Hz60,
        other => PowerLine::Other(other),
    };
    Ok(CameraOptions::default()
        .size(width as u16, height as u16)
        .framerate(framerate as u16)
        .power_line(power_line)
        .channel_frames(1))
}

/// The last picture that a program got. Its bytes stay where they are until the next one.
#[derive(Default)]
pub(crate) struct Buffer(Vec<u8>);

impl Buffer {
    /// Waits for the next frame of the controller at this host that is a picture, and takes it in, repaired. Returns
    /// where the program finds it, and its size; `None` when no more frames come, or no picture in time.
    pub(crate) fn next(
        &mut self,
        host: &str,
        frames: &Receiver<CameraFrame>,
    ) -> Option<(*mut u8, usize)> {
        self.next_within(FRAME_LIMIT, host, frames)
    }

    fn next_within(
        &mut self,
        limit: Duration,
        host: &str,
        frames: &Receiver<CameraFrame>,
    ) -> Option<(*mut u8, usize)> {
        let deadline = Instant::now() + limit;
        let mut wrong = None;
        while let Ok(frame) = frames.recv_deadline(deadline) {
            match self.fill(&frame) {
                // The next frame is a better one.
                Err(error) => wrong = Some(error),
                Ok(filled) => return Some(filled),
            }
            // Frames that wait are received after it, too.
            if Instant::now() >= deadline {
                break;
            }
        }
        if let Some(error) = wrong {
            report::failure(format_args!(
                "{host}: no frame of the camera was a picture for {limit:?}: {error:#}"
            ));
        }
        None
    }

    fn fill(&mut self, frame: &CameraFrame) -> Result<(*mut u8, usize), Error> {
        let jpeg = frame.jpeg()?;
        self.0.clear();
        self.0.extend_from_slice(&jpeg);
        self.0.resize(jpeg.len() + SPARE, 0);
        Ok((self.0.as_mut_ptr(), jpeg.len()))
    }
}

/// Decodes a frame to YUV 4:2:2, interleaved. `read` gets the length of the picture without its end marker.
/// Returns 0 when it is not a picture, or does not fit.
///
/// # Safety
///
/// `jpeg` points to `size` bytes, `yuv` to `yuv_size` bytes that the program gives to this call alone, and
/// `read` is null or points to a number.
#[no_mangle]
pub unsafe extern "C" fn ft_jpeg_decode(
    jpeg: *const u8,
    size: usize,
    yuv: *mut u8,
    yuv_size: usize,
    read: *mut usize,
) -> i32 {
    guarded(0, || {
        if jpeg.is_null() || yuv.is_null() || size > isize::MAX as usize {
            return 0;
        }
        // SAFETY: as the caller promises.
        let bytes = unsafe { slice::from_raw_parts(jpeg, size) };
        let frame = CameraFrame::new(bytes.to_vec());
        let decoded = frame.jpeg().map(|jpeg| jpeg.len()).and_then(|length| {
            let picture = frame.to_yuv422()?;
            Ok((length, picture.data))
        });
        let (length, data) = match decoded {
            Ok(decoded) => decoded,
            Err(error) => {
                report::failure(error);
                return 0;
            }
        };
        if data.len() > yuv_size {
            report::failure("the decoded picture is longer than the program's memory for it");
            return 0;
        }
        // SAFETY: it fits into the memory that the caller promises.
        unsafe { yuv.copy_from_nonoverlapping(data.as_ptr(), data.len()) };
        if !read.is_null() {
            // SAFETY: as the caller promises.
            unsafe { read.write_unaligned(length.saturating_sub(2).min(size)) };
        }
        1
    })
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicBool, Ordering};
    use std::thread;

    use crossbeam_channel::bounded;

    use super::*;

    #[test]
    fn frames_that_are_no_pictures_do_not_prolong_the_wait_for_one() {
        let (sender, frames) = bounded(1);
        let is_over = AtomicBool::new(false);
        let deadline = Instant::now() + Duration::from_secs(30);
        thread::scope(|scope| {
            scope.spawn(|| {
                while !is_over.load(Ordering::Relaxed) && Instant::now() < deadline {
                    let _ = sender.try_send(CameraFrame::new(vec![0; 100]));
                    thread::sleep(Duration::from_millis(1));
                }
            });
            let limit = Duration::from_millis(100);
            assert!(Buffer::default().next_within(limit, "10.0.0.7", &frames).is_none());
            is_over.store(true, Ordering::Relaxed);
        });
        assert!(Instant::now() < deadline, "it has waited as long as frames came");
    }
}
