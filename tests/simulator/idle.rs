//! No thread of a simulated TXT wakes up while it has nothing to do.

use std::collections::BTreeMap;
use std::env;
use std::fs;
use std::net::{Ipv4Addr, TcpStream};
use std::process::Command;
use std::thread;
use std::time::{Duration, Instant};

use ft_transfer_area::wire::{CommandId, ExchangeData, ResponseId};
use ft_transfer_area_simulator::{CameraConnection, SimulatedTxt, SimulatedTxtBuilder};

use crate::camera_client::{settings, CameraClient};
use crate::wire_client::{Client, LIMIT};

/// The program that counts has no other test's simulated TXT in it.
#[cfg_attr(not(target_os = "linux"), ignore = "only Linux counts how often a thread wakes")]
#[test]
fn no_thread_wakes_while_nobody_comes_and_clients_are_silent() {
    let name = "idle::in_a_program_of_its_own";
    let arguments = ["--exact", name, "--ignored", "--nocapture", "--test-threads=1"];
    let output = Command::new(env::current_exe().unwrap()).args(arguments).output().unwrap();
    let reported =
        String::from_utf8_lossy(&output.stdout) + String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{reported}");
    assert!(reported.contains("1 passed"), "{reported}");
}

#[test]
#[ignore = "another test runs it in a program of its own"]
fn in_a_program_of_its_own() {
    for connection in [CameraConnection::Waits, CameraConnection::Txt, CameraConnection::Txt40] {
        let txt = builder().camera_connection(connection).start().unwrap();
        assert_sleeps("nobody is connected");
        drop(txt);
    }
    a_silent_client_on_each_port();
    a_camera_that_starts();
    clients_that_wait();
    a_motor_that_turns();
}

/// With limits, which a thread must not wait for in small steps.
fn builder() -> SimulatedTxtBuilder {
    SimulatedTxt::builder().pace(Duration::ZERO).idle_limit(Duration::from_secs(3600))
}

fn a_silent_client_on_each_port() {
    let txt = builder().camera_start_up(Duration::ZERO).start().unwrap();
    let mut main = Client::online(&txt);
    let _i2c = TcpStream::connect((Ipv4Addr::LOCALHOST, txt.i2c_port())).unwrap();
    assert_sleeps("a client is online");
    main.start_camera(settings(16, 16, 15));
    let mut camera = CameraClient::connect(&txt);
    camera.receive();
    assert_sleeps("a frame is not acknowledged");
}

fn a_camera_that_starts() {
    let hour = Duration::from_secs(3600);
    for connection in [CameraConnection::Waits, CameraConnection::Txt] {
        let builder = builder().camera_connection(connection).camera_start_up(hour);
        let txt = builder.start().unwrap();
        let mut main = Client::online(&txt);
        let _early = TcpStream::connect((Ipv4Addr::LOCALHOST, txt.camera_port()));
        main.start_camera(settings(16, 16, 15));
        assert_sleeps("the camera starts up");
    }
    let builder =
        builder().camera_connection(CameraConnection::Txt).camera_start_up(Duration::ZERO);
    let txt = builder.start().unwrap();
    let mut main = Client::online(&txt);
    main.start_camera(settings(16, 16, 15));
    assert_sleeps("the camera waits for a client");
}

fn clients_that_wait() {
    let txt = builder().start().unwrap();
    let mut first = Client::connect(&txt);
    let _second = Client::connect(&txt);
    first.command(CommandId::QueryStatus);
    ResponseId::QueryStatus.check(&first.receive(24)).unwrap();
    assert_sleeps("a client waits for another one to leave");
}

fn a_motor_that_turns() {
    // By the clock, but nobody looks.
    let txt = builder().pace(Duration::from_millis(10)).start().unwrap();
    let mut client = Client::online(&txt);
    let outputs = ExchangeData { duty: [512, 0, 0, 0, 0, 0, 0, 0], ..ExchangeData::default() };
    client.exchange(&outputs);
    assert_sleeps("a motor turns");
}

/// Fails unless all threads of the simulated TXT sleep while this one takes many naps.
fn assert_sleeps(when: &str) {
    let begin = Instant::now();
    loop {
        let before = wakes();
        (0..20).for_each(|_| thread::sleep(Duration::from_millis(5)));
        let after = wakes();
        if before.len() == 3 && before == after {
            return;
        }
        // Perhaps they had not begun to wait yet.
        assert!(begin.elapsed() < LIMIT, "while {when}: {before:?}, then {after:?}");
    }
}

/// How often each thread of the simulated TXT has been woken, by its id.
fn wakes() -> BTreeMap<String, String> {
    let tasks = fs::read_dir("/proc/self/task").unwrap().map(|task| task.unwrap().path());
    // A thread that has just ended has no status.
    let statuses = tasks.filter_map(|task| fs::read_to_string(task.join("status")).ok());
    statuses
        .filter(|status| status.starts_with("Name:\tsimulated-"))
        .map(|status| {
            let line = |name| {
                let of_name = |line: &&str| line.starts_with(name);
                status.lines().find(of_name).unwrap().to_owned()
            };
            (line("Pid:"), line("voluntary_ctxt_switches:"))
        })
        .collect()
}
