//! `txt start`: what its page finds and starts, and that nothing outlives it.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::process::Command;
use std::thread;
use std::time::Duration;

use ft_transfer_area_simulator::SimulatedTxt;
use serde_json::Value;

use crate::running::{wait_for, Running};

/// How long a test waits for what has to happen.
const LIMIT: Duration = Duration::from_secs(40);
/// No program gets this port by chance.
const REFUSES: &str = "127.0.0.1:1";

/// The address of a page, and its token.
pub(crate) struct Start {
    running: Running,
    pub(crate) url: String,
}

impl Start {
    /// It asks at this address only, so that no test leaves this machine.
    pub(crate) fn at(controller: &str) -> Self {
        let mut command = Command::new(env!("CARGO_BIN_EXE_txt"));
        let running = Running::start(command.args(["start", controller, "--only", "--no-browser"]));
        Self { url: running.line(), running }
    }
}

/// Host and token of a page.
fn parts(url: &str) -> (&str, &str) {
    url.strip_prefix("http://").and_then(|rest| rest.split_once("/?token=")).unwrap()
}

/// Status and text of an answer.
fn ask(url: &str, method: &str, path: &str) -> (u16, String) {
    let (host, token) = parts(url);
    let separator = if path.contains('?') { '&' } else { '?' };
    let mut stream = TcpStream::connect(host).unwrap();
    stream.set_read_timeout(Some(LIMIT)).unwrap();
    let head = format!("{method} {path}{separator}token={token} HTTP/1.1\r\nHost: {host}\r\n");
    stream
        .write_all(format!("{head}Connection: close\r\nContent-Length: 0\r\n\r\n").as_bytes())
        .unwrap();
    let mut answer = String::new();
    stream.read_to_string(&mut answer).unwrap();
    let (head, text) = answer.split_once("\r\n\r\n").unwrap();
    (head.split(' ').nth(1).unwrap().parse().unwrap(), text.to_owned())
}

fn json(url: &str, method: &str, path: &str) -> Value {
    let (status, text) = ask(url, method, path);
    assert_eq!(status, 200, "{path}: {text}");
    serde_json::from_str(&text).unwrap()
}

fn open(start: &Start, kind: &str, name: &str) -> String {
    let answer = json(&start.url, "POST", &format!("/open?kind={kind}&name={name}"));
    answer["url"].as_str().unwrap().to_owned()
}

fn is_served(url: &str) -> bool {
    TcpStream::connect(parts(url).0).is_ok()
}

#[test]
fn the_page_has_what_was_found_and_what_can_be_started() {
    let txt = SimulatedTxt::builder().device_name("gate").start().unwrap();
    let start = Start::at(&txt.address().to_string());
    let found = json(&start.url, "POST", "/find");
    assert_eq!(found["controllers"][0]["name"], "gate", "{found}");
    let state = json(&start.url, "GET", "/state");
    assert_eq!(state["lessons"][3]["title"]["de"], "am Endschalter anhalten", "{state}");
    assert!(state["worlds"].as_array().unwrap().iter().any(|world| world == "slide"), "{state}");
    assert_eq!(ask(&start.url, "GET", "/").0, 200);
    let stranger = start.url.replace("token=", "token=0");
    for (method, path) in [("GET", "/state"), ("POST", "/find"), ("POST", "/quit")] {
        assert_eq!(ask(&stranger, method, path).0, 403, "{path}");
    }
}

#[test]
fn what_was_started_runs_once_and_ends_by_itself_or_with_the_page() {
    let txt = SimulatedTxt::builder().start().unwrap();
    let start = Start::at(REFUSES);
    let world = open(&start, "world", "slide");
    assert_eq!(open(&start, "world", "slide"), world);
    let panel = open(&start, "panel", &txt.address().to_string());
    assert!(is_served(&world) && is_served(&panel));
    let id = json(&start.url, "GET", "/state")["running"][0]["id"].clone();
    assert_eq!(ask(&start.url, "POST", &format!("/end?id={id}")).0, 204);
    wait_for("the first one goes on", || !is_served(&world));
    wait_for("it is still shown", || {
        json(&start.url, "GET", "/state")["running"].as_array().unwrap().len() == 1
    });
    assert_eq!(ask(&start.url, "POST", "/quit").0, 204);
    assert!(start.running.end().status.success());
    assert!(!is_served(&panel), "the panel has outlived it");
}

