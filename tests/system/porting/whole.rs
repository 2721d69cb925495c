//! The whole program of docs/porting.md, in C and in Rust: both do the same in the same world, and the document shows
//! them as they are.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::Duration;

use ft_transfer_area::tx::Sound;
use ft_transfer_area::wire::CommandId;
use ft_transfer_area_simulator::world::{Piece, Remote, World};
use ft_transfer_area_simulator::{Machine, SimulatedTxt};

use crate::program::{example, has_compiler, output_in_time, tx_run};

const BEFORE: &str = "c/examples/warehouse.cpp";
const AFTER: &str = "examples/warehouse.rs";

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").canonicalize().unwrap()
}

/// The outputs of an exchange: duties, distances, sound.
type Outputs = ([i16; 8], [u16; 4], u16);

fn outputs(machine: &Machine) -> Outputs {
    let outputs = &machine.controllers[0].outputs;
    (outputs.duty, outputs.distance, outputs.sound_index)
}

/// What a program has done.
#[derive(Debug, PartialEq)]
struct Done {
    said: String,
    /// Each change, in order.
    outputs: Vec<Outputs>,
    places: Vec<(String, Option<Piece>)>,
}

/// Somebody with the remote, who sees what the program does: ON half a second after a container is offered; on the way
/// back from the shelf that is far away OFF, all axes by hand, and ON.
#[derive(Default)]
struct Hand {
    /// The exchanges in which these began.
    offered: Option<u64>,
    goes_far: Option<u64>,
}

impl Hand {
    fn remote(&mut self, machine: &Machine) -> Remote {
        let (now, outputs) = (machine.exchanges(), &machine.controllers[0].outputs);
        if outputs.sound_index == Sound::Bell.index() {
            self.offered.get_or_insert(now);
        }
        if outputs.distance[1] > 1900 {
            self.goes_far.get_or_insert(now);
        }
        let since = |begin: Option<u64>| begin.map_or(u64::MAX, |begin| now - begin);
        let remote = Remote::default();
        match (since(self.offered), since(self.goes_far)) {
            (50..80, _) | (_, 260..290) => Remote { on: true, ..remote },
            (_, 100..130) => Remote { off: true, ..remote },
            (_, 130..230) => Remote { left_y: 15, right_x: -15, right_y: 9, ..remote },
            _ => remote,
        }
    }
}

/// Runs a program until its end. Each exchange is 10 ms in the world, whatever the clock says.
fn run(start: impl FnOnce(&str) -> Command) -> Done {
    let noted: Arc<Mutex<Vec<Outputs>>> = Arc::default();
    let note = Arc::clone(&noted);
    let mut hand = Hand::default();
    let world = World::shipped("high_bay_warehouse").unwrap().remote(Remote::default());
    let txt = SimulatedTxt::builder()
        .pace(Duration::ZERO)
        .world(world)
        .on_exchange(move |machine| {
            note.lock().unwrap().push(outputs(machine));
            let remote = hand.remote(machine);
            machine.world_mut().unwrap().set_remote(remote);
        })
        .start()
        .unwrap();
    let mut command = start(&txt.address().to_string());
    let output =
        output_in_time(command.args(["A2", "C3"]).current_dir(root()).stdin(Stdio::null()));
    let [said, errors] =
        [output.stdout, output.stderr].map(|text| String::from_utf8(text).unwrap());
    assert!(output.status.success(), "{}: {said}{errors}", output.status);
    let mut outputs = std::mem::take(&mut *noted.lock().unwrap());
    outputs.dedup();
    assert!(matches!(outputs.last(), Some(([0, 0, 0, 0, 0, 0, 0, 0], [0, 0, 0, 0], _))));
    // Whether the end takes one exchange or two is not the program's, and that of a transfer also stops the sound.
    while outputs.last().is_some_and(|(duties, ..)| *duties == [0; 8]) {
        outputs.pop();
    }
    let places = txt.with_machine(|machine| {
        assert_eq!(machine.oddities().next(), None);
        assert_eq!(machine.commands().last(), Some(CommandId::StopOnline));
        assert_eq!(machine.world().unwrap().mishaps(), []);
        machine.world().unwrap().places()
    });
    Done { said, outputs, places }
}

#[cfg_attr(windows, ignore = "no C compiler is expected there")]
#[test]
fn the_warehouse_in_rust_does_what_the_one_in_c_does() {
    if !has_compiler("c++") {
        return;
    }
    // On a busy machine a program may miss its window and react an exchange later, and an axis goes four pulses further.
    // A difference between the programs is there in every run.
    let mut runs: Vec<(Done, Done)> = Vec::new();
    while runs.len() < 5 {
        runs.push(run_both());
        if runs.iter().any(|(before, _)| runs.iter().any(|(_, after)| before == after)) {
            return;
        }
    }
    let (before, after) = &runs[0];
    assert_eq!(before.said, after.said);
    for (number, (before, after)) in before.outputs.iter().zip(&after.outputs).enumerate() {
        assert_eq!(before, after, "change {number}");
    }
    assert_eq!(before, after);
}

/// Runs the program in C and the one in Rust at the same time.
fn run_both() -> (Done, Done) {
    let (before, after) = thread::scope(|scope| {
        let before = scope.spawn(|| {
            run(|address| {
                let mut command = tx_run();
                // Not with what this machine's user has compiled.
                command.env("XDG_CACHE_HOME", Path::new(env!("CARGO_TARGET_TMPDIR")).join("cache"));
                command.args([BEFORE, "--host", address, "--"]);
                command
            })
        });
        let after = run(|address| {
            let mut command = example("warehouse");
            command.arg(address);
            command
        });
        (before.join().unwrap(), after)
    });
    for done in [&before, &after] {
        for part in
            ["A2 is outside", "stopped: OFF was pressed, in step \"to the belt\"", "C3 is back"]
        {
            assert!(done.said.contains(part), "no {part:?} in {}", done.said);
        }
        for shelf in ["A2", "C3"] {
            let place = done.places.iter().find(|(name, _)| name == shelf).unwrap();
            assert_eq!(place.1, Some(Piece::Container), "{shelf}");
        }
        assert!(done.outputs.len() > 60, "{:?}", done.outputs);
    }
    (before, after)
}

/// The text without what stands before its lines.
fn flat(text: &str) -> String {
    text.lines().map(str::trim).filter(|line| !line.is_empty()).collect::<Vec<_>>().join("\n")
}

#[test]
fn the_document_shows_the_programs_as_they_are() {
    let read = |path: &str| fs::read_to_string(root().join(path)).unwrap().replace("\r\n", "\n");
    let (before, after) = (flat(&read(BEFORE)), flat(&read(AFTER)));
    let document = read("docs/porting.md");
    let (_, section) = document.split_once("\n## A whole program\n").expect("its section");
    let section = section.split("\n## ").next().unwrap_or(section);
    let mut pieces = section.split("\n```");
    pieces.next();
    let mut shown = 0;
    // Each piece ends with a line of its own, and what follows is text.
    while let (Some(piece), Some(_)) = (pieces.next(), pieces.next()) {
        let (language, code) = piece.split_once('\n').unwrap();
        let program = match language {
            "sh" => continue,
            "c" => &before,
            "rust,ignore" => &after,
            other => panic!("a piece in {other:?}"),
        };
        assert!(program.contains(&flat(code)), "the program has not: {code}");
        shown += 1;
    }
    assert!(shown >= 8, "{shown} pieces");
}
