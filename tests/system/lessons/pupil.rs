//! What pupils have after each lesson's text, word for word, and where the compiler's advice leads after a first mistake.

use std::ops::Range;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::{env, fs};

use serde_json::Value;

const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");

/// Where the code of a lesson goes in the first program.
enum Place {
    Item,
    BeforeTransfer,
    InLoop,
    /// In an `impl` of the lesson's states.
    Next,
}
use Place::{BeforeTransfer, InLoop, Item, Next};

/// All code of the lessons, without their first lines: a part of the page, and what stands for what it leaves out.
const TEXTS: &[(usize, Place, &str, &str)] = &[
    (1, BeforeTransfer, "areas.lock()[LOCAL_IO].set_ft_motor_config(M4, false);", "@"),
    (1, InLoop, "area.set_out_pwm_values(O8, DUTY_MAX)?", "@;"),
    (1, InLoop, "let duty = if pressed { DUTY_MAX } else { 0 };", "@ area.set_out_pwm_values(O8, duty)?;"),
    (2, InLoop, "std::thread::sleep(Duration::from_millis(500))", "@;"),
    (2, BeforeTransfer, "areas.wait_cycle()?[LOCAL_IO].set_out_pwm_values(…)?;", "@"),
    (3, InLoop, "area.set_out_motor_values(M1, DUTY_MAX, Direction::Cw)?", "@;"),
    (3, InLoop, "Direction::Ccw", "area.set_out_motor_values(M1, DUTY_MAX, @)?;"),
    (3, InLoop, "Direction::Halt", "area.set_out_motor_values(M1, 0, @)?;"),
    (3, InLoop, "match (i1, i2)", "let i1 = pressed; let i2 = !pressed; @ { (true, false) => (), _ => () }"),
    (4, Item, "fn wait_for(areas: &TransferAreas, input: Input) -> Result<(), Error> {", ""),
    (4, BeforeTransfer, "areas.lock()[LOCAL_IO]", "wait_for(areas, I3)?; @.set_out_motor_values(M1, DUTY_MAX, Direction::Cw)?;"),
    (5, InLoop, "area.get_in_cnt_count(C1)", "let _count = @;"),
    (5, InLoop, "area.start_counter_reset(C1)", "@;"),
    (5, BeforeTransfer, "areas.wait_counter_reset(LOCAL_IO, C1, LIMIT)?", "@;"),
    (5, BeforeTransfer, "|now: &[FishX1Transfer]| now[LOCAL_IO].get_in_cnt_count(C1) >= 100", "areas.wait_until(@, LIMIT)?; areas.wait_until(@, Duration::MAX)?;"),
    (5, BeforeTransfer, "now[LOCAL_IO].input.uni[I1] != 0", "areas.wait_until(|now: &[FishX1Transfer]| @, LIMIT)?;"),
    (6, InLoop, "area.start_motor_ex_cmd(M1, DUTY_MAX, Direction::Cw, &slaves, 500)?;", ""),
    (6, BeforeTransfer, "areas.wait_motor_ex(LOCAL_IO, M1, LIMIT)?", "@;"),
    (6, BeforeTransfer, "handler.end_transfer()", "@?;"),
    (7, BeforeTransfer, "areas.lock()[LOCAL_IO].set_ft_uni_config(I1, InputMode::Resistance, false);", ""),
    (7, InLoop, "area.get_in_io_value_analogue(I1)?", "let _ohms = @;"),
    (8, Item, "enum State {\n    Green,\n    Yellow(Instant),\n    Red(Instant),\n    RedYellow(Instant),\n}", ""),
    (8, InLoop, "let area = &mut now[LOCAL_IO];", "let time = now.arrived(); @ let _state = State::Green.next(area.get_in_io_value_binary(I1)?, time);"),
    (8, Next, "Self::Yellow(since) if time - since >= Duration::from_secs(1) => Self::Red(time)", "@,"),
    (8, Next, "set_ft_motor_config(M1, false)", "other => { let mut area = FishX1Transfer::default(); area.@; if pressed { Self::Green } else { other } }"),
    (9, Item, "_ if inputs.stop => Self::Stopped", "enum State { Stopped, Open(Instant) } struct Inputs { stop: bool } impl State { fn next(self, inputs: &Inputs) -> Self { match self { @, same => same } } }"),
    (10, BeforeTransfer, "InputMode::Voltage", "areas.lock()[LOCAL_IO].set_ft_uni_config(I2, @, false);"),
];

/// A first mistake, as a replacement in the program of the first steps.
struct Mistake {
    name: &'static str,
    right: &'static str,
    wrong: &'static str,
}

const MOTOR: &str = "area.set_out_motor_values(M1, DUTY_MAX, direction)?;";

