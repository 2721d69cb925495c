//! Compilers, and programs that run.

use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::mpsc::{channel, Receiver};
use std::sync::OnceLock;
use std::thread;
use std::time::{Duration, Instant};

use ft_transfer_area::wire::CommandId;
use ft_transfer_area_simulator::{Machine, SimulatedTxt, SimulatedTxtBuilder};

/// Longer than any wait on a busy machine; only a test that fails waits this long.
pub(crate) const DEADLINE: Duration = Duration::from_secs(30);

/// The C++ compilers that are here.
pub(crate) fn compilers() -> &'static [&'static str] {
    static COMPILERS: OnceLock<Vec<&str>> = OnceLock::new();
    COMPILERS.get_or_init(|| {
        let mut here = crate::compilers_of(&["g++", "clang++"], "zig c++");
        here.retain(|name| crate::is_here(name));
        if here.is_empty() {
            crate::miss_compilers("g++ or clang++");
        }
        here
    })
}

pub(crate) fn include(folder: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("include").join(folder)
}

/// The folder with the library that belongs to this test.
pub(crate) fn library() -> PathBuf {
    let test = std::env::current_exe().unwrap();
    test.parent().unwrap().to_owned()
}

/// Compiles a program of `programs`. `None` without a compiler, and the first one is taken.
pub(crate) fn compile(folder: &str, standard: &str, source: &str, name: &str) -> Option<PathBuf> {
    let compiler = compilers().first()?;
    let build = Path::new(env!("CARGO_TARGET_TMPDIR")).join("kits");
    std::fs::create_dir_all(&build).unwrap();
    let (file, mut program) = (build.join(format!("{name}.cpp")), build.join(name));
    program.set_extension(std::env::consts::EXE_EXTENSION);
    std::fs::write(&file, source).unwrap();
    let mut command = crate::compiler(compiler);
    command.arg(format!("-std={standard}")).args(["-Wall", "-Wextra", "-Werror", "-pthread"]);
    command.arg("-I").arg(include(folder)).arg("-I").arg(include("kit/Common"));
    if cfg!(unix) {
        command.arg("-I").arg(include("posix"));
    }
    // For sanitizers: KITS_CXXFLAGS="-g -fsanitize=address,undefined".
    let options = std::env::var("KITS_CXXFLAGS").unwrap_or_default();
    command.args(options.split_whitespace());
    command.arg(&file).arg("-o").arg(&program);
    if cfg!(unix) {
        command.arg("-L").arg(library()).arg("-lftMscLib");
        command.arg(format!("-Wl,-rpath,{}", library().display()));
    } else {
        command.arg(library().join("ftMscLib.dll"));
    }
    let output = command.output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    Some(program)
}

/// A program that runs.
pub(crate) struct Running {
    child: Child,
    /// What it prints, line by line.
    lines: Receiver<String>,
}

/// The signals that ask a program to end: SIGINT, SIGTERM, SIGHUP.
pub(crate) const SIGNALS: [i32; 3] = [libc::SIGINT, libc::SIGTERM, 1];

/// How a program has ended.
pub(crate) struct Ended {
    /// `None` when a signal ended it.
    pub(crate) code: Option<i32>,
    /// The one that ended it.
    pub(crate) signal: Option<i32>,
    pub(crate) out: String,
    pub(crate) err: String,
}

/// A program that was compiled, and its controller.
pub(crate) fn command(program: &Path, host: &str) -> Command {
    let mut command = Command::new(program);
    // Where tests run the second one leads to a library that may be older.
    command.env("FT_TXT_HOST", host).env_remove("FT_TXT_LOG").env_remove("LD_LIBRARY_PATH");
    if cfg!(windows) {
        // Where it finds the library.
        command.env("PATH", library());
    }
    command
}

/// The signal that has ended a program.
fn signal_of(status: ExitStatus) -> Option<i32> {
    #[cfg(unix)]
    return std::os::unix::process::ExitStatusExt::signal(&status);
    #[cfg(not(unix))]
    return None.filter(|_: &i32| status.success());
}

impl Running {
    pub(crate) fn start(program: &Path, host: &str, arguments: &[&str]) -> Self {
        let mut command = command(program, host);
        command.args(arguments);
        command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
        // As by a shell: systems do not suspend what nobody is there to continue.
        #[cfg(unix)]
        std::os::unix::process::CommandExt::process_group(&mut command, 0);
        let mut child = command.spawn().unwrap();
        let stdout = BufReader::new(child.stdout.take().unwrap());
        let (sender, lines) = channel();
        thread::spawn(move || {
            stdout.lines().map_while(Result::ok).try_for_each(|line| sender.send(line))
        });
        Self { child, lines }
    }

