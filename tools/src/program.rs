//! A program of the user, as a child process. However this process ends, the program ends, too, with all programs that
//! it has started.
//!
//! A keeper sees to that: another process of `txt`, which ends it when the system closes the keeper's input.

use std::env;
use std::ffi::OsString;
use std::io::{self, IsTerminal, Write};
use std::process::{Child, ChildStderr, Command, ExitStatus, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::Context;

use crate::guardian::{apart, outliving};

/// Where a program finds the address, beside its last argument. The second one is that of C programs.
const VARIABLES: [&str; 2] = [ADDRESS, "FT_TXT_HOST"];
pub(crate) const ADDRESS: &str = "TXT_ADDRESS";
/// What names those of COM ports for C programs. The entry `none` keeps them from a file that names some: the program
/// would drive another controller, or this one past us.
const PORTS: &str = "FT_TXT_PORTS";

/// What the program and all that it starts have in their environment: the number of the keeper. On Linux it finds them
/// by that, whatever their groups, sessions and parents are.
pub(crate) const MARK: &str = "TXT_KEEPER";
/// What the keeper gets when the program has ended.
const GONE: &str = "gone";

/// The hidden command of the keeper.
pub(crate) const KEEPER: &str = "keep-program";

/// How often to look whether a program has ended that should.
const LOOK: Duration = Duration::from_millis(10);

/// How long the end of a program may take: the keeper kills it after a second, and tries that for another one.
const END_LIMIT: Duration = Duration::from_secs(3);

/// A running program. It ends when this is dropped.
pub(crate) struct Program {
    child: Child,
    keeper: Child,
    /// It was seen that the keeper is gone.
    is_alone: bool,
    /// Whether it has a process group of its own, with most that it starts. Otherwise it is in ours, because only the
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
    /// Starts it. It gets the address of the controller as its last argument, and prints to this standard output.
    pub(crate) fn start(
        words: &[OsString],
        address: &str,
        reads: Reads,
        stdout: Stdio,
    ) -> anyhow::Result<Self> {
        Self::start_with(words, address, reads, [stdout, Stdio::inherit()])
    }

    /// The same for a program whose standard error is read here.
    pub(crate) fn start_heard(
        words: &[OsString],
        address: &str,
        reads: Reads,
    ) -> anyhow::Result<(Self, ChildStderr)> {
        let prints = [Stdio::inherit(), Stdio::piped()];
        let mut program = Self::start_with(words, address, reads, prints)?;
        let heard = program.child.stderr.take().context("the program has no standard error")?;
        Ok((program, heard))
    }

    fn start_with(
        words: &[OsString],
        address: &str,
        reads: Reads,
        [stdout, stderr]: [Stdio; 2],
    ) -> anyhow::Result<Self> {
        let (name, arguments) = words.split_first().context("there is no program")?;
        let mut command = Command::new(name);
        command.args(arguments).arg(address).envs(VARIABLES.map(|name| (name, address)));
        let ports = env::var(PORTS).unwrap_or_default();
        command.env(PORTS, format!("{ports}\nnone"));
        command.stdout(stdout).stderr(stderr);
        command.stdin(match reads {
            Reads::Nothing => Stdio::null(),
            Reads::OurInput => Stdio::inherit(),
        });
        let has_group = cfg!(unix) && (reads == Reads::Nothing || !io::stdin().is_terminal());
        if has_group {
            apart(&mut command);
        }
        let keeper = keeper().context("can't start the process that ends the program")?;
        command.env(MARK, keeper.id().to_string());
        let child = command
            .spawn()
            .with_context(|| format!("can't start the program {}", name.to_string_lossy()))?;
        // After an error it is ended, too.
        let mut program = Self { child, keeper, is_alone: false, has_group };
        let sign = if has_group { "-" } else { "" };
        let what = format!("{sign}{}", program.child.id());
        program.write_to_keeper(&what).context("the process that ends the program is gone")?;
        Ok(program)
    }

    /// Tells the keeper what to end.
    fn write_to_keeper(&mut self, what: &str) -> io::Result<()> {
        let input = self.keeper.stdin.as_mut().ok_or(io::ErrorKind::BrokenPipe)?;
        input.write_all(format!("{what}\n").as_bytes())
    }

    /// How it has ended; `None` while it runs.
    pub(crate) fn ended(&mut self) -> io::Result<Option<ExitStatus>> {
        if !self.is_alone && !matches!(self.keeper.try_wait(), Ok(None)) {
            self.is_alone = true;
            log::warn!("the process that ends the program when this one is killed has ended: the program goes on then");
        }
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
            // Its number may be that of another process by now. A keeper that is gone ends nothing.
            let _ = self.write_to_keeper(GONE);
        }
        let has_keeper = matches!(self.keeper.try_wait(), Ok(None));
        if self.has_group && !has_keeper {
            system::kill_group(self.child.id());
        }
        drop(self.keeper.stdin.take());
        // One that waits for a disk does not end before the disk answers. Nothing waits for that.
        let deadline = Instant::now() + END_LIMIT;
        while Instant::now() < deadline {
            let runs = [&mut self.child, &mut self.keeper]
                .map(|process| matches!(process.try_wait(), Ok(None)));
            match runs {
                [false, false] => return,
                // The keeper was killed, or could not end it.
                [true, false] => drop(self.child.kill()),
                [_, true] => {}
            }
            thread::sleep(LOOK);
        }
    }
}

