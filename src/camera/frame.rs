//! One frame, as it came in.

use std::borrow::Cow;
use std::time::Instant;

use super::decode::{decode_rgb, Picture};
use super::repair::repair;
use super::yuv::decode_yuv422;
use crate::error::Error;

/// A frame of the camera, as it came over the wire.
///
/// The camera leaves out the end of its JPEG pictures (the EOI marker), often also the Huffman tables,
/// and sends garbage after the picture. [`jpeg`](Self::jpeg) repairs this.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct CameraFrame {
    /// Number of the frame in its stream, from 0. The numbers of dropped frames are missing.
    pub sequence: u64,
    /// When the whole frame had come in.
    pub arrived: Instant,
    /// 1 when the frame was waiting for the program's acknowledgement, otherwise 0 (the maker's firmware 4.7.0,
    /// measured under emulation).
    pub frames_ready: u32,
    /// Width in pixels, as announced.
    pub width: u16,
    /// Height in pixels, as announced.
    pub height: u16,
    /// Size when decoded to YUV 4:2:2, as announced.
    pub size_raw: u32,
    /// The bytes as they came in, with the camera's faults.
    pub data: Vec<u8>,
}

impl CameraFrame {
    /// A frame of these bytes, to test what a program does with a picture.
    ///
    /// It is number 0 and arrived now; one frame was ready, and the announced sizes are 0. Set the fields to
    /// change this.
    ///
    /// ```
    /// # use ft_transfer_area::CameraFrame;
    /// let mut frame = CameraFrame::new(b"no picture".to_vec());
    /// frame.sequence = 7;
    /// assert!(frame.to_rgb().is_err());
    /// ```
    pub fn new(data: Vec<u8>) -> Self {
        Self {
            sequence: 0,
            arrived: Instant::now(),
            frames_ready: 1,
            width: 0,
            height: 0,
            size_raw: 0,
            data,
        }
    }

    /// The picture as JPEG that any viewer opens.
    ///
    /// The end marker is added if it is missing, bytes after the picture are cut off, and the
    /// standard Huffman tables are added if there are none. A picture that is already correct is not
    /// copied.
    ///
    /// # Errors
    ///
    /// [`Error::BadPicture`] when it is not a baseline JPEG picture, not complete, or has more than
    /// 16 million pixels. Its values are not checked.
    #[doc(alias = "GetCameraFrameJpeg")]
    pub fn jpeg(&self) -> Result<Cow<'_, [u8]>, Error> {
        repair(&self.data)
    }

    /// The picture as RGB, 3 bytes per pixel, row by row from the top left.
    ///
    /// # Errors
    ///
    /// [`Error::BadPicture`] as for [`jpeg`](Self::jpeg), and when its values make no sense.
    pub fn to_rgb(&self) -> Result<Picture, Error> {
        decode_rgb(&self.jpeg()?)
    }

    /// The picture as YUV 4:2:2 in the order Y0 Cb Y1 Cr, 4 bytes for two pixels, row by row from
    /// the top left, as in the kit's camera sample. A row of odd width ends with its last pixel
    /// twice.
    ///
    /// A 4:2:2 picture, which the camera sends, gives its own samples, neither filtered nor converted. In
    /// other pictures each pixel has the chroma sample that covers it, and a pair of pixels gets the mean of
    /// both. The picture's components are assumed to be Y, Cb and Cr, as in cameras' JPEG pictures.
    ///
    /// # Errors
    ///
    /// [`Error::BadPicture`] as for [`jpeg`](Self::jpeg), and when its values make no sense.
    #[doc(alias = "ftProJpegDec")]
    pub fn to_yuv422(&self) -> Result<Picture, Error> {
        decode_yuv422(&self.data)
    }
}
