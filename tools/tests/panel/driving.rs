//! Who may drive, and what stops the motors.

use ft_transfer_area_simulator::{Fault, FaultKind, SimulatedTxt};
use serde_json::json;

use super::http::post_stop;
use super::page::Page;
use super::program::Panel;
use super::LIMIT;

/// Turns M1 ahead, and waits until the controller has got it.
fn turn(page: &mut Page, txt: &SimulatedTxt) {
    page.done(json!({"do": "motor", "motor": 0, "duty": 512}));
    wait_for_duty(txt, 512);
}

fn wait_for_duty(txt: &SimulatedTxt, duty: i16) {
    let arrived = txt.wait_until(|machine| machine.controllers[0].outputs.duty[0] == duty, LIMIT);
    assert!(arrived, "the controller did not get duty {duty}");
}

fn wait_for_stop(txt: &SimulatedTxt) {
    let stopped = |outputs: &ft_transfer_area::wire::ExchangeData| outputs.duty == [0; 8];
    assert!(
        txt.wait_until(
            |machine| machine.controllers.iter().all(|one| stopped(&one.outputs)),
            LIMIT
        ),
        "the motors still run"
    );
}

#[test]
fn a_page_turns_a_motor_and_stops_it() {
    let txt = SimulatedTxt::builder().extensions(1).start().unwrap();
    let panel = Panel::of(&[&txt]);
    let mut page = panel.driver();
    turn(&mut page, &txt);
    page.done(json!({"do": "motor", "area": 1, "motor": 3, "duty": -300}));
    let state = page.state(0, |state| state["areas"][1]["motors"][3]["duty"] == json!([0, 300]));
    assert_eq!((&state["you_drive"], &state["driver"]), (&json!(true), &json!(page.number)));
    assert!(txt.wait_until(|machine| machine.controllers[0].counter[0] > 0, LIMIT));
    assert!(txt.wait_until(|machine| machine.controllers[1].outputs.duty[7] == 300, LIMIT));
    page.done(json!({"do": "stop"}));
    wait_for_stop(&txt);
    // What was on its way before the stop has no effect after it, so the page takes control again.
    assert_eq!(page.refused(json!({"do": "motor", "motor": 0, "duty": 9})), "not_driving");
    page.done(json!({"do": "drive"}));
    turn(&mut page, &txt);
}

#[test]
fn a_command_from_before_a_gap_moves_nothing_after_it() {
    let txt = SimulatedTxt::builder().start().unwrap();
    let panel = Panel::of(&[&txt]);
    let mut page = panel.driver();
    let silent = txt.with_machine(|machine| {
        machine.disturb(FaultKind::Silence);
        machine.exchanges() + 1
    });
    assert!(txt.wait_until(|machine| machine.exchanges() == silent, LIMIT));
    // It waits for a response, which is that of the next connection.
    page.ask(json!({"do": "motor", "motor": 0, "duty": 300}));
    page.state(0, |state| state["link"]["gaps"] == 1 && state["link"]["phase"] == "running");
    assert!(txt.wait_until(|machine| machine.exchanges() > silent + 20, LIMIT));
    txt.with_machine(|machine| assert_eq!(machine.controllers[0].outputs.duty, [0; 8]));
}

#[test]
fn only_one_page_drives_and_the_others_look() {
    let txt = SimulatedTxt::builder().start().unwrap();
    let panel = Panel::of(&[&txt]);
    let mut looks = panel.page();
    assert_eq!(looks.refused(json!({"do": "motor", "motor": 0, "duty": 9})), "not_driving");
    let mut drives = panel.driver();
    turn(&mut drives, &txt);
    assert_eq!(looks.refused(json!({"do": "drive"})), "taken");
    for command in [
        json!({"do": "motor", "motor": 0, "duty": 9}),
        json!({"do": "uni", "input": 0, "mode": "voltage", "digital": false}),
        json!({"do": "i2c_scan"}),
        json!({"do": "camera", "on": true}),
    ] {
        assert_eq!(looks.refused(command), "not_driving");
    }
    let state = looks.state(0, |state| state["areas"][0]["motors"][0]["duty"][0] == 512);
    assert_eq!((&state["you_drive"], &state["driver"]), (&json!(false), &json!(drives.number)));
    wait_for_duty(&txt, 512);
}

