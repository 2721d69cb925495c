//! The program as a child of this process: a crash of it does not take the simulated TXT with it.

use std::env;
use std::ffi::OsString;
use std::process::{Command, ExitStatus};

use crate::program::Program;
use crate::symbols::Entry;
use crate::target::Target;
use crate::{signals, stop, Sentence};

/// The environment variable that names the controller.
const HOST: &str = "FT_TXT_HOST";

/// How a program has ended.
pub(crate) struct Ended {
    /// The exit status for `tx_run`.
    pub(crate) status: i32,
    /// What is still to be said.
    pub(crate) words: Vec<String>,
}

/// Runs the program. Its motors are off afterwards, as far as that is possible.
pub(crate) fn run(
    program: &Program,
    target: &Target,
    arguments: &[OsString],
) -> Result<Ended, Sentence> {
    let mut command = Command::new(&program.path);
    command.args(arguments).env(HOST, target.host());
    if cfg!(windows) {
        let before = env::var_os("PATH").unwrap_or_default();
        let own = std::iter::once(program.library_folder.clone());
        command.env("PATH", env::join_paths(own.chain(env::split_paths(&before)))?);
    }
    end_with_this_process(&mut command);
    let mut child = command.spawn()?;
    let id = signals::pass_on_to(&child);
    let status = child.wait();
    signals::stop_passing_on(id);
    let status = status?;
    let is_sudden = is_sudden(program.entry, status);
    let stopped = match target {
        // After Ctrl-C the library has done so, unless the program has taken that from it.
        Target::Host(host) if is_sudden || status.code().is_none() => Some(stop::stop(host)),
        _ => None,
    };
    let name = program.path.file_stem().unwrap_or_default().to_string_lossy();
    let (status, word) = end_of(&name, program.entry, status);
    let stopped = stopped.and_then(|stopped| match (stopped, is_sudden) {
        (Ok(()), false) => None,
        (Ok(()), true) => Some(String::from(
            "it could send no last exchange, so tx_run has sent it: all outputs are off",
        )),
        (Err(error), true) => Some(format!(
            "it could send no last exchange, and tx_run could not either, so motors may go on: {error}"
        )),
        (Err(error), false) => Some(format!(
            "tx_run could not make sure that all outputs are off: {error}"
        )),
    });
    Ok(Ended { status, words: word.into_iter().chain(stopped).collect() })
}

/// Whether the program has ended without a chance to send a last exchange. The runtime of a program with `PrgTic` ends
/// with 0 or 1, so other codes are from `_exit`; in others they may be from `main`.
fn is_sudden(entry: Entry, status: ExitStatus) -> bool {
    let is_own = status.code().is_none_or(|code| [0, 1].contains(&code));
    signals::is_sudden(status) || (entry == Entry::PrgTic && !is_own)
}

/// Has the program ended when nobody is left who would: `tx_run` was killed. Other systems than Linux have
/// no such request.
#[cfg(target_os = "linux")]
pub(crate) fn end_with_this_process(command: &mut Command) {
    use std::os::unix::process::CommandExt;
    let parent = std::process::id() as libc::pid_t;
    // SAFETY: between fork and exec it makes two system calls, which take no pointers.
    unsafe {
        command.pre_exec(move || {
            libc::prctl(libc::PR_SET_PDEATHSIG, libc::SIGTERM);
            // It may have been killed before.
            match libc::getppid() == parent {
                true => Ok(()),
                false => Err(std::io::ErrorKind::NotFound.into()),
            }
        });
    }
}

#[cfg(not(target_os = "linux"))]
pub(crate) fn end_with_this_process(_: &mut Command) {}

/// The exit status for a program that has ended, 1 for a crash, and how it has ended, unless it has said so itself.
fn end_of(name: &str, entry: Entry, status: ExitStatus) -> (i32, Option<String>) {
    let Some(code) = status.code() else {
        return (1, Some(format!("{name} was ended by {}", signals::name_in(status))));
    };
    // The runtime ends a program with PrgTic with 1, and has said why. Other codes are from _exit.
    let is_said = code == 0 || (entry == Entry::PrgTic && code == 1);
    let word = (!is_said).then(|| format!("{name} {}", signals::words_of(code)));
    (if signals::is_crash(code) { 1 } else { code }, word)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What `tx_run` ends with when its program has ended with this status.
    fn after(status: i32) -> i32 {
        let [shell, option] = if cfg!(windows) { ["cmd", "/c"] } else { ["sh", "-c"] };
        let mut command = Command::new(shell);
        let status = command.args([option, &format!("exit {status}")]).status().unwrap();
        end_of("a", Entry::Main, status).0
    }

    #[test]
    fn the_status_is_the_programs() {
        assert_eq!([0, 1, 7, 255].map(after), [0, 1, 7, 255]);
    }

    #[cfg_attr(not(windows), ignore = "a status has 8 bits, and a crash is a signal")]
    #[test]
    fn a_crash_has_the_status_1_and_a_long_status_is_kept() {
        assert_eq!([300, -1, -0x3FFF_FFFB].map(after), [300, -1, 1]);
    }
}
