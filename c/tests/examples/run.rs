//! A sample that is run with `tx_run`, on a simulated TXT that notes each exchange.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::sync::{mpsc, LazyLock, Mutex};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use ft_transfer_area::wire::{ExchangeData, ExchangeDataResponse};
use ft_transfer_area_simulator::world::World;
use ft_transfer_area_simulator::SimulatedTxt;

/// Longer than anything takes on a busy machine; only a failing test waits this long.
pub(crate) const DEADLINE: Duration = Duration::from_secs(900);

/// What one controller got and answered in one exchange.
#[derive(Clone)]
pub(crate) struct Seen {
    pub(crate) outputs: ExchangeData,
    pub(crate) inputs: ExchangeDataResponse,
}

/// What is known after a sample has ended.
pub(crate) struct Run {
    pub(crate) output: Output,
    /// For each controller, all exchanges.
    pub(crate) seen: [Vec<Seen>; 2],
}

pub(crate) fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..").canonicalize().expect("it exists")
}

/// Whether there are compilers for C and C++. If not, this is said where the tests are run.
pub(crate) fn compilers() -> bool {
    let missing: Vec<&str> = ["cc", "c++"]
        .into_iter()
        .filter(|compiler| {
            let zig = if *compiler == "cc" { "zig cc" } else { "zig c++" };
            !crate::compilers_of(&[compiler], zig).into_iter().any(crate::is_here)
        })
        .collect();
    if !missing.is_empty() {
        crate::miss_compilers(&missing.join(" and no "));
    }
    missing.is_empty()
}

/// The arguments of `tx_run` in the sample's first lines, for a simulated TXT.
pub(crate) fn arguments(sample: &str) -> Vec<String> {
    let path = root().join("c/examples").join(sample);
    let text = std::fs::read_to_string(path).expect("a sample");
    let line = text.lines().take(20).find(|line| line.contains("--world")).expect("a command");
    let (_, arguments) = line.split_once("tx_run -- ").expect("tx_run is run by cargo");
    let (arguments, _) = arguments.split_once('(').expect("what it runs on");
    arguments.split_whitespace().map(str::to_owned).collect()
}

/// `tx_run`, in the folder from which the commands are given.
pub(crate) fn tx_run(arguments: &[String]) -> Output {
    tx_run_with(arguments, &[])
}

/// The same with these environment variables.
pub(crate) fn tx_run_with(arguments: &[String], variables: &[(&str, String)]) -> Output {
    let begin = Instant::now();
    let mut child = Command::new(env!("CARGO_BIN_EXE_tx_run"))
        .args(arguments)
        .envs(variables.iter().map(|(name, value)| (name, value)))
        .current_dir(root())
        // Not with what this machine's user has compiled.
        .env("XDG_CACHE_HOME", Path::new(env!("CARGO_TARGET_TMPDIR")).join("cache"))
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("it is built with the tests");
    while child.try_wait().expect("it can be asked").is_none() {
        if begin.elapsed() > DEADLINE {
            child.kill().expect("it runs");
        }
        thread::sleep(Duration::from_millis(5));
    }
    child.wait_with_output().expect("it has ended")
}

/// The samples that tests look at. All are started with the first test, because each takes some seconds in
/// which it mostly waits.
const SAMPLES: [&str; 5] =
    ["gate.c", "pc_slide.c", "txt_button.cpp", "kit_loop.cpp", "kit_callbacks.cpp"];

type Started = HashMap<&'static str, JoinHandle<Option<Run>>>;

static STARTED: LazyLock<Mutex<Started>> = LazyLock::new(|| {
    let start = |sample| (sample, thread::spawn(move || finish(sample)));
    Mutex::new(SAMPLES.map(start).into())
});

/// A sample's run with the world that its first lines name, to be taken once. `None` without a compiler.
pub(crate) fn run(sample: &str) -> Option<Run> {
    let started = STARTED.lock().expect("no test panics here").remove(sample);
    started.expect("a sample of the list").join().expect("it ends well")
}

fn finish(sample: &str) -> Option<Run> {
    if !compilers() {
        return None;
    }
    let mut arguments = arguments(sample);
    let at = arguments.iter().position(|argument| argument == "--world").expect("a world");
    let world = &arguments[at + 1];
    let world = if world.ends_with(".toml") {
        World::load(root().join(world))
    } else {
        World::shipped(world)
    };
    let (note, noted) = mpsc::channel();
    let txt = SimulatedTxt::builder()
        .world(world.expect("a right world"))
        .on_exchange(move |machine| {
            let each = (0..machine.controllers.len()).map(|index| Seen {
                outputs: machine.controllers[index].outputs,
                inputs: machine.report(index).expect("there is this controller"),
            });
            // The receiver lives as long as the simulated TXT is looked at.
            let _ = note.send(each.collect::<Vec<_>>());
        })
        .start()
        .expect("free ports");
    arguments[at] = String::from("--host");
    arguments[at + 1] = txt.address().to_string();
    let output = tx_run(&arguments);

    assert!(txt.wait_until(|machine| !machine.connected(), DEADLINE), "the connection stays open");
    txt.with_machine(|machine| {
        for (index, controller) in machine.controllers.iter().enumerate() {
            assert_eq!(controller.outputs.duty, [0; 8], "controller {index} is not stopped");
        }
        let oddities: Vec<_> = machine.oddities().collect();
        assert!(oddities.is_empty(), "{oddities:?}");
    });
    let mut seen = [Vec::new(), Vec::new()];
    for exchange in noted.try_iter() {
        for (seen, controller) in seen.iter_mut().zip(exchange) {
            seen.push(controller);
        }
    }
    Some(Run { output, seen })
}

impl Run {
    /// It has ended well, with its motors stopped by itself. Returns what it has printed.
    pub(crate) fn check(&self) -> String {
        let said = self.check_status();
        let last = self.seen[0].last().expect("an exchange");
        assert_eq!(last.outputs.duty, [0; 8], "{said}");
        said
    }

    /// It has ended well. Returns what it has printed.
    pub(crate) fn check_status(&self) -> String {
        let (said, errors) = (text(&self.output.stdout), text(&self.output.stderr));
        assert!(self.output.status.success(), "{}: {said}{errors}", self.output.status);
        said
    }

    /// The duties that an output of a controller had, one after the other.
    pub(crate) fn duties(&self, controller: usize, output: usize) -> Vec<i16> {
        let mut duties: Vec<i16> =
            self.seen[controller].iter().map(|seen| seen.outputs.duty[output]).collect();
        duties.dedup();
        duties
    }
}

pub(crate) fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}
