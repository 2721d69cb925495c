//! Runs `tx_run`, and reads what it says.

use std::fs;
use std::io::Read;
#[cfg(unix)]
use std::net::SocketAddr;
#[cfg(unix)]
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicU16, Ordering};
use std::sync::{Arc, Mutex, OnceLock};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use ft_transfer_area_simulator::{Machine, SimulatedTxt, SimulatedTxtBuilder};

/// Far more than anything here takes.
pub(crate) const LIMIT: Duration = Duration::from_secs(60);

/// Whether there is a compiler; a test without one says so.
pub(crate) fn has_compiler() -> bool {
    static FOUND: OnceLock<bool> = OnceLock::new();
    let found = *FOUND.get_or_init(|| {
        crate::compilers_of(&["cc", "gcc", "clang"], "zig cc").into_iter().any(crate::is_here)
    });
    if !found {
        crate::miss_compilers("C compiler");
    }
    found
}

/// A simulated TXT without a world: the test sets the inputs.
pub(crate) fn txt() -> SimulatedTxtBuilder {
    SimulatedTxt::builder()
}

/// The port for one that goes before its program: `tx_run` tries to stop it there for some seconds more, and no other test
/// is given this port.
pub(crate) fn own_port() -> u16 {
    static NEXT: AtomicU16 = AtomicU16::new(30_200);
    let mut ports = std::iter::repeat_with(|| NEXT.fetch_add(3, Ordering::Relaxed));
    ports.find(|port| txt().port(*port).start().is_ok()).unwrap()
}

/// Compiles a dynamic library.
#[cfg(target_os = "linux")]
pub(crate) fn shared_library(source: &Path, to: &Path, options: &[&str]) {
    let mut compiler = Command::new("cc");
    compiler.args(["-shared", "-fPIC"]).args(options).arg(source).arg("-o").arg(to);
    assert!(compiler.status().unwrap().success(), "{}", source.display());
}

/// Waits until the machine is as expected.
#[track_caller]
pub(crate) fn wait_for(txt: &SimulatedTxt, what: &str, condition: impl FnMut(&Machine) -> bool) {
    assert!(txt.wait_until(condition, LIMIT), "never: {what}");
}

/// Polls for a condition that wakes no thread when it becomes true.
#[cfg(unix)]
#[track_caller]
pub(crate) fn wait_until(what: &str, condition: impl Fn() -> bool) {
    let deadline = Instant::now() + LIMIT;
    while !condition() {
        assert!(Instant::now() < deadline, "never: {what}");
        thread::sleep(Duration::from_millis(5));
    }
}

/// Whether a process has ended, and perhaps nobody has asked for its end.
#[cfg(unix)]
pub(crate) fn has_ended(process: i32) -> bool {
    match fs::read_to_string(format!("/proc/{process}/stat")) {
        Ok(stat) => stat.contains(") Z "),
        // SAFETY: a call without pointers, which sends nothing.
        Err(_) => unsafe { libc::kill(process, 0) != 0 },
    }
}

/// Whether the motor of the programs for a PC turns.
#[cfg(unix)]
pub(crate) fn turns(machine: &Machine) -> bool {
    machine.controllers[0].outputs.duty[0] == 300
}

/// As a shell does, which suspends all of it.
#[cfg(unix)]
pub(crate) fn run_in_group(controller: SocketAddr, name: &str, flags: &str) -> Run {
    let mut command = tx_run(&["--host", &controller.to_string()]);
    Run::start(command.arg(program(name)).env("CFLAGS", flags).process_group(0))
}

/// The number of the program that `tx_run` has started.
#[cfg(target_os = "linux")]
pub(crate) fn program_of(run: &Run) -> String {
    let children = format!("/proc/{0}/task/{0}/children", run.id());
    fs::read_to_string(children).unwrap().trim().to_owned()
}

#[cfg(target_os = "linux")]
pub(crate) fn send(signal: &str, process: &str) {
    assert!(Command::new("kill").args(["-s", signal, process]).status().unwrap().success());
}

#[cfg(target_os = "linux")]
pub(crate) fn is_suspended(process: &str) -> bool {
    fs::read_to_string(format!("/proc/{process}/stat")).unwrap().contains(") T ")
}

/// Runs these files, the names of which are relative to the folder in which `tx_run` is started.
pub(crate) fn run_files(files: &[(&str, &str)], arguments: &[&str]) -> Ended {
    let folder = tempfile::tempdir().unwrap();
    files.iter().for_each(|(name, text)| write(folder.path(), name, text));
    Run::start(tx_run(arguments).current_dir(folder.path())).end()
}

/// Writes a file, and makes the folders for it.
pub(crate) fn write(folder: &Path, name: &str, text: &str) {
    let path = folder.join(name);
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    fs::write(path, text).unwrap();
}

#[cfg(unix)]
pub(crate) fn make_pipe(path: &Path) {
    assert!(Command::new("mkfifo").arg(path).status().unwrap().success());
}

/// A program of the folder `programs`.
pub(crate) fn program(name: &str) -> PathBuf {
    let path: PathBuf =
        [env!("CARGO_MANIFEST_DIR"), "tests", "tx_run", "programs", name].iter().collect();
    // Under Wine it has no drive, and some tests run in a folder on another one.
    std::path::absolute(path).unwrap()
}

