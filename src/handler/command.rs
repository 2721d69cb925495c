//! Commands that the transfer thread sends between two exchanges.

use crate::wire::StartCameraOnline;

/// What the program has the transfer thread send.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Command {
    StartCamera(StartCameraOnline),
    StopCamera,
}
