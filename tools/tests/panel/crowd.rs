//! Many pages, and pages that do not read.

#[cfg(target_os = "linux")]
use std::net::TcpStream;
#[cfg(target_os = "linux")]
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use ft_transfer_area_simulator::SimulatedTxt;
use serde_json::json;

use super::page::is_running;
use super::program::Panel;
use super::LIMIT;

#[cfg_attr(windows, ignore = "Wine is too slow for thousands of messages in a second")]
#[test]
fn forty_pages_look_and_one_drives() {
    const PAGES: usize = 40;
    let txt = SimulatedTxt::builder().start().unwrap();
    let panel = Panel::of(&[&txt]);
    let mut drives = panel.driver();
    let (number, seen) = (drives.number, AtomicUsize::new(0));
    drives.done(json!({"do": "motor", "motor": 2, "duty": 321}));
    // Each page reads all the time, as a browser does.
    thread::scope(|scope| {
        for _ in 0..PAGES {
            scope.spawn(|| {
                let mut page = panel.page();
                let state = page.wait_for_text(|text| text.contains("[321,0]"));
                assert_eq!(state["areas"][0]["motors"][2]["duty"], json!([321, 0]));
                assert_eq!(state["driver"], number);
                seen.fetch_add(1, Ordering::Relaxed);
                page.wait_for_text(|_| seen.load(Ordering::Relaxed) == PAGES);
            });
        }
        drives.state(0, |_| seen.load(Ordering::Relaxed) == PAGES);
    });
}

#[cfg_attr(windows, ignore = "Wine is too slow for thousands of messages in a second")]
#[test]
fn too_many_pages_are_refused() {
    let panel = Panel::start(&[]);
    let mut pages = Vec::new();
    let status = loop {
        let request = super::page::request(&panel.address, &panel.token);
        match super::page::Page::connect(&panel.address, request) {
            Ok(page) => {
                // Otherwise the panel ends it, and its place is free.
                page.ignore_all();
                pages.push(page);
            }
            Err(status) => break status,
        }
        assert!(pages.len() < 1000, "there is no limit");
    };
    assert_eq!(status, 503);
    assert!(pages.len() >= 100, "a hundred pages have to be possible");
    pages.truncate(10);
    // Their places become free when their ends have been seen.
    let free = || {
        let request = super::page::request(&panel.address, &panel.token);
        super::page::Page::connect(&panel.address, request).is_ok()
    };
    let deadline = Instant::now() + LIMIT;
    while !free() {
        assert!(Instant::now() < deadline, "no place becomes free");
    }
}

#[test]
fn pages_that_send_without_end_do_not_make_the_driver_silent() {
    let txt = SimulatedTxt::builder().start().unwrap();
    let panel = Panel::of(&[&txt]);
    let mut drives = panel.driver();
    let number = drives.number;
    thread::scope(|scope| {
        let mut pages: Vec<_> = (0..8).map(|_| panel.page()).collect();
        for page in &mut pages {
            page.fall_silent();
            scope.spawn(page.flood());
        }
        // As long as a silent page may drive, and again.
        let begin = drives.state(0, |_| true)["at"].as_u64().unwrap();
        let later = |state: &serde_json::Value| state["at"].as_u64().unwrap() > begin + 2500;
        let end = drives.state(0, |state| later(state) || state["driver"] != number);
        assert_eq!(end["driver"], number, "{}", end["freed"]);
    });
}

/// The memory that a process has, in kB.
#[cfg(target_os = "linux")]
fn memory(process: u32) -> u64 {
    let status = std::fs::read_to_string(format!("/proc/{process}/status")).unwrap();
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:")).unwrap();
    line.trim().trim_end_matches(" kB").parse().unwrap()
}

/// The others are for the controllers: without one left, a lost connection is not made again, and nothing stops there.
#[cfg(target_os = "linux")]
#[test]
fn pages_and_connections_without_a_token_leave_half_of_the_files_that_may_be_open() {
    const ALLOWED: usize = 128;
    let mut command = Command::new("sh");
    let limited = format!("ulimit -n {ALLOWED} && exec \"$0\" \"$@\"");
    command.args(["-c", &limited, env!("CARGO_BIN_EXE_txt"), "panel"]).stdin(Stdio::null());
    let panel = Panel::by(&mut command);
    panel.driver();
    let files = || std::fs::read_dir(format!("/proc/{}/fd", panel.running.id())).unwrap().count();
    let mut pages = Vec::new();
    let open = || super::page::request(&panel.address, &panel.token);
    while let Ok(page) = super::page::Page::connect(&panel.address, open()) {
        page.ignore_all();
        pages.push(page);
        assert!(pages.len() < ALLOWED / 2, "there is no limit");
    }
    pages.pop();
    let address = panel.address.parse().unwrap();
    let connect = || TcpStream::connect_timeout(&address, Duration::from_millis(200)).ok();
    let mut crowd = Vec::new();
    let deadline = Instant::now() + LIMIT;
    while crowd.len() < 2 * ALLOWED && Instant::now() < deadline {
        crowd.extend(connect());
        assert!(files() < ALLOWED * 3 / 4, "{} of {ALLOWED} files are open", files());
    }
}

/// It reads a little, so that it is not closed as one that reads nothing.
#[cfg(target_os = "linux")]
#[test]
fn pings_of_a_page_that_reads_slowly_are_not_all_kept() {
    let panel = Panel::start(&[]);
    let page = panel.page();
    let before = memory(panel.running.id());
    page.ping_and_read_slowly(200_000);
    let more = memory(panel.running.id()).saturating_sub(before);
    // All their answers would be 25 MB.
    assert!(more < 6_000, "{more} kB");
}

#[test]
fn a_driver_that_never_reads_is_dropped_and_its_motors_stop() {
    let txt = SimulatedTxt::builder().extensions(8).start().unwrap();
    let panel = Panel::of(&[&txt]);
    let mut page = panel.driver();
    page.done(json!({"do": "motor", "motor": 0, "duty": 512}));
    assert!(txt.wait_until(|machine| machine.controllers[0].outputs.duty[0] == 512, LIMIT));
    // It says that it is there, but takes nothing.
    let stopped = || txt.with_machine(|machine| machine.controllers[0].outputs.duty[0] == 0);
    let deadline = Instant::now() + LIMIT;
    while !stopped() {
        assert!(Instant::now() < deadline, "the motor still turns");
        txt.wait_until(|_| false, Duration::from_millis(100));
    }
    let mut other = panel.page();
    other.state(0, |state| state["driver"].is_null() && is_running(state));
}
