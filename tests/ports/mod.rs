//! Ports on which a simulated TXT can be started more than once.

use std::net::TcpListener;
use std::sync::atomic::{AtomicU16, Ordering};

/// The first of three free ports in a row. The operating system does not give ports below 32768 to
/// other tests.
pub(crate) fn unused_ports() -> u16 {
    static NEXT: AtomicU16 = AtomicU16::new(0);
    let start = 20_000 + (std::process::id() % 1000) as u16 * 10;
    loop {
        let first = start + 3 * NEXT.fetch_add(1, Ordering::Relaxed) % 2000;
        let listeners = (first..first + 3).map(|port| TcpListener::bind(("127.0.0.1", port)));
        if listeners.collect::<Result<Vec<_>, _>>().is_ok() {
            return first;
        }
    }
}
