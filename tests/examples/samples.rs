//! The sample programs as a user runs them: what they print without a controller, and how they
//! leave one that is named.

use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{self, Receiver};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::{Duration, Instant};

use ft_transfer_area::simulator::world::{Remote, World};
use ft_transfer_area::simulator::{Machine, SimulatedTxt};
use ft_transfer_area::tx::Input;
use ft_transfer_area::wire::{CommandId, ExchangeData};

use crate::program::{example, DEADLINE};

const SAMPLES: [&str; 10] = [
    "c_program",
    "camera",
    "extended_motor_control",
    "extension",
    "i2c",
    "infrared_remote",
    "motor_on_off_switch",
    "slide_on_events",
    "sound_and_lamps",
    "wlan",
];

/// Pulses by which a count may miss its distance.
const FEW: u16 = 3;

/// Pulses by which synchronised motors may differ.
const APART: u16 = 6;

/// A sample that runs, ended when this is dropped.
pub(crate) struct Run {
    child: Child,
    stdout: Receiver<String>,
    lines: Vec<String>,
}

impl Run {
    pub(crate) fn start(name: &str, arguments: &[&str]) -> Self {
        let mut child = example(name).args(arguments).stdout(Stdio::piped()).spawn().unwrap();
        let (sender, stdout) = mpsc::channel();
        let lines = BufReader::new(child.stdout.take().unwrap()).lines();
        thread::spawn(move || lines.map_while(Result::ok).try_for_each(|line| sender.send(line)));
        Self { child, stdout, lines: Vec::new() }
    }

