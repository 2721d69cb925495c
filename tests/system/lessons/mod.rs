//! The lessons: each solution passes its check, and what pupils get wrong at first gets a sentence that helps.

mod pupil;

use std::collections::BTreeSet;
use std::process::{Command, Output};
use std::sync::Mutex;
use std::time::{Duration, SystemTime};
use std::{fs, thread};

use ft_transfer_area::tx::Input;
use ft_transfer_area_simulator::world::World;
use ft_transfer_area_simulator::SimulatedTxt;

use crate::program::{example, output_in_time, txt, Program, DEADLINE};

/// The examples with the solutions, in the order of the lessons.
const SOLUTIONS: [&str; 10] = [
    "lesson_01_lamp",
    "lesson_02_blink",
    "lesson_03_motor",
    "lesson_04_end_switch",
    "lesson_05_counter",
    "lesson_06_distance",
    "lesson_07_thermostat",
    "lesson_08_traffic_light",
    "lesson_09_gate",
    "lesson_10_sorting",
];

/// A mistake of the program `lesson_mistakes`, after the name of its lesson, and a part of what the check says.
const MISTAKES: &[(&str, &str)] = &[
    ("lamp/no_address", "The program ended with an error before it was online."),
    ("lamp/never_online", "The program ended without going online."),
    ("lamp/ends", "The program ended, but it should go on."),
    ("lamp/half_of_a_motor", "The program ended with an error. Its message is above."),
    ("lamp/inverted", "The lamp at O8 is lit although nobody has pressed I1."),
    ("lamp/stays_on", "The lamp at O8 stays on after I1 was released."),
    ("lamp/other_output", "I1 was pressed, but O7 went on and not the lamp at O8."),
    ("lamp/copy", "I1 was pressed, but the lamp at O8 stayed dark."),
    ("lamp/weak", "The lamp at O8 only glows: its duty is 1 of 512."),
    ("lamp/kept_guard", "I1 was pressed, but the lamp at O8 stayed dark."),
    ("blink/kept_guard", "The lamp at O8 stays dark."),
    ("blink/no_second_sleep", "s; it should be 0.5 s."),
    ("blink/slow", "The lamp at O8 was on for 1."),
    ("blink/three_times", "s, and then stopped."),
    ("blink/only_on", "The lamp at O8 is lit all the time."),
    ("motor/runs_at_once", "M1 turns although nobody has pressed a button."),
    ("motor/swapped", "I1 is pressed, and M1 turns the wrong way."),
    ("motor/other_motor", "I1 is pressed, but O3 went on and not M1."),
    ("motor/no_halt", "M1 keeps turning after I1 was released."),
    ("motor/second_if_undoes", "I1 is pressed, but M1 does not turn."),
    ("motor/first_wins", "I1 and I2 are both pressed, and M1 follows I1."),
    ("motor/both_outputs", "O1 and O2 were on at the same time"),
    ("end_switch/no_button", "The slide moves although nobody has pressed I3."),
    ("end_switch/wrong_direction", "I3 was pressed, but the slide goes away from I2."),
    ("end_switch/while_pressed", "The slide has not reached I2."),
    ("end_switch/by_time", "The slide has not reached I2."),
    ("end_switch/no_stop", "The slide has reached I2, but M1 still pushes"),
    ("end_switch/back_at_once", "The slide was at I2 and left it again without I3."),
    ("end_switch/one_way", "the slide does not go to I1."),
    ("counter/no_reset", "The first press was right, but the second one lowered the load by only"),
    ("counter/by_time", "pulses instead of 100."),
    ("counter/no_stop", "The winch does not stop"),
    ("counter/exactly", "never 100. Wait for 100 or more"),
    ("counter/up", "The load went up instead of down."),
    ("distance/no_wait", "of 500 pulses ahead."),
    ("distance/one_wheel", "Only the wheel M1 turns"),
    ("distance/curve", "The car drives a curve"),
    ("distance/only_m1", "M2 drove only 49"),
    ("distance/short_limit", "The program ended with an error. Its message is above."),
    ("distance/no_return", "from where it started; it should come back."),
    ("thermostat/digital", "The program ended with an error. Its message is above."),
    ("thermostat/never", "It is 35 °C, but the fan is off."),
    ("thermostat/inverted", "It is 20 °C, but the fan is running."),
    ("thermostat/one_low_limit", "It cooled down from 35 °C to 27 °C, and the fan stopped."),
    ("thermostat/one_high_limit", "It warmed up from 20 °C to 27 °C, and the fan started."),
    ("traffic_light/dark_at_first", "it should be green, but it is dark."),
    ("traffic_light/deaf", "the light stays green."),
    ("traffic_light/stays_lit", "After green comes yellow, but it is yellow and green."),
    ("traffic_light/short", "s; it should be 3 s."),
    ("traffic_light/no_red_yellow", "After red comes red and yellow, but it is green."),
    ("gate/stop_is_no_opener", "I3 was pressed for a moment, but the gate does not open."),
    ("gate/pushes", "The gate is at I2, but M1 still pushes against the end."),
    ("gate/stays_open", "The gate is open, and does not close by itself."),
    ("gate/no_pause", "s; it should be 2 s."),
    ("gate/no_barrier", "Something is in the light barrier I4, but the gate keeps closing."),
    ("gate/no_stop", "I5 was pressed, but the gate keeps moving."),
    ("gate/goes_on", "it moved again when I5 was released."),
    ("sorting/light_means_disc", "Nothing is on the belt, but"),
    ("sorting/never_starts", "the belt does not start."),
    ("sorting/colour_blind", "The white disc ran off the end"),
    ("sorting/no_air", "The white disc ran off the end"),
    ("sorting/old_colour", "A disc that is not white was blown into the storage"),
    ("sorting/valve_stays", "the valve O3 or the compressor O4 is still on."),
    ("sorting/runs_on", "The disc is in its storage, but the belt keeps running."),
];

