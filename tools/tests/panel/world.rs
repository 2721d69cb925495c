//! The world of a simulated TXT that the program starts itself.

use serde_json::{json, Value};

use super::page::is_running;
use super::program::Panel;

fn sensor(state: &Value, area: usize, input: usize) -> Value {
    let inputs = state["world"]["boards"][area]["inputs"].as_array().unwrap();
    inputs.iter().find(|one| one["input"] == input).cloned().unwrap_or_default()
}

#[test]
fn a_page_that_is_gone_holds_no_button() {
    let panel = Panel::start(&[]);
    let mut page = panel.driver();
    page.done(json!({"do": "press", "input": 0, "pressed": true}));
    let remote = json!({"do": "remote", "remote": 0, "left_x": 0, "left_y": 15, "right_x": 0, "right_y": 0,
        "on": false, "off": false});
    page.done(remote);
    page.state(0, |state| state["areas"][0]["inputs"][0]["value"] == 1);
    page.state(0, |state| state["world"]["remotes"][0]["left_y"] == 15);
    drop(page);
    let mut page = panel.page();
    page.state(0, |state| state["areas"][0]["inputs"][0]["value"] == 0);
    page.state(0, |state| state["world"]["remotes"][0]["left_y"] == 0);
}

#[test]
fn buttons_sensors_and_remotes_are_moved_by_hand() {
    let panel = Panel::start(&[]);
    let mut page = panel.driver();
    assert_eq!(page.state(0, |_| true)["areas"].as_array().unwrap().len(), 2);
    page.done(json!({"do": "press", "input": 0, "pressed": true}));
    let state = page.state(0, |state| state["areas"][0]["inputs"][0]["value"] == 1);
    assert_eq!(sensor(&state, 0, 0)["kind"], "button");
    page.done(json!({"do": "press", "input": 0, "pressed": false}));
    page.state(0, |state| state["areas"][0]["inputs"][0]["value"] == 0);

    // What is plugged in is configured from the start.
    let ultrasonic = page.state(0, |_| true)["areas"][1]["inputs"][1].clone();
    assert_eq!(
        (&ultrasonic["mode"], &ultrasonic["digital"]),
        (&json!("ultrasonic"), &json!(false))
    );
    page.done(json!({"do": "sensor", "area": 1, "input": 1, "value": 123}));
    let state = page.state(0, |state| state["areas"][1]["inputs"][1]["value"] == 123);
    let wanted = json!({"input": 1, "kind": "ultrasonic", "value": 123.0, "min": 0.0, "max": 1024.0, "unit": "cm", "moved_by": null, "place": null});
    assert_eq!(sensor(&state, 1, 1), wanted);

    let remote = json!({"do": "remote", "remote": 0, "left_x": -15, "left_y": 0, "right_x": 0, "right_y": 7,
        "on": true, "off": false});
    page.done(remote);
    let state = page.state(0, |state| state["areas"][0]["remotes"][2]["left_x"] == -15);
    assert_eq!(state["areas"][0]["remotes"][0]["right_y"], 7);
    assert_eq!(state["world"]["remotes"][0]["left_x"], -15);
}

#[test]
fn what_is_not_there_can_not_be_moved() {
    let panel = Panel::start(&[]);
    let mut page = panel.driver();
    for (command, code) in [
        (json!({"do": "press", "input": 1, "pressed": true}), "no_button"),
        (json!({"do": "press", "input": 8, "pressed": true}), "out_of_range"),
        (json!({"do": "press", "area": 5, "input": 0, "pressed": true}), "no_button"),
        (json!({"do": "sensor", "input": 7, "value": 1}), "no_sensor"),
        (json!({"do": "sensor", "input": 1, "value": -1}), "out_of_range"),
        (json!({"do": "sensor", "input": 1, "value": 1025}), "out_of_range"),
        (json!({"do": "plug", "area": 0, "alive": false}), "no_extension"),
        (json!({"do": "plug", "area": 2, "alive": true}), "no_extension"),
        (
            json!({"do": "remote", "remote": 1, "left_x": 0, "left_y": 0, "right_x": 0, "right_y": 0,
            "on": false, "off": false}),
            "no_remote",
        ),
    ] {
        assert_eq!(page.refused(command.clone()), code, "{command}");
    }
}

