//! `txt find`: controllers that answer, that are in use, and hosts that are something else.

use std::io::{Read, Write};
use std::net::TcpListener;
use std::process::{Command, Output};
use std::thread;

use ft_transfer_area::{FirmwareVersion, TransferAreaComHandler};
use ft_transfer_area_simulator::SimulatedTxt;
use serde_json::Value;

/// No program gets this port by chance.
const REFUSES: &str = "127.0.0.1:1";

/// Asks at these addresses only, so that no test leaves this machine.
fn find(options: &[&str], addresses: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_txt"));
    command.args(["find", "--only"]).args(options).args(addresses).output().unwrap()
}

fn text(bytes: &[u8]) -> &str {
    std::str::from_utf8(bytes).unwrap()
}

fn json(output: &Output) -> Value {
    serde_json::from_slice(&output.stdout).unwrap()
}

fn named(name: &str) -> SimulatedTxt {
    let builder = SimulatedTxt::builder().device_name(name);
    builder.firmware(FirmwareVersion::new(4, 1, 6)).start().unwrap()
}

/// A server that answers each connection with these bytes, and whose thread ends with the test.
fn stranger(answer: &'static [u8]) -> String {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap().to_string();
    thread::spawn(move || {
        for stream in listener.incoming() {
            let mut stream = stream.unwrap();
            let _ = stream.write_all(answer);
            // Until the other side has closed.
            let _ = stream.read_to_end(&mut Vec::new());
        }
    });
    address
}

/// The columns of the line with this address.
fn columns<'a>(table: &'a str, address: &str) -> Vec<&'a str> {
    let line = table.lines().find(|line| line.starts_with(address));
    let line = line.unwrap_or_else(|| panic!("no {address} in {table}"));
    line.split("  ").map(str::trim).filter(|column| !column.is_empty()).collect()
}

#[test]
fn each_controller_that_answers_has_a_line_in_the_order_of_the_addresses() {
    let txts = ["left", "right", "third one"].map(named);
    let addresses = txts.each_ref().map(|txt| txt.address().to_string());
    let output = find(&[], &addresses.each_ref().map(String::as_str));
    assert!(output.status.success());
    let table = text(&output.stdout);
    assert_eq!(table.lines().count(), 4, "{table}");
    for (index, (address, name)) in addresses.iter().zip(["left", "right", "third one"]).enumerate()
    {
        let row = [address, "this machine", name, "4.1.6", "unknown", "nobody"];
        assert_eq!(columns(table, address), row);
        assert!(table.lines().nth(index + 1).unwrap().starts_with(address), "{table}");
    }
    assert_eq!(text(&output.stderr), "");
    assert!(txts.iter().all(|txt| txt.with_machine(|machine| machine.exchanges() == 0)));
}

#[test]
fn a_controller_on_which_somebody_is_online_is_listed_and_not_disturbed() {
    let (free, used) = (named("free"), named("used"));
    let [free_at, used_at] = [&free, &used].map(|txt| txt.address().to_string());
    let handler = TransferAreaComHandler::builder(&used_at).build().unwrap();
    handler.begin_transfer().unwrap();
    handler.areas().wait_cycle().unwrap()[0].output.duty[0] = 512;
    let output = find(&[], &[&used_at, &free_at]);
    assert!(output.status.success());
    let row = columns(text(&output.stdout), &used_at);
    assert_eq!(row[1..5], ["this machine", "unknown", "unknown", "unknown"]);
    assert!(row[5].starts_with("perhaps: "), "{row:?}");
    assert_eq!(columns(text(&output.stdout), &free_at)[2], "free");

    // Also when it is asked to start cameras.
    let output = find(&["--try-camera", "--json"], &[&used_at]);
    assert_eq!(output.status.code(), Some(1));
    assert_eq!(json(&output)["controllers"], Value::Array(vec![]));
    assert_eq!(json(&output)["others"][0]["perhaps_in_use"], Value::Bool(true));
    handler.areas().wait_cycle().unwrap();
    used.with_machine(|machine| assert_eq!(machine.controllers[0].outputs.duty[0], 512));
    assert_eq!(handler.areas().statistics().gaps, 0);
    handler.end_transfer().unwrap();
}

