//! The examples that `--help` shows run as they are written, with the addresses in them: in a network of their own, in
//! which controllers answer there.

use std::io::{self, Write};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::thread;
use std::time::{Duration, Instant};
use std::{env, fs};

use ft_transfer_area::{TransferAreaComHandler, PORT};
use ft_transfer_area_recorder::{Options, Recorder};
use ft_transfer_area_simulator::SimulatedTxt;
use tempfile::TempDir;

use crate::bridge::mosquitto;
use crate::help::COMMANDS;
use crate::running;

const DEADLINE: Duration = Duration::from_secs(120);

/// Set where this program runs in a network of its own.
const INSIDE: &str = "TXT_EXAMPLES_INSIDE";

/// Where the controllers of the examples are.
const ADDRESSES: [&str; 3] = ["192.168.7.2", "192.168.8.2", "192.168.1.17"];

/// Commands that end by themselves. The others go on until Ctrl-C.
const ENDING: [&str; 8] = ["check", "compare", "csv", "find", "info", "plot", "selftest", "stop"];

/// Commands that write a recording.
const RECORDING: [&str; 2] = ["record", "watch"];

/// The one without an address of its own, as in the example of `txt find`.
const BESIDE: u16 = 65010;

#[cfg_attr(not(target_os = "linux"), ignore = "only Linux has network namespaces")]
#[test]
fn every_example_runs_as_it_is_written() {
    if env::var_os(INSIDE).is_some() {
        return run_all();
    }
    let network = ["--user", "--map-root-user", "--net"];
    let set_up =
        "ip link set lo up && for a in \"$@\"; do ip addr add $a/32 dev lo || exit 1; done";
    let mut possible = Command::new("unshare");
    possible.args(network).args(["sh", "-c", set_up, "sh"]).args(ADDRESSES);
    if !possible.output().is_ok_and(|output| output.status.success()) {
        // Not into the test's captured output, so that the note is always shown.
        let note = "SKIPPED: no network of its own for the examples of --help (unshare and ip are needed)\n";
        io::stderr().write_all(note.as_bytes()).unwrap();
        return;
    }
    let name = "examples::every_example_runs_as_it_is_written";
    let again = format!("{set_up}; exec \"$0\" --exact {name} --nocapture");
    let output = Command::new("unshare")
        .args(network)
        .args(["sh", "-c", &again])
        .arg(env::current_exe().unwrap())
        .args(ADDRESSES)
        .env(INSIDE, "1")
        .output()
        .unwrap();
    let said = text(&output);
    assert!(output.status.success() && said.contains("1 passed"), "{said}");
    // What it has skipped is shown here, too.
    for note in said.lines().filter(|line| line.starts_with("SKIPPED")) {
        io::stderr().write_all(format!("{note}\n").as_bytes()).unwrap();
    }
}

fn text(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr)
}

/// Each example, in a folder with recordings, and with controllers at all addresses.
fn run_all() {
    let recording = recording();
    // It takes the ports of the controllers at all addresses.
    run_each("classroom", &recording);
    let at = |ip: &str| SimulatedTxt::builder().extensions(1).bind(ip.parse().unwrap()).port(PORT);
    let txts: Vec<_> = ADDRESSES.iter().map(|ip| at(ip).start().unwrap()).collect();
    let beside = SimulatedTxt::builder().port(BESIDE).start().unwrap();
    let broker = Broker::start();
    for command in COMMANDS {
        match command {
            "classroom" => {}
            "bridge" if broker.is_some() && clients() => bridge(&examples(Some(command))),
            // What is missing has been said.
            "bridge" => {}
            _ => run_each(command, &recording),
        }
    }
    for example in examples(None) {
        assert_eq!(try_out(&example, true, recording.path()), Some(0), "{example}");
    }
    drop((txts, beside));
}

