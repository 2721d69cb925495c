//! Ten thousand clients at each port leak nothing. This is a separate program, because memory and files
//! are counted.

use std::io::{self, ErrorKind, Read, Write};
use std::net::{Ipv4Addr, Shutdown, TcpStream};
use std::thread;
use std::time::{Duration, Instant};

use ft_transfer_area::wire::{CameraFrameHeader, CommandId, StartCameraOnline};
use ft_transfer_area::{TimeLimits, TxtClient};
use ft_transfer_area_simulator::SimulatedTxt;

/// Longer than anything takes on a busy machine.
const LIMIT: Duration = Duration::from_secs(60);

/// In each round a thousand clients connect to each port.
const ROUNDS: usize = 10;

/// Less growth in a round is not a leak, in KiB: half of the smallest piece that an allocator gives, which has 32 bytes,
/// for each client of one port.
const NO_GROWTH: u64 = 16;

const SMALL_PICTURE: StartCameraOnline =
    StartCameraOnline { width: 16, height: 16, framerate: 1000, power_line_frequency: 50 };

/// To a missing device.
const I2C_REQUEST: [u8; 16] = [0xB9, 0xDB, 0x3B, 0x39, 0, 0, 0, 0, 0x18, 0, 0, 0, 0, 0, 0, 0];

fn client(txt: &SimulatedTxt) -> TxtClient {
    TxtClient::connect(txt.address(), TimeLimits::default()).unwrap()
}

fn connect(port: u16) -> TcpStream {
    let stream = TcpStream::connect((Ipv4Addr::LOCALHOST, port)).unwrap();
    stream.set_read_timeout(Some(LIMIT)).unwrap();
    stream
}

/// Connects, sends something and leaves without an answer, 500 times.
///
/// A client that closes first in the normal way keeps its port busy for a minute. A client that leaves an
/// answer unread does not, so the tests after this one find free ports.
fn come_and_go(port: u16, words: &[u8]) {
    for number in 0..500 {
        let mut stream = connect(port);
        match number % 50 {
            // Now and then a client waits for its end, so that the system's queue does not overflow.
            0 => {
                let _ = stream.shutdown(Shutdown::Write);
                match io::copy(&mut stream, &mut io::sink()) {
                    Ok(_) => {}
                    Err(error) => assert_eq!(error.kind(), ErrorKind::ConnectionReset),
                }
            }
            // These send nothing, or not enough.
            1 => {}
            2 => drop(stream.write_all(&words[..3])),
            // A refused client can't send anything.
            _ => drop(stream.write_all(words)),
        }
    }
}

/// Clients connect to all ports while nobody is online, and to the camera and I2C ports while somebody is. At the main
/// port they would wait until the system's queue is full.
fn round(txt: &SimulatedTxt) {
    let come = |to_main: bool| {
        thread::scope(|scope| {
            if to_main {
                scope.spawn(|| come_and_go(txt.port(), &CommandId::QueryStatus.id().to_le_bytes()));
            }
            scope.spawn(|| come_and_go(txt.camera_port(), b"none"));
            scope.spawn(|| come_and_go(txt.i2c_port(), &I2C_REQUEST));
        });
    };
    come(true);
    let mut first = client(txt);
    first.start_online().unwrap();
    first.start_camera_online(&SMALL_PICTURE).unwrap();
    come(false);
    first.query_status().unwrap();
}

/// Fails unless each port serves.
fn assert_serves(txt: &SimulatedTxt) {
    let mut client = client(txt);
    client.start_online().unwrap();
    client.start_camera_online(&SMALL_PICTURE).unwrap();
    let mut header = [0; CameraFrameHeader::LEN];
    connect(txt.camera_port()).read_exact(&mut header).unwrap();
    CameraFrameHeader::parse(&header).unwrap();
    let mut i2c = connect(txt.i2c_port());
    i2c.write_all(&I2C_REQUEST).unwrap();
    i2c.read_exact(&mut [0; 12]).unwrap();
}

/// The private memory of this process in KiB, if the system reports it.
fn memory() -> Option<u64> {
    let rollup = std::fs::read_to_string("/proc/self/smaps_rollup").ok()?;
    let kib = |name: &str| -> Option<u64> {
        let line = rollup.lines().find_map(|line| line.strip_prefix(name))?;
        line.trim().strip_suffix(" kB")?.parse().ok()
    };
    Some(kib("Anonymous:")? + kib("Swap:")?)
}

/// The open files of this process, if the system reports them.
fn open_files() -> Option<usize> {
    Some(std::fs::read_dir("/proc/self/fd").ok()?.count())
}

#[test]
fn ten_thousand_clients_come_and_go_at_each_port_and_the_next_is_served() {
    let txt =
        SimulatedTxt::builder().idle_limit(LIMIT).camera_start_up(Duration::ZERO).start().unwrap();
    assert_serves(&txt);
    let files_before = open_files();
    let mut memory_after = Vec::new();
    for _ in 0..ROUNDS {
        round(&txt);
        memory_after.extend(memory());
    }
    assert_serves(&txt);
    let frames = txt.with_machine(|machine| machine.camera_frames());
    println!("{frames} camera frames sent");
    assert!(frames > 0);
    println!("KiB after each round: {memory_after:?}");
    // A leak grows in most rounds; an allocator's growth shows in one or two.
    let mut grown: Vec<u64> =
        memory_after.windows(2).map(|pair| pair[1].saturating_sub(pair[0])).collect();
    grown.sort_unstable();
    if let Some(growth) = grown.get(grown.len() / 2) {
        assert!(*growth < NO_GROWTH, "it leaks: {memory_after:?} KiB");
    }
    if let Some(before) = files_before {
        // The simulated TXT's threads close the last connections after their clients.
        let begin = Instant::now();
        let mut after = open_files().unwrap();
        while after > before + 2 && begin.elapsed() < LIMIT {
            thread::sleep(Duration::from_millis(10));
            after = open_files().unwrap();
        }
        assert!(after <= before + 2, "{before} files before, {after} after");
    }
}