#[test]
fn what_ends_is_not_opened_again() {
    let start = Start::at(REFUSES);
    let first = open(&start, "world", "slide");
    let id = json(&start.url, "GET", "/state")["running"][0]["id"].clone();
    assert_eq!(ask(&start.url, "POST", &format!("/end?id={id}")).0, 204);
    let second = open(&start, "world", "slide");
    assert_ne!(second, first);
    assert!(!is_served(&first) && is_served(&second));
}

/// It may be the one that their page has gone to.
#[test]
fn another_lesson_is_chosen_on_the_page_of_the_lessons() {
    let start = Start::at(REFUSES);
    // Without a free port the command says so.
    let (status, text) = ask(&start.url, "POST", "/open?kind=lesson&name=1");
    if status != 200 {
        assert!(text.contains("port 65000"), "{text}");
        return;
    }
    let (status, text) = ask(&start.url, "POST", "/open?kind=lesson&name=4");
    assert!(status == 409 && text.contains("choose one on their page"), "{status}: {text}");
}

/// As when somebody clicks and loads the page again.
#[test]
fn what_nobody_waits_for_any_more_runs_once_too() {
    let start = Start::at(REFUSES);
    let (host, token) = parts(&start.url);
    let head = format!(
        "POST /open?kind=world&name=slide&token={token} HTTP/1.1\r\nHost: {host}\r\nContent-Length: 0\r\n\r\n"
    );
    for _ in 0..20 {
        let mut stream = TcpStream::connect(host).unwrap();
        stream.write_all(head.as_bytes()).unwrap();
        // Long enough for it to begin, and too short to end.
        thread::sleep(Duration::from_millis(5));
    }
    open(&start, "world", "slide");
    let state = json(&start.url, "GET", "/state");
    assert_eq!(state["running"].as_array().unwrap().len(), 1, "{state}");
}

#[cfg(unix)]
#[test]
fn nothing_outlives_a_start_page_that_is_killed() {
    let start = Start::at(REFUSES);
    let world = open(&start, "world", "car");
    start.running.signal("KILL");
    wait_for("the panel goes on", || !is_served(&world));
}

#[test]
fn what_can_not_be_started_says_why() {
    let start = Start::at(REFUSES);
    for (wanted, why) in [
        ("kind=lesson&name=99", "lesson"),
        ("kind=world&name=nope", "there is no such world"),
        ("kind=simulate&name=/tmp/x.toml", "there is no such world"),
        ("kind=panel&name=", "this is no address"),
    ] {
        let (status, text) = ask(&start.url, "POST", &format!("/open?{wanted}"));
        assert!(status == 409 && text.contains(why), "{wanted}: {status} {text}");
    }
    assert_eq!(ask(&start.url, "POST", "/open?kind=shell&name=x").0, 400);
}

/// A file manager has it read and write nothing.
#[cfg(unix)]
#[test]
fn a_double_click_opens_the_page() {
    use std::fs::{self, File};
    use std::process::Stdio;

    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let mut command = Command::new(env!("CARGO_BIN_EXE_txt"));
    command.env("DISPLAY", ":none").env("BROWSER", "/bin/true").env("HOME", folder.path());
    command.stdin(Stdio::null()).stdout(File::create(&out).unwrap()).stderr(Stdio::null());
    let mut child = command.spawn().unwrap();
    let mut text = String::new();
    wait_for("there is no page", || {
        text = fs::read_to_string(&out).unwrap();
        text.contains('\n')
    });
    assert_eq!(ask(text.lines().next().unwrap(), "POST", "/quit").0, 204);
    assert!(child.wait().unwrap().success());
}