/// How many checks run at the same time. Each waits most of the time.
const TOGETHER: usize = 16;

fn check(language: &str, lesson: &str, program: &Command, argument: Option<&str>) -> Output {
    let mut txt = txt();
    txt.args(["check", "--language", language, lesson]).arg(program.get_program());
    output_in_time(txt.args(argument))
}

fn text(bytes: &[u8]) -> &str {
    std::str::from_utf8(bytes).unwrap()
}

/// Does this for each of them, a few at the same time.
fn for_each<T: Sync>(all: &[T], does: impl Fn(&T) + Sync) {
    let all = Mutex::new(all.iter());
    let next = || all.lock().unwrap().next();
    thread::scope(|scope| {
        for _ in 0..TOGETHER {
            scope.spawn(|| {
                while let Some(one) = next() {
                    does(one);
                }
            });
        }
    });
}

#[test]
fn each_solution_passes_the_check_of_its_lesson() {
    let numbered: Vec<_> = SOLUTIONS.into_iter().zip(1..).collect();
    for_each(&numbered, |(name, number)| {
        let output = check("en", &number.to_string(), &example(name), None);
        let (said, errors) = (text(&output.stdout), text(&output.stderr));
        assert!(output.status.success(), "{name}: {said}{errors}");
        assert!(said.contains(&format!("Lesson {number}: ")), "{name}: {said}");
        assert!(said.contains("Solved."), "{name}: {said}");
        assert!(!said.contains("wrong"), "{name}: {said}");
    });
}

#[test]
fn each_mistake_gets_a_sentence_that_helps() {
    for_each(MISTAKES, |(mistake, sentence)| {
        let lesson = mistake.split('/').next().unwrap();
        let output = check("en", lesson, &example("lesson_mistakes"), Some(mistake));
        let (said, errors) = (text(&output.stdout), text(&output.stderr));
        assert_eq!(output.status.code(), Some(1), "{mistake}: {said}{errors}");
        assert!(errors.contains(sentence), "{mistake}: {said}{errors}");
        let tells_itself = sentence.ends_with("Its message is above.");
        assert!(errors.contains("\nHint: "), "{mistake}: {errors}");
        if tells_itself {
            assert!(errors.contains("Error: "), "{mistake}: {errors}");
        }
    });
}

#[test]
fn each_lesson_has_mistakes() {
    let lessons: BTreeSet<_> =
        MISTAKES.iter().filter_map(|(name, _)| name.split('/').next()).collect();
    let solved = SOLUTIONS.map(|name| name.split_at("lesson_00_".len()).1);
    assert_eq!(lessons, BTreeSet::from(solved));
}

