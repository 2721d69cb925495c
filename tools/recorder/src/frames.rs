//! Pictures of the camera that wait for the disk.

use std::sync::atomic::Ordering;
use std::sync::Arc;

use crossbeam_channel::{bounded, Receiver, Sender};
use ft_transfer_area::CameraFrame;

use crate::state::State;

/// How many pictures wait for the disk, and how many bytes they may have.
const FRAMES: usize = 32;
const FRAME_BYTES: usize = 64 << 20;

/// Takes the camera's pictures into a recording. Cheap to clone, for the thread that gets them.
#[derive(Clone, Debug)]
pub struct FrameSink {
    sender: Sender<CameraFrame>,
    state: Arc<State>,
}

impl FrameSink {
    pub(crate) fn channel(state: Arc<State>) -> (Self, Receiver<CameraFrame>) {
        let (sender, waiting) = bounded(FRAMES);
        (Self { sender, state }, waiting)
    }

    /// Records a picture. Does not wait: if the disk is too slow, the picture is lost and counted.
    pub fn record(&self, frame: &CameraFrame) {
        let (state, size) = (&self.state, frame.data.len());
        let has_room = state.frame_bytes.fetch_add(size, Ordering::Relaxed) + size <= FRAME_BYTES;
        if !has_room || self.sender.try_send(frame.clone()).is_err() {
            state.frame_bytes.fetch_sub(size, Ordering::Relaxed);
            state.lost_frames.fetch_add(1, Ordering::Relaxed);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_that_wait_for_the_disk_have_a_bound_in_bytes() {
        let (sink, waiting) = FrameSink::channel(Arc::default());
        let frame = CameraFrame::new(vec![0; FRAME_BYTES / 4]);
        for _ in 0..10 {
            sink.record(&frame);
        }
        assert_eq!((waiting.len(), sink.state.recorded().lost_frames), (4, 6));
    }
}
