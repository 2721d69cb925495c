//! A program beside a test. It ends with the test.

use std::io::{BufRead, BufReader, Read};
use std::process::{Child, Command, Output, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use crossbeam_channel::{unbounded, Receiver};

/// How long a line may take, however busy the computer is.
const LIMIT: Duration = Duration::from_secs(60);

/// How long anything else may take that a test waits for.
const WAIT: Duration = Duration::from_secs(40);

/// How long it may take to end when it is asked to.
const LAST_WORDS: Duration = Duration::from_secs(10);

/// Waits until this is so; if it takes too long, the test fails.
pub(crate) fn wait_for(what: &str, mut is_so: impl FnMut() -> bool) {
    let deadline = Instant::now() + WAIT;
    while !is_so() {
        assert!(Instant::now() < deadline, "{what}");
        thread::sleep(Duration::from_millis(10));
    }
}

pub(crate) struct Running {
    child: Child,
    /// What it prints.
    lines: Receiver<String>,
}

impl Running {
    pub(crate) fn start(command: &mut Command) -> Self {
        let mut child = command.stdin(Stdio::null()).stdout(Stdio::piped()).spawn().unwrap();
        let (sender, lines) = unbounded();
        let out = BufReader::new(child.stdout.take().unwrap());
        thread::spawn(move || {
            for line in out.lines().map_while(Result::ok) {
                // When nobody waits for it any more, it is read and thrown away.
                let _ = sender.send(line);
            }
        });
        Self { child, lines }
    }

    /// The next line that it prints.
    pub(crate) fn line(&self) -> String {
        self.line_if_any().expect("the program prints a line")
    }

    /// The same; `None` when it prints no more.
    pub(crate) fn line_if_any(&self) -> Option<String> {
        self.lines.recv_timeout(LIMIT).ok()
    }

    pub(crate) fn id(&self) -> u32 {
        self.child.id()
    }

    /// Sends it a signal, such as INT.
    pub(crate) fn signal(&self, signal: &str) {
        assert!(is_sent(&self.child, signal));
    }

    /// Waits until its standard output is closed by it and all that it has started; `false` when that takes too long.
    pub(crate) fn leaves_nothing(&self) -> bool {
        let deadline = Instant::now() + LIMIT;
        loop {
            match self.lines.recv_deadline(deadline) {
                Ok(_) => {}
                Err(error) => return error.is_disconnected(),
            }
        }
    }

    /// Waits until it ends by itself: how, and what else it has printed. Errors only if they were piped.
    pub(crate) fn end(mut self) -> Output {
        let mut stderr = Vec::new();
        if let Some(mut errors) = self.child.stderr.take() {
            errors.read_to_end(&mut stderr).unwrap();
        }
        let stdout = self.lines.iter().flat_map(|line| (line + "\n").into_bytes()).collect();
        Output { status: self.child.wait().unwrap(), stdout, stderr }
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        end(&mut self.child);
    }
}

/// Ends a program of the box. After a kill, its guardian would look for the controller when that is gone, and could find
/// the one of another test at its port.
pub(crate) fn end(child: &mut Child) {
    let has_ended = |child: &mut Child| matches!(child.try_wait(), Ok(Some(_)));
    if cfg!(unix) && !has_ended(child) && is_sent(child, "TERM") {
        let deadline = Instant::now() + LAST_WORDS;
        while !has_ended(child) && Instant::now() < deadline {
            thread::sleep(Duration::from_millis(5));
        }
    }
    // It may have ended already.
    let _ = child.kill();
    let _ = child.wait();
}

/// Sends a signal, such as INT; `false` when it has ended. After STOP it runs no more: a busy computer takes its time.
pub(crate) fn is_sent(child: &Child, signal: &str) -> bool {
    let (option, id) = (format!("-{signal}"), child.id().to_string());
    let sent = Command::new("kill").args([&option, &id]).status();
    if signal == "STOP" {
        wait_for("the program is suspended", || {
            let state = Command::new("ps").args(["-o", "stat=", "-p", &id]).output().unwrap();
            state.stdout.starts_with(b"T")
        });
    }
    sent.is_ok_and(|status| status.success())
}