#[test]
fn a_check_speaks_german() {
    let output = check("de", "1", &example("lesson_mistakes"), Some("lamp/stays_on"));
    assert_eq!(output.status.code(), Some(1));
    let said = text(&output.stdout);
    assert!(said.starts_with("Lektion 1: eine Lampe\n"), "{said}");
    assert!(said.contains("  ok      I1 wird gedrückt: die Lampe an O8 leuchtet\n"), "{said}");
    assert!(said.contains("  falsch  I1 wird losgelassen: die Lampe an O8 geht aus\n"), "{said}");
    let errors = text(&output.stderr);
    assert!(
        errors.contains("Die Lampe an O8 bleibt an, nachdem I1 losgelassen wurde.\nTipp: "),
        "{errors}"
    );
}

/// What `txt check` says with these words, in a folder like a pupil's, where `lamp` was changed after it was built.
fn said_in_a_folder(arguments: &[&str]) -> (Option<i32>, String) {
    let folder = tempfile::tempdir().unwrap();
    let place = |name: &str| folder.path().join(name);
    for name in ["src/bin", "target/debug", "elsewhere"] {
        fs::create_dir_all(place(name)).unwrap();
    }
    fs::write(place("Cargo.toml"), "").unwrap();
    fs::write(place("target/debug/lamp"), "").unwrap();
    for name in ["src/bin/lamp.rs", "src/bin/blink.rs", "lamp.py", "lamp.c"] {
        fs::write(place(name), "").unwrap();
    }
    let later = SystemTime::now() + Duration::from_secs(60);
    fs::File::open(place("src/bin/lamp.rs")).unwrap().set_modified(later).unwrap();
    let output = output_in_time(txt().arg("check").args(arguments).current_dir(folder.path()));
    (output.status.code(), text(&output.stderr).to_owned())
}

#[cfg_attr(windows, ignore = "an empty file is no program there")]
#[test]
fn a_program_that_is_older_than_its_source_is_told() {
    let (code, said) = said_in_a_folder(&["--language", "en", "1", "target/debug/lamp"]);
    let part = "src/bin/lamp.rs was changed after target/debug/lamp was built";
    assert!(said.contains(part), "{said}");
    assert_eq!(code, Some(1), "{said}");
}

#[test]
fn what_can_not_be_checked_is_told_in_the_language_chosen() {
    for (arguments, status, part) in [
        (&["11", "x"][..], 2, "there is no lesson \"11\"; there are 1 lamp, 2 blink"),
        (
            &["--language", "de", "11", "x"],
            2,
            "die Lektion „11“ gibt es nicht; es gibt 1 lampe, 2 blinken",
        ),
        (&["1"], 2, "<PROGRAM>"),
        (&["--language", "fr", "1", "x"], 2, "en"),
        (
            &["1", "./no/such/program"],
            2,
            "can't start the program ./no/such/program: there is no such file",
        ),
        (&["1", "no_such_program"], 1, "can't start the program no_such_program: "),
        (
            &["1", "src/bin/lamp.rs"],
            2,
            "is the source of a program; build it with `cargo build`, and check target/debug/lamp",
        ),
        (
            &["--language", "de", "lampe", "src/bin/lamp.rs"],
            2,
            "ist der Quelltext eines Programms. Bau es mit `cargo build`",
        ),
        (&["1", "lamp.py"], 2, "write: txt check 1 python3 lamp.py"),
        (&["1", "lamp.c"], 2, "compile it"),
        (&["2", "target/debug/blink"], 2, "there is no such file; run `cargo build` first"),
        (&["--language", "de", "2", "target/debug/blink"], 2, "Ruf zuerst `cargo build` auf"),
        (&["1", "target/debug/lampe"], 2, "the sources in src/bin are blink.rs, lamp.rs"),
        (&["1", "target/debug/lamp", "--show"], 2, "--show stands after the program"),
        (
            &["--language", "de", "1", "python3", "lamp.py", "--language=en"],
            2,
            "steht hinter dem Programm",
        ),
    ] {
        let (code, said) = said_in_a_folder(arguments);
        assert!(said.contains(part), "{arguments:?}: {said}");
        assert_eq!(code, Some(status), "{arguments:?}: {said}");
    }
}

