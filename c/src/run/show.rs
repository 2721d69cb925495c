//! A simulated TXT whose world is shown on a page: the program `txt`, beside this one or where the system finds it.

use std::env;
use std::ffi::OsStr;
use std::io::{self, BufRead, BufReader, ErrorKind, Read};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{sync_channel, Receiver};
use std::thread;
use std::time::{Duration, Instant};

use crate::target::several;
use crate::{say, signals, Sentence};

/// How long the world may take until it is shown.
const LIMIT: Duration = Duration::from_secs(20);
/// How long a line of it may be, in bytes.
const LINE: u64 = 4096;

/// A running `txt simulate --show`. It ends with this value.
pub(crate) struct Shown {
    process: Child,
    /// Of its main port.
    pub(crate) address: String,
}

impl Shown {
    pub(crate) fn start(world: &OsStr) -> Result<Self, Sentence> {
        let beside =
            env::current_exe()?.with_file_name("txt").with_extension(env::consts::EXE_EXTENSION);
        let program = if beside.is_file() { beside } else { "txt".into() };
        let mut command = Command::new(program);
        command.args(["simulate", "--port", "0", "--show", "--world"]).arg(world);
        command.stdin(Stdio::null()).stdout(Stdio::piped());
        in_a_group_of_its_own(&mut command);
        let process = command.spawn().map_err(|error| match error.kind() {
            ErrorKind::NotFound => String::from(
                "--show needs the program txt, and it is neither beside tx_run nor on the PATH; build it with \
                 cargo build --release --package txt-tools",
            ),
            _ => format!("txt can't be started: {error}"),
        })?;
        let mut shown = Self { process, address: String::new() };
        // Without the program of the user there is nothing else to end.
        let id = signals::pass_on_to(&shown.process);
        let page = shown.wait_for_page();
        signals::stop_passing_on(id);
        signals::check("the world was opened")?;
        // Without a page it has said why.
        let page = page.ok_or("txt shows no world")?;
        if shown.address.is_empty() {
            return Err(several(&world.to_string_lossy()));
        }
        say(&format!("the world is shown at {page}"));
        Ok(shown)
    }

    /// Reads the lines before the page's: with the address. Another program may have the name `txt`.
    fn wait_for_page(&mut self) -> Option<String> {
        let lines = lines_of(self.process.stdout.take()?).ok()?;
        let limit = Instant::now() + LIMIT;
        while let Ok(line) = lines.recv_timeout(limit.saturating_duration_since(Instant::now())) {
            if let Some(address) = line.strip_prefix("main ") {
                self.address = address.to_owned();
            } else if let Some(page) = line.strip_prefix("page ") {
                return Some(page.to_owned());
            }
        }
        None
    }
}

/// The lines that come, in pieces where they are too long, until nobody waits for them.
fn lines_of(from: impl Read + Send + 'static) -> io::Result<Receiver<String>> {
    let (sender, lines) = sync_channel(16);
    let read = move || {
        let mut from = BufReader::new(from);
        let mut line = Vec::new();
        while from.by_ref().take(LINE).read_until(b'\n', &mut line).is_ok_and(|length| length > 0) {
            if sender.send(String::from_utf8_lossy(&line).trim_end().to_owned()).is_err() {
                return;
            }
            line.clear();
        }
    };
    thread::Builder::new().spawn(read)?;
    Ok(lines)
}

impl Drop for Shown {
    fn drop(&mut self) {
        // It may have ended already.
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// Ctrl-C in the terminal is for the C program, which then still has to stop its motors.
#[cfg(unix)]
fn in_a_group_of_its_own(command: &mut Command) {
    use std::os::unix::process::CommandExt;
    command.process_group(0);
    crate::child::end_with_this_process(command);
}

#[cfg(windows)]
fn in_a_group_of_its_own(command: &mut Command) {
    use std::os::windows::process::CommandExt;
    const CREATE_NEW_PROCESS_GROUP: u32 = 0x200;
    command.creation_flags(CREATE_NEW_PROCESS_GROUP);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_without_an_end_comes_in_pieces() {
        let lines = lines_of("main here\n".as_bytes().chain(io::repeat(b'x'))).unwrap();
        assert_eq!(lines.recv().as_deref(), Ok("main here"));
        assert_eq!(lines.recv().map(|line| line.len() as u64), Ok(LINE));
    }
}
