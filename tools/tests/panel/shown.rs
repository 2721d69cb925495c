//! `txt simulate --show`: a page that looks at what another program drives.

use std::process::{Command, Stdio};

use ft_transfer_area::transfer_area::LOCAL_IO;
use ft_transfer_area::TransferAreaComHandler;
use serde_json::{json, Value};

use crate::page::{is_running, Page};
use crate::running::Running;

/// A simulated TXT with the slide, its page, and the address of its main port.
fn simulate() -> (Running, Page, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_txt"));
    command.args(["simulate", "--port", "0", "--world", "slide", "--show", "--no-browser"]);
    let running = Running::start(command.stdin(Stdio::null()));
    let address = running.line().strip_prefix("main ").unwrap().to_owned();
    let [_camera, _i2c, url] = [(); 3].map(|()| running.line());
    let page = url.strip_prefix("page http://").and_then(|rest| rest.split_once("/?token="));
    let (page, token) = page.unwrap_or_else(|| panic!("{url:?} is no address of a page"));
    (running, Page::open(page, token), address)
}

fn slide(state: &Value) -> f64 {
    state["world"]["boards"][0]["motors"][0]["slide"].as_f64().unwrap()
}

#[test]
fn the_page_shows_what_a_program_drives_and_presses_buttons_for_it() {
    let (_running, mut page, address) = simulate();
    let begin = page.state(0, |_| true);
    assert_eq!((is_running(&begin), slide(&begin)), (false, 0.5));

    let handler = TransferAreaComHandler::builder(&*address).build().unwrap();
    handler.begin_transfer().unwrap();
    handler.lock()[LOCAL_IO].output.duty[0] = 300;
    let state = page.state(0, |state| is_running(state) && slide(state) > 0.6);
    assert_eq!(state["areas"][0]["motors"][0]["duty"][0], 300);
    assert_eq!(state["driver"], Value::Null);

    page.done(json!({"do": "press", "input": 2, "pressed": true}));
    drop(handler.wait_until(|areas| areas[LOCAL_IO].input.uni[2] == 1, crate::LIMIT).unwrap());
    handler.end_transfer().unwrap();
    page.state(0, |state| !is_running(state) && state["areas"][0]["motors"][0]["duty"][0] == 0);
}

#[test]
fn the_page_drives_nothing() {
    let (_running, mut page, address) = simulate();
    let handler = TransferAreaComHandler::builder(&*address).build().unwrap();
    handler.begin_transfer().unwrap();
    page.state(0, is_running);
    let motor = json!({"do": "motor", "motor": 0, "duty": 512});
    page.done(json!({"do": "drive"}));
    assert_eq!(page.refused(motor), "not_driven");
    handler.lock()[LOCAL_IO].output.duty[6] = 512;
    page.state(0, |state| state["areas"][0]["motors"][3]["duty"][0] == 512);
    // Neither its stop nor its end stops the program's motors.
    page.done(json!({"do": "stop"}));
    page.close(true);
    for _ in 0..5 {
        assert_eq!(handler.wait_cycle().unwrap()[LOCAL_IO].output.duty[6], 512);
    }
}