/// Runs all examples of a command, each in a folder of its own.
fn run_each(command: &str, recording: &TempDir) {
    let examples = examples(Some(command));
    assert!(!examples.is_empty(), "{command} has no example");
    for example in &examples {
        assert!(example.starts_with("txt "), "{example}");
        let folder = tempfile::tempdir().unwrap();
        // A recording is not in the way of another one.
        if !RECORDING.contains(&command) {
            for name in ["run.mcap", "yesterday.mcap", "today.mcap"] {
                fs::copy(recording.path().join("run.mcap"), folder.path().join(name)).unwrap();
            }
        }
        let mut status = 0;
        // The program in an example of `txt watch`. Ctrl-C, which comes when it has printed, is not its end.
        let program = "import signal\nsignal.signal(signal.SIGINT, signal.SIG_IGN)\nprint('runs')";
        fs::write(folder.path().join("run.py"), program).unwrap();
        if command == "check" {
            write_programs(folder.path());
            // The pupil's programs do nothing yet, and that is what the check says.
            status = 1;
        }
        let ended = try_out(example, !ENDING.contains(&command), folder.path());
        assert_eq!(ended, Some(status), "{example}");
    }
}

/// The lines of a command's examples: what comes after three spaces explains them.
fn examples(command: Option<&str>) -> Vec<String> {
    let mut txt = Command::new(env!("CARGO_BIN_EXE_txt"));
    let output = txt.args(command).arg("--help").output().unwrap();
    let help = String::from_utf8(output.stdout).unwrap();
    let end = help.trim_end().rsplit("\n\n").next().unwrap().to_owned();
    assert!(end.starts_with("Example"), "{end}");
    let lines = end.lines().filter_map(|line| {
        line.strip_prefix("Example: ").or_else(|| line.strip_prefix("  ")).map(str::trim_start)
    });
    lines.map(|line| line.split("   ").next().unwrap().trim().to_owned()).collect()
}

/// The programs that the examples of `txt check` name.
fn write_programs(folder: &Path) {
    let lamp = folder.join("target/debug/lamp");
    fs::create_dir_all(lamp.parent().unwrap()).unwrap();
    fs::write(&lamp, "#!/bin/sh\nsleep 1\n").unwrap();
    assert!(Command::new("chmod").arg("+x").arg(&lamp).status().unwrap().success());
    fs::write(folder.join("end_switch.py"), "").unwrap();
}

/// Runs an example until it ends, and returns its status. One that is endless is ended with Ctrl-C when it has printed
/// or written something.
fn try_out(example: &str, is_endless: bool, folder: &Path) -> Option<i32> {
    let before = files(folder);
    let mut running = Example::start(example, folder);
    let begin = Instant::now();
    let ended = loop {
        if let Some(status) = running.child.try_wait().unwrap() {
            break status;
        }
        if is_endless && (files(folder) > before || running.has_printed()) {
            running.interrupt();
            break running.end(begin);
        }
        assert!(begin.elapsed() < DEADLINE, "{example}: there is nothing to see of it");
        thread::sleep(Duration::from_millis(20));
    };
    assert!(files(folder) > before || running.has_printed(), "{example} does nothing");
    if ended.code() != Some(0) {
        eprintln!("{example}: {ended}: {}", running.printed());
    }
    ended.code()
}

/// How many bytes are in the files that an example writes.
fn files(folder: &Path) -> u64 {
    let entries = fs::read_dir(folder).unwrap().map(Result::unwrap);
    let sizes = entries.map(|entry| match entry.metadata() {
        Ok(metadata) if metadata.is_dir() => files(&entry.path()),
        // What it prints is looked at on its own.
        Ok(metadata) if entry.file_name() != PRINTED => metadata.len(),
        _ => 0,
    });
    sizes.sum()
}

const PRINTED: &str = "printed";

/// An example that runs. It is killed when the test ends.
struct Example {
    child: Child,
    folder: std::path::PathBuf,
}

impl Example {
    fn start(example: &str, folder: &Path) -> Self {
        let programs = Path::new(env!("CARGO_BIN_EXE_txt")).parent().unwrap().to_owned();
        let path = env::var_os("PATH").unwrap_or_default();
        let path = env::join_paths([programs].into_iter().chain(env::split_paths(&path))).unwrap();
        let printed = fs::File::create(folder.join(PRINTED)).unwrap();
        let child = Command::new("sh")
            .args(["-c", &format!("exec {example}")])
            .current_dir(folder)
            .env("PATH", path)
            // Nobody looks at a browser here.
            .env("BROWSER", "true")
            .stdin(Stdio::null())
            .stderr(printed.try_clone().unwrap())
            .stdout(printed)
            .spawn()
            .unwrap();
        Self { child, folder: folder.to_owned() }
    }

