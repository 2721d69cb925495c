//! A process of its own that switches controllers off when this program is killed.

use std::env;
use std::io::{self, Write};
use std::process::{ChildStdin, Command, Stdio};

use anyhow::Context;

/// Waits until this program is gone.
pub(crate) struct Guardian {
    /// The system closes it, however this program ends.
    input: ChildStdin,
}

impl Guardian {
    /// Starts it for these controllers.
    pub(crate) fn start(hosts: &[String]) -> anyhow::Result<Self> {
        let start = || {
            let mut command = Command::new(env::current_exe()?);
            command.args(["stop", "--guard", "--"]).args(hosts);
            command.stdin(Stdio::piped()).stdout(io::stderr());
            apart(&mut command);
            command.spawn()
        };
        let mut child = start()
            .context("can't start the process that stops the motors when this one is killed")?;
        let input = child.stdin.take().context("that process has no input")?;
        Ok(Self { input })
    }

    /// The outputs are off: it has nothing more to do.
    pub(crate) fn dismiss(mut self) {
        // One that is gone needs no farewell.
        let _ = self.input.write_all(b".");
    }
}

/// What ends this program by the keyboard does not end the other one.
#[cfg(unix)]
pub(crate) fn apart(command: &mut Command) {
    use std::os::unix::process::CommandExt;
    command.process_group(0);
}

#[cfg(windows)]
pub(crate) fn apart(command: &mut Command) {
    use std::os::windows::process::CommandExt;
    const CREATE_NEW_PROCESS_GROUP: u32 = 0x200;
    command.creation_flags(CREATE_NEW_PROCESS_GROUP);
}
