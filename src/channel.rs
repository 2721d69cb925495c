//! The channels in which [events](crate::Events) and [camera frames](crate::CameraFrame) come in.
//!
//! They are from the crate `crossbeam-channel`. Its names that a program needs are here, so that the
//! program does not have to depend on that crate.
//!
//! ```
//! use std::time::Duration;
//! use ft_transfer_area::channel::{Receiver, RecvTimeoutError};
//! use ft_transfer_area::CameraFrame;
//!
//! /// The newest frame; older ones are discarded.
//! fn newest(frames: &Receiver<CameraFrame>) -> Result<CameraFrame, RecvTimeoutError> {
//!     match frames.try_iter().last() {
//!         Some(frame) => Ok(frame),
//!         None => frames.recv_timeout(Duration::from_secs(1)),
//!     }
//! }
//! ```

pub use crossbeam_channel::{
    after, never, select, tick, IntoIter, Iter, Receiver, RecvError, RecvTimeoutError, Select,
    SelectTimeoutError, SelectedOperation, TryIter, TryRecvError, TrySelectError,
};