/// Starts a keeper.
fn keeper() -> io::Result<Child> {
    outliving()?.arg(KEEPER).stdout(Stdio::null()).stderr(Stdio::null()).spawn()
}

/// What a keeper does: it reads what to end, waits for the end of its input, and ends it.
pub(crate) fn keep() -> anyhow::Result<()> {
    let what = io::stdin().lines().map_while(Result::ok).last();
    // Without a line, the process that started this one was killed before it could write it: the program may run.
    let what = what.filter(|what| what != GONE).map(|what| what.parse()).transpose()?;
    system::end(what);
    Ok(())
}

#[cfg(unix)]
mod system {
    use std::thread;
    use std::time::{Duration, Instant};

    use nix::sys::signal::{kill, killpg, Signal};
    use nix::unistd::Pid;

    use super::LOOK;

    /// How long a program may take to end by itself, and how long killing it is tried.
    const FAREWELL: Duration = Duration::from_secs(1);

    pub(super) fn interrupt_group(group: u32) {
        if let Ok(group) = i32::try_from(group) {
            // One that has just ended needs no signal.
            let _ = killpg(Pid::from_raw(group), Signal::SIGINT);
        }
    }

    pub(super) fn kill_group(group: u32) {
        if let Ok(group) = i32::try_from(group) {
            // As long as somebody is in it, nobody else gets its number.
            let _ = killpg(Pid::from_raw(group), Signal::SIGKILL);
        }
    }

    /// Ends this process, or with a minus all of this group, and all that have this process as their keeper.
    pub(super) fn end(what: Option<i32>) {
        let what = what.map(Pid::from_raw);
        let all = || what.into_iter().chain(marked()).filter(|one| kill(*one, None).is_ok());
        let send = |signal| {
            for one in all() {
                // One that has just ended needs no signal.
                let _ = kill(one, signal);
            }
        };
        for signal in [Signal::SIGTERM, Signal::SIGKILL] {
            let begin = Instant::now();
            send(signal);
            while begin.elapsed() < FAREWELL {
                if all().next().is_none() {
                    return;
                }
                if signal == Signal::SIGKILL {
                    // Others may have been started meanwhile.
                    send(signal);
                }
                thread::sleep(LOOK);
            }
        }
    }

    /// The processes that have this one as their keeper.
    #[cfg(target_os = "linux")]
    fn marked() -> Vec<Pid> {
        let mark = format!("{}={}", super::MARK, std::process::id()).into_bytes();
        let has_mark = |id: &i32| {
            let environment = std::fs::read(format!("/proc/{id}/environ")).unwrap_or_default();
            environment.split(|byte| *byte == 0).any(|variable| variable == mark)
        };
        let names = std::fs::read_dir("/proc").into_iter().flatten().flatten();
        let ids = names.filter_map(|entry| entry.file_name().to_str()?.parse().ok());
        ids.filter(has_mark).map(Pid::from_raw).collect()
    }

    /// Other systems do not show which processes these are.
    #[cfg(not(target_os = "linux"))]
    fn marked() -> Vec<Pid> {
        Vec::new()
    }
}

#[cfg(not(unix))]
mod system {
    use std::process::{Command, Stdio};

    /// There are no such groups. A console passes Ctrl-C to all of its processes.
    pub(super) fn interrupt_group(_: u32) {}

    pub(super) fn kill_group(_: u32) {}

    /// Ends this process and those that it has started.
    pub(super) fn end(what: Option<i32>) {
        let Some(what) = what else { return };
        let mut command = Command::new("taskkill");
        command.args(["/T", "/F", "/PID", &what.to_string()]).stdin(Stdio::null());
        // Nobody could read about an error.
        let _ = command.status();
    }
}
