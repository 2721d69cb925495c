//! What a page can order, and what arrives at the controller.

use ft_transfer_area_simulator::{Machine, SimulatedTxt};
use serde_json::{json, Value};

use super::program::Panel;
use super::LIMIT;

#[test]
fn terminals_change_their_mode_in_place() {
    let txt = SimulatedTxt::builder().extensions(1).start().unwrap();
    txt.with_machine(|machine| machine.controllers[1].uni[2] = 77);
    let panel = Panel::of(&[&txt]);
    let mut page = panel.driver();
    for (mode, number, unit) in [
        ("voltage", 0, "mV"),
        ("resistance", 1, "Ω"),
        ("resistance15k", 2, "Ω"),
        ("ultrasonic", 3, "cm"),
    ] {
        page.done(json!({"do": "uni", "area": 1, "input": 2, "mode": mode, "digital": false}));
        let configured = |uni: &ft_transfer_area::transfer_area::UniConfig| {
            (uni.mode, uni.digital) == (number, 0)
        };
        assert!(txt.wait_until(|machine| configured(&machine.controllers[1].config.uni[2]), LIMIT));
        let input =
            json!({"mode": mode, "digital": false, "value": 77, "unit": unit, "overrun": false});
        page.state(0, |state| state["areas"][1]["inputs"][2] == input);
    }
    page.done(json!({"do": "counter_mode", "counter": 3, "mode": "inverted"}));
    assert!(txt.wait_until(|machine| machine.controllers[0].config.cnt[3].mode == 0, LIMIT));
    page.state(0, |state| state["areas"][0]["counters"][3]["mode"] == "inverted");
}

#[test]
fn a_counter_is_reset() {
    let txt = SimulatedTxt::builder().start().unwrap();
    txt.with_machine(|machine| machine.controllers[0].counter[1] = 123);
    let panel = Panel::of(&[&txt]);
    let mut page = panel.driver();
    page.state(0, |state| state["areas"][0]["counters"][1]["value"] == 123);
    page.done(json!({"do": "reset_counter", "counter": 1}));
    assert!(txt.wait_until(|machine| machine.controllers[0].counter[1] == 0, LIMIT));
    page.state(0, |state| {
        let counter = &state["areas"][0]["counters"][1];
        counter["value"] == 0 && counter["resetting"] == false
    });
}

#[test]
fn a_pair_becomes_two_outputs_and_a_motor_again() {
    let txt = SimulatedTxt::builder().start().unwrap();
    let panel = Panel::of(&[&txt]);
    let mut page = panel.driver();
    assert_eq!(page.refused(json!({"do": "output", "output": 7, "duty": 200})), "not_an_output");
    page.done(json!({"do": "motor_kind", "motor": 3, "outputs": true}));
    page.done(json!({"do": "output", "output": 7, "duty": 200}));
    assert!(txt.wait_until(
        |machine| {
            let one = &machine.controllers[0];
            one.config.motor == [1, 1, 1, 0] && one.outputs.duty[7] == 200
        },
        LIMIT
    ));
    page.state(0, |state| state["areas"][0]["motors"][3]["outputs"] == true);
    assert_eq!(page.refused(json!({"do": "motor", "motor": 3, "duty": 1})), "not_a_motor");
    page.done(json!({"do": "motor_kind", "motor": 3, "outputs": false}));
    assert!(txt.wait_until(
        |machine| {
            let one = &machine.controllers[0];
            one.config.motor == [1; 4] && one.outputs.duty == [0; 8]
        },
        LIMIT
    ));
}

#[test]
fn a_distance_is_driven_with_progress_and_plain_speed_follows() {
    let txt = SimulatedTxt::builder().start().unwrap();
    let panel = Panel::of(&[&txt]);
    let mut page = panel.driver();
    let go = json!({"do": "distance", "motor": 0, "duty": -512, "pulses": 100, "with": 1, "opposite": true});
    page.done(go);
    let motor = |state: &Value, index: usize| state["areas"][0]["motors"][index].clone();
    let under_way = page.state(0, |state| {
        let done = motor(state, 0)["done"].as_u64();
        done > Some(0) && done < Some(100)
    });
    assert_eq!(motor(&under_way, 0)["ready"], false);
    assert_eq!(
        (&motor(&under_way, 1)["with"], &motor(&under_way, 1)["duty"]),
        (&json!(0), &json!([512, 0]))
    );
    let arrived =
        page.state(0, |state| motor(state, 0)["ready"] == true && motor(state, 1)["ready"] == true);
    assert_eq!(motor(&arrived, 0)["distance"], 100);
    page.state(0, |state| motor(state, 1)["done"].as_u64() >= Some(100));
    page.done(json!({"do": "motor", "motor": 0, "duty": 512}));
    assert!(txt.wait_until(
        |machine| {
            let one = &machine.controllers[0];
            one.outputs.distance == [0; 4] && one.counter[0] > 150
        },
        LIMIT
    ));
    // Nothing of all this was what a correct client does not do.
    txt.with_machine(|machine| assert_eq!(machine.oddities().collect::<Vec<_>>(), [""; 0]));
}

