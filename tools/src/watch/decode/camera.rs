//! The camera's connection: pictures, and an acknowledgement of each.

use std::time::Instant;

use ft_transfer_area::wire::{CameraFrameHeader, CAMERA_FRAME_ACKNOWLEDGE, ID_LEN};
use ft_transfer_area::CameraFrame;

use super::Reader;
use crate::camera::PICTURE_MAX;
use crate::seen::{Happened, Side};
use crate::watch::packet::Inbox;

#[derive(Default)]
pub(super) struct CameraReader {
    acknowledgements: Inbox,
    frames: Inbox,
    count: u64,
}

impl Reader for CameraReader {
    fn read(
        &mut self,
        side: Side,
        at: Instant,
        bytes: &[u8],
        report: &mut dyn FnMut(Happened),
    ) -> Result<(), String> {
        if side == Side::Program {
            self.acknowledgements.add(bytes);
            while let Some(packet) = self.acknowledgements.next(|_| Ok(ID_LEN))? {
                if packet != CAMERA_FRAME_ACKNOWLEDGE {
                    return Err(format!("{packet:02x?} acknowledges no picture"));
                }
            }
            return Ok(());
        }
        self.frames.add(bytes);
        while let Some(packet) = self.frames.next(frame_size)? {
            let (header, data) = packet.split_at(CameraFrameHeader::LEN);
            let header = CameraFrameHeader::parse(header).map_err(|error| error.to_string())?;
            let mut frame = CameraFrame::new(data.to_vec());
            frame.sequence = self.count;
            frame.arrived = at;
            frame.frames_ready = u32::try_from(header.frames_ready).unwrap_or_default();
            frame.width = u16::try_from(header.width).unwrap_or_default();
            frame.height = u16::try_from(header.height).unwrap_or_default();
            frame.size_raw = u32::try_from(header.size_raw).unwrap_or_default();
            self.count += 1;
            report(Happened::Picture(frame));
        }
        Ok(())
    }
}

fn frame_size(start: &[u8]) -> Result<usize, String> {
    let Some(header) = start.get(..CameraFrameHeader::LEN) else {
        return Ok(CameraFrameHeader::LEN);
    };
    let header = CameraFrameHeader::parse(header).map_err(|error| error.to_string())?;
    let size = usize::try_from(header.size_compressed).ok().filter(|size| *size <= PICTURE_MAX);
    let size =
        size.ok_or_else(|| format!("a picture can't have {} bytes", header.size_compressed))?;
    Ok(CameraFrameHeader::LEN + size)
}
