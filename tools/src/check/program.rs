//! The program that is checked, as a child process.

use std::ffi::OsString;
use std::io;
use std::process::{Child, Command, ExitStatus, Stdio};

use anyhow::Context;

/// Where a program finds the address, beside its last argument.
const VARIABLE: &str = "TXT_ADDRESS";

/// A running program. It ends when this is dropped.
pub(super) struct Program {
    child: Child,
}

impl Program {
    /// Starts it. It gets the address of the controller as its last argument.
    pub(super) fn start(words: &[OsString], address: &str) -> anyhow::Result<Self> {
        let (name, arguments) = words.split_first().context("there is no program")?;
        let child = Command::new(name)
            .args(arguments)
            .arg(address)
            .env(VARIABLE, address)
            .stdin(Stdio::null())
            .spawn()
            .with_context(|| format!("can't start the program {}", name.to_string_lossy()))?;
        Ok(Self { child })
    }

    /// How it has ended; `None` while it runs.
    pub(super) fn ended(&mut self) -> io::Result<Option<ExitStatus>> {
        self.child.try_wait()
    }
}

impl Drop for Program {
    fn drop(&mut self) {
        // It may have ended.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