#[test]
fn a_sound_plays() {
    let txt = SimulatedTxt::builder().start().unwrap();
    let panel = Panel::of(&[&txt]);
    let mut page = panel.driver();
    page.done(json!({"do": "sound", "index": 3, "repeat": 0}));
    assert!(txt.wait_until(
        |machine| {
            let one = &machine.controllers[0];
            one.playing_sound().is_some() && one.outputs.sound_index == 3
        },
        LIMIT
    ));
    page.state(0, |state| {
        state["areas"][0]["sound"] == json!({"index": 3, "repeat": 0, "playing": true})
    });
    page.done(json!({"do": "sound", "index": 0, "repeat": 1}));
    page.state(0, |state| state["areas"][0]["sound"]["playing"] == false);
}

#[test]
fn a_stop_ends_a_sound_too() {
    let txt = SimulatedTxt::builder().start().unwrap();
    let panel = Panel::of(&[&txt]);
    let mut page = panel.driver();
    let plays = |machine: &Machine| machine.controllers[0].playing_sound().is_some();
    page.done(json!({"do": "sound", "index": 3, "repeat": 200}));
    assert!(txt.wait_until(plays, LIMIT));
    page.done(json!({"do": "stop"}));
    assert!(txt.wait_until(|machine| !plays(machine), LIMIT), "it plays on");
}

#[test]
fn what_is_wrong_is_told_in_a_sentence_and_stops_the_motors_of_the_driver() {
    let txt = SimulatedTxt::builder().start().unwrap();
    let panel = Panel::of(&[&txt]);
    let (mut page, mut looks) = (panel.driver(), panel.page());
    let turns =
        |duty| txt.wait_until(|machine| machine.controllers[0].outputs.duty[0] == duty, LIMIT);
    for (wrong, code) in [
        (json!({"do": "motor", "motor": 1, "duty": 513}), "out_of_range"),
        (json!({"do": "motor", "motor": 4, "duty": 1}), "out_of_range"),
        (json!({"do": "motor", "area": 9, "motor": 1, "duty": 1}), "out_of_range"),
        (json!({"do": "distance", "motor": 1, "duty": 1, "pulses": 0}), "zero_pulses"),
        (json!({"do": "distance", "motor": 1, "duty": 1, "pulses": 5, "with": 1}), "motor_twice"),
        (json!({"do": "sound", "index": 100, "repeat": 1}), "out_of_range"),
        (json!({"do": "fly"}), "bad_message"),
        (json!({"do": "motor", "motor": "M1", "duty": 1}), "bad_message"),
    ] {
        page.done(json!({"do": "drive"}));
        page.done(json!({"do": "motor", "motor": 0, "duty": 400}));
        assert!(turns(400));
        assert_eq!(page.refused(wrong.clone()), code, "{wrong}");
        assert!(turns(0), "{wrong}");
    }
    page.done(json!({"do": "drive"}));
    page.done(json!({"do": "motor", "motor": 0, "duty": 400}));
    for garbage in ["", "{", "\u{0}\u{1}", "[[[[", "{\"do\":7}", "null"] {
        looks.send(garbage);
        assert_eq!(looks.next_error(), "bad_message", "{garbage:?}");
        // It still drives, and shows that it is there.
        page.done(json!({"do": "motor", "motor": 0, "duty": 400}));
    }
    assert_eq!(page.refused(json!({"do": "motor", "host": 7, "motor": 0, "duty": 1})), "no_host");
    assert!(turns(400), "a page that only looks can't stop a motor by garbage");
    page.send_bytes(vec![0xFF; 100]);
    assert_eq!(page.next_error(), "bad_message");
    assert!(turns(0));
}
