//! Pictures of the camera for both kits.
#![allow(unreachable_pub, reason = "the linker exports it")]

use std::slice;

use ft_transfer_area::{CameraFrame, Error};

use crate::ffi::guarded;
use crate::report;

/// Bytes after each picture that belong to the program, too: the kits' samples write the end marker there.
const SPARE: usize = 16;

/// The last picture that a program got. Its bytes stay where they are until the next one.
#[derive(Default)]
pub(crate) struct Buffer(Vec<u8>);

impl Buffer {
    /// Takes a frame in, repaired. Returns where the program finds it, and its size.
    pub(crate) fn fill(&mut self, frame: &CameraFrame) -> Result<(*mut u8, usize), Error> {
        let jpeg = frame.jpeg()?;
        self.0.clear();
        self.0.extend_from_slice(&jpeg);
        self.0.resize(jpeg.len() + SPARE, 0);
        Ok((self.0.as_mut_ptr(), jpeg.len()))
    }
}

/// Decodes a frame to YUV 4:2:2, interleaved. `read` gets the length of the picture without its end marker.
/// Returns 0 when it is no picture, or does not fit.
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
