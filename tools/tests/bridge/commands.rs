//! What commands do, and what they must not do.

use std::thread;
use std::time::{Duration, Instant};

use ft_transfer_area_simulator::SimulatedTxt;
use serde_json::{json, Value};

use super::support::{is_state, m1, wait_machine, Bridge, Broker, Listener, LONGEST_WAIT};

#[cfg_attr(not(unix), ignore = "the tests end the bridge by a signal")]
#[test]
fn commands_move_motors_switch_outputs_and_play_sounds() {
    let Some(broker) = Broker::start() else { return };
    let txt = SimulatedTxt::builder().start().unwrap();
    let host = txt.address().to_string();
    let _bridge = Bridge::start(broker.port, [&*host, "--name", "press", "--every", "0"]);
    let listener = Listener::new(&broker);
    listener.wait(0, "ft/press/state", is_state("online"));

    listener.send("ft/press/M1/set", r#"{"duty": -300}"#);
    wait_machine(&txt, "M1 turns", |machine| machine.controllers[0].outputs.duty[1] == 300);
    listener.wait(0, "ft/press/M1", |reported| reported["duty"] == -300);
    listener.wait(0, "ft/press/master", |reported| *reported == json!({"alive": true}));

    let order = r#"{"duty": 512, "distance": 30, "with": [{"motor": "M3", "reverse": true}]}"#;
    listener.send("ft/press/M2/move", order);
    for motor in ["M2", "M3"] {
        let right = |reported: &serde_json::Value| {
            reported["event"] == "motor_reached"
                && reported["motor"] == motor
                && reported["position"] == 30
        };
        listener.wait(0, "ft/press/event", right);
    }
    listener.wait(0, "ft/press/C2", |reported| reported["count"] == 30);
    let from = listener.now();
    listener.send("ft/press/C2/reset", "");
    listener.wait(0, "ft/press/event", |reported| reported["event"] == "counter_reset");
    listener.wait(from, "ft/press/C2", |reported| reported["count"] == 0);

    listener.send("ft/press/M4/mode", r#"{"mode": "outputs"}"#);
    listener.wait(0, "ft/press/M4/config", |reported| reported["mode"] == "outputs");
    listener.send("ft/press/O8/set", r#"{"duty": 77}"#);
    wait_machine(&txt, "O8 is on", |machine| machine.controllers[0].outputs.duty[7] == 77);
    listener.send("ft/press/sound/set", r#"{"sound": "Bell"}"#);
    wait_machine(&txt, "a sound", |machine| machine.controllers[0].playing_sound().is_some());

    listener.send("ft/press/stop", "");
    wait_machine(&txt, "all off", |machine| machine.controllers[0].outputs.duty == [0; 8]);
}

#[cfg_attr(not(unix), ignore = "the tests end the bridge by a signal")]
#[test]
fn wrong_commands_are_answered_and_change_nothing() {
    let Some(broker) = Broker::start() else { return };
    let txt = SimulatedTxt::builder().start().unwrap();
    let host = txt.address().to_string();
    let arguments = [&*host, "--name", "press", "--master-limit", "0"];
    let _bridge = Bridge::start(broker.port, arguments);
    let listener = Listener::new(&broker);
    listener.wait(0, "ft/press/state", is_state("online"));
    listener.send("ft/press/M1/set", r#"{"duty": 200}"#);
    wait_machine(&txt, "M1 turns", |machine| m1(machine) == 200);
    let mut wrong: Vec<(&str, Vec<u8>, &str)> = vec![
        ("M1/set", b"full speed".to_vec(), "the payload is not JSON"),
        ("M1/set", br#"{"duty": 4000}"#.to_vec(), "from -512 to 512, not 4000"),
        ("M1/set", vec![0xC3, 0x28, 0xFF], "not UTF-8"),
        ("M1/set", vec![b'5'; 5000], "5000 bytes"),
        ("O1/set", br#"{"duty": 1}"#.to_vec(), "are the motor M1"),
        ("M9/set", br#"{"duty": 1}"#.to_vec(), "there is no terminal \"M9\""),
        ("M1/speed", br#"{"duty": 1}"#.to_vec(), "its commands are M1/set, M1/move"),
        ("ext1/motor/left", vec![], "there is no terminal \"motor\""),
        ("ext1/M1/set", br#"{"duty": 1}"#.to_vec(), "there is no extension 1"),
    ];
    let long = format!("{}/set", "x".repeat(60_000));
    wrong.push((&long, b"{}".to_vec(), "there is no terminal"));
    for (tail, payload, error) in wrong {
        let (from, topic) = (listener.now(), format!("ft/press/{tail}"));
        listener.send(&topic, payload);
        // A topic that no command could have is shortened.
        let short = tail.get(..60).map(|tail| format!("ft/press/{tail}…"));
        let topic = short.unwrap_or(topic);
        let reported =
            listener.wait(from, "ft/press/error", |reported| reported["topic"] == *topic);
        assert!(reported["error"].as_str().unwrap().contains(error), "{reported}");
    }
    assert_eq!(txt.with_machine(|machine| m1(machine)), 200, "it still turns");
}

#[cfg_attr(not(unix), ignore = "the tests end the bridge by a signal")]
#[test]
fn an_extension_that_is_not_connected_takes_no_commands_and_has_no_values() {
    let Some(broker) = Broker::start() else { return };
    let txt = SimulatedTxt::builder().extensions(1).start().unwrap();
    let host = txt.address().to_string();
    let arguments = [&*host, "--name", "press", "--extensions", "2", "--master-limit", "0"];
    let _bridge = Bridge::start(broker.port, arguments);
    let listener = Listener::new(&broker);
    let is_refused = |extension: usize, duty: i16| {
        let (from, topic) = (listener.now(), format!("ft/press/ext{extension}/M1/set"));
        listener.send(&topic, format!("{{\"duty\": {duty}}}"));
        let error = format!("extension {extension} is not connected");
        listener.wait(from, "ft/press/error", |reported| {
            (&reported["topic"], &reported["error"]) == (&json!(topic), &json!(error))
        });
    };
    listener.wait(0, "ft/press/ext1/M1", |reported| reported["duty"] == 0);
    is_refused(2, 200);
    listener.send("ft/press/ext1/M1/set", r#"{"duty": 200}"#);
    listener.wait(0, "ft/press/ext1/M1", |reported| reported["duty"] == 200);

    // It is cut off.
    let from = listener.now();
    txt.with_machine(|machine| machine.alive[0] = false);
    listener.wait(from, "ft/press/extensions", |reported| reported["connected"][0] == false);
    for tail in ["M1", "M1/config", "I1", "I1/config", "microphone"] {
        listener.wait(from, &format!("ft/press/ext1/{tail}"), Value::is_null);
    }
    is_refused(1, 333);

    // It is back: nothing turns before the next command.
    let from = listener.now();
    txt.with_machine(|machine| machine.alive[0] = true);
    listener.wait(from, "ft/press/ext1/I1", |reported| reported["value"] == 0);
    listener.wait(from, "ft/press/ext1/M1", |reported| reported["duty"] == 0);
    listener.send("ft/press/ext1/M2/set", r#"{"duty": 5}"#);
    wait_machine(&txt, "M2 turns", |machine| machine.controllers[1].outputs.duty[2] == 5);
    assert_eq!(txt.with_machine(|machine| machine.controllers[1].outputs.duty[0]), 0);
    assert!(listener.all("ft/press/ext2/I1").iter().all(Value::is_null), "it was never there");
}

#[cfg_attr(not(unix), ignore = "the tests end the bridge by a signal")]
#[test]
fn a_command_that_the_broker_has_kept_moves_nothing() {
    let Some(broker) = Broker::start() else { return };
    let listener = Listener::new(&broker);
    listener.send_retained("ft/press/M1/set", r#"{"duty": 400}"#);
    listener.send_retained("ft/press/heartbeat", "1");
    listener.wait(0, "ft/press/M1/set", |_| true);
    let txt = SimulatedTxt::builder().start().unwrap();
    let host = txt.address().to_string();
    let _bridge = Bridge::start(broker.port, [&*host, "--name", "press"]);
    let reported =
        listener.wait(0, "ft/press/error", |reported| reported["topic"] == "ft/press/M1/set");
    assert!(reported["error"].as_str().unwrap().contains("retain flag"), "{reported}");
    listener.wait(0, "ft/press/error", |reported| reported["topic"] == "ft/press/heartbeat");
    // A command that comes later goes out later. When it has arrived, the first one has not.
    listener.send("ft/press/M2/set", r#"{"duty": 5}"#);
    wait_machine(&txt, "M2 turns", |machine| machine.controllers[0].outputs.duty[2] == 5);
    assert_eq!(txt.with_machine(|machine| m1(machine)), 0);
    assert_eq!(listener.all("ft/press/M1"), [json!({"duty": 0, "distance": 0, "done": true})]);
}

#[cfg_attr(not(unix), ignore = "the tests end the bridge by a signal")]
#[test]
fn a_silent_master_stops_the_motors_and_a_heartbeat_keeps_them_turning() {
    const LIMIT: Duration = Duration::from_millis(800);
    let begin = Instant::now();
    let Some(broker) = Broker::start() else { return };
    let txt = SimulatedTxt::builder().start().unwrap();
    let host = txt.address().to_string();
    let limit = LIMIT.as_millis().to_string();
    let arguments = [&*host, "--name", "press", "--master-limit", &limit];
    let bridge = Bridge::start(broker.port, arguments);
    let listener = Listener::new(&broker);
    listener.wait(0, "ft/press/state", is_state("online"));
    // This thread may be late on a busy machine. Then the bridge is right to stop, and the test tries again.
    let deadline = Instant::now() + LONGEST_WAIT;
    while !keeps_turning(&listener, &txt, LIMIT) {
        assert!(Instant::now() < deadline, "the heartbeat does not keep the motor turning");
    }
    // No more heartbeats.
    let from = listener.now();
    wait_machine(&txt, "M1 is stopped", |machine| m1(machine) == 0);
    listener.wait(from, "ft/press/event", |reported| reported["event"] == "stopped");
    bridge.wait_for("no command and no heartbeat came for 800ms");
    listener.wait(from, "ft/press/master", |reported| reported["alive"] == false);
    // A master that comes back goes on.
    listener.send("ft/press/M1/set", r#"{"duty": 50}"#);
    wait_machine(&txt, "M1 turns again", |machine| m1(machine) == 50);
    let from = listener.now();
    listener.wait(from, "ft/press/event", |reported| reported["event"] == "stopped");
    if begin.elapsed() < Duration::from_secs(50) {
        assert_eq!(bridge.count("no command and no heartbeat came"), 1, "once a minute");
    }
}

/// Turns M1 and sends heartbeats for twice the limit; `false` if that was not possible in time.
fn keeps_turning(listener: &Listener, txt: &SimulatedTxt, limit: Duration) -> bool {
    listener.send("ft/press/M1/set", r#"{"duty": 200}"#);
    wait_machine(txt, "M1 turns", |machine| m1(machine) == 200);
    let begin = Instant::now();
    let mut last = begin;
    while begin.elapsed() < 2 * limit {
        listener.send("ft/heartbeat", "");
        thread::sleep(limit / 16);
        if m1_of(txt) != 200 || last.elapsed() > limit / 4 {
            return false;
        }
        last = Instant::now();
    }
    true
}

fn m1_of(txt: &SimulatedTxt) -> i16 {
    txt.with_machine(|machine| m1(machine))
}
