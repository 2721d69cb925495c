//! Ctrl-C, and the end of the session.

use anyhow::Context;
use crossbeam_channel::{bounded, Receiver};

/// A receiver that gets one message with each Ctrl-C. A program calls this once, before it moves anything.
pub(crate) fn receiver() -> anyhow::Result<Receiver<()>> {
    let (sender, interrupted) = bounded(1);
    let watched = ctrlc::set_handler(move || {
        // A full one already has the message.
        let _ = sender.try_send(());
    });
    let watched = watched.map_err(|error| match error {
        ctrlc::Error::System(cause) => anyhow::Error::from(cause),
        other => other.into(),
    });
    watched.context("Ctrl-C can't be watched")?;
    Ok(interrupted)
}