#[test]
fn what_the_library_says_is_explained_in_the_language_chosen() {
    for (mistake, language, part) in [
        ("lamp/half_of_a_motor", "en", "\nHint: this output is still half of a motor."),
        ("lamp/half_of_a_motor", "de", "\nTipp: Dieser Ausgang ist noch ein halber Motor."),
        ("lamp/kept_guard", "en", "\nHint: the program holds a guard for too long"),
        ("lamp/kept_guard", "de", "\nTipp: Das Programm hält einen Guard zu lange fest"),
        ("thermostat/digital", "de", "\nTipp: Dieser Eingang ist für Taster eingestellt."),
        (
            "distance/short_limit",
            "en",
            "\nHint: what the program waited for did not happen in time.",
        ),
        (
            "distance/kept_guard",
            "de",
            "\nTipp: Das Programm verlangt die Werte, während es sie schon hat.",
        ),
    ] {
        let lesson = mistake.split('/').next().unwrap();
        let output = check(language, lesson, &example("lesson_mistakes"), Some(mistake));
        let errors = text(&output.stderr);
        assert!(errors.contains(part), "{mistake} {language}: {errors}");
    }
}

/// It stops itself for a moment, as a computer that stands still does.
#[cfg(unix)]
#[test]
fn a_computer_that_stands_still_is_no_mistake_of_the_pupil() {
    let programs = ["blink/stands_still", "counter/stands_still_once", "counter/stands_still"];
    for_each(&programs, |name| {
        let lesson = name.split('/').next().unwrap();
        let output = check("en", lesson, &example("lesson_mistakes"), Some(name));
        let (said, errors) = (text(&output.stdout), text(&output.stderr));
        let tries = said.matches("Nothing was exchanged for").count();
        if *name == "counter/stands_still" {
            assert_eq!(output.status.code(), Some(1), "{name}: {said}{errors}");
            assert!(errors.contains("meanwhile, which may be the reason"), "{name}: {errors}");
            assert_eq!(tries, 2, "{name}: {said}");
        } else {
            assert!(output.status.success(), "{name}: {said}{errors}");
            assert!(said.contains("Solved."), "{name}: {said}");
        }
        if *name == "counter/stands_still_once" {
            assert_eq!(tries, 1, "{name}: {said}");
        }
    });
}

#[test]
fn the_programs_of_the_first_steps_turn_m1_while_i1_is_pressed() {
    for name in ["first_steps", "erste_schritte"] {
        let world = include_str!("../../../docs/lessons/worlds/03-motor.toml");
        let builder = SimulatedTxt::builder().world(World::from_toml(world).unwrap());
        let txt = builder.start().unwrap();
        let mut child = example(name).arg(txt.address().to_string()).spawn().unwrap();
        for (pressed, duty) in [(true, 512), (false, 0), (true, 512)] {
            txt.with_machine(|machine| machine.world_mut().unwrap().press(0, Input::I1, pressed));
            let turns = txt.wait_until(
                |machine| machine.online() && machine.controllers[0].outputs.duty[0] == duty,
                DEADLINE,
            );
            assert!(turns, "{name}: I1 {pressed}");
        }
        // The connection is lost, so the program ends with an error.
        drop(txt);
        assert_eq!(child.wait().unwrap().code(), Some(1), "{name}");
    }
}

#[test]
fn the_machine_of_each_lesson_is_simulated_by_its_name() {
    for number in 1..=SOLUTIONS.len() {
        Program::start(&["--world", &format!("lesson{number}")]);
    }
}

#[test]
fn each_lesson_has_a_page_in_both_languages() {
    for language in ["en", "de"] {
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/lessons/").to_owned();
        let mut pages: Vec<_> =
            fs::read_dir(folder + language).unwrap().map(|page| page.unwrap().path()).collect();
        pages.sort();
        assert_eq!(pages.len(), 1 + SOLUTIONS.len(), "{pages:#?}");
        for (page, (solution, number)) in pages.iter().skip(1).zip(SOLUTIONS.iter().zip(1..)) {
            let text = fs::read_to_string(page).unwrap();
            let solution = solution.trim_start_matches("lesson_");
            for part in [
                format!("`txt simulate --world lesson{number} --show`"),
                format!("`txt check {number} target/debug/"),
                format!("(../solutions/{solution}.rs)"),
            ] {
                assert!(text.contains(&part), "{}: no {part}", page.display());
            }
        }
    }
}
