//! The broker or the controller goes away, comes back, or refuses; the bridge ends.

use std::path::Path;
use std::process::Command;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::Arc;
use std::thread;
use std::time::{Duration, Instant};

use ft_transfer_area_simulator::{FaultKind, Machine, SimulatedTxt};
use serde_json::{json, Value};

use super::support::{
    is_state, m1, mosquitto, wait_machine, Bridge, Broker, Listener, LONGEST_WAIT,
};
use crate::watch::away::at_free_ports;

/// A bridge whose M1 turns.
fn turning(broker: &Broker, listener: &Listener) -> (SimulatedTxt, Bridge) {
    let txt = at_free_ports(|port| SimulatedTxt::builder().port(port));
    let host = txt.address().to_string();
    let limits = ["--master-limit", "0", "--broker-limit", "2000"];
    let bridge = Bridge::start(broker.port, [&*host, "--name", "press"].into_iter().chain(limits));
    listener.wait(0, "ft/press/state", is_state("online"));
    listener.send("ft/press/M1/set", r#"{"duty": 200}"#);
    wait_machine(&txt, "M1 turns", |machine| m1(machine) == 200);
    (txt, bridge)
}

/// Everything works again after a fault, and what was commanded before moves nothing.
fn works_again(txt: &SimulatedTxt, listener: &Listener, from: usize) {
    listener.wait(from, "ft/press/event", |reported| reported["event"] == "stopped");
    listener.wait(from, "ft/press/M1", |reported| reported["duty"] == 0);
    assert_eq!(txt.with_machine(|machine| m1(machine)), 0);
    txt.with_machine(|machine| machine.controllers[0].uni[0] = 1);
    listener.wait(from, "ft/press/I1", |reported| reported["value"] == 1);
    listener.send("ft/press/M1/set", r#"{"duty": 77}"#);
    wait_machine(txt, "M1 turns again", |machine| m1(machine) == 77);
}

#[cfg_attr(not(unix), ignore = "the tests end the bridge by a signal")]
#[test]
fn a_broker_that_dies_stops_the_motors_and_may_come_back() {
    let Some(mut broker) = Broker::start() else { return };
    let listener = Listener::new(&broker);
    let (txt, bridge) = turning(&broker, &listener);
    broker.kill();
    wait_machine(&txt, "M1 is stopped", |machine| m1(machine) == 0);
    bridge.wait_for("closed the connection; it was stopped or restarted");
    let from = listener.now();
    broker.start_again();
    listener.wait(from, "subscribed", |_| true);
    works_again(&txt, &listener, from);
}

#[cfg_attr(not(unix), ignore = "the tests end the bridge by a signal")]
#[test]
fn at_the_end_each_controller_that_is_away_is_named() {
    let Some(broker) = Broker::start() else { return };
    let listener = Listener::new(&broker);
    let both = [(); 2].map(|()| SimulatedTxt::builder().start().unwrap());
    let [one, other] = both.each_ref().map(|txt| txt.address().to_string());
    let arguments = [&*one, &other, "--name", "press", "--name", "saw"];
    let mut bridge = Bridge::start(broker.port, arguments);
    for name in ["press", "saw"] {
        listener.wait(0, &format!("ft/{name}/state"), is_state("online"));
    }
    let from = listener.now();
    for txt in &both {
        txt.with_machine(|machine| {
            machine.set_absent(true);
            machine.disturb(FaultKind::Close { after: 0 });
        });
    }
    for name in ["press", "saw"] {
        listener.wait(from, &format!("ft/{name}/state"), |state| state["state"] != "online");
    }
    bridge.interrupt();
    for name in ["press", "saw"] {
        bridge.wait_for(&format!("{name}: the transfer ended with an error"));
    }
    both.iter().for_each(|txt| txt.with_machine(|machine| machine.set_absent(false)));
    assert!(!bridge.wait().success());
}

#[cfg_attr(not(unix), ignore = "the tests end the bridge by a signal")]
#[test]
fn a_broker_that_is_silent_stops_the_motors() {
    let Some(broker) = Broker::start() else { return };
    let listener = Listener::new(&broker);
    let (txt, bridge) = turning(&broker, &listener);
    let from = listener.now();
    broker.signal("STOP");
    wait_machine(&txt, "M1 is stopped", |machine| m1(machine) == 0);
    bridge.wait_for("was silent for 2s");
    broker.signal("CONT");
    works_again(&txt, &listener, from);
}

#[cfg_attr(not(unix), ignore = "the tests end the bridge by a signal")]
#[test]
fn a_message_that_is_too_large_stops_the_motors_and_nothing_else() {
    let Some(broker) = Broker::start() else { return };
    let listener = Listener::new(&broker);
    let (txt, bridge) = turning(&broker, &listener);
    let from = listener.now();
    let file = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(file.path(), vec![b' '; 2 << 20]).unwrap();
    large_message(&broker, file.path());
    wait_machine(&txt, "M1 is stopped", |machine| m1(machine) == 0);
    bridge.wait_for("but more than 1048576 are not read");
    works_again(&txt, &listener, from);
}

/// Sends a file's contents. The listener itself would not take it, so this client has its own limits.
fn large_message(broker: &Broker, file: &Path) {
    use rumqttc::{Client, Event, MqttOptions, Packet, QoS};
    let mut options = MqttOptions::new("large", "127.0.0.1", broker.port);
    options.set_max_packet_size(4 << 20, 4 << 20);
    let (client, mut connection) = Client::new(options, 10);
    let payload = std::fs::read(file).unwrap();
    client.publish("ft/press/M1/set", QoS::AtLeastOnce, false, payload).unwrap();
    let taken = |event| matches!(event, Ok(Event::Incoming(Packet::PubAck(_))));
    assert!(connection.iter().any(taken));
}

#[cfg_attr(not(unix), ignore = "the tests end the bridge by a signal")]
#[test]
fn a_controller_that_goes_away_is_told_and_goes_on_when_it_is_back() {
    let Some(broker) = Broker::start() else { return };
    let listener = Listener::new(&broker);
    let (txt, bridge) = turning(&broker, &listener);
    let ports = (txt.port(), txt.camera_port(), txt.i2c_port());
    let from = listener.now();
    drop(txt);
    let gap = listener.wait(from, "ft/press/state", is_state("gap"));
    assert!(gap["reason"].as_str().unwrap().len() > 20, "{gap}");
    listener.send("ft/press/M1/set", r#"{"duty": 300}"#);
    let error = listener.wait(from, "ft/press/error", |_| true);
    assert!(error["error"].as_str().unwrap().contains("not online"), "{error}");
    let again = || {
        let builder = SimulatedTxt::builder().port(ports.0).camera_port(ports.1);
        builder.i2c_port(ports.2).start()
    };
    let txt = again().unwrap();
    listener.wait(from, "ft/press/state", is_state("online"));
    assert_eq!(txt.with_machine(|machine| m1(machine)), 0, "no old command moves it");
    listener.send("ft/press/M1/set", r#"{"duty": 44}"#);
    wait_machine(&txt, "M1 turns again", |machine| m1(machine) == 44);
    drop(bridge);
}

/// As when a laptop is closed and opened again.
#[cfg_attr(not(unix), ignore = "the tests end the bridge by a signal")]
#[test]
fn what_came_while_the_bridge_was_suspended_moves_nothing() {
    const OLD: i16 = 400;
    let Some(broker) = Broker::start() else { return };
    let listener = Listener::new(&broker);
    let has_turned = Arc::new(AtomicBool::new(false));
    let turned = Arc::clone(&has_turned);
    let script = move |machine: &mut Machine| {
        turned.fetch_or(m1(machine) == OLD, Ordering::Relaxed);
    };
    let txt = SimulatedTxt::builder().on_exchange(script).start().unwrap();
    let host = txt.address().to_string();
    let limits = ["--master-limit", "0", "--broker-limit", "60000"];
    let bridge = Bridge::start(broker.port, [&*host, "--name", "press"].into_iter().chain(limits));
    listener.wait(0, "ft/press/state", is_state("online"));
    bridge.signal("STOP");
    let from = listener.now();
    listener.send("ft/press/M1/set", format!("{{\"duty\": {OLD}}}"));
    listener.send("ft/behind", "1");
    // The broker has passed on the command when the next message comes here.
    listener.wait(from, "ft/behind", |_| true);
    // Longer than a command may wait, but not so long that the controller is given up.
    thread::sleep(Duration::from_millis(1400));
    bridge.signal("CONT");
    let reported =
        listener.wait(from, "ft/press/error", |reported| reported["topic"] == "ft/press/M1/set");
    let error = reported["error"].as_str().unwrap();
    assert!(error.contains("may have waited"), "{error}");
    let deadline = Instant::now() + LONGEST_WAIT;
    while txt.with_machine(|machine| m1(machine)) != 77 {
        assert!(Instant::now() < deadline, "new commands move it");
        listener.send("ft/press/M1/set", r#"{"duty": 77}"#);
        thread::sleep(Duration::from_millis(50));
    }
    assert!(!has_turned.load(Ordering::Relaxed), "the old command has moved it");
}

#[cfg_attr(not(unix), ignore = "the tests end the bridge by a signal")]
#[test]
fn an_interrupt_stops_the_motors_says_gone_and_is_a_success() {
    let Some(broker) = Broker::start() else { return };
    let listener = Listener::new(&broker);
    let (txt, mut bridge) = turning(&broker, &listener);
    bridge.interrupt();
    let gone = listener.wait(0, "ft/press/state", is_state("gone"));
    assert_eq!(gone["reason"], "the bridge was ended");
    assert!(bridge.wait().success());
    wait_machine(&txt, "offline", |machine| !machine.online() && m1(machine) == 0);
    // Not the last will.
    assert_eq!(listener.all("ft/press/state").last(), Some(&gone));
}

#[cfg_attr(not(unix), ignore = "the tests end the bridge by a signal")]
#[test]
fn the_broker_says_gone_when_a_bridge_is_killed() {
    let Some(broker) = Broker::start() else { return };
    let listener = Listener::new(&broker);
    let (txt, mut bridge) = turning(&broker, &listener);
    bridge.kill();
    let gone = listener.wait(0, "ft/press/state", is_state("gone"));
    assert_eq!(gone["reason"], "the bridge has lost its connection to the broker");
    wait_machine(&txt, "what the bridge has left behind", |machine| m1(machine) == 0);
    // The broker keeps it for those who come later.
    let late = Listener::new(&broker);
    late.wait(0, "ft/press/state", is_state("gone"));
}

/// The broker publishes a last will when it learns that a connection was lost: perhaps only after the next one was made.
#[cfg_attr(not(unix), ignore = "the tests end the bridge by a signal")]
#[test]
fn a_last_will_that_comes_late_is_replaced() {
    let Some(broker) = Broker::start() else { return };
    let listener = Listener::new(&broker);
    let (_txt, _bridge) = turning(&broker, &listener);
    let online = listener.wait(0, "ft/press/state", is_state("online"));
    let says_gone = |bridge: &Value| {
        let from = listener.now();
        let gone = json!({"state": "gone", "bridge": bridge}).to_string();
        listener.send_retained("ft/press/state", &gone);
        listener.wait(from, "ft/press/state", is_state("gone"));
        assert_eq!(listener.wait(from, "ft/press/state", is_state("online")), online);
    };
    says_gone(&online["bridge"]);
    // What another bridge of this name has left is replaced, too.
    let from = listener.now();
    listener.send_retained("ft/press/I1", r#"{"value": 77}"#);
    says_gone(&json!("another"));
    listener.wait(from, "ft/press/I1", |reported| reported["value"] == 0);
}

#[cfg_attr(not(unix), ignore = "the tests end the bridge by a signal")]
#[test]
fn a_broker_that_refuses_the_user_ends_the_bridge_with_a_sentence() {
    let Some(program) = mosquitto() else { return };
    let tool = program.with_file_name("mosquitto_passwd");
    let tool = if tool.is_file() { tool } else { "mosquitto_passwd".into() };
    let prepare = |files: &Path| {
        let mut command = Command::new(&tool);
        command.arg("-c").arg("-b").arg(files.join("passwords")).args(["master", "secret"]);
        assert!(command.status().unwrap().success());
    };
    let lines = "allow_anonymous false\npassword_file {dir}/passwords\n";
    let Some(broker) = Broker::with(lines, prepare) else { return };
    let txt = SimulatedTxt::builder().start().unwrap();
    let host = txt.address().to_string();
    let arguments = || [&*host, "--name", "press", "--user", "master"];
    let mut wrong = Bridge::start_as(broker.port, arguments(), Some("guessed"));
    wrong.wait_for("refuses this user");
    assert_eq!(wrong.wait().code(), Some(1));
    let mut nobody = Bridge::start(broker.port, [&*host]);
    assert_eq!(nobody.wait().code(), Some(1));
    let right = Bridge::start_as(broker.port, arguments(), Some("secret"));
    right.wait_for("online as ft/press/");
}
