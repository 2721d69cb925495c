//! The program as a child of this process: a crash of it does not take the simulated TXT with it.

#[cfg(not(target_os = "linux"))]
use std::collections::BTreeSet;
use std::env;
use std::ffi::OsString;
#[cfg(not(target_os = "linux"))]
use std::io;
use std::path::Path;
use std::process::{Command, ExitStatus};
use std::sync::mpsc::{sync_channel, SyncSender};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use ft_transfer_area::Error;

use crate::endings::{self, Doing, Endings};
#[cfg(target_os = "linux")]
use crate::forks::Forks;
use crate::online::{self, Online, While};
use crate::options::Options;
use crate::port_entries::entries;
use crate::program::Program;
use crate::symbols::Entry;
use crate::target::Target;
use crate::{signals, stop, write_sentence, Sentence};

/// The environment variable that names the controller.
const HOST: &str = "FT_TXT_HOST";

/// The environment variable that names those of COM ports.
const PORTS: &str = "FT_TXT_PORTS";

/// How a program has ended.
pub(crate) struct Ended {
    /// The exit status for `tx_run`.
    pub(crate) status: i32,
    /// What is being said since before.
    pub(crate) saying: Option<JoinHandle<()>>,
    /// What is still to be said.
    pub(crate) words: Vec<String>,
}

/// What is said of a simulated TXT whose program could not stop it.
const ENDS_WITH_US: &str = "nothing is known of its last exchange; its simulated TXT ends now";

/// How often is looked at the program.
const LOOK: Duration = Duration::from_millis(10);

/// The COM ports that the user has named for this start; none when the options say which controller it is.
pub(crate) fn named_ports(options: &Options) -> String {
    let is_said = options.host.is_some() || options.world.is_some() || options.show;
    let named = env::var_os(PORTS).filter(|_| !is_said).unwrap_or_default();
    // A comment may be in another encoding.
    named.to_string_lossy().trim().to_owned()
}

/// The hosts that such a text names.
fn hosts_in(ports: &str) -> impl Iterator<Item = String> + '_ {
    let hosts = entries(ports).filter_map(|entry| entry.split_once('='));
    hosts.map(|(_, host)| host.trim().to_owned()).filter(|host| !host.is_empty())
}

/// Runs the program. Its motors are off afterwards, as far as that is possible.
pub(crate) fn run(
    program: &Program,
    target: &Target,
    ports: &str,
    arguments: &[OsString],
    build: &Path,
) -> Result<Ended, Sentence> {
    let named = hosts_in(ports).chain([target.host()]).collect();
    let mut online = Online::new(build, named)?;
    let mut command = Command::new(&program.path);
    command.args(arguments).env(HOST, target.host()).env(online::VARIABLE, &online.folder);
    // Without the entry a file may send the program to another controller than the one that was said.
    command.env(PORTS, format!("{ports}\nnone"));
    // What the user has set wins.
    let is_free = |name: &str| env::var_os(name).is_none_or(|value| value.is_empty());
    command.envs(target.supply().into_iter().filter(|(name, _)| is_free(name)));
    if cfg!(windows) {
        let before = env::var_os("PATH").unwrap_or_default();
        let own = std::iter::once(program.library_folder.clone());
        command.env("PATH", env::join_paths(own.chain(env::split_paths(&before)))?);
    }
    end_with_this_process(&mut command);
    signals::let_suspend_it(&mut command);
    let forks = Forks::of(&program.path)?;
    signals::begin_program();
    signals::take_up_pauses()?;
    let mut child = command.spawn().map_err(|error| {
        let program = program.path.display();
        format!("{program} does not start: {error}; TMPDIR may name another folder for it")
    })?;
    let id = signals::pass_on_to(&child);
    let mut was_left = false;
    let (mut endings, mut was_cut_off) = (Endings::default(), false);
    let (to_say, saying) = say_meanwhile();
    let status = loop {
        match child.try_wait() {
            Ok(None) => {}
            Ok(Some(status)) => break Ok(status),
            Err(error) => break Err(error),
        }
        let is_suspended = signals::is_to_pause(&child);
        if online.is_left(is_suspended) {
            was_left = true;
            online.begin_to_stop(if is_suspended { While::IsSuspended } else { While::Runs });
        }
        for (process, doing) in endings.take_long(|| online.drivers()) {
            match doing {
                Doing::WritesImage => {
                    was_cut_off = true;
                    endings::cut_off(process);
                }
                Doing::WaitsForSystem => online.give_up(process),
            }
        }
        // Sentences without room are not said.
        for stopped in online.take_stopped() {
            drop(to_say.try_send(words_of_stop(stopped, folder_if_gone(&online).as_deref())));
        }
        // Not while motors may be on.
        match is_suspended && !online.has_any() {
            true => signals::pause(),
            false => thread::sleep(LOOK),
        }
    };
    signals::stop_passing_on(id);
    let status = status?;
    let name = program.path.file_stem().unwrap_or_default().to_string_lossy();
    let is_crash = status.code().is_none_or(signals::is_crash);
    let (status, word) = end_of(&name, program.entry, status);
    // What no process drives any more does not wait for what takes its time to end, which may have the connection.
    let drivers = online.drivers();
    let (left, mut stopped) = thread::scope(|scope| {
        let ending = thread::Builder::new().spawn_scoped(scope, || forks.end(&drivers));
        let stopped = stop_left(&mut online, target, While::Ends);
        let left = ending.ok().and_then(|ending| ending.join().ok());
        (left.unwrap_or_else(|| forks.end(&drivers)), stopped)
    });
    stopped.retain(|(is_over, _)| *is_over);
    for host in online.not_stopped() {
        let seconds = stop::TRIES.as_secs();
        drop(to_say.try_send(format!(
            "{host} could not be stopped; it is tried for {seconds} s, unless you press Ctrl-C twice"
        )));
    }
    // Also those that could not be stopped while the program ran.
    stopped.extend(stop_left(&mut online, target, While::HasEnded));
    drop(to_say);
    let forks = match left {
        Left::Nothing => None,
        Left::Ended => Some(format!("what {name} has left running was ended")),
        Left::Unknown => {
            Some(format!("/proc is not mounted, so what {name} may have left running goes on"))
        }
    };
    // All that it began has ended by its own last exchange, perhaps long ago: another program may drive by now. Without a
    // transfer nobody knows what the outputs do.
    let is_off = online.has_begun() && stopped.is_empty() && !was_left;
    let word = word.map(|word| {
        if is_crash && is_off {
            word + "; its transfer has ended with all outputs off"
        } else {
            word
        }
    });
    let cut_off = was_cut_off
        .then(|| "a memory image (core) was cut off, because motors were on meanwhile".to_owned());
    let stopped = stopped.into_iter().map(|(_, it)| it);
    let words = word.into_iter().chain(cut_off).chain(forks).chain(stopped).collect();
    Ok(Ended { status, saying, words })
}

