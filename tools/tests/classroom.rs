//! `txt classroom`: a controller for each pupil, and a page that looks at all.

use std::process::{Command, Stdio};

use ft_transfer_area::transfer_area::LOCAL_IO;
use ft_transfer_area::TransferAreaComHandler;
use serde_json::json;

use crate::panel::page::{self, is_running, Page};
use crate::running::Running;

const LIMIT: std::time::Duration = std::time::Duration::from_secs(60);

/// A page's address and token, from its link.
fn place(link: &str) -> (String, String) {
    let place = link.strip_prefix("http://").and_then(|rest| rest.split_once("/?token="));
    let (address, token) = place.unwrap_or_else(|| panic!("{link:?} is not a link"));
    (address.to_owned(), token.to_owned())
}

struct Classroom {
    _running: Running,
    all: (String, String),
    /// Of each pupil: where programs connect to, and the page.
    pupils: Vec<(String, (String, String))>,
}

impl Classroom {
    fn start(count: usize) -> Self {
        let mut command = Command::new(env!("CARGO_BIN_EXE_txt"));
        command.args(["classroom", &count.to_string(), "--port", "0", "--world", "slide"]);
        let running = Running::start(command.stdin(Stdio::null()));
        let all = place(running.line().strip_prefix("all ").unwrap());
        let pupil = |number: usize| {
            let line = running.line();
            let rest = line.strip_prefix(&format!("pupil {number}: program ")).unwrap();
            let (program, link) = rest.split_once(", page ").unwrap();
            (program.to_owned(), place(link))
        };
        let pupils = (1..=count).map(pupil).collect();
        Self { _running: running, all, pupils }
    }
}

#[test]
fn each_pupil_has_a_controller_and_the_page_for_all_only_looks() {
    let classroom = Classroom::start(3);
    let open = |(address, token): &(String, String)| Page::open(address, token);
    let mut all = open(&classroom.all);
    let (program, link) = &classroom.pupils[1];
    let mut own = open(link);
    let handler = TransferAreaComHandler::builder(&**program).build().unwrap();
    handler.begin_transfer().unwrap();
    assert_eq!(handler.device_name().as_deref(), Some("TXT 2"));
    handler.areas().lock()[LOCAL_IO].output.duty[0] = 300;
    // The pupil's page has one controller.
    let state = own.state(0, is_running);
    assert_eq!(state["link"]["name"], "TXT 2");
    let state =
        all.state(1, |state| is_running(state) && state["areas"][0]["motors"][0]["duty"][0] == 300);
    assert_eq!(state["link"]["name"], "TXT 2");
    assert!(!is_running(&all.state(2, |_| true)));

    let press = |host| json!({"do": "press", "host": host, "input": 2, "pressed": true});
    assert_eq!(own.refused(press(1)), "no_host");
    assert_eq!(all.refused(press(1)), "only_looks");
    own.done(press(0));
    drop(handler.areas().wait_until(|areas| areas[LOCAL_IO].input.uni[2] == 1, LIMIT).unwrap());
    // The button of another pupil is not pressed.
    let others = all.state(0, |_| true);
    assert_eq!(others["world"]["boards"][0]["inputs"][2]["value"], 0.0);
    handler.end_transfer().unwrap();
}

#[test]
fn a_link_that_is_nearly_right_lets_nobody_in() {
    let classroom = Classroom::start(1);
    let (address, token) = &classroom.pupils[0].1;
    assert_ne!(*token, classroom.all.1);
    let wrong = page::request(address, &token[1..]);
    assert_eq!(Page::connect(address, wrong).err(), Some(403));
}

#[test]
fn a_number_of_pupils_for_whom_there_are_no_ports_is_a_sentence() {
    let mut command = Command::new(env!("CARGO_BIN_EXE_txt"));
    command.args(["classroom", "60", "--port", "65400"]).stdin(Stdio::null());
    let output = command.output().unwrap();
    assert_eq!(output.status.code(), Some(1));
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(said.contains("--port"), "{said}");
}