#[test]
fn hosts_that_are_no_controller_are_not_in_the_list() {
    let txt = named("one");
    let address = txt.address().to_string();
    let garbage = stranger(b"HTTP/1.1 400 Bad Request\r\n\r\n");
    let silent = TcpListener::bind("127.0.0.1:0").unwrap();
    let silence = silent.local_addr().unwrap().to_string();
    let output = find(&[], &[&garbage, REFUSES, &silence, "txt:port", &address]);
    assert!(output.status.success());
    let (table, said) = (text(&output.stdout), text(&output.stderr));
    assert_eq!(columns(table, &address)[2], "one");
    // A silent host looks like a controller that serves somebody else.
    assert!(columns(table, &silence)[5].starts_with("perhaps: it accepted"), "{table}");
    assert_eq!(table.lines().count(), 3, "{table}");
    for (address, outcome) in [
        (&*garbage, "what answers is not a TXT"),
        (REFUSES, "nothing listens there"),
        ("txt:port", "is not a controller's address"),
    ] {
        let line = said.lines().find(|line| line.starts_with(address));
        assert!(line.is_some_and(|line| line.contains(outcome)), "{said}");
    }
}

#[test]
fn without_a_controller_it_says_what_happened_and_what_to_check() {
    let output = find(&[], &[REFUSES]);
    assert_eq!(output.status.code(), Some(1));
    assert_eq!(text(&output.stdout), "");
    let said = text(&output.stderr);
    let lines: Vec<_> = said.lines().collect();
    let [sentence, address, check] = lines[..] else { panic!("{said}") };
    assert!(sentence.contains("`txt simulate`"), "{sentence}");
    assert_eq!(address, "  127.0.0.1:1 (this machine): nothing listens there");
    assert!(check.contains("must have finished starting"), "{check}");
}

#[test]
fn json_has_what_the_table_has() {
    let txt = named("gate");
    let address = txt.address().to_string();
    let output = find(&["--json"], &[&address, REFUSES]);
    assert!(output.status.success());
    let [found, other] = [&json(&output)["controllers"][0], &json(&output)["others"][0]];
    assert_eq!(
        *found,
        serde_json::json!({
            "address": address, "way": "this machine", "name": "gate", "firmware": "4.1.6",
            "camera": null, "online": false,
        })
    );
    assert_eq!(
        *other,
        serde_json::json!({
            "address": REFUSES, "way": "this machine", "perhaps_in_use": false,
            "outcome": "nothing listens there",
        })
    );
}

#[test]
fn a_name_is_no_command_for_the_terminal() {
    let txt = named("\u{1b}[2Jred");
    let output = find(&[], &[&txt.address().to_string()]);
    assert!(text(&output.stdout).contains("\u{FFFD}[2Jred"), "{output:?}");
}

#[test]
fn a_camera_is_known_when_it_is_started() {
    let with_camera = SimulatedTxt::builder().start().unwrap();
    // This one accepts the start, and then sends nothing.
    let without = SimulatedTxt::builder().camera_stall_after(0).start().unwrap();
    let addresses = [&with_camera, &without].map(|txt| txt.address().to_string());
    let output = find(&["--try-camera", "--json"], &[&addresses[0], &addresses[1]]);
    assert!(output.status.success());
    let cameras = [0, 1].map(|index| json(&output)["controllers"][index]["camera"].clone());
    assert_eq!(cameras, [Value::Bool(true), Value::Bool(false)]);
    for txt in [with_camera, without] {
        txt.with_machine(|machine| assert!(!machine.online() && machine.camera().is_none()));
    }
}

#[test]
fn auto_is_no_address_and_a_sentence_says_what_asks_there() {
    for given in ["auto", "AUTO:65000"] {
        let output = find(&[], &[given]);
        assert_eq!(output.status.code(), Some(2), "{output:?}");
        let said = text(&output.stderr);
        assert!(said.contains("without any, this command asks where \"auto\" does"), "{said}");
        assert!(!said.contains("no such host"), "{said}");
    }
}
