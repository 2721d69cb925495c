//! A process of its own that switches a controller off when this program is killed.

use std::env;
use std::io::{self, Write};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::Context;

use crate::program;

/// A pause follows so many guardians, one after another, that have ended within such a time: they can't run.
const MANY: u32 = 5;
const SOON: Duration = Duration::from_secs(1);
const PAUSE: Duration = Duration::from_secs(1);

/// Waits until this program is gone. If it ends before, another one takes its place.
pub(crate) struct Guardian(Input);

/// The system closes it, however this program ends. Nothing when no guardian is wanted any more.
type Input = Arc<Mutex<Option<ChildStdin>>>;

impl Guardian {
    /// Starts it for this controller. Each has its own: one that does not answer at the end is no reason to stop others,
    /// which somebody else may drive by then.
    pub(crate) fn start(host: &str) -> anyhow::Result<Self> {
        #[cfg(unix)]
        leave_no_memory_image();
        let (child, input) = spawn(host)
            .context("can't start the process that stops the motors when this one is killed")?;
        let input = Arc::new(Mutex::new(Some(input)));
        let (host, kept) = (host.to_owned(), Arc::clone(&input));
        let replace = move || replace(child, &host, &kept);
        thread::Builder::new().name("guardian".to_owned()).spawn(replace)?;
        Ok(Self(input))
    }

    /// The outputs are off: it has nothing more to do.
    pub(crate) fn dismiss(self) {
        if let Some(mut input) = lock(&self.0).take() {
            // One that is gone needs no message.
            let _ = input.write_all(b".");
        }
    }
}

impl Drop for Guardian {
    fn drop(&mut self) {
        drop(lock(&self.0).take());
    }
}

/// The system closes the input of a program that has crashed only when its memory image is written, and the disk for that
/// may stand still.
#[cfg(unix)]
fn leave_no_memory_image() {
    use nix::sys::resource::{getrlimit, setrlimit, Resource};

    // With 0 Linux still hands it to a program that collects them.
    let set = getrlimit(Resource::RLIMIT_CORE)
        .and_then(|(_, most)| setrlimit(Resource::RLIMIT_CORE, most.min(1), most));
    if let Err(error) = set {
        log::warn!("a crash may keep motors on until its memory image is written: {error}");
    }
}

fn lock(input: &Input) -> MutexGuard<'_, Option<ChildStdin>> {
    input.lock().unwrap_or_else(PoisonError::into_inner)
}

fn spawn(host: &str) -> io::Result<(Child, ChildStdin)> {
    let mut command = outliving()?;
    let mut child = command.args(["stop", "--guard", "--", host]).stdout(io::stderr()).spawn()?;
    let input = child.stdin.take().ok_or(io::ErrorKind::BrokenPipe)?;
    Ok((child, input))
}

/// Starts another guardian whenever one ends that is still wanted, as when somebody has killed it.
fn replace(mut child: Child, host: &str, input: &Input) {
    let mut short = 0;
    loop {
        let begun = Instant::now();
        let ended = child.wait();
        short = if begun.elapsed() < SOON { short + 1 } else { 0 };
        if short >= MANY {
            thread::sleep(PAUSE);
        }
        let mut place = lock(input);
        if place.is_none() {
            return;
        }
        let next = spawn(host).map(|(next, input)| {
            *place = Some(input);
            next
        });
        drop(place);
        let ended = ended.map_or_else(|error| error.to_string(), |status| status.to_string());
        match next {
            Ok(next) => child = next,
            Err(error) => {
                log::warn!("the process that stops {host} when this one is killed has ended ({ended}), and no other one can be started ({error}): its motors go on then");
                return;
            }
        }
        log::warn!("the process that stops {host} when this one is killed has ended ({ended}); another one takes its place");
    }
}

/// Another process of this program, which sees by its input that this one has ended.
pub(crate) fn outliving() -> io::Result<Command> {
    let mut command = this_program()?;
    // Where this program was started by another `txt`, that one does not end it.
    command.stdin(Stdio::piped()).env_remove(program::MARK);
    apart(&mut command);
    Ok(command)
}

/// This program once more, also when its file was replaced or removed, as by an update.
pub(crate) fn this_program() -> io::Result<Command> {
    let file = env::current_exe()?;
    #[cfg(target_os = "linux")]
    if !file.exists() {
        // What runs here.
        let mut command = Command::new("/proc/self/exe");
        let name = env::args_os().next().unwrap_or_default();
        std::os::unix::process::CommandExt::arg0(&mut command, name);
        return Ok(command);
    }
    Ok(Command::new(file))
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
