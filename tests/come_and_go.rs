//! Ten thousand clients leave nothing behind. A program of its own, because memory and files are
//! counted.

use std::io::Read;
use std::net::{Shutdown, TcpStream};
use std::time::Duration;

use ft_transfer_area::simulator::SimulatedTxt;
use ft_transfer_area::{TimeLimits, TxtClient};

/// Longer than anything takes on a busy machine.
const LIMIT: Duration = Duration::from_secs(60);

fn client(txt: &SimulatedTxt) -> TxtClient {
    TxtClient::connect("127.0.0.1", txt.port(), TimeLimits::default()).unwrap()
}

/// Connects and leaves so often, while a client is online or none is.
fn come_and_go(txt: &SimulatedTxt, times: u32) {
    for number in 0..times {
        let mut stream = TcpStream::connect(txt.address()).unwrap();
        // Now and then it waits for its end, lest the system's queue overflow.
        if number % 50 == 49 {
            stream.set_read_timeout(Some(LIMIT)).unwrap();
            stream.shutdown(Shutdown::Write).unwrap();
            assert_eq!(stream.read(&mut [0]).unwrap_or(0), 0);
        }
    }
}

/// Memory of this process in KiB, where the system tells.
fn memory() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"))?;
    line.trim().strip_suffix(" kB")?.parse().ok()
}

/// Open files of this process, where the system tells.
fn open_files() -> Option<usize> {
    Some(std::fs::read_dir("/proc/self/fd").ok()?.count())
}

#[test]
fn ten_thousand_clients_come_and_go_and_the_next_is_served() {
    let txt = SimulatedTxt::builder().idle_limit(LIMIT).start().unwrap();
    come_and_go(&txt, 1000);
    let (memory_before, files_before) = (memory(), open_files());
    for _ in 0..5 {
        let mut first = client(&txt);
        first.start_online().unwrap();
        come_and_go(&txt, 1000);
        first.query_status().unwrap();
        drop(first);
        come_and_go(&txt, 1000);
    }
    client(&txt).query_status().unwrap();
    assert!(txt.with_machine(|machine| machine.refused()) > 0);
    println!("KiB before and after: {memory_before:?} {:?}", memory());
    if let (Some(before), Some(after)) = (memory_before, memory()) {
        assert!(after < before + 2048, "{before} KiB before, {after} KiB after");
    }
    if let (Some(before), Some(after)) = (files_before, open_files()) {
        assert!(after <= before + 2, "{before} files before, {after} after");
    }
}
