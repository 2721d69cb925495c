//! A sample, or another program, as a child process, read line by line.

use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{self, Receiver};
use std::thread;
use std::time::{Duration, Instant};

use crate::program::{example, DEADLINE};

/// A running program, which is killed when this is dropped.
pub(crate) struct Run {
    child: Child,
    stdout: Receiver<String>,
    lines: Vec<String>,
}

impl Run {
    /// A sample with these arguments.
    pub(crate) fn start(name: &str, arguments: &[&str]) -> Self {
        Self::of(example(name).args(arguments))
    }

    pub(crate) fn of(command: &mut Command) -> Self {
        let mut child = command.stdout(Stdio::piped()).spawn().unwrap();
        let (sender, stdout) = mpsc::channel();
        let lines = BufReader::new(child.stdout.take().unwrap()).lines();
        thread::spawn(move || lines.map_while(Result::ok).try_for_each(|line| sender.send(line)));
        Self { child, stdout, lines: Vec::new() }
    }

    /// Waits for a line that contains this.
    pub(crate) fn wait_for(&mut self, part: &str) {
        let begin = Instant::now();
        loop {
            let limit = DEADLINE.saturating_sub(begin.elapsed());
            let Ok(line) = self.stdout.recv_timeout(limit) else {
                panic!("no line has {part:?}: {:#?}", self.lines)
            };
            self.lines.push(line);
            if self.lines.last().is_some_and(|line| line.contains(part)) {
                return;
            }
        }
    }

    /// The process.
    #[allow(dead_code, reason = "only the checks with the firmware use it")]
    pub(crate) fn id(&self) -> u32 {
        self.child.id()
    }

    /// The line that was read last.
    #[allow(dead_code, reason = "only the checks with the firmware use it")]
    pub(crate) fn last_line(&self) -> &str {
        self.lines.last().map_or("", String::as_str)
    }

    /// Presses Ctrl-C.
    pub(crate) fn interrupt(&self) {
        self.signal("INT");
    }

    /// Sends a signal, such as TERM.
    pub(crate) fn signal(&self, name: &str) {
        let id = self.child.id().to_string();
        assert!(Command::new("kill").args(["-s", name, &id]).status().unwrap().success());
    }

    /// Waits for its end, which must be without an error. Returns what it has printed.
    pub(crate) fn finish(self) -> Vec<String> {
        self.end(true)
    }

    /// The same for a sample that must fail.
    pub(crate) fn fail(self) -> Vec<String> {
        self.end(false)
    }

    fn end(mut self, well: bool) -> Vec<String> {
        let begin = Instant::now();
        while self.child.try_wait().unwrap().is_none() {
            assert!(begin.elapsed() < DEADLINE, "it does not end: {:#?}", self.lines);
            thread::sleep(Duration::from_millis(5));
        }
        self.lines.extend(self.stdout.iter());
        assert_eq!(self.child.wait().unwrap().success(), well, "{:#?}", self.lines);
        std::mem::take(&mut self.lines)
    }
}

impl Drop for Run {
    fn drop(&mut self) {
        // It has ended already unless a test failed.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Checks that these texts are in the lines, in this order.
pub(crate) fn assert_in_order(lines: &[String], parts: &[&str]) {
    let mut rest = lines.iter();
    for part in parts {
        assert!(rest.any(|line| line.contains(part)), "no {part:?} in its place: {lines:#?}");
    }
}
