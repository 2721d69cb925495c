//! Ctrl-C, and the end of the session.

use crossbeam_channel::{bounded, Receiver};

/// A receiver that gets one message with each Ctrl-C. A program calls this once, before it moves anything.
pub(crate) fn receiver() -> anyhow::Result<Receiver<()>> {
    let (sender, interrupted) = bounded(1);
    ctrlc::set_handler(move || {
        // One that is full has told of it already.
        let _ = sender.try_send(());
    })?;
    Ok(interrupted)
}
