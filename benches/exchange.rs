//! What a cycle costs: in the exchange alone, and over a socket with an unpaced simulated TXT.
//!
//! ```text
//! cargo bench --bench exchange
//! ```

use std::hint::black_box;
use std::time::Duration;

use divan::Bencher;
use ft_transfer_area::simulator::SimulatedTxt;
use ft_transfer_area::transfer_area::LOCAL_IO;
use ft_transfer_area::{
    Exchange, FirmwareVersion, FishX1Transfer, TimeLimits, TransferAreaComHandler, TransferMode,
    TxtClient,
};

fn main() {
    divan::main();
}

/// Makes a request in which all outputs of so many areas have changed.
#[divan::bench(args = [1, 9])]
fn request(bencher: Bencher, count: usize) {
    let mut exchange = Exchange::new(TransferMode::Compressed, FirmwareVersion::new(4, 6, 6));
    let mut areas = vec![FishX1Transfer::default(); count];
    let mut request = Vec::new();
    let mut duty = 0;
    bencher.bench_local(|| {
        duty = (duty + 1) % 512;
        for area in &mut areas {
            area.output.duty = [duty; 8];
        }
        exchange.request(black_box(&areas), &mut request)
    });
}

/// A whole cycle by the client, without a thread and without the controller's 10 ms.
#[divan::bench(args = [0, 8])]
fn do_transfer(bencher: Bencher, extensions: usize) {
    let txt = unpaced(extensions);
    let mut client = TxtClient::connect("127.0.0.1", txt.port(), TimeLimits::default())
        .expect("the simulated TXT listens");
    let version = client.query_status().expect("the simulated TXT answers").version;
    let mut exchange = Exchange::new(TransferMode::Compressed, version);
    let mut areas = vec![FishX1Transfer::default(); 1 + extensions];
    client.start_online().expect("the simulated TXT answers");
    bencher.bench_local(|| client.do_transfer(&mut exchange, &mut areas));
}

/// A whole cycle by the handler: wake, react, exchange.
#[divan::bench(args = [0, 8])]
fn wait_cycle(bencher: Bencher, extensions: usize) {
    let txt = unpaced(extensions);
    let mut handler = TransferAreaComHandler::builder("127.0.0.1")
        .port(txt.port())
        .areas(1 + extensions)
        .build()
        .expect("1 to 9 areas are right");
    handler.begin_transfer().expect("the simulated TXT answers");
    bencher.bench_local(|| {
        let mut areas = handler.wait_cycle().expect("the transfer goes on");
        areas[LOCAL_IO].output.duty[0] = areas[LOCAL_IO].input.uni[0];
    });
}

/// What a polling program pays for a look at the areas.
#[divan::bench(args = [1, 9])]
fn lock(bencher: Bencher, count: usize) {
    let handler = TransferAreaComHandler::builder("127.0.0.1")
        .areas(count)
        .build()
        .expect("1 to 9 areas are right");
    bencher.bench_local(|| handler.lock()[LOCAL_IO].input.uni[0]);
}

fn unpaced(extensions: usize) -> SimulatedTxt {
    SimulatedTxt::builder()
        .extensions(extensions)
        .pace(Duration::ZERO)
        .start()
        .expect("a simulated TXT starts")
}
