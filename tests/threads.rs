//! No failure leaves a thread running. This is a separate program, because threads are counted.

use std::time::{Duration, Instant};

use ft_transfer_area::{find_controllers, SearchOptions, TransferAreaComHandler};
use ft_transfer_area_simulator::{Fault, FaultKind, SimulatedTxt};

#[cfg_attr(
    not(target_os = "linux"),
    ignore = "only Linux shows the threads of a program as a folder"
)]
#[test]
fn no_thread_is_left_after_an_end_or_a_failure() {
    let before = thread_names();
    // Four connections fail in the handshake, four in an exchange.
    let txt = (0..8).fold(SimulatedTxt::builder().pace(Duration::ZERO), |txt, number| {
        txt.fault(Fault::at_response(number / 4 * 5, FaultKind::WrongId))
    });
    let txt = txt.start().unwrap();
    let mut failures = 0;
    for _ in 0..10 {
        let handler = TransferAreaComHandler::builder(txt.address()).build().unwrap();
        let result = handler
            .begin_transfer()
            .and_then(|()| (0..20).try_for_each(|_| handler.areas().wait_cycle().map(drop)));
        failures += usize::from(result.is_err());
        assert_eq!(handler.end_transfer(), result);
    }
    assert_eq!(failures, 8);
    // The search for controllers, also where none answers.
    let silent = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let addresses = [txt.port(), silent.local_addr().unwrap().port(), 1];
    let addresses = addresses.map(|port| format!("127.0.0.1:{port}"));
    assert_eq!(
        find_controllers(&SearchOptions::default().addresses(&addresses))
            .unwrap()
            .controllers
            .len(),
        1
    );
    drop(txt);
    // The operating system removes a thread from its list shortly after it was joined.
    let deadline = Instant::now() + Duration::from_secs(10);
    while thread_names() != before && Instant::now() < deadline {
        std::thread::yield_now();
    }
    assert_eq!(thread_names(), before);
}

/// The names of all threads of this program.
fn thread_names() -> Vec<String> {
    let tasks = std::fs::read_dir("/proc/self/task").unwrap();
    let mut names: Vec<String> = tasks
        .filter_map(|task| std::fs::read_to_string(task.unwrap().path().join("comm")).ok())
        .collect();
    names.sort();
    names
}
