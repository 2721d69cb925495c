//! How long a cycle takes: the exchange alone, and over a socket with a simulated TXT without a pace.
//!
//! ```text
//! cargo bench --bench exchange
//! ```

use std::hint::black_box;
use std::time::Duration;

use divan::Bencher;
use ft_transfer_area::simulator::SimulatedTxt;
use ft_transfer_area::transfer_area::LOCAL_IO;
use ft_transfer_area::wire::{CmprHeader, Compressor};
use ft_transfer_area::{
    EventKind, Exchange, FirmwareVersion, FishX1Transfer, TimeLimits, TransferAreaComHandler,
    TransferMode, TxtClient,
};

fn main() {
    divan::main();
}

/// Makes a request in which the duties of this number of areas have changed.
#[divan::bench(args = [1, 9])]
fn request(bencher: Bencher, count: usize) {
    let mut exchange = exchange_with(count);
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

/// Reads a response in which the universal inputs of this number of areas have changed.
#[divan::bench(args = [1, 9])]
fn receive(bencher: Bencher, count: usize) {
    let mut areas = vec![FishX1Transfer::default(); count];
    let mut controller = Compressor::new();
    let mut exchange = Exchange::new(TransferMode::Compressed, FIRMWARE);
    let mut value = 0;
    bencher
        .with_inputs(|| {
            value = (value + 1) % 5000;
            response(&mut controller, count, value)
        })
        .bench_local_values(|response| {
            exchange.receive(&response).expect("it is right").apply(black_box(&mut areas));
        });
}

/// A whole cycle of the client, without a thread and without the controller's 10 ms.
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

/// A whole cycle of the handler: wake, react, exchange.
#[divan::bench(args = [0, 8])]
fn wait_cycle(bencher: Bencher, extensions: usize) {
    let txt = unpaced(extensions);
    let handler = handler_for(&txt, extensions);
    handler.begin_transfer().expect("the simulated TXT answers");
    bencher.bench_local(|| answer(&handler));
}

/// The same with a listener for all events, 8 of each controller in each response.
#[divan::bench(args = [0, 8])]
fn wait_cycle_and_listen(bencher: Bencher, extensions: usize) {
    let txt = unpaced(extensions);
    let handler = handler_for(&txt, extensions);
    let events = handler.events(EventKind::ALL, 1000).expect("1000 places are allowed");
    handler.begin_transfer().expect("the simulated TXT answers");
    bencher.bench_local(|| {
        answer(&handler);
        events.receiver().try_iter().count()
    });
}

/// The same with a log of all cycles.
#[divan::bench(args = [0, 8])]
fn wait_cycle_and_log(bencher: Bencher, extensions: usize) {
    let txt = unpaced(extensions);
    let handler = handler_for(&txt, extensions);
    let log = handler.cycle_log(1000).expect("1000 places are allowed");
    handler.begin_transfer().expect("the simulated TXT answers");
    bencher.bench_local(|| {
        answer(&handler);
        log.receiver().try_iter().count()
    });
}

/// Answers the next response.
fn answer(handler: &TransferAreaComHandler) {
    let mut areas = handler.wait_cycle().expect("the transfer goes on");
    areas[LOCAL_IO].output.duty[0] = areas[LOCAL_IO].input.uni[0];
}

/// How long it takes a polling program to look at the areas.
#[divan::bench(args = [1, 9])]
fn lock(bencher: Bencher, count: usize) {
    let handler = TransferAreaComHandler::builder("127.0.0.1")
        .areas(count)
        .build()
        .expect("1 to 9 areas are right");
    bencher.bench_local(|| handler.lock()[LOCAL_IO].input.uni[0]);
}

const FIRMWARE: FirmwareVersion = FirmwareVersion::new(4, 6, 6);

/// An exchange that has received a response with this number of areas.
fn exchange_with(count: usize) -> Exchange {
    let mut exchange = Exchange::new(TransferMode::Compressed, FIRMWARE);
    exchange.receive(&response(&mut Compressor::new(), count, 0)).expect("it is right");
    exchange
}

/// A response of this number of areas whose universal inputs have this value.
fn response(controller: &mut Compressor, count: usize, value: u16) -> Vec<u8> {
    let mut area = [0; 52];
    area[..8].fill(value);
    let mut data = Vec::new();
    let crc = controller.compress(&area.repeat(count), &mut data);
    let extra_size = u32::try_from(data.len()).expect("some hundred bytes");
    let active_extensions = (1 << (count - 1)) - 1;
    let mut response = Vec::new();
    CmprHeader { extra_size, crc, active_extensions }.emit_response(&mut response);
    response.extend(data);
    response
}

/// A simulated TXT that does not wait, and whose inputs change with every response.
fn unpaced(extensions: usize) -> SimulatedTxt {
    SimulatedTxt::builder()
        .extensions(extensions)
        .pace(Duration::ZERO)
        .on_exchange(|machine| {
            for controller in &mut machine.controllers {
                controller.uni = controller.uni.map(|value| 1 - value);
            }
        })
        .start()
        .expect("a simulated TXT starts")
}

/// A handler for it, with an area for each extension.
fn handler_for(txt: &SimulatedTxt, extensions: usize) -> TransferAreaComHandler {
    TransferAreaComHandler::builder("127.0.0.1")
        .port(txt.port())
        .areas(1 + extensions)
        .build()
        .expect("1 to 9 areas are right")
}
