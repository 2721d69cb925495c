//! `txt lesson`, and the lessons of a class: checks of programs that are started elsewhere.

use std::fs;
use std::io::{Read, Write};
use std::net::TcpStream;
use std::process::Command;
use std::thread;
use std::time::{Duration, Instant};

use ft_transfer_area::prelude::*;
use ft_transfer_area::TimeLimits;
use serde_json::{json, Value};

use crate::panel::page::Page;
use crate::running::Running;

/// Only a test that fails waits so long.
const LIMIT: Duration = Duration::from_secs(60);
const LOOK: Duration = Duration::from_millis(20);

/// The status and the body of what a page gets.
pub(crate) fn get(address: &str, path: &str) -> (u16, String) {
    ask("GET", address, path)
}

fn ask(method: &str, address: &str, path: &str) -> (u16, String) {
    let mut stream = TcpStream::connect(address).unwrap();
    stream.set_read_timeout(Some(LIMIT)).unwrap();
    let head = format!(
        "{method} {path} HTTP/1.1\r\nHost: {address}\r\nConnection: close\r\nContent-Length: 0\r\n\r\n"
    );
    stream.write_all(head.as_bytes()).unwrap();
    let mut response = String::new();
    stream.read_to_string(&mut response).unwrap();
    let (head, body) = response.split_once("\r\n\r\n").unwrap();
    (head.split(' ').nth(1).unwrap().parse().unwrap(), body.to_owned())
}

/// The page of a lesson.
struct Lesson {
    running: Running,
    program: String,
    address: String,
    token: String,
}

impl Lesson {
    fn start(arguments: &[&str]) -> Self {
        let mut command = Command::new(env!("CARGO_BIN_EXE_txt"));
        command.args(["lesson", "--port", "0", "--no-browser"]).args(arguments);
        let running = Running::start(&mut command);
        let program = running.line().strip_prefix("program ").unwrap().to_owned();
        let link = running.line();
        let place = link.strip_prefix("page http://").unwrap();
        let (address, token) = place.split_once("/lesson?token=").unwrap();
        let (address, token) = (address.to_owned(), token.to_owned());
        Self { running, program, address, token }
    }

    fn post(&self, what: &str) -> u16 {
        ask("POST", &self.address, &format!("/lesson/{what}?token={}", self.token)).0
    }

    fn state(&self) -> Value {
        let (status, body) = get(&self.address, &format!("/lesson/state?token={}", self.token));
        assert_eq!(status, 200, "{body}");
        serde_json::from_str(&body).unwrap()
    }

    /// Waits until the check is so far.
    fn wait_for(&self, phase: &str) -> Value {
        let begin = Instant::now();
        loop {
            let state = self.state();
            if state["check"]["phase"] == phase {
                return state;
            }
            assert!(begin.elapsed() < LIMIT, "{phase} did not come: {}", state["check"]);
            thread::sleep(LOOK);
        }
    }
}

/// A pupil's program of lesson 1, until its controller is gone or has no more of it. A wrong one never switches off.
pub(crate) fn lamp(address: &str, is_right: bool, is_over: impl Fn() -> bool) {
    let handler = TransferAreaComHandler::builder(address).build().unwrap();
    drives_a_lamp(&handler, is_right, is_over);
}

fn drives_a_lamp(handler: &TransferAreaComHandler, is_right: bool, is_over: impl Fn() -> bool) {
    let areas = handler.areas();
    areas.lock()[LOCAL_IO].set_ft_motor_config(M4, false);
    handler.begin_transfer().unwrap();
    while !is_over() {
        let mut now = areas.wait_cycle().unwrap();
        let area = &mut now[LOCAL_IO];
        if area.get_in_io_value_binary(I1).unwrap() {
            area.set_out_pwm_values(O8, DUTY_MAX).unwrap();
        } else if is_right {
            area.set_out_pwm_values(O8, 0).unwrap();
        }
    }
    handler.end_transfer().unwrap();
}

#[test]
fn steps_are_ticked_while_a_program_runs_and_the_next_lesson_follows() {
    let lesson = Lesson::start(&[]);
    let before = lesson.state();
    assert_eq!((&before["number"], &before["check"]["phase"]), (&1.into(), &"idle".into()));
    assert!(before["task"]["de"].as_str().unwrap().contains("<h1>Lektion 1"), "{}", before["task"]);
    assert_eq!(before["address"], *lesson.program);

    assert_eq!(lesson.post("check"), 204);
    assert_eq!(lesson.post("check"), 409);
    lesson.wait_for("waiting");
    let is_over = || lesson.state()["checking"] == false;
    lamp(&lesson.program, false, is_over);
    let wrong = lesson.wait_for("wrong");
    let what = wrong["check"]["wrong"]["what"]["en"].as_str().unwrap();
    assert_eq!(what, "The lamp at O8 stays on after I1 was released.");
    let signs = |state: &Value| -> Vec<String> {
        let steps = state["check"]["steps"].as_array().unwrap();
        steps.iter().map(|step| step["sign"].as_str().unwrap().to_owned()).collect()
    };
    assert_eq!(signs(&wrong), ["ok", "ok", "wrong"]);

    assert_eq!(lesson.post("check"), 204);
    lesson.wait_for("waiting");
    lamp(&lesson.program, true, is_over);
    let solved = lesson.wait_for("solved");
    assert_eq!(signs(&solved), ["ok"; 5]);
    assert_eq!(solved["passed"], serde_json::json!([1]));

    assert_eq!(lesson.post("go/2"), 204);
    let next = lesson.state();
    assert_eq!((&next["number"], &next["check"]["phase"]), (&2.into(), &"idle".into()));
    assert_eq!(lesson.post("go/11"), 409);
}