#[test]
fn another_page_takes_the_wheel_with_all_motors_off() {
    let txt = SimulatedTxt::builder().start().unwrap();
    let panel = Panel::of(&[&txt]);
    let (mut first, mut second) = (panel.driver(), panel.page());
    turn(&mut first, &txt);
    second.done(json!({"do": "take"}));
    wait_for_stop(&txt);
    let number = second.number;
    first.state(0, |state| state["driver"] == number && state["you_drive"] == false);
    assert_eq!(first.refused(json!({"do": "motor", "motor": 0, "duty": 9})), "not_driving");
    turn(&mut second, &txt);
    second.done(json!({"do": "release"}));
    wait_for_stop(&txt);
    first.state(0, |state| state["driver"].is_null());
    first.done(json!({"do": "drive"}));
    turn(&mut first, &txt);
}

#[test]
fn a_page_that_closes_stops_the_motors() {
    let txt = SimulatedTxt::builder().start().unwrap();
    let panel = Panel::of(&[&txt]);
    for politely in [true, false] {
        let mut page = panel.driver();
        turn(&mut page, &txt);
        page.close(politely);
        wait_for_stop(&txt);
    }
}

#[test]
fn a_driving_page_that_is_silent_stops_the_motors_and_drives_no_more() {
    let txt = SimulatedTxt::builder().start().unwrap();
    let panel = Panel::of(&[&txt]);
    let (mut page, mut looks) = (panel.driver(), panel.page());
    turn(&mut page, &txt);
    looks.fall_silent();
    page.fall_silent();
    wait_for_stop(&txt);
    page.state(0, |state| state["freed"] == "silent" && state["driver"].is_null());
    // A page that only looks may be silent.
    looks.state(0, |state| state["driver"].is_null());
    assert_eq!(page.refused(json!({"do": "motor", "motor": 0, "duty": 9})), "not_driving");
    page.done(json!({"do": "drive"}));
    turn(&mut page, &txt);
}

#[test]
fn any_page_stops_all_controllers() {
    let txts = [(); 2].map(|()| SimulatedTxt::builder().start().unwrap());
    let panel = Panel::of(&[&txts[0], &txts[1]]);
    let (mut drives, mut looks) = (panel.driver(), panel.page());
    drives.state(1, super::page::is_running);
    let turn_all = |page: &mut Page| {
        for (host, txt) in txts.iter().enumerate() {
            page.done(json!({"do": "motor", "host": host, "motor": 0, "duty": 512}));
            wait_for_duty(txt, 512);
        }
    };
    turn_all(&mut drives);
    looks.done(json!({"do": "stop"}));
    drives.state(0, |state| state["freed"] == "stop" && state["driver"].is_null());
    txts.iter().for_each(wait_for_stop);
    drives.done(json!({"do": "drive"}));
    turn_all(&mut drives);
    assert_eq!(post_stop(&panel, &panel.token, ""), 204);
    txts.iter().for_each(wait_for_stop);
}

#[test]
fn a_stop_reaches_the_others_while_one_controller_hangs() {
    let silence = Fault::at_exchange(150, FaultKind::Silence);
    let hangs = SimulatedTxt::builder().fault(silence).start().unwrap();
    let txt = SimulatedTxt::builder().start().unwrap();
    let panel = Panel::of(&[&hangs, &txt]);
    let mut page = panel.driver();
    page.state(1, super::page::is_running);
    page.done(json!({"do": "motor", "host": 1, "motor": 0, "duty": 512}));
    wait_for_duty(&txt, 512);
    assert!(hangs.wait_until(|machine| machine.exchanges() >= 150, LIMIT));
    assert_eq!(post_stop(&panel, &panel.token, ""), 204);
    wait_for_stop(&txt);
}
