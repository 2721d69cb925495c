//! Commands that the transfer thread sends between two exchanges.

use crate::wire::StartCameraOnline;

/// A command that the transfer thread sends for the program.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Command {
    StartCamera(StartCameraOnline),
    StopCamera,
}