/// The controller serves one program after the other.
#[test]
fn a_check_does_not_go_on_with_a_program_that_has_waited_for_the_first_one() {
    let lesson = Lesson::start(&[]);
    assert_eq!(lesson.post("check"), 204);
    lesson.wait_for("waiting");
    let is_over = || lesson.state()["checking"] == false;
    let has_begun = || lesson.state()["check"]["steps"].as_array().unwrap().len() > 2;
    let second = || {
        let mut patient = TimeLimits::default();
        patient.read = LIMIT;
        let handler = TransferAreaComHandler::builder(&lesson.program).time_limits(patient);
        drives_a_lamp(&handler.build().unwrap(), true, is_over);
    };
    thread::scope(|scope| {
        lamp(&lesson.program, true, || {
            let leaves = has_begun();
            if leaves {
                scope.spawn(second);
                // It comes at once, or a little later: both is right.
                thread::sleep(Duration::from_millis(300));
            }
            leaves
        });
        let wrong = lesson.wait_for("wrong");
        let what = &wrong["check"]["wrong"]["what"]["en"];
        assert_eq!(what, "The program ended, but it should go on.");
    });
}

#[test]
fn the_page_shows_the_machine_of_the_lesson_that_the_pupil_has_gone_to() {
    let lesson = Lesson::start(&[]);
    let mut page = Page::open(&lesson.address, &lesson.token);
    assert_eq!(lesson.post("go/4"), 204);
    page.state(0, |state| state["world"]["boards"][0]["motors"][0]["slide"].is_number());
    assert_eq!(lesson.post("go/10"), 204);
    page.state(0, |state| state["world"]["floor"]["belts"][0]["motor"] == "M1");
    assert_eq!(lesson.post("go/1"), 204);
    page.state(0, |state| state["world"]["floor"].is_null());
}

#[cfg_attr(not(unix), ignore = "Ctrl-C can't be sent to a single program there")]
#[test]
fn a_check_can_be_ended_before_a_program_comes() {
    let lesson = Lesson::start(&["motor"]);
    assert_eq!(lesson.post("check"), 204);
    lesson.wait_for("waiting");
    // A right program would be told that it answers what nobody has pressed.
    let press = json!({"do": "press", "input": 0, "pressed": true});
    let mut page = Page::open(&lesson.address, &lesson.token);
    assert_eq!(page.refused(press), "checked");
    assert_eq!(lesson.post("end"), 204);
    lesson.wait_for("idle");
    let begin = Instant::now();
    while lesson.post("check") != 204 {
        assert!(begin.elapsed() < LIMIT, "the check does not end");
        thread::sleep(LOOK);
    }
    // It ends with the program, too.
    lesson.running.signal("INT");
    assert!(lesson.running.leaves_nothing());
}

#[test]
fn how_far_a_pupil_is_stays_in_the_file_beside_the_class() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| folder.path().join(name);
    fs::write(file("7b.toml"), "[[pupils]]\nname = \"Zoë\"\nlesson = 1\n").unwrap();
    fs::write(file("7b.csv"), "name,lesson,passed,wrong_since,last_wrong\nZoë,4,1 2 3,0,\n")
        .unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_txt"));
    command.args(["classroom", "--class", "7b.toml", "--port", "0"]).current_dir(folder.path());
    let running = Running::start(&mut command);
    let _all = running.line();
    let line = running.line();
    let place = line.split_once(", page http://").unwrap().1;
    let (address, token) = place.split_once("/lesson?token=").unwrap();
    let (_, state) = get(address, &format!("/lesson/state?token={token}"));
    let state: Value = serde_json::from_str(&state).unwrap();
    assert_eq!((&state["number"], &state["passed"]), (&4.into(), &serde_json::json!([1, 2, 3])));
    assert_eq!(state["whose"], "Zoë");
    assert_eq!(ask("POST", address, &format!("/lesson/go/5?token={token}")).0, 204);
    let begin = Instant::now();
    while !fs::read_to_string(file("7b.csv")).unwrap().contains("Zoë,5,1 2 3,0,") {
        assert!(begin.elapsed() < LIMIT, "the file stays as it was");
        thread::sleep(LOOK);
    }
}
