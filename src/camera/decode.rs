//! Decodes whole JPEG pictures with `jpeg-decoder`.

use jpeg_decoder::{Decoder, PixelFormat};

use crate::error::Error;

/// A decoded picture.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Picture {
    /// Width in pixels, which may differ from the announced one of the frame.
    pub width: u16,
    /// Height in pixels.
    pub height: u16,
    /// The samples, in the order that the method which made the picture describes.
    pub data: Vec<u8>,
}

pub(super) fn decode_rgb(jpeg: &[u8]) -> Result<Picture, Error> {
    let (picture, format) = decode(jpeg)?;
    Ok(match format {
        PixelFormat::RGB24 => picture,
        _ => Picture { data: picture.data.iter().flat_map(|&y| [y; 3]).collect(), ..picture },
    })
}

/// Decodes to RGB or one grey sample per pixel.
pub(super) fn decode(jpeg: &[u8]) -> Result<(Picture, PixelFormat), Error> {
    let mut decoder = Decoder::new(jpeg);
    let bad = |reason: String| Error::BadPicture { reason };
    let data = decoder.decode().map_err(|error| bad(error.to_string()))?;
    let info = decoder.info().ok_or_else(|| bad("it has no size".to_owned()))?;
    match info.pixel_format {
        PixelFormat::RGB24 | PixelFormat::L8 => {}
        format => return Err(bad(format!("pixels of the kind {format:?} are not supported"))),
    }
    Ok((Picture { width: info.width, height: info.height, data }, info.pixel_format))
}