    /// Without a controller and for as long as it likes.
    pub(crate) fn simulated(name: &str) -> Self {
        Self::start(name, &["--seconds", "3600"])
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

    /// Presses Ctrl-C.
    pub(crate) fn interrupt(&self) {
        let id = self.child.id().to_string();
        assert!(Command::new("kill").args(["-INT", &id]).status().unwrap().success());
    }

    /// Waits for its end, which has to be a good one; what it has printed.
    pub(crate) fn finish(mut self) -> Vec<String> {
        let begin = Instant::now();
        while self.child.try_wait().unwrap().is_none() {
            assert!(begin.elapsed() < DEADLINE, "it does not end: {:#?}", self.lines);
            thread::sleep(Duration::from_millis(5));
        }
        assert!(self.child.wait().unwrap().success(), "{:#?}", self.lines);
        self.lines.extend(self.stdout.iter());
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

/// C1 and C2 of the lines with this label, as in `arrived: C1 200, C2 0`.
fn counters(lines: &[String], label: &str) -> Vec<[u16; 2]> {
    let prefix = format!("  {label}: C1 ");
    let counters = lines.iter().filter_map(|line| line.strip_prefix(&prefix)?.split_once(", C2 "));
    counters.map(|(c1, c2)| [c1.parse().unwrap(), c2.parse().unwrap()]).collect()
}

/// The number in front of ` pulses.` in the line that begins like this.
fn pulses(lines: &[String], start: &str) -> u16 {
    let line = lines.iter().find_map(|line| line.strip_prefix(start)?.strip_suffix(" pulses."));
    line.unwrap_or_else(|| panic!("no {start:?} in {lines:#?}")).parse().unwrap()
}

#[test]
fn extended_motor_control_ends_within_a_few_pulses_and_leaves_the_mode() {
    let lines = Run::simulated("extended_motor_control").finish();
    let arrived = |pulses: u16| (150..=150 + FEW).contains(&pulses);
    let [alone, together] = counters(&lines, "arrived")[..] else { panic!("{lines:#?}") };
    assert!(arrived(alone[0]) && alone[1] == 0, "{alone:?}");
    assert!(together.into_iter().all(arrived), "{together:?}");
    assert_eq!(counters(&lines, "counters reset"), [[0, 0]]);
    let on_the_way = counters(&lines, "on the way");
    assert_eq!(on_the_way.len(), 3);
    for [c1, c2] in on_the_way {
        assert!(c1.abs_diff(c2) <= APART, "{c1} and {c2}");
    }
    let [held, free] = counters(&lines, "after half a second")[..] else { panic!("{lines:#?}") };
    assert!(held.into_iter().all(arrived), "{held:?}");
    assert!(free[0] > held[0] + 30 && free[1] > held[1] + 30, "{held:?} and {free:?}");
}

#[test]
fn the_c_program_opens_and_closes_the_gate() {
    let lines = Run::simulated("c_program").finish();
    let (open, closed) =
        (pulses(&lines, "It is open after "), pulses(&lines, "It is closed after "));
    assert!((200..=200 + FEW).contains(&open), "{open}");
    // Its switch is pressed a little before the gate can't go on.
    assert!((open - 10..=open).contains(&closed), "{closed}");
}

#[test]
fn lamps_are_lit_in_turn_and_sounds_played_one_after_another_until_the_button_is_pressed() {
    let lines = Run::simulated("sound_and_lamps").finish();
    assert_eq!(lines.last().unwrap(), "I1 is pressed.");
    let states = lines.iter().filter_map(|line| line.strip_prefix("O5 ")?.split_once(" O8   "));
    let (mut lamps, mut sounds): (Vec<&str>, Vec<&str>) = states.unzip();
    sounds.dedup();
    assert_eq!(sounds, ["Bell", "Car-horn-short", "Propeller-airplane"]);
    lamps.sort_unstable();
    lamps.dedup();
    assert_eq!(lamps, ["* . . .", ". * . .", ". . * .", ". . . *"]);
}

#[test]
fn the_slide_turns_round_at_its_end_switches_until_the_button_is_pressed() {
    let lines = Run::simulated("slide_on_events").finish();
    let turns: Vec<&str> =
        lines.iter().filter_map(|line| line.split_once(", the ")).map(|turn| turn.0).collect();
    assert!(turns.len() >= 3, "{lines:#?}");
    for (turn, switch) in turns.iter().zip(["I2", "I1"].into_iter().cycle()) {
        assert_eq!(*turn, switch, "{lines:#?}");
    }
    // Between the hundredths of its way in which the switches are pressed, and the whole.
    let way = pulses(&lines, "I1, the start, after ");
    assert!((570..=600).contains(&way), "{way} pulses");
    assert_eq!(lines[lines.len() - 2..], ["I3 is pressed.", "0 events were lost."]);
}

#[test]
fn the_remote_drives_between_on_and_off_and_another_remote_does_not() {
    let mut run = Run::simulated("infrared_remote");
    run.wait_for("left  15, right  15   OFF   M1    0, M2    0");
    run.wait_for("left  15, right  15   ON    M1  512, M2  512");
    run.wait_for("left  15, right   5   ON    M1  512, M2  170");
    run.wait_for("left  -8, right  -8   ON    M1 -273, M2 -273");
    run.wait_for("left  -8, right  -8   OFF   M1    0, M2    0");
    run.interrupt();
    let lines = run.finish();
    assert!(lines.iter().any(|line| line.contains("ON ") && !line.ends_with("C1    0, C2    0")));
    for line in lines.iter().filter(|line| line.contains("OFF")) {
        assert!(line.contains("M1    0, M2    0"), "{line}");
    }
}

#[test]
fn the_remote_is_the_one_that_is_chosen() {
    let mut run = Run::start("infrared_remote", &["--seconds", "3600", "--remote", "off-off"]);
    run.wait_for("left  15, right   0   ON    M1  512, M2    0");
    run.interrupt();
    run.finish();
}

#[test]
fn a_button_of_an_extension_that_is_away_is_not_believed() {
    let mut run = Run::simulated("extension");
    run.wait_for("master: I1 pressed, M1 stands    extension: I1 open   , M1 runs");
    run.wait_for("master: I1 open   , M1 runs      extension: I1 pressed, M1 stands");
    run.wait_for("master: I1 open   , M1 stands    extension: away");
    run.wait_for("master: I1 open   , M1 runs      extension: I1 pressed, M1 stands");
    run.interrupt();
    run.finish();
}

#[test]
fn time_that_is_up_ends_a_sample_well() {
    // The camera's would leave its pictures behind.
    for name in SAMPLES.into_iter().filter(|name| *name != "camera") {
        let lines = Run::start(name, &["--seconds", "0"]).finish();
        assert!(lines.len() < 5, "{name}: {lines:#?}");
    }
}

/// What a test plugs in and does, so that the sample has something to stop.
struct Table {
    name: &'static str,
    world: &'static str,
    /// Whoever presses buttons.
    user: fn(&mut Machine),
    /// The outputs of master and extension that are on then.
    on: &'static [(usize, usize)],
}

const TABLES: [Table; 7] = [
    Table { name: "c_program", world: "gate", user: press_i3, on: &[(0, 0)] },
    Table { name: "extended_motor_control", world: "two_motors", user: |_| {}, on: &[(0, 0)] },
    Table { name: "extension", world: "extension", user: press_i1, on: &[(0, 0), (1, 0)] },
    Table { name: "infrared_remote", world: "two_motors", user: drive, on: &[(0, 1), (0, 2)] },
    Table { name: "slide_on_events", world: "slide", user: |_| {}, on: &[(0, 0)] },
    Table { name: "sound_and_lamps", world: "lamps", user: |_| {}, on: &[(0, 7)] },
    Table { name: "wlan", world: "slide", user: |_| {}, on: &[(0, 1)] },
];

fn press_i1(machine: &mut Machine) {
    for controller in 0..2 {
        machine.world_mut().unwrap().press(controller, Input::I1, true);
    }
}

fn press_i3(machine: &mut Machine) {
    machine.world_mut().unwrap().press(0, Input::I3, true);
}

fn drive(machine: &mut Machine) {
    let remote = Remote { dip1: true, left_y: -15, right_y: 15, on: true, ..Remote::default() };
    machine.world_mut().unwrap().set_remote(remote);
}

#[test]
fn ctrl_c_stops_the_motors_of_the_controller_that_is_named_and_goes_offline() {
    thread::scope(|scope| {
        for table in TABLES {
            scope.spawn(|| assert_ctrl_c_stops(table));
        }
    });
}

fn assert_ctrl_c_stops(Table { name, world, user, on }: Table) {
    let world = format!("{}/examples/worlds/{world}.toml", env!("CARGO_MANIFEST_DIR"));
    let last: Arc<Mutex<Vec<ExchangeData>>> = Arc::default();
    let record = Arc::clone(&last);
    let txt = SimulatedTxt::builder()
        .extensions(1)
        .world(World::load(world).unwrap())
        .on_exchange(move |machine| {
            user(machine);
            let outputs = machine.controllers.iter().map(|controller| controller.outputs);
            *record.lock().unwrap() = outputs.collect();
        })
        .start()
        .unwrap();
    let run = Run::start(name, &[&txt.address().to_string()]);
    let is_on = |machine: &Machine, &(controller, output): &(usize, usize)| {
        machine.controllers[controller].outputs.duty[output] > 0
    };
    let all_on = |machine: &Machine| on.iter().all(|output| is_on(machine, output));
    assert!(txt.wait_until(DEADLINE, all_on), "{name} does nothing");
    run.interrupt();
    let lines = run.finish();
    if ["c_program", "extended_motor_control"].contains(&name) {
        assert_eq!(lines.last().unwrap(), "Stopped.", "{name} is not done yet");
    }

    assert!(txt.wait_until(DEADLINE, |machine| !machine.connected()), "{name}");
    let last = last.lock().unwrap();
    assert!(last.iter().all(|outputs| outputs.duty == [0; 8]), "{name}: {last:?}");
    if name == "sound_and_lamps" {
        assert_eq!(last[0].sound_index, 0, "silence");
    }
    txt.with_machine(|machine| {
        assert_eq!(machine.commands().last(), Some(CommandId::StopOnline), "{name}");
        assert_eq!(machine.oddities().next(), None, "{name}");
    });
}

#[test]
fn what_can_not_be_done_ends_in_a_sentence_and_status_1() {
    // No part of a name has more than 63 characters, so nobody is asked for this one.
    let nowhere = "x".repeat(64);
    for name in SAMPLES {
        for (arguments, part, lines) in [
            (&[nowhere.as_str()][..], "there is no host", 1),
            (&["127.0.0.1:x"], "\"x\" in \"127.0.0.1:x\" is no port", 1),
            (&["--seconds", "x"], "invalid digit", 1),
            (&["--no-such-thing"], "--no-such-thing", 2),
            (&["one", "two"], "two", 2),
        ] {
            let output = example(name).args(arguments).output().unwrap();
            assert_eq!(output.status.code(), Some(1), "{name} {arguments:?}");
            let message = String::from_utf8(output.stderr).unwrap();
            assert!(message.contains(part), "{name} {arguments:?}: {message}");
            // The second one is the usage.
            assert_eq!(message.lines().count(), lines, "{name} {arguments:?}: {message}");
        }
    }
}