/// How a run has ended.
#[derive(Debug)]
pub(crate) struct Ended {
    pub(crate) status: Option<i32>,
    pub(crate) out: String,
    pub(crate) err: String,
}

impl Ended {
    /// The program has ended well.
    #[track_caller]
    pub(crate) fn well(&self) {
        assert_eq!(self.status, Some(0), "{}{}", self.out, self.err);
    }

    /// The run has failed, and says why.
    #[track_caller]
    pub(crate) fn badly(&self, sentence: &str) {
        assert!(self.status != Some(0) && self.err.contains(sentence), "{self:#?}");
    }
}

/// `tx_run` while it runs.
pub(crate) struct Run {
    child: Child,
    out: Arc<Mutex<String>>,
    threads: Vec<JoinHandle<()>>,
    err: Arc<Mutex<String>>,
}

/// A command line of `tx_run`.
pub(crate) fn tx_run(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_tx_run"));
    command.args(arguments).env_remove("FT_TXT_HOST");
    // What tests compile is not kept with what this machine's user has compiled.
    command.env("XDG_CACHE_HOME", cache()).env("HOME", cache());
    command
}

/// The folder for what `tx_run` keeps, which all tests share.
pub(crate) fn cache() -> PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR")).join("cache")
}

/// What is kept in a folder for a cache, without the part of `tx_run` that it adds to programs with `main`.
#[cfg(unix)]
pub(crate) fn kept_in(cache: &Path) -> Vec<PathBuf> {
    const OF_TX_RUN: &[u8] = b"__wrap_main";
    let is_of_tx_run = |file: &PathBuf| {
        let text = fs::read(file).unwrap_or_default();
        text.windows(OF_TX_RUN.len()).any(|part| part == OF_TX_RUN)
    };
    let all = fs::read_dir(cache.join("tx_run")).unwrap().map(|entry| entry.unwrap().path());
    all.filter(|file| !is_of_tx_run(file)).collect()
}

/// `tx_run` with a program of the folder, on this simulated TXT.
pub(crate) fn run_on(txt: &SimulatedTxt, name: &str, flags: &str) -> Run {
    run_with(txt, name, flags, &[])
}

/// The same with these variables in its environment.
pub(crate) fn run_with(
    txt: &SimulatedTxt,
    name: &str,
    flags: &str,
    variables: &[(&str, &Path)],
) -> Run {
    let mut command = tx_run(&["--host", &txt.address().to_string()]);
    command.arg(program(name)).env("CFLAGS", flags).envs(variables.iter().copied());
    Run::start(&mut command)
}

fn read(mut from: impl Read, to: &Mutex<String>) {
    let mut text = Vec::new();
    let _ = from.read_to_end(&mut text);
    // Windows ends lines in another way.
    *to.lock().unwrap() = String::from_utf8_lossy(&text).replace("\r\n", "\n");
}

impl Run {
    pub(crate) fn start(command: &mut Command) -> Self {
        let command = command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.spawn().unwrap();
        let (out, err) = (Arc::<Mutex<String>>::default(), Arc::<Mutex<String>>::default());
        let (stdout, stderr) = (child.stdout.take().unwrap(), child.stderr.take().unwrap());
        let (for_out, for_err) = (Arc::clone(&out), Arc::clone(&err));
        let threads = vec![
            thread::spawn(move || read(stdout, &for_out)),
            thread::spawn(move || read(stderr, &for_err)),
        ];
        Self { child, out, threads, err }
    }

    /// Its number.
    #[cfg(target_os = "linux")]
    pub(crate) fn id(&self) -> u32 {
        self.child.id()
    }

    /// Sends a signal to `tx_run`.
    #[cfg(unix)]
    pub(crate) fn signal(&self, signal: i32) {
        // SAFETY: a call without pointers, for a child that was not waited for.
        assert_eq!(unsafe { libc::kill(self.child.id() as libc::pid_t, signal) }, 0);
    }

    /// Sends a signal to the process group of `tx_run`.
    #[cfg(unix)]
    pub(crate) fn signal_group(&self, signal: i32) {
        // SAFETY: a call without pointers, for a child that was not waited for.
        assert_eq!(unsafe { libc::kill(-(self.child.id() as libc::pid_t), signal) }, 0);
    }

    /// Sends a signal until `tx_run` has ended.
    #[cfg(unix)]
    #[track_caller]
    pub(crate) fn end_by(mut self, signal: i32) -> Ended {
        let deadline = Instant::now() + LIMIT;
        while self.child.try_wait().unwrap().is_none() && Instant::now() < deadline {
            self.signal(signal);
            thread::sleep(Duration::from_millis(20));
        }
        self.end()
    }

    /// Waits for the end.
    #[track_caller]
    pub(crate) fn end(mut self) -> Ended {
        let deadline = Instant::now() + LIMIT;
        let status = loop {
            if let Some(status) = self.child.try_wait().unwrap() {
                break status;
            }
            if Instant::now() > deadline {
                self.child.kill().unwrap();
                panic!("the program does not end: {}", self.out.lock().unwrap());
            }
            thread::sleep(Duration::from_millis(5));
        };
        self.threads.drain(..).for_each(|thread| thread.join().unwrap());
        let text = |text: &Mutex<String>| text.lock().unwrap().clone();
        Ended { status: status.code(), out: text(&self.out), err: text(&self.err) }
    }
}

impl Drop for Run {
    fn drop(&mut self) {
        // Nothing is left behind by a test that has failed.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
