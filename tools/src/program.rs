//! A program of the user, as a child process.

use std::ffi::OsString;
use std::io;
use std::process::{Child, Command, ExitStatus, Stdio};

use anyhow::Context;

/// Where a program finds the address, beside its last argument. The second one is that of C programs.
const VARIABLES: [&str; 2] = ["TXT_ADDRESS", "FT_TXT_HOST"];

/// A running program. It ends when this is dropped.
pub(crate) struct Program {
    child: Child,
}

impl Program {
    /// Starts it. It gets the address of the controller as its last argument.
    pub(crate) fn start(words: &[OsString], address: &str, input: Stdio) -> anyhow::Result<Self> {
        let (name, arguments) = words.split_first().context("there is no program")?;
        let child = Command::new(name)
            .args(arguments)
            .arg(address)
            .envs(VARIABLES.map(|name| (name, address)))
            .stdin(input)
            .spawn()
            .with_context(|| format!("can't start the program {}", name.to_string_lossy()))?;
        Ok(Self { child })
    }

    /// How it has ended; `None` while it runs.
    pub(crate) fn ended(&mut self) -> io::Result<Option<ExitStatus>> {
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
