//! `txt simulate --show`: a page that looks at what another program drives.

use std::process::{Command, Stdio};

use ft_transfer_area::transfer_area::LOCAL_IO;
use ft_transfer_area::TransferAreaComHandler;
use serde_json::{json, Value};

use super::http::post_stop;
use super::page::{is_running, Page};
use super::program::Panel;
use crate::running::Running;

/// A simulated TXT with this world, its page, and the address of its main port.
fn simulate(world: &str) -> (Panel, Page, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_txt"));
    command.args(["simulate", "--port", "0", "--world", world, "--show", "--no-browser"]);
    let running = Running::start(command.stdin(Stdio::null()));
    let address = running.line().strip_prefix("main ").unwrap().to_owned();
    let [_camera, _i2c, url] = [(); 3].map(|()| running.line());
    let page = url.strip_prefix("page http://").and_then(|rest| rest.split_once("/?token="));
    let (page, token) = page.unwrap_or_else(|| panic!("{url:?} is not the address of a page"));
    let panel = Panel { running, address: page.to_owned(), token: token.to_owned() };
    let page = panel.page();
    (panel, page, address)
}

fn slide(state: &Value) -> f64 {
    state["world"]["boards"][0]["motors"][0]["slide"].as_f64().unwrap()
}

#[test]
fn the_page_shows_what_a_program_drives_and_presses_buttons_for_it() {
    let (_panel, mut page, address) = simulate("slide");
    let begin = page.state(0, |_| true);
    assert_eq!((is_running(&begin), slide(&begin)), (false, 0.5));

    let handler = TransferAreaComHandler::builder(&*address).build().unwrap();
    handler.begin_transfer().unwrap();
    handler.areas().lock()[LOCAL_IO].output.duty[0] = 300;
    let state = page.state(0, |state| is_running(state) && slide(state) > 0.6);
    assert_eq!(state["areas"][0]["motors"][0]["duty"][0], 300);
    assert_eq!(state["driver"], Value::Null);

    page.done(json!({"do": "press", "input": 2, "pressed": true}));
    drop(
        handler
            .areas()
            .wait_until(|areas| areas[LOCAL_IO].input.uni[2] == 1, super::LIMIT)
            .unwrap(),
    );
    handler.end_transfer().unwrap();
    page.state(0, |state| !is_running(state) && state["areas"][0]["motors"][0]["duty"][0] == 0);
}

/// As on a laptop and a phone.
#[test]
fn a_button_that_two_pages_press_is_let_go_by_the_last_one() {
    let (panel, mut first, _) = simulate("slide");
    let [mut second, mut third] = [panel.page(), panel.page()];
    let press = |pressed| json!({"do": "press", "input": 2, "pressed": pressed});
    let is_pressed = |state: &Value| {
        let inputs = state["world"]["boards"][0]["inputs"].as_array().unwrap();
        inputs.iter().any(|input| input["input"] == 2 && input["value"] == 1.0)
    };
    for page in [&mut first, &mut second, &mut third] {
        page.done(press(true));
    }
    second.done(press(false));
    first.close(true);
    for _ in 0..10 {
        assert!(is_pressed(&third.state(0, |_| true)));
    }
    third.done(press(false));
    third.state(0, |state| !is_pressed(state));
}

#[test]
fn the_page_drives_nothing() {
    let (panel, mut page, address) = simulate("slide");
    let handler = TransferAreaComHandler::builder(&*address).build().unwrap();
    handler.begin_transfer().unwrap();
    page.state(0, is_running);
    let motor = json!({"do": "motor", "motor": 0, "duty": 512});
    page.done(json!({"do": "drive"}));
    assert_eq!(page.refused(motor), "only_looks");
    handler.areas().lock()[LOCAL_IO].output.duty[6] = 512;
    page.state(0, |state| state["areas"][0]["motors"][3]["duty"][0] == 512);
    // Neither its stop nor its end stops the program's motors, and the stop says so.
    assert_eq!(page.refused(json!({"do": "stop"})), "only_looks");
    assert_eq!(post_stop(&panel, &panel.token, ""), 409);
    page.close(true);
    for _ in 0..5 {
        assert_eq!(handler.areas().wait_cycle().unwrap()[LOCAL_IO].output.duty[6], 512);
    }
}

#[test]
fn workpieces_are_shown_put_and_taken_away() {
    let (_panel, mut page, address) = simulate("sorting_line");
    let floor = |state: &Value| state["world"]["floor"].clone();
    let begin = floor(&page.state(0, |_| true));
    assert_eq!(begin["belts"][0]["motor"], "M1");
    let names: Vec<_> =
        begin["places"].as_array().unwrap().iter().map(|place| place["name"].clone()).collect();
    assert!(names.contains(&json!("red_storage")), "{names:?}");

    // The belt carries it only while a program drives.
    page.done(json!({"do": "put", "piece": "blue", "place": "entry"}));
    let blue = |state: &Value| floor(state)["belts"][0]["pieces"][0].clone();
    let put = blue(&page.state(0, |state| blue(state)["piece"] == "blue"))["mm"].as_f64().unwrap();
    assert_eq!(page.refused(json!({"do": "put", "piece": "red", "place": "entry"})), "no_room");
    assert_eq!(
        page.refused(json!({"do": "put", "piece": "green", "place": "entry"})),
        "bad_message"
    );
    let handler = TransferAreaComHandler::builder(&*address).build().unwrap();
    handler.begin_transfer().unwrap();
    handler.areas().lock()[LOCAL_IO].output.duty[1] = 512;
    page.state(0, |state| blue(state)["mm"].as_f64().is_some_and(|mm| mm > put + 10.0));
    // An ejector is on with its compressor.
    let is_on = |state: &Value| floor(state)["drawing"]["ejectors"][1]["on"] == true;
    assert!(!is_on(&page.state(0, |_| true)));
    handler.areas().lock()[LOCAL_IO].output.duty[5] = 512;
    handler.areas().lock()[LOCAL_IO].output.duty[7] = 512;
    page.state(0, is_on);
    handler.end_transfer().unwrap();

    page.done(json!({"do": "put", "piece": "white", "place": "red_storage"}));
    page.done(json!({"do": "take_away", "place": "red_storage"}));
    assert_eq!(page.refused(json!({"do": "take_away", "place": "red_storage"})), "no_piece");
}