    pub(crate) fn with(program: &Path, txt: &SimulatedTxt, arguments: &[&str]) -> Self {
        Self::start(program, &txt.address().to_string(), arguments)
    }

    /// The next line that it prints.
    pub(crate) fn line(&mut self) -> String {
        self.lines.recv_timeout(DEADLINE).unwrap_or_else(|_| self.fail("no line comes"))
    }

    pub(crate) fn expect(&mut self, line: &str) {
        let got = self.line();
        if got != line {
            self.fail(&format!("{got:?} instead of {line:?}"));
        }
    }

    /// The same for the kits' line, whatever the counters are: motors have turned.
    pub(crate) fn expect_area(&mut self, inputs: &str, outputs: &str) {
        let got = self.line();
        let counters = got.strip_prefix(inputs).and_then(|rest| rest.strip_suffix(outputs));
        let is_number = |text: &str| text.parse::<i16>().is_ok();
        let is_four = |text: &str| text.split(' ').filter(|text| is_number(text)).count() == 4;
        if !counters.is_some_and(is_four) {
            self.fail(&format!("{got:?} instead of {inputs:?}…{outputs:?}"));
        }
    }

    /// Reads from the standard error until there is a line with this. A busy computer writes it late.
    pub(crate) fn expect_error(&mut self, part: &str) {
        let mut lines = BufReader::new(self.child.stderr.take().unwrap()).lines();
        assert!(lines.any(|line| line.unwrap().contains(part)), "no error {part:?}");
    }

    fn fail(&mut self, what: &str) -> ! {
        // It may have ended already.
        let _ = self.child.kill();
        let errors = self.errors();
        panic!("{what}: {:?}, {errors}", self.child.wait());
    }

    /// What it has written to the standard error, until its end.
    fn errors(&mut self) -> String {
        let mut text = String::new();
        self.child.stderr.take().unwrap().read_to_string(&mut text).unwrap();
        text
    }

    /// Sends it a signal.
    #[cfg(unix)]
    pub(crate) fn signal(&self, signal: i32) {
        // SAFETY: a call without pointers, for a child that was not waited for.
        assert_eq!(unsafe { libc::kill(self.child.id() as libc::pid_t, signal) }, 0);
    }

    #[cfg(not(unix))]
    pub(crate) fn signal(&self, signal: i32) {
        panic!("there is no signal {signal} here");
    }

    /// Its number.
    #[cfg(target_os = "linux")]
    pub(crate) fn id(&self) -> u32 {
        self.child.id()
    }

    pub(crate) fn kill(&mut self) {
        self.child.kill().unwrap();
    }

    /// Waits for its end; one that does not come fails the test.
    pub(crate) fn end(mut self) -> Ended {
        let begun = Instant::now();
        let status = loop {
            if let Some(status) = self.child.try_wait().unwrap() {
                break status;
            }
            if begun.elapsed() > DEADLINE {
                self.fail("the program does not end");
            }
            thread::sleep(Duration::from_millis(5));
        };
        let out = self.lines.iter().map(|line| line + "\n").collect();
        let err = self.errors();
        Ended { code: status.code(), signal: signal_of(status), out, err }
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        // Nothing is left behind by a test that has failed.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Ended {
    pub(crate) fn well(&self) {
        assert_eq!(self.code, Some(0), "{}{}", self.out, self.err);
    }
}

pub(crate) fn simulated() -> SimulatedTxtBuilder {
    SimulatedTxt::builder().camera_start_up(Duration::ZERO)
}

pub(crate) fn wait_until(txt: &SimulatedTxt, what: &str, condition: impl FnMut(&Machine) -> bool) {
    assert!(txt.wait_until(condition, DEADLINE), "{what} did not happen");
}

/// Waits for a duty of the master.
pub(crate) fn wait_duty(txt: &SimulatedTxt, output: usize, duty: i16) {
    let what = format!("duty {duty} of output {output}");
    wait_until(txt, &what, |machine| machine.controllers[0].outputs.duty[output] == duty);
}

/// Waits until the simulated TXT is offline and its motors are off.
pub(crate) fn wait_offline(txt: &SimulatedTxt) {
    wait_until(txt, "the end of online mode", |machine| {
        !machine.online() && machine.controllers[0].outputs.duty == [0; 8]
    });
}

/// Waits for the end of a client that has sent the last command.
pub(crate) fn wait_stopped(txt: &SimulatedTxt) {
    wait_offline(txt);
    wait_until(txt, "StopOnline", |machine| {
        machine.commands().last() == Some(CommandId::StopOnline)
    });
}

pub(crate) fn set_input(txt: &SimulatedTxt, input: usize, value: i16) {
    txt.with_machine(|machine| machine.controllers[0].uni[input] = value);
}