    fn printed(&self) -> String {
        fs::read_to_string(self.folder.join(PRINTED)).unwrap_or_default()
    }

    fn has_printed(&self) -> bool {
        !self.printed().is_empty()
    }

    fn interrupt(&self) {
        let id = self.child.id().to_string();
        assert!(Command::new("kill").args(["-INT", &id]).status().unwrap().success());
    }

    fn end(&mut self, begin: Instant) -> std::process::ExitStatus {
        loop {
            if let Some(status) = self.child.try_wait().unwrap() {
                return status;
            }
            assert!(begin.elapsed() < DEADLINE, "Ctrl-C does not end it: {}", self.printed());
            thread::sleep(Duration::from_millis(20));
        }
    }

    fn wait_for(&self, part: &str) {
        let begin = Instant::now();
        while !self.printed().contains(part) {
            assert!(begin.elapsed() < DEADLINE, "no {part:?}: {}", self.printed());
            thread::sleep(Duration::from_millis(20));
        }
    }
}

impl Drop for Example {
    fn drop(&mut self) {
        running::end(&mut self.child);
    }
}

/// The example of the bridge: what the second line listens to has what the third one sets.
fn bridge(examples: &[String]) {
    let [bridge, listen, set] = examples else { panic!("{examples:?}") };
    let folders = [(); 3].map(|()| tempfile::tempdir().unwrap());
    let mut bridge = Example::start(bridge, folders[0].path());
    let listening = Example::start(listen, folders[1].path());
    listening.wait_for("ft/press/M1");
    let mut set = Example::start(set, folders[2].path());
    assert!(set.end(Instant::now()).success(), "{}", set.printed());
    listening.wait_for("300");
    bridge.interrupt();
    assert!(bridge.end(Instant::now()).success(), "{}", bridge.printed());
}

/// Whether the programs that the bridge's example listens and publishes with are there. Debian has them in a package
/// of their own.
fn clients() -> bool {
    let runs = |program| Command::new(program).arg("--help").output().is_ok();
    let found = runs("mosquitto_sub") && runs("mosquitto_pub");
    if !found {
        // Not into the test's captured output, so that the note is always shown.
        let note =
            "SKIPPED: the example of `txt bridge` (mosquitto_sub and mosquitto_pub are needed)\n";
        io::stderr().write_all(note.as_bytes()).unwrap();
    }
    found
}

/// Mosquitto at its usual port.
struct Broker {
    child: Child,
    _files: TempDir,
}

impl Broker {
    fn start() -> Option<Self> {
        let program = mosquitto()?;
        let files = tempfile::tempdir().unwrap();
        let config = files.path().join("mosquitto.conf");
        // There is no other user in this network.
        let lines = "listener 1883 127.0.0.1\nallow_anonymous true\nuser root\n";
        fs::write(&config, lines).unwrap();
        let mut command = Command::new(program);
        command.arg("-c").arg(config).stdout(Stdio::null()).stderr(Stdio::null());
        let broker = Self { child: command.spawn().unwrap(), _files: files };
        let begin = Instant::now();
        while TcpStream::connect(("127.0.0.1", 1883)).is_err() {
            assert!(begin.elapsed() < DEADLINE, "Mosquitto does not listen");
            thread::sleep(Duration::from_millis(20));
        }
        Some(broker)
    }
}

impl Drop for Broker {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Eleven seconds of a controller with an extension.
fn recording() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let txt = SimulatedTxt::builder().extensions(1).lock_step().start().unwrap();
    let builder = TransferAreaComHandler::builder(txt.address().to_string()).areas(2);
    let handler = builder.lock_step().build().unwrap();
    let options = Options::default().capacity(6_000);
    let recorder = Recorder::start(&handler, folder.path().join("run.mcap"), options).unwrap();
    handler.begin_transfer().unwrap();
    (0..1_100).for_each(|_| drop(handler.areas().wait_cycle().unwrap()));
    handler.end_transfer().unwrap();
    recorder.finish().unwrap();
    folder
}
