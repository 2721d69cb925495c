//! Controllers that are not there, go away and come back.

use std::net::TcpListener;
use std::time::Duration;

use ft_transfer_area_simulator::SimulatedTxt;
use serde_json::json;

use super::page::is_running;
use super::program::Panel;
use super::LIMIT;
use crate::watch::away::{at_free_ports, started};

/// A simulated TXT at the ports of one that was there before.
fn at(port: u16) -> SimulatedTxt {
    started(|| SimulatedTxt::builder().port(port))
}

#[test]
fn a_page_gets_the_names_of_all_controllers_however_many_they_are() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("names.toml");
    // As many and as long as they may be.
    let terminals = [('I', 8), ('C', 4), ('M', 4), ('O', 8)];
    let terminals = terminals.iter().flat_map(|(kind, count)| (1..=*count).map(move |n| (kind, n)));
    let of_area: String =
        terminals.map(|(kind, n)| format!("{kind}{n}='{}'\n", "\"".repeat(40))).collect();
    let tables = (0..9).map(|area| match area {
        0 => format!("[master]\n{of_area}"),
        _ => format!("[ext{area}]\n{of_area}"),
    });
    std::fs::write(&path, tables.collect::<String>()).unwrap();
    // Nothing listens there.
    let hosts = ["127.0.0.1:1"; 30];
    let names = ["--names", path.to_str().unwrap()].repeat(hosts.len());
    let panel = Panel::start(&[&hosts[..], &names].concat());
    let mut page = panel.page();
    page.state(hosts.len() - 1, |_| true);
}

#[test]
fn a_controller_that_goes_away_and_comes_back_is_told_and_its_motors_stay_off() {
    let txt = at_free_ports(|port| SimulatedTxt::builder().port(port));
    let port = txt.port();
    let other = SimulatedTxt::builder().start().unwrap();
    let panel = Panel::of(&[&txt, &other]);
    let mut page = panel.driver();
    page.state(1, is_running);
    page.done(json!({"do": "uni", "input": 4, "mode": "ultrasonic", "digital": false}));
    for host in [0, 1] {
        page.done(json!({"do": "motor", "host": host, "motor": 0, "duty": 512}));
    }
    drop(txt);
    let state = page.state(0, |state| state["link"]["phase"] == "gap");
    assert_eq!(state["link"]["error"]["code"], "connection_lost");
    assert_eq!(state["areas"][0]["alive"], false);
    assert_eq!(page.refused(json!({"do": "motor", "motor": 0, "duty": 9})), "not_connected");
    let txt = at(port);
    let state = page.state(0, is_running);
    assert_eq!(state["link"]["gaps"], 1);
    assert!(state["link"]["error"].is_null());
    assert_eq!(state["areas"][0]["motors"][0]["duty"], json!([0, 0]));
    txt.with_machine(|machine| {
        let one = &machine.controllers[0];
        assert_eq!((one.outputs.duty, one.config.uni[4].mode), ([0; 8], 3));
    });
    page.done(json!({"do": "motor", "motor": 0, "duty": 300}));
    assert!(txt.wait_until(|machine| machine.controllers[0].outputs.duty[0] == 300, LIMIT));
    // The other one was not disturbed.
    assert_eq!(other.with_machine(|machine| machine.controllers[0].outputs.duty[0]), 512);
    // While the controller is there.
    drop(panel);
}

#[test]
fn another_controller_in_place_of_the_one_that_was_driven_is_told() {
    let first = |port| SimulatedTxt::builder().port(port).device_name("FIRST");
    let first =
        at_free_ports(|port| first(port).camera_start_up(Duration::ZERO).camera_stall_after(1));
    let port = first.port();
    let panel = Panel::of(&[&first]);
    let mut page = panel.driver();
    page.done(json!({"do": "camera", "on": true}));
    page.state(0, |state| !state["camera"]["error"].is_null());
    drop(first);
    page.state(0, |state| state["link"]["phase"] == "gap");
    let _second = started(|| SimulatedTxt::builder().port(port).device_name("SECOND"));
    let state = page.state(0, is_running);
    let error = &state["link"]["error"];
    assert_eq!(error["code"], "replaced", "{state}");
    assert_eq!(error["text"], "SECOND answers in place of FIRST, whose motors may go on");
    assert!(state["camera"]["error"].is_null(), "it was of the other one: {state}");
}

#[test]
fn a_controller_that_is_not_there_yet_is_tried_again() {
    let port = at_free_ports(|port| SimulatedTxt::builder().port(port)).port();
    let panel = Panel::start(&[&format!("127.0.0.1:{port}")]);
    let mut page = panel.page();
    let state = page.state(0, |state| !state["link"]["error"].is_null());
    assert_eq!(state["link"]["phase"], "connecting");
    assert_eq!(state["link"]["error"]["code"], "connection_refused");
    page.done(json!({"do": "drive"}));
    assert_eq!(page.refused(json!({"do": "camera", "on": true})), "not_connected");
    let txt = at(port);
    let state = page.state(0, is_running);
    assert_eq!(state["link"]["firmware"], "4.7.0");
    page.done(json!({"do": "motor", "motor": 0, "duty": 512}));
    assert!(txt.wait_until(|machine| machine.controllers[0].outputs.duty[0] == 512, LIMIT));
    // While the controller is there.
    drop(panel);
}

#[test]
fn a_host_that_is_no_controller_is_told_and_the_page_goes_on() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap().to_string();
    let closes = std::thread::spawn(move || drop(listener.accept().unwrap()));
    let panel = Panel::start(&[&address, "simulated"]);
    let mut page = panel.page();
    page.state(0, |state| !state["link"]["error"].is_null());
    page.state(1, is_running);
    closes.join().unwrap();
}

#[test]
fn cycles_are_measured() {
    let txt = SimulatedTxt::builder().start().unwrap();
    let panel = Panel::of(&[&txt]);
    let mut page = panel.page();
    let state = page.state(0, |state| state["link"]["cycles"].as_u64() > Some(50));
    let bins = state["link"]["histogram"].as_array().unwrap();
    assert_eq!(bins.len(), 31);
    let count: u64 = bins.iter().map(|count| count.as_u64().unwrap()).sum();
    assert!((1..50 + 100).contains(&count), "{state}");
    let short: u64 = bins[..5].iter().map(|count| count.as_u64().unwrap()).sum();
    assert!(2 * short < count, "most take 10 ms or longer: {bins:?}");
    assert!(state["link"]["cycle_ms"].as_f64() > Some(0.0));
}
