//! A program of the user, as a child process. However this process ends, the program ends, too, with all programs that
//! it has started.
//!
//! A keeper sees to that: another process of `txt`, which ends it when the system closes the keeper's input.

use std::env;
use std::ffi::OsString;
use std::io::{self, IsTerminal, Write};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::Context;

use crate::guardian::apart;

/// Where a program finds the address, beside its last argument. The second one is that of C programs.
const VARIABLES: [&str; 2] = ["TXT_ADDRESS", "FT_TXT_HOST"];

/// The hidden command of the keeper.
pub(crate) const KEEPER: &str = "keep-program";

/// How often to look whether a program has ended that should.
const LOOK: Duration = Duration::from_millis(10);

/// How long the end of a program may take. The keeper kills it after a second.
const END_LIMIT: Duration = Duration::from_secs(3);

/// A running program. It ends when this is dropped.
pub(crate) struct Program {
    child: Child,
    keeper: Child,
    /// Whether it has a process group of its own, with all that it starts. Otherwise it is in ours, because only the
    /// group in front may read the terminal and gets its Ctrl-C.
    has_group: bool,
}

/// What a program reads.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Reads {
    Nothing,
    /// What this process would read.
    OurInput,
}

impl Program {
    /// Starts it. It gets the address of the controller as its last argument.
    pub(crate) fn start(words: &[OsString], address: &str, reads: Reads) -> anyhow::Result<Self> {
        let (name, arguments) = words.split_first().context("there is no program")?;
        let mut command = Command::new(name);
        command.args(arguments).arg(address).envs(VARIABLES.map(|name| (name, address)));
        command.stdin(match reads {
            Reads::Nothing => Stdio::null(),
            Reads::OurInput => Stdio::inherit(),
        });
        let has_group = cfg!(unix) && (reads == Reads::Nothing || !io::stdin().is_terminal());
        if has_group {
            apart(&mut command);
        }
        let keeper = keeper().context("can't start the process that ends the program")?;
        let child = command
            .spawn()
            .with_context(|| format!("can't start the program {}", name.to_string_lossy()))?;
        // After an error it is ended, too.
        let mut program = Self { child, keeper, has_group };
        program.tell_keeper().context("the process that ends the program is gone")?;
        Ok(program)
    }

    /// Tells the keeper what to end.
    fn tell_keeper(&mut self) -> io::Result<()> {
        let sign = if self.has_group { "-" } else { "" };
        let input = self.keeper.stdin.as_mut().ok_or(io::ErrorKind::BrokenPipe)?;
        input.write_all(format!("{sign}{}\n", self.child.id()).as_bytes())
    }

    /// How it has ended; `None` while it runs.
    pub(crate) fn ended(&mut self) -> io::Result<Option<ExitStatus>> {
        self.child.try_wait()
    }

    /// Passes Ctrl-C on, unless it gets those of the terminal itself.
    pub(crate) fn interrupt(&self) {
        if self.has_group {
            system::interrupt_group(self.child.id());
        }
    }
}

impl Drop for Program {
    fn drop(&mut self) {
        if !self.has_group && !matches!(self.child.try_wait(), Ok(None)) {
            // Its number may be that of another process by now.
            let _ = self.keeper.kill();
        }
        drop(self.keeper.stdin.take());
        // One that waits for a disk does not end before the disk answers. Nothing waits for that.
        let deadline = Instant::now() + END_LIMIT;
        while matches!(self.child.try_wait(), Ok(None)) && Instant::now() < deadline {
            if !matches!(self.keeper.try_wait(), Ok(None)) {
                // The keeper was killed, or could not end it.
                let _ = self.child.kill();
            }
            thread::sleep(LOOK);
        }
        let _ = self.keeper.wait();
    }
}

/// Starts a keeper.
fn keeper() -> io::Result<Child> {
    let mut command = Command::new(env::current_exe()?);
    command.arg(KEEPER).stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::null());
    apart(&mut command);
    command.spawn()
}

/// What a keeper does: it reads what to end, waits for the end of its input, and ends it.
pub(crate) fn keep() -> anyhow::Result<()> {
    let mut lines = io::stdin().lines().map_while(Result::ok);
    let Some(what) = lines.next() else { return Ok(()) };
    lines.for_each(drop);
    system::end(what.parse()?)
}

#[cfg(unix)]
mod system {
    use std::thread;
    use std::time::{Duration, Instant};

    use nix::sys::signal::{kill, killpg, Signal};
    use nix::unistd::Pid;

    use super::LOOK;

    /// How long a program may take to end by itself.
    const FAREWELL: Duration = Duration::from_secs(1);

    pub(super) fn interrupt_group(group: u32) {
        if let Ok(group) = i32::try_from(group) {
            // One that has just ended needs no signal.
            let _ = killpg(Pid::from_raw(group), Signal::SIGINT);
        }
    }

    /// Ends this process; with a minus, all of this group.
    pub(super) fn end(what: i32) -> anyhow::Result<()> {
        let what = Pid::from_raw(what);
        let begin = Instant::now();
        kill(what, Signal::SIGTERM)?;
        while begin.elapsed() < FAREWELL {
            // Nothing is sent: whether it is there.
            kill(what, None)?;
            thread::sleep(LOOK);
        }
        Ok(kill(what, Signal::SIGKILL)?)
    }
}

#[cfg(not(unix))]
mod system {
    use std::process::{Command, Stdio};

    /// There are no such groups. A console passes Ctrl-C to all of its processes.
    pub(super) fn interrupt_group(_: u32) {}

    /// Ends this process and those that it has started.
    pub(super) fn end(what: i32) -> anyhow::Result<()> {
        let mut command = Command::new("taskkill");
        command.args(["/T", "/F", "/PID", &what.to_string()]).stdin(Stdio::null());
        command.status()?;
        Ok(())
    }
}
