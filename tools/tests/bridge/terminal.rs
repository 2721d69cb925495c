//! What the bridge prints, and who waits for it: nobody.

use ft_transfer_area_simulator::SimulatedTxt;
use serde_json::{json, Value};

use super::support::{is_state, Bridge, Broker, Listener};

/// What another bridge of the same name would say. An answer is printed, and published as an error.
fn other_bridge(number: usize, host: &str) -> String {
    json!({"state": "online", "bridge": number.to_string(), "host": host}).to_string()
}

fn is_about_the_state(error: &Value) -> bool {
    error["topic"] == "ft/press/state"
}

/// A bridge with its controller, and somebody who listens.
fn online(broker: &Broker) -> (SimulatedTxt, Bridge, Listener) {
    let txt = SimulatedTxt::builder().start().unwrap();
    let bridge = Bridge::start(broker.port, [&*txt.address().to_string(), "--name", "press"]);
    let listener = Listener::new(broker);
    listener.wait(0, "ft/press/state", is_state("online"));
    (txt, bridge, listener)
}

#[cfg(unix)]
#[test]
fn a_paused_terminal_delays_neither_a_stop_nor_the_end() {
    use super::support::{m1, wait_machine};

    let Some(broker) = Broker::start() else { return };
    let txt = SimulatedTxt::builder().start().unwrap();
    let host = txt.address().to_string();
    let arguments = [&*host, "--name", "press", "--master-limit", "0"];
    let (mut bridge, _unread) = Bridge::start_unread(broker.port, arguments);
    let listener = Listener::new(&broker);
    listener.wait(0, "ft/press/state", is_state("online"));
    listener.send("ft/press/state", other_bridge(1, "h"));
    listener.wait(0, "ft/press/error", is_about_the_state);
    for duty in [200, 300] {
        listener.send("ft/press/M1/set", format!("{{\"duty\": {duty}}}"));
        wait_machine(&txt, "M1 turns", |machine| m1(machine) == duty);
        if duty == 200 {
            listener.send("ft/press/stop", "");
            wait_machine(&txt, "M1 is stopped", |machine| m1(machine) == 0);
        }
    }
    bridge.signal("TERM");
    assert!(bridge.wait().success());
    wait_machine(&txt, "M1 is stopped", |machine| !machine.online() && m1(machine) == 0);
    listener.wait(0, "ft/press/state", is_state("gone"));
}

#[cfg_attr(not(unix), ignore = "the tests end the bridge by a signal")]
#[test]
fn another_bridge_that_says_much_is_told_seldom() {
    // Fewer than may come at once.
    const MESSAGES: usize = 500;
    let Some(broker) = Broker::start() else { return };
    let (_txt, bridge, listener) = online(&broker);
    for number in 0..MESSAGES {
        listener.send("ft/press/state", other_bridge(number, &number.to_string()));
    }
    listener.send("ft/press/M1/speed", "");
    listener.wait(0, "ft/press/error", |reported| reported["topic"] == "ft/press/M1/speed");
    bridge.wait_for("another bridge uses this topic");
    let reported = listener.all("ft/press/error").into_iter().filter(is_about_the_state).count();
    let printed = bridge.count("another bridge uses this topic");
    // One for each minute that this has taken.
    assert!(reported < MESSAGES / 20 && printed < MESSAGES / 20, "{reported} {printed}");
}

#[cfg_attr(not(unix), ignore = "the tests end the bridge by a signal")]
#[test]
fn lines_have_their_time_and_no_control_characters_of_others() {
    let Some(broker) = Broker::start() else { return };
    let (_txt, bridge, listener) = online(&broker);
    let evil = "\u{1b}[2J\u{202e}\r\n\u{9b}31m";
    listener.send("ft/press/state", other_bridge(1, evil));
    let line = bridge.wait_for("another bridge uses this topic");
    assert!(line.contains("(\u{fffd}[2J\u{fffd}\u{fffd}\u{fffd}\u{fffd}31m)"), "{line:?}");
    // 2026-11-23 14:38:59.123
    let (time, line) = line.split_at(23);
    let shape: String = time.chars().map(|c| if c.is_ascii_digit() { '0' } else { c }).collect();
    assert_eq!(shape, "0000-00-00 00:00:00.000");
    assert!(line.starts_with(" press: "), "{line}");
}