/// Says sentences while the program runs, which is looked at meanwhile: perhaps nobody reads them.
fn say_meanwhile() -> (SyncSender<String>, Option<JoinHandle<()>>) {
    const ROOM: usize = 16;
    let (to_say, sentences) = sync_channel::<String>(ROOM);
    let say = move || sentences.iter().for_each(|it| write_sentence(&it));
    // Without a thread they are not said.
    (to_say, thread::Builder::new().spawn(say).ok())
}

/// What a program has left running when it has ended.
pub(crate) enum Left {
    Nothing,
    /// There was something.
    #[cfg_attr(not(target_os = "linux"), allow(dead_code, reason = "only Linux shows it"))]
    Ended,
    /// The system does not show it any more.
    #[cfg_attr(not(target_os = "linux"), allow(dead_code, reason = "only Linux shows it"))]
    Unknown,
}

/// Other systems do not show which processes these are.
#[cfg(not(target_os = "linux"))]
struct Forks;

#[cfg(not(target_os = "linux"))]
impl Forks {
    fn of(_: &Path) -> io::Result<Self> {
        Ok(Self)
    }

    fn end(&self, _: &BTreeSet<u32>) -> Left {
        Left::Nothing
    }
}

/// Stops the controllers that the program has left, and returns what is to be said of each, and whether it needs no other
/// try.
fn stop_left(online: &mut Online, target: &Target, program: While) -> Vec<(bool, String)> {
    // A simulated TXT ends with this process.
    let simulated = match target {
        Target::Host(_) => None,
        Target::Simulated { .. } | Target::Shown { .. } => Some(target.host()),
    };
    let ends = simulated.as_ref().is_some_and(|host| online.has_left(host, program));
    let ends = ends.then(|| (true, String::from(ENDS_WITH_US)));
    let gone = folder_if_gone(online);
    let stopped = online.stop_left(simulated.as_deref(), program).into_iter();
    let words = stopped.map(|it| (it.1.is_ok(), words_of_stop(it, gone.as_deref())));
    ends.into_iter().chain(words).collect()
}

/// The folder of its notes, when they were removed.
fn folder_if_gone(online: &Online) -> Option<String> {
    online.is_gone().then(|| online.folder.display().to_string())
}

/// A program may have several controllers. The folder is the one of its notes when they were removed.
fn words_of_stop((host, stopped): (String, Result<String, Error>), gone: Option<&str>) -> String {
    match (stopped, gone) {
        (Ok(name), None) => format!(
            "nothing is known of its last exchange with {host}, so tx_run has sent it: all outputs are off; {name} has answered"
        ),
        (Err(error), None) => format!(
            "nothing is known of its last exchange with {host}, and tx_run could send none, so motors may go on: {error:#}"
        ),
        (Ok(name), Some(folder)) => format!(
            "its notes in {folder} were removed, so tx_run has sent a last exchange to {host}: all outputs are off; {name} \
             has answered"
        ),
        (Err(error), Some(folder)) => format!(
            "its notes in {folder} were removed, and tx_run could send no last exchange to {host}, so motors may go \
             on there: {error:#}"
        ),
    }
}

/// Asks the system to end the program when `tx_run` is killed. Only Linux has such a request.
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
