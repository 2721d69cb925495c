//! What the bridge publishes.

use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::Arc;

use ft_transfer_area_simulator::world::World;
use ft_transfer_area_simulator::SimulatedTxt;
use serde_json::{json, Value};

use super::support::{is_state, wait_machine, Bridge, Broker, Listener};
use crate::names;
use crate::watch::away::{at_free_ports, started};

#[cfg_attr(not(unix), ignore = "the tests end the bridge by a signal")]
#[test]
fn inputs_and_counters_of_all_areas_are_topics_and_the_broker_keeps_them() {
    let Some(broker) = Broker::start() else { return };
    let txt = SimulatedTxt::builder().extensions(1).device_name("Press").start().unwrap();
    let host = txt.address().to_string();
    let folder = tempfile::tempdir().unwrap();
    let names = names::file(folder.path());
    let arguments =
        [&*host, "--name", "press", "--extensions", "1", "--every", "0", "--names", &names];
    let bridge = Bridge::start(broker.port, arguments);
    let early = Listener::new(&broker);
    let state = early.wait(0, "ft/press/state", is_state("online"));
    assert_eq!((&state["host"], &state["device"]), (&json!(host), &json!("Press")));
    let names = &state["names"];
    assert_eq!(
        (&names["O8"], &names["ext1/I2"]),
        (&json!("lamp"), &json!("button of the operator, at the door"))
    );
    early.wait(0, "ft/press/I1", |reported| *reported == json!({"value": 0}));
    txt.with_machine(|machine| {
        machine.controllers[0].uni[0] = 1;
        machine.controllers[1].uni[7] = 1;
        machine.controllers[0].counter[2] = -1;
        machine.controllers[1].ir[0].left_x = 9;
    });
    early.wait(0, "ft/press/I1", |reported| *reported == json!({"value": 1}));
    early.wait(0, "ft/press/ext1/I8", |reported| *reported == json!({"value": 1}));
    early.wait(0, "ft/press/C3", |reported| reported["count"] == 65_535);
    early.wait(0, "ft/press/ext1/remote/any", |reported| reported["left"]["x"] == 9);
    early.wait(0, "ft/press/extensions", |reported| reported["connected"][0] == true);
    early.send("ft/press/I2/mode", r#"{"mode": "ultrasonic", "digital": false}"#);
    early.wait(0, "ft/press/I2/config", |reported| reported["mode"] == "ultrasonic");
    wait_machine(&txt, "the mode", |machine| machine.controllers[0].config.uni[1].mode == 3);
    txt.with_machine(|machine| machine.controllers[0].uni[1] = 1024);
    let far = json!({"value": 1024, "unit": "cm", "over_range": true});
    early.wait(0, "ft/press/I2", |reported| *reported == far);
    // Somebody who comes later gets the newest value of each at once.
    let late = Listener::new(&broker);
    late.wait(0, "ft/press/I2", |_| true);
    assert_eq!(late.all("ft/press/I2"), [far]);
    drop(bridge);
}

/// The first one is killed, so it can't tidy up.
#[cfg_attr(not(unix), ignore = "the tests end the bridge by a signal")]
#[test]
fn what_an_earlier_bridge_has_left_is_removed() {
    let Some(broker) = Broker::start() else { return };
    let txts = [1, 0].map(|count| SimulatedTxt::builder().extensions(count).start().unwrap());
    let hosts = txts.each_ref().map(|txt| txt.address().to_string());
    let listener = Listener::new(&broker);
    listener.send_retained("ft/belt/O1", r#"{"duty": 5}"#);
    let arguments = [&*hosts[0], "--name", "press", "--extensions", "1"];
    let mut first = Bridge::start(broker.port, arguments);
    listener.wait(0, "ft/press/state", is_state("online"));
    listener.send("ft/press/M1/mode", r#"{"mode": "outputs"}"#);
    listener.wait(0, "ft/press/M1/config", |reported| reported["mode"] == "outputs");
    listener.send("ft/press/O1/set", r#"{"duty": 300}"#);
    listener.wait(0, "ft/press/O1", |reported| reported["duty"] == 300);
    listener.wait(0, "ft/press/ext1/M2", |reported| reported["duty"] == 0);
    first.kill();
    first.wait();
    listener.wait(0, "ft/press/state", is_state("gone"));
    let begin = listener.now();
    let _second = Bridge::start(broker.port, [&*hosts[1], "--name", "press"]);
    listener.wait(begin, "ft/press/M1/config", |reported| reported["mode"] == "motor");
    listener.wait(begin, "ft/press/ext1/M2", Value::is_null);
    listener.wait(begin, "ft/press/O1", Value::is_null);
    // The broker answers in order: what it has kept comes before this.
    let late = Listener::new(&broker);
    late.send("ft/end", "1");
    late.wait(0, "ft/end", |_| true);
    assert_eq!(late.all("ft/press/M1").len(), 1, "what there is stays");
    assert_eq!(late.all("ft/belt/O1").len(), 1, "it is of another one");
    assert_eq!(late.all("ft/press/O1"), [Value::Null; 0]);
    assert_eq!(late.all("ft/press/ext1/M2"), [Value::Null; 0]);
}

/// Who reads `online` takes the values that it has for those of this controller.
#[cfg_attr(not(unix), ignore = "the tests end the bridge by a signal")]
#[test]
fn online_comes_after_all_values_of_the_controller_that_answers() {
    let Some(broker) = Broker::start() else { return };
    let listener = Listener::new(&broker);
    let first = at_free_ports(|port| SimulatedTxt::builder().port(port).extensions(8));
    let (port, host) = (first.port(), first.address().to_string());
    first.with_machine(|machine| {
        machine.controllers[0].uni[0] = 1;
        machine.controllers[0].mic_lin = 700;
        machine.controllers[8].uni[7] = 1;
    });
    // Measured values would wait for an hour.
    let arguments = [&*host, "--name", "press", "--extensions", "8", "--every", "3600000"];
    let bridge = Bridge::start(broker.port, arguments);
    listener.wait(0, "ft/press/state", is_state("online"));
    let before = |from, topic: &str| {
        listener.before_state(from, "ft/press/state", is_state("online"), topic)
    };
    assert_eq!(before(0, "ft/press/ext8/I8"), Some(json!({"value": 1})));
    let from = listener.now();
    drop(first);
    listener.wait(from, "ft/press/state", is_state("gap"));
    let _second = started(|| SimulatedTxt::builder().port(port));
    listener.wait(from, "ft/press/state", is_state("online"));
    assert_eq!(before(from, "ft/press/I1"), Some(json!({"value": 0})));
    assert_eq!(before(from, "ft/press/microphone").unwrap()["linear"], 0);
    for area in 1..=8 {
        assert_eq!(before(from, &format!("ft/press/ext{area}/I8")), Some(Value::Null), "{area}");
    }
    drop(bridge);
}

#[cfg_attr(not(unix), ignore = "the tests end the bridge by a signal")]
#[test]
fn no_change_of_a_digital_input_is_lost() {
    const CHANGES: u32 = 100;
    let Some(broker) = Broker::start() else { return };
    let left = Arc::new(AtomicU32::new(0));
    let changes = Arc::clone(&left);
    // A change with each response: faster than anybody presses.
    let script = move |machine: &mut ft_transfer_area_simulator::Machine| {
        let count = |left: u32| left.checked_sub(1);
        if changes.fetch_update(Ordering::Relaxed, Ordering::Relaxed, count).is_ok() {
            machine.controllers[0].uni[3] ^= 1;
        }
    };
    let txt = SimulatedTxt::builder().on_exchange(script).start().unwrap();
    let host = txt.address().to_string();
    let _bridge = Bridge::start(broker.port, [&*host, "--name", "press"]);
    let listener = Listener::new(&broker);
    listener.wait(0, "ft/press/I4", |_| true);
    left.store(CHANGES, Ordering::Relaxed);
    wait_machine(&txt, "all changes", |_| left.load(Ordering::Relaxed) == 0);
    let end = listener.now();
    txt.with_machine(|machine| machine.controllers[0].uni[4] = 1);
    listener.wait(end, "ft/press/I5", |reported| reported["value"] == 1);
    let reported = listener.all("ft/press/I4");
    // The first one is the value at the beginning.
    let expected: Vec<_> = (0..=CHANGES).map(|change| json!({"value": change % 2})).collect();
    assert_eq!(reported, expected);
}

#[cfg_attr(not(unix), ignore = "the tests end the bridge by a signal")]
#[test]
fn a_motor_that_is_blocked_is_an_event_if_it_has_an_encoder() {
    let Some(broker) = Broker::start() else { return };
    let txt = SimulatedTxt::builder().world(World::shipped("slide").unwrap()).start().unwrap();
    let host = txt.address().to_string();
    let limits = ["--master-limit", "0", "--stall-limit", "200"];
    let arguments = [&[&*host, "--name", "press"], &limits[..]].concat();
    let _bridge = Bridge::start(broker.port, arguments);
    let listener = Listener::new(&broker);
    listener.wait(0, "ft/press/state", is_state("online"));
    // Nothing is at M2. M1 drives the slide to its end, which takes more than a second.
    listener.send("ft/press/M2/set", r#"{"duty": 512}"#);
    listener.send("ft/press/M1/set", r#"{"duty": 512}"#);
    let stalled = |reported: &Value| reported["event"] == "motor_stalled";
    listener.wait(0, "ft/press/event", stalled);
    let event = &listener.all("ft/press/event")[0];
    assert_eq!((&event["event"], &event["motor"]), (&json!("motor_stalled"), &json!("M1")));
    assert!(event["position"].as_u64() > Some(0), "{event}");
}

#[cfg_attr(not(unix), ignore = "the tests end the bridge by a signal")]
#[test]
fn one_program_serves_several_controllers_and_several_programs_one_broker() {
    let Some(broker) = Broker::start() else { return };
    let txts = [(); 3].map(|()| SimulatedTxt::builder().start().unwrap());
    let hosts = txts.each_ref().map(|txt| txt.address().to_string());
    let two = [&*hosts[0], &*hosts[1], "--name", "a", "--name", "b"];
    let _bridges = [Bridge::start(broker.port, two), Bridge::start(broker.port, [&*hosts[2]])];
    let listener = Listener::new(&broker);
    for (index, name) in ["a", "b", &hosts[2]].into_iter().enumerate() {
        listener.wait(0, &format!("ft/{name}/state"), is_state("online"));
        listener.send(&format!("ft/{name}/M1/set"), format!(r#"{{"duty": {}}}"#, 100 + index));
    }
    for (txt, duty) in txts.iter().zip(100..) {
        wait_machine(txt, "its own duty", |machine| super::support::m1(machine) == duty);
    }
    // One command stops all.
    listener.send("ft/stop", "");
    for txt in &txts {
        wait_machine(txt, "stopped", |machine| super::support::m1(machine) == 0);
    }
}

#[cfg_attr(not(unix), ignore = "the tests end the bridge by a signal")]
#[test]
fn two_bridges_of_one_name_are_told() {
    let Some(broker) = Broker::start() else { return };
    let txts = [(); 2].map(|()| SimulatedTxt::builder().start().unwrap());
    let hosts = txts.each_ref().map(|txt| txt.address().to_string());
    let listener = Listener::new(&broker);
    let first = Bridge::start(broker.port, [&*hosts[0], "--name", "press"]);
    listener.wait(0, "ft/press/state", is_state("online"));
    let second = Bridge::start(broker.port, [&*hosts[1], "--name", "press"]);
    first.wait_for("another bridge uses this topic");
    second.wait_for("another bridge uses this topic");
    listener.wait(0, "ft/press/error", |reported| reported["topic"] == "ft/press/state");
}