/// After these, the compiler's advice leads to a program that compiles.
const WITH_ADVICE: &[Mistake] = &[
    Mistake { name: "no_instant", right: "fn main", wrong: "pub enum State { Green, Yellow(Instant) }\n\nfn main" },
    Mistake { name: "no_thread", right: MOTOR, wrong: "area.set_out_motor_values(M1, DUTY_MAX, direction)?;\nthread::sleep(Duration::from_millis(500));" },
    Mistake { name: "no_mut", right: "let mut now", wrong: "let now" },
    Mistake { name: "no_question_mark", right: MOTOR, wrong: "area.set_out_motor_values(M1, DUTY_MAX, direction);" },
    Mistake { name: "small_letter", right: "(M1,", wrong: "(m1," },
    Mistake { name: "method", right: MOTOR, wrong: "area.set_out_pwm_value(O8, DUTY_MAX)?;\nlet _ = direction;" },
    Mistake { name: "whole_name", right: "(M1,", wrong: "(Motor::M1," },
    Mistake { name: "other_error", right: "fn main", wrong: "pub fn on(area: &mut FishX1Transfer) -> Result<(), Error> { area.set_out_pwm_values(Output::O8, 1) }\n\nfn main" },
];

/// The advice for this one leads astray, so the first steps name it.
const NO_PRELUDE: Mistake =
    Mistake { name: "no_prelude", right: "use ft_transfer_area::prelude::*;\n", wrong: "" };
const OUTPUT: Mistake = Mistake {
    name: "no_output",
    right: "use ft_transfer_area::prelude::*;\n",
    wrong: "pub fn output() -> Output { todo!() }\n",
};

fn page(language: &str, number: usize) -> String {
    let mut pages: Vec<PathBuf> = fs::read_dir(format!("{ROOT}/docs/lessons/{language}"))
        .unwrap()
        .map(|page| page.unwrap().path())
        .collect();
    pages.sort();
    fs::read_to_string(&pages[number]).unwrap().replace("\r\n", "\n")
}

/// The blocks of Rust code.
fn blocks(page: &str) -> Vec<&str> {
    let blocks = page.split("```rust,ignore\n").skip(1);
    blocks.map(|rest| rest.split_once("```").unwrap().0).collect()
}

/// A pupil's folder for programs, made with the commands of the first steps.
struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let made = Self(folder);
        succeed(
            Command::new(cargo()).args(["new", "--quiet", "lessons"]).current_dir(made.0.path()),
        );
        // So that nothing has to be looked up in the network.
        fs::copy(format!("{ROOT}/Cargo.lock"), made.path().join("Cargo.lock")).unwrap();
        succeed(made.cargo("add").args(["--quiet", "ft-transfer-area", "--path", ROOT]));
        fs::create_dir(made.path().join("src/bin")).unwrap();
        made
    }

    fn path(&self) -> PathBuf {
        self.0.path().join("lessons")
    }

    fn cargo(&self, command: &str) -> Command {
        let mut cargo = Command::new(cargo());
        cargo.args([command, "--offline"]).current_dir(self.path());
        // Built once for all tests.
        let tests = env::current_exe().unwrap();
        cargo.env("CARGO_TARGET_DIR", tests.ancestors().nth(3).unwrap().join("pupil"));
        cargo
    }

    fn file(&self, name: &str) -> PathBuf {
        self.path().join(format!("src/bin/{name}.rs"))
    }

    /// What the compiler says of this program.
    fn messages(&self, name: &str) -> Vec<Value> {
        let output = self.cargo("check").args(["--message-format=json", "--bin", name]).output();
        let said = String::from_utf8(output.unwrap().stdout).unwrap();
        let lines = said.lines().map(|line| serde_json::from_str::<Value>(line).unwrap());
        let messages = lines.filter(|line| line["reason"] == "compiler-message");
        let messages = messages.map(|line| line["message"].clone());
        messages
            .filter(|message| message["spans"].as_array().is_some_and(|all| !all.is_empty()))
            .collect()
    }
}

fn cargo() -> std::ffi::OsString {
    env::var_os("CARGO").unwrap_or_else(|| "cargo".into())
}

fn succeed(command: &mut Command) -> Output {
    let output = command.output().unwrap();
    assert!(output.status.success(), "{command:?}: {}", String::from_utf8_lossy(&output.stderr));
    output
}

