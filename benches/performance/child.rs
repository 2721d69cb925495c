//! Other processes of this program.

use std::io::{BufRead, BufReader, Read};
use std::process::{Child, ChildStdout, Command, Stdio};

use anyhow::{Context, Result};

use crate::process::Process;

/// A process that serves until this is dropped.
pub(crate) struct Server {
    child: Child,
    out: BufReader<ChildStdout>,
}

impl Server {
    /// Starts this program in a role; it prints a line when it is ready.
    pub(crate) fn start(arguments: &[String]) -> Result<Self> {
        let mut child = Command::new(std::env::current_exe()?)
            .args(arguments)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()?;
        let out = child.stdout.take().context("no output")?;
        Ok(Self { child, out: BufReader::new(out) })
    }

    /// The next line that it prints.
    pub(crate) fn line(&mut self) -> Result<String> {
        let mut line = String::new();
        let size = self.out.read_line(&mut line)?;
        anyhow::ensure!(size > 0, "the other process ended");
        Ok(line.trim_end().to_owned())
    }

    /// What it takes now.
    pub(crate) fn process(&self) -> Result<Process> {
        Process::of(self.child.id())
    }

    /// The number that it prints next, such as its port.
    pub(crate) fn number(&mut self) -> Result<u16> {
        let line = self.line()?;
        line.parse().with_context(|| format!("{line:?} is not a number"))
    }

    /// All that it prints until it ends by itself.
    pub(crate) fn rest(mut self) -> Result<String> {
        let mut text = String::new();
        self.out.read_to_string(&mut text)?;
        let status = self.child.wait()?;
        anyhow::ensure!(status.success(), "the other process failed");
        Ok(text)
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        // It may have ended already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Runs this program in a role to its end; returns what it prints.
pub(crate) fn run(arguments: &[String]) -> Result<String> {
    Server::start(arguments)?.rest()
}

/// Arguments as they are given to a process.
pub(crate) fn arguments<const N: usize>(words: [&dyn ToString; N]) -> Vec<String> {
    words.iter().map(|word| word.to_string()).collect()
}
