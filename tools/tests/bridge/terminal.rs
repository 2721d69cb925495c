//! What the bridge prints, and who waits for it: nobody.

use ft_transfer_area_simulator::SimulatedTxt;
use serde_json::json;

use super::support::{is_state, m1, wait_machine, Bridge, Broker, Listener};

/// What another bridge of the same name would say. It is printed, and published as an error.
fn other_bridge(number: usize, host: &str) -> String {
    json!({"state": "online", "bridge": number.to_string(), "host": host}).to_string()
}

#[cfg_attr(not(unix), ignore = "the tests end the bridge by a signal")]
#[test]
fn a_paused_terminal_delays_neither_a_stop_nor_the_end() {
    // More than a pipe and the bridge keep.
    const LINES: usize = 2000;
    // Fewer than may come at once.
    const AT_ONCE: usize = 200;
    let Some(broker) = Broker::start() else { return };
    let txt = SimulatedTxt::builder().start().unwrap();
    let host = txt.address().to_string();
    let arguments = [&*host, "--name", "press", "--master-limit", "0"];
    let mut bridge = Bridge::start_unread(broker.port, arguments);
    let listener = Listener::new(&broker);
    listener.wait(0, "ft/press/state", is_state("online"));
    for number in 0..LINES {
        let from = listener.now();
        listener.send("ft/press/state", other_bridge(number, &format!("number {number} ")));
        if number % AT_ONCE == 0 {
            let right = |reported: &serde_json::Value| {
                reported["error"]
                    .as_str()
                    .is_some_and(|error| error.contains(&format!(" {number} ")))
            };
            listener.wait(from, "ft/press/error", right);
        }
    }
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
fn lines_have_their_time_and_no_control_characters_of_others() {
    let Some(broker) = Broker::start() else { return };
    let txt = SimulatedTxt::builder().start().unwrap();
    let host = txt.address().to_string();
    let bridge = Bridge::start(broker.port, [&*host, "--name", "press"]);
    let listener = Listener::new(&broker);
    listener.wait(0, "ft/press/state", is_state("online"));
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