/// The first program with the code of a lesson.
fn program(first: &str, page: &str, number: usize) -> String {
    let mut blocks = blocks(page);
    assert!(
        blocks.first().is_some_and(|lines| lines.starts_with("use ")),
        "lesson {number} has no first lines"
    );
    let lines = blocks.remove(0);
    let (mut items, mut before, mut inside, mut arms) = Default::default();
    for (_, place, text, whole) in TEXTS.iter().filter(|(lesson, ..)| *lesson == number) {
        assert!(page.contains(text), "lesson {number} has no {text}");
        let code = match blocks.iter().position(|block| block.contains(text)) {
            Some(index) => blocks.remove(index).to_owned(),
            None => whole.replace('@', text).replace('…', "O8, DUTY_MAX"),
        };
        let target: &mut String = match place {
            Item => &mut items,
            BeforeTransfer => &mut before,
            InLoop => &mut inside,
            Next => &mut arms,
        };
        *target += &format!("{code}\n");
    }
    assert!(blocks.is_empty(), "lesson {number} has more code: {blocks:?}");
    if !arms.is_empty() {
        items += &format!("impl State {{ fn next(self, pressed: bool, time: Instant) -> Self {{ match self {{ {arms} }} }} }}\n");
    }
    let used = "use std::time::Duration;\n\nuse ft_transfer_area::prelude::*;\n";
    let mut program = first.to_owned();
    for (mark, code) in [
        (used, lines.to_owned()),
        ("\nfn main", format!("\n{items}\nfn main")),
        ("    handler.begin_transfer", format!("{before}    handler.begin_transfer")),
        (MOTOR, format!("{inside}{MOTOR}")),
    ] {
        assert_eq!(program.matches(mark).count(), 1, "{mark}");
        program = program.replace(mark, &code);
    }
    program
}

#[test]
#[cfg_attr(windows, ignore = "cargo runs on the system that compiles")]
fn what_each_lesson_says_compiles_word_for_word() {
    let folder = Folder::new();
    for language in ["en", "de"] {
        let first = page(language, 0);
        let first = blocks(&first)[0];
        for number in 1..=10 {
            let program = program(first, &page(language, number), number);
            fs::write(folder.file(&format!("{language}{number}")), program).unwrap();
        }
    }
    succeed(folder.cargo("check").args(["--quiet", "--keep-going", "--bins"]));
}

#[test]
#[cfg_attr(windows, ignore = "cargo runs on the system that compiles")]
fn the_advice_for_a_first_mistake_leads_to_a_program_that_compiles() {
    let folder = Folder::new();
    for mistake in WITH_ADVICE {
        folder.make(mistake);
        let said = follow_advice(&folder, mistake.name);
        assert!(said.is_empty(), "{}: {said:#?}", mistake.name);
    }
}

#[test]
#[cfg_attr(windows, ignore = "cargo runs on the system that compiles")]
fn the_first_steps_name_the_advice_that_leads_astray() {
    let folder = Folder::new();
    let mut advised = Vec::new();
    for mistake in [NO_PRELUDE, OUTPUT] {
        folder.make(&mistake);
        let messages = folder.messages(mistake.name);
        let all = messages.iter().flat_map(|message| message["children"].as_array().unwrap());
        let all = all.flat_map(|child| child["spans"].as_array().unwrap());
        let text = |span: &Value| {
            span["suggested_replacement"].as_str().map(|text| text.trim().to_owned())
        };
        advised.extend(all.filter_map(text).filter(|text| text.starts_with("use std::")));
    }
    for use_line in ["use std::process::Output;", "use std::io::Error;"] {
        assert!(advised.iter().any(|advice| advice == use_line), "{use_line}: {advised:?}");
        for language in ["en", "de"] {
            assert!(page(language, 0).contains(&format!("`{use_line}`")), "{language}: {use_line}");
        }
    }
}

impl Folder {
    /// Writes the first program with a mistake.
    fn make(&self, Mistake { name, right, wrong }: &Mistake) {
        let first = page("en", 0);
        let first = blocks(&first)[0];
        assert_eq!(first.matches(right).count(), 1, "{name}");
        fs::write(self.file(name), first.replace(right, wrong)).unwrap();
    }
}

/// Does what the compiler says, one message at a time. Returns what it says at the end.
fn follow_advice(folder: &Folder, name: &str) -> Vec<String> {
    const ROUNDS: usize = 4;
    let file = folder.file(name);
    for _ in 0..ROUNDS {
        let messages = folder.messages(name);
        let Some(advice) = messages.iter().find_map(advice) else {
            return messages.iter().map(|message| message["rendered"].to_string()).collect();
        };
        apply(&file, advice);
    }
    vec![format!("{ROUNDS} rounds of advice have led nowhere")]
}

/// The first thing that a message advises.
fn advice(message: &Value) -> Option<Vec<(Range<usize>, String)>> {
    let children = message["children"].as_array()?;
    children.iter().find_map(|child| {
        let at = |span: &Value, key: &str| usize::try_from(span[key].as_u64()?).ok();
        let change = |span: &Value| {
            let text = span["suggested_replacement"].as_str()?.to_owned();
            Some((at(span, "byte_start")?..at(span, "byte_end")?, text))
        };
        let changes: Option<Vec<_>> = child["spans"].as_array()?.iter().map(change).collect();
        changes.filter(|changes| !changes.is_empty())
    })
}

/// Makes these changes, the last one first, so that the others stay where they are.
fn apply(file: &Path, mut changes: Vec<(Range<usize>, String)>) {
    changes.sort_by_key(|(place, _)| place.start);
    let mut text = fs::read_to_string(file).unwrap();
    for (place, new) in changes.into_iter().rev() {
        text.replace_range(place, &new);
    }
    fs::write(file, text).unwrap();
}
