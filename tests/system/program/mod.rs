//! The examples and `txt simulate` as child processes.

use std::io::{BufRead, BufReader, Read, Write};
use std::path::PathBuf;
use std::process::{Child, ChildStdin, Command, Output, Stdio};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use ft_transfer_area::{TransferAreaComHandler, TransferAreaComHandlerBuilder};

/// Longer than anything takes on a busy machine; only a failing test waits this long.
pub(crate) const DEADLINE: Duration = Duration::from_secs(180);

/// An example, built with the tests.
pub(crate) fn example(name: &str) -> Command {
    built("examples", name, "cargo build --examples")
}

/// The command `txt simulate`.
pub(crate) fn simulate() -> Command {
    let mut txt = txt();
    txt.arg("simulate");
    txt
}

/// The program `txt`, built with the tests of all packages.
pub(crate) fn txt() -> Command {
    built("", "txt", "cargo build --package txt-tools")
}

/// The program that runs C programs, built with the tests of all packages.
pub(crate) fn tx_run() -> Command {
    built("", "tx_run", "cargo build --package ft-transfer-area-c")
}

/// Whether there is this compiler. A test that has checked nothing must not look like one that has passed.
pub(crate) fn has_compiler(name: &str) -> bool {
    let found = Command::new(name).arg("--version").output().is_ok();
    if !found {
        assert!(
            std::env::var_os("NO_COMPILER").is_some(),
            "there is no {name}, which this test needs; with NO_COMPILER=1 it passes without a check"
        );
        let _ = writeln!(std::io::stderr(), "skipped: there is no {name}");
    }
    found
}

/// A program beside the tests, in the folder `target/debug`.
fn built(folder: &str, name: &str, how: &str) -> Command {
    let tests: PathBuf = std::env::current_exe().unwrap();
    let file = format!("{name}{}", std::env::consts::EXE_SUFFIX);
    let path = tests.ancestors().nth(2).unwrap().join(folder).join(file);
    assert!(path.exists(), "{path:?} is not built: {how}");
    Command::new(path)
}

/// Reads the output of a child process all the time. Otherwise the process would block at some point.
pub(crate) fn read_all(mut stream: impl Read + Send + 'static) -> JoinHandle<String> {
    thread::spawn(move || {
        let mut said = Vec::new();
        stream.read_to_end(&mut said).unwrap();
        String::from_utf8(said).unwrap()
    })
}

/// The output of a program. It is killed if it does not end.
pub(crate) fn output_in_time(command: &mut Command) -> Output {
    ended_in_time(command.stdout(Stdio::piped()).stderr(Stdio::piped())).wait_with_output().unwrap()
}

/// A program that has ended. It is killed if it does not end.
pub(crate) fn ended_in_time(command: &mut Command) -> Child {
    let begin = Instant::now();
    let mut child = command.spawn().unwrap();
    while child.try_wait().unwrap().is_none() {
        if begin.elapsed() > DEADLINE {
            child.kill().unwrap();
        }
        thread::sleep(Duration::from_millis(1));
    }
    child
}

/// The simulated TXT as a program on free ports. It ends when this is dropped.
pub(crate) struct Program {
    child: Child,
    /// For typed lines; `None` ends its input.
    pub(crate) stdin: Option<ChildStdin>,
    /// Main, camera, I2C.
    pub(crate) ports: [u16; 3],
    log: Option<JoinHandle<String>>,
    /// `txt watch` between it and its clients.
    watch: Option<Watch>,
}

/// A running `txt watch`, and what it says on stderr.
struct Watch {
    child: Child,
    said: Option<JoinHandle<String>>,
}

impl Drop for Watch {
    fn drop(&mut self) {
        // It may have ended already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Program {
    pub(crate) fn start(options: &[&str]) -> Self {
        let mut child = simulate()
            .args(["--port", "0"])
            .args(options)
            .env("RUST_LOG", "info")
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let log = read_all(child.stderr.take().unwrap());
        let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
        let ports = ["main", "camera", "i2c"].map(|name| {
            let line = lines.next().unwrap().unwrap();
            let port = line.strip_prefix(name).and_then(|rest| rest.strip_prefix(" 127.0.0.1:"));
            port.unwrap_or_else(|| panic!("{line:?} is no {name} port")).parse().unwrap()
        });
        let stdin = child.stdin.take();
        Self { child, stdin, ports, log: Some(log), watch: None }
    }

    /// The same through `txt watch`, whose ports are given to clients from now on.
    pub(crate) fn watched(mut self) -> Self {
        let mut child = txt()
            .args(["watch", &format!("127.0.0.1:{}", self.ports[0]), "--port", "0", "--no-browser"])
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let said = Some(read_all(child.stderr.take().unwrap()));
        let mut out = BufReader::new(child.stdout.take().unwrap());
        let mut line = String::new();
        out.read_line(&mut line).unwrap();
        let main = line.trim().strip_prefix("main 127.0.0.1:").and_then(|port| port.parse().ok());
        self.watch = Some(Watch { child, said });
        let Some(main) = main else { panic!("{line:?} is not a port: {}", self.end_watch()) };
        let main: u16 = main;
        read_all(out);
        self.ports = [main, main + 1, main + 2];
        self
    }

    /// Ends `txt watch`; returns what it had to say.
    pub(crate) fn end_watch(&mut self) -> String {
        let mut watch = self.watch.take().unwrap();
        watch.child.kill().unwrap();
        watch.said.take().unwrap().join().unwrap()
    }

    pub(crate) fn type_line(&mut self, line: &str) {
        writeln!(self.stdin.as_mut().unwrap(), "{line}").unwrap();
    }

    /// Settings for a handler for it.
    pub(crate) fn handler(&self) -> TransferAreaComHandlerBuilder {
        TransferAreaComHandler::builder(format!("127.0.0.1:{}", self.ports[0]))
    }

    /// Ends it as Ctrl-C does. Returns its output on stderr.
    pub(crate) fn interrupt(mut self) -> String {
        let id = self.child.id().to_string();
        assert!(Command::new("kill").args(["-INT", &id]).status().unwrap().success());
        let log = self.log.take().unwrap().join().unwrap();
        let status = self.child.wait().unwrap();
        assert!(status.success(), "{status}: {log}");
        log
    }
}

impl Drop for Program {
    fn drop(&mut self) {
        // It has already ended, unless a test failed.
        let _ = self.child.kill();
        let _ = self.child.wait();
        if let Some(Ok(log)) = self.log.take().map(JoinHandle::join) {
            eprintln!("{log}");
        }
    }
}