#[test]
fn an_extension_is_unplugged_and_plugged_in_again() {
    let panel = Panel::start(&["--extensions", "3"]);
    let mut page = panel.driver();
    page.state(0, |state| state["areas"][3]["alive"] == true);
    let duty = |state: &Value| state["areas"][3]["motors"][0]["duty"][0].clone();
    page.done(json!({"do": "motor", "area": 3, "motor": 0, "duty": 300}));
    page.state(0, |state| duty(state) == 300);
    page.done(json!({"do": "plug", "area": 3, "alive": false}));
    let state = page.state(0, |state| state["areas"][3]["alive"] == false);
    assert_eq!(state["world"]["boards"][3]["alive"], false);
    assert_eq!(state["areas"][2]["alive"], true);
    assert_eq!(duty(&state), 0);
    // Nothing that was ordered before it is back turns then.
    assert_eq!(page.refused(json!({"do": "motor", "area": 3, "motor": 0, "duty": 512})), "absent");
    page.done(json!({"do": "plug", "area": 3, "alive": true}));
    let state = page.state(0, |state| state["areas"][3]["alive"] == true);
    assert_eq!(duty(&state), 0);
    page.done(json!({"do": "motor", "area": 3, "motor": 0, "duty": 100}));
}

/// A short slide, and a lamp.
const WORLD: &str = r#"
[master]
lamps = { O7 = "green" }
[master.inputs]
I5 = { switch = {} }
[master.motors.M3]
pulses_per_turn = 63.3
[master.motors.M3.slide]
travel = { pulses = 80 }
end_switch = "I5"
"#;

#[test]
fn the_slide_of_a_file_moves_to_its_switch_and_lamps_glow() {
    let file = tempfile::Builder::new().suffix(".toml").tempfile().unwrap();
    std::fs::write(file.path(), WORLD).unwrap();
    let panel = Panel::start(&["--world", file.path().to_str().unwrap()]);
    let mut page = panel.driver();
    page.done(json!({"do": "motor", "motor": 2, "duty": 512}));
    let slide = |state: &Value| state["world"]["boards"][0]["motors"][0].clone();
    let state = page.state(0, |state| slide(state)["speed"].as_f64() > Some(0.0));
    assert_eq!(slide(&state)["motor"], 2);
    assert!((0.0..1.0).contains(&slide(&state)["slide"].as_f64().unwrap()), "{state}");
    let state = page.state(0, |state| state["areas"][0]["inputs"][4]["value"] == 1);
    assert!(slide(&state)["slide"].as_f64() > Some(0.9), "{state}");
    assert_eq!(sensor(&state, 0, 4)["moved_by"], 2);
    // A pair with a lamp is two outputs from the start.
    page.done(json!({"do": "output", "output": 6, "duty": 256}));
    page.state(0, |state| {
        state["world"]["boards"][0]["lamps"][0]
            == json!({"output": 6, "glow": 0.5, "colour": "green"})
    });
}

#[test]
fn a_controller_without_a_world_has_none() {
    let panel = Panel::start(&["--world", "none"]);
    let mut page = panel.driver();
    assert!(page.state(0, is_running)["world"].is_null());
    assert_eq!(page.refused(json!({"do": "press", "input": 0, "pressed": true})), "no_world");
}

#[test]
fn a_real_controller_has_no_world() {
    let txt = ft_transfer_area_simulator::SimulatedTxt::builder().start().unwrap();
    let panel = Panel::of(&[&txt]);
    let mut page = panel.driver();
    assert_eq!(page.refused(json!({"do": "press", "input": 0, "pressed": true})), "not_simulated");
}
