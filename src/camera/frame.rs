//! One frame, as it came in.

use std::borrow::Cow;
use std::time::Instant;

use super::decode::{decode_rgb, decode_yuv422, Picture};
use super::repair::repair;
use crate::error::Error;

/// A frame of the camera, as it came over the wire.
///
/// The camera leaves out the end of its JPEG pictures (the EOI marker), often the Huffman tables
/// too, and sends garbage behind them. [`jpeg`](Self::jpeg) mends this.
#[doc(alias = "GetCameraFrameJpeg")]
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CameraFrame {
    /// Number of the frame in its stream, from 0. Numbers are missing where frames were dropped.
    pub sequence: u64,
    /// When it had come in completely.
    pub arrived: Instant,
    /// How many frames waited on the controller; more than 1 when the connection is too slow.
    pub frames_ready: u32,
    /// Width in pixels, as announced.
    pub width: u16,
    /// Height in pixels, as announced.
    pub height: u16,
    /// Size when decoded to YUV 4:2:2, as announced.
    pub size_raw: u32,
    /// The bytes that came, with the camera's faults.
    pub data: Vec<u8>,
}

impl CameraFrame {
    /// The picture as JPEG that any viewer opens.
    ///
    /// The end marker is added where it is missing, what follows the picture is cut off, and the
    /// standard Huffman tables are put in where there are none. What is right already is not
    /// copied.
    ///
    /// # Errors
    ///
    /// [`Error::BadPicture`] when it is no baseline JPEG picture, not a whole one, or has more than
    /// 16 million pixels. What its values mean is not looked at.
    pub fn jpeg(&self) -> Result<Cow<'_, [u8]>, Error> {
        Ok(repair(&self.data)?.jpeg)
    }

    /// The picture as RGB, 3 bytes a pixel, row by row from the top left.
    ///
    /// # Errors
    ///
    /// [`Error::BadPicture`] as [`jpeg`](Self::jpeg), and when its values make no sense.
    pub fn to_rgb(&self) -> Result<Picture, Error> {
        decode_rgb(&self.jpeg()?)
    }

    /// The picture as YUV 4:2:2 in the order Y0 Cb Y1 Cr, 4 bytes for two pixels, row by row from
    /// the top left, as in the kit's camera sample. A row of odd width ends with its last pixel
    /// twice.
    ///
    /// A 4:2:2 picture, which is what the camera sends, gives its own samples, neither filtered
    /// nor converted. Of others the chroma is that of each pair of pixels, averaged. The picture is
    /// taken to hold Y, Cb and Cr, as cameras' JPEG pictures do.
    ///
    /// # Errors
    ///
    /// [`Error::BadPicture`] as [`jpeg`](Self::jpeg), and when its values make no sense.
    #[doc(alias = "ftProJpegDec")]
    pub fn to_yuv422(&self) -> Result<Picture, Error> {
        let repaired = repair(&self.data)?;
        decode_yuv422(&repaired.jpeg, repaired.is_422)
    }
}
