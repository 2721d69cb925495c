//! Garbage, huge, slow and half requests.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::sync::mpsc;
use std::thread;
use std::time::{Duration, Instant};

use ft_transfer_area_simulator::SimulatedTxt;
use serde_json::json;

use super::http::{connect, exchange, post_stop, request, status};
use super::page;
use super::program::Panel;
use super::LIMIT;

#[test]
fn garbage_and_huge_requests_are_refused_and_the_motor_turns_on() {
    let txt = SimulatedTxt::builder().start().unwrap();
    let panel = Panel::of(&[&txt]);
    let mut page = panel.driver();
    page.done(json!({"do": "motor", "motor": 0, "duty": 512}));
    assert_eq!(status(&exchange(&panel, b"\x16\x03\x01\x02\x00\x01\x00\x01\xFC\r\n\r\n")), 400);
    assert_eq!(status(&exchange(&panel, b"GET\r\n\r\n")), 400);
    let huge = format!("X-Huge: {}\r\n", "x".repeat(100_000));
    assert!([400, 431].contains(&status(&request(&panel, "GET /", &panel.address, &huge))));
    let line = format!("GET /{}", "x".repeat(100_000));
    assert!([400, 414, 431].contains(&status(&request(&panel, &line, &panel.address, ""))));
    let many: String = (0..500).map(|number| format!("X-{number}: 1\r\n")).collect();
    assert!([400, 431].contains(&status(&request(&panel, "GET /", &panel.address, &many))));
    // It announces more than anybody would read.
    let body = "Content-Length: 99999999999\r\n";
    assert_eq!(status(&request(&panel, "GET /", &panel.address, body)), 200);
    let twice = "Content-Length: 5\r\nContent-Length: 6\r\n";
    assert_eq!(status(&request(&panel, "GET /", &panel.address, twice)), 400);
    assert!(txt.wait_until(|machine| machine.controllers[0].outputs.duty[0] == 512, LIMIT));
}

#[test]
fn a_huge_message_ends_the_page_that_sent_it() {
    let txt = SimulatedTxt::builder().start().unwrap();
    let panel = Panel::of(&[&txt]);
    let mut page = panel.driver();
    page.done(json!({"do": "motor", "motor": 0, "duty": 512}));
    assert!(txt.wait_until(|machine| machine.controllers[0].outputs.duty[0] == 512, LIMIT));
    page.send(&"x".repeat(1 << 20));
    page.wait_for_end();
    assert!(txt.wait_until(|machine| machine.controllers[0].outputs.duty[0] == 0, LIMIT));
    panel.driver();
}

#[test]
fn a_slow_request_is_ended() {
    let panel = Panel::start(&[]);
    let mut slow = connect(&panel);
    slow.write_all(b"GET / HTTP/1.1\r\nHost:").unwrap();
    let mut nothing = connect(&panel);
    let mut response = Vec::new();
    // They end without an answer, or with one that says why.
    let _ = slow.read_to_end(&mut response);
    assert!(nothing.read_to_end(&mut response).is_ok(), "the silent connection was ended, too");
}

#[test]
fn half_requests_keep_nobody_out() {
    let txt = SimulatedTxt::builder().start().unwrap();
    let panel = Panel::of(&[&txt]);
    let half: Vec<TcpStream> = (0..500)
        .map(|_| {
            let mut stream = connect(&panel);
            // One of the first ones is ended by those after it.
            let _ = stream.write_all(b"POST /stop?token=");
            stream
        })
        .collect();
    let mut page = panel.driver();
    page.done(json!({"do": "motor", "motor": 0, "duty": 512}));
    assert!(txt.wait_until(|machine| machine.controllers[0].outputs.duty[0] == 512, LIMIT));
    assert_eq!(post_stop(&panel, &panel.token, ""), 204);
    assert!(txt.wait_until(|machine| machine.controllers[0].outputs.duty[0] == 0, LIMIT));
    drop(half);
}

/// No picture follows, so the connection is none of a camera.
#[test]
fn the_head_of_a_camera_takes_no_place_of_a_picture() {
    let panel = Panel::start(&[]);
    let head =
        format!("HEAD /camera/0?token={} HTTP/1.1\r\nHost: {}\r\n\r\n", panel.token, panel.address);
    let mut asks = connect(&panel);
    asks.write_all(head.as_bytes()).unwrap();
    let mut answer = [0; 12];
    asks.read_exact(&mut answer).unwrap();
    assert_eq!(&answer, b"HTTP/1.1 200");
    // It goes on asking while others come, of whom there may be 400.
    let (over, is_over) = mpsc::channel();
    thread::spawn(move || {
        while asks.write_all(head.as_bytes()).is_ok() && is_open(&mut asks) {
            thread::sleep(Duration::from_millis(20));
        }
        over.send(()).unwrap();
    });
    let deadline = Instant::now() + LIMIT;
    while is_over.try_recv().is_err() {
        assert!(Instant::now() < deadline, "the oldest connection is never ended");
        drop((0..450).map(|_| connect(&panel)).collect::<Vec<_>>());
    }
}

/// Whether it is, as far as what can be read now says.
fn is_open(stream: &mut TcpStream) -> bool {
    stream.set_read_timeout(Some(Duration::from_millis(1))).unwrap();
    !matches!(stream.read(&mut [0; 4096]), Ok(0))
}

#[cfg_attr(windows, ignore = "Wine is too slow for thousands of messages in a second")]
#[test]
fn a_page_that_sends_no_end_of_commands_hinders_nobody() {
    let txt = SimulatedTxt::builder().start().unwrap();
    let panel = Panel::of(&[&txt]);
    let (mut page, mut looks) = (panel.driver(), panel.page());
    for duty in (0..=512).cycle().take(3000) {
        page.send(&json!({"do": "motor", "motor": 0, "duty": duty}).to_string());
    }
    looks.done(json!({"do": "stop"}));
    page.state(0, |state| state["areas"][0]["motors"][0]["duty"] == json!([0, 0]));
    looks.state(0, page::is_running);
}
