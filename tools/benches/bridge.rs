//! Fifty simulated controllers over one broker: does every change of an input arrive, and how soon?
//!
//! The simulated TXTs and the subscriber are in this process, so one clock measures both ends.

#![cfg_attr(not(unix), allow(unused))]

#[cfg(unix)]
#[allow(dead_code, reason = "the tests use all of it")]
#[path = "../tests/running/mod.rs"]
mod running;

#[cfg(unix)]
#[allow(dead_code, reason = "the tests use all of it")]
#[path = "../tests/bridge/support.rs"]
mod support;

use std::sync::{Arc, Mutex};
use std::thread;
use std::time::{Duration, Instant};

use crossbeam_channel::{unbounded, Receiver};
use ft_transfer_area_simulator::{Machine, SimulatedTxt};
use rumqttc::{Client, Event, MqttOptions, Packet, QoS};

const CONTROLLERS: usize = 50;

/// Each input changes with every tenth response, ten times a second.
const EXCHANGES_PER_CHANGE: u32 = 10;

/// How often each input changes.
const CHANGES: usize = 200;

/// When the inputs of one controller changed; `None` before it may begin.
type Changes = Arc<Mutex<Option<Vec<Instant>>>>;

#[cfg(unix)]
fn main() {
    println!(
        "{CONTROLLERS} controllers, {CHANGES} changes of an input each, ten a second\n\
         bridges           changes  arrived  lost   median     99 %   longest"
    );
    for processes in [1, CONTROLLERS] {
        let Some(broker) = support::Broker::start() else { return };
        print_row(processes, &measure(&broker, processes));
    }
}

#[cfg(not(unix))]
fn main() {
    println!("not measured: this needs a Unix system");
}

/// A simulated TXT whose I1 changes, once it may.
fn changing(changes: Changes) -> SimulatedTxt {
    let mut exchanges = 0;
    let script = move |machine: &mut Machine| {
        let Ok(mut changes) = changes.lock() else { return };
        let Some(changes) = changes.as_mut().filter(|changes| changes.len() < CHANGES) else {
            return;
        };
        exchanges += 1;
        if exchanges % EXCHANGES_PER_CHANGE == 0 {
            machine.controllers[0].uni[0] ^= 1;
            changes.push(Instant::now());
        }
    };
    SimulatedTxt::builder().on_exchange(script).start().expect("simulated TXTs can be started")
}

/// The latencies of all changes that arrived.
#[cfg(unix)]
fn measure(broker: &support::Broker, processes: usize) -> Vec<Duration> {
    let changes: Vec<Changes> = (0..CONTROLLERS).map(|_| Changes::default()).collect();
    let txts: Vec<_> = changes.iter().map(|changes| changing(Arc::clone(changes))).collect();
    let hosts: Vec<_> = txts.iter().map(|txt| txt.address().to_string()).collect();
    let names: Vec<_> = (0..CONTROLLERS).map(|index| format!("c{index}")).collect();
    let arrivals = subscribe(broker.port);
    let group = CONTROLLERS / processes;
    let _bridges: Vec<_> = hosts
        .chunks(group)
        .zip(names.chunks(group))
        .map(|(hosts, names)| {
            let names = names.iter().flat_map(|name| ["--name", name]);
            support::Bridge::start(broker.port, hosts.iter().map(|host| &**host).chain(names))
        })
        .collect();
    // Each bridge publishes all its values at the beginning, and this one last.
    let mut ready = [false; CONTROLLERS];
    while ready.contains(&false) {
        let first = arrivals.recv_timeout(support::LONGEST_WAIT).expect("all come online");
        ready[first.controller] |= first.tail == "extensions";
    }
    for changes in &changes {
        *changes.lock().expect("no script panics") = Some(Vec::new());
    }
    let mut arrived = vec![Vec::new(); CONTROLLERS];
    // All, or as many as come.
    while arrived.iter().any(|of_one: &Vec<Instant>| of_one.len() < CHANGES) {
        let Ok(change) = arrivals.recv_timeout(Duration::from_secs(10)) else { break };
        arrived[change.controller].push(change.at);
    }
    let changed = changes.iter().map(|changes| changes.lock().expect("no script panics"));
    let pairs = changed.zip(arrived).flat_map(|(changed, arrived)| {
        let changed = changed.clone().unwrap_or_default();
        changed.into_iter().zip(arrived).collect::<Vec<_>>()
    });
    pairs.map(|(changed, arrived)| arrived.saturating_duration_since(changed)).collect()
}

/// A message that has arrived.
struct Arrival {
    controller: usize,
    tail: String,
    at: Instant,
}

/// Receives all messages about an I1, and about extensions, which do not change.
fn subscribe(port: u16) -> Receiver<Arrival> {
    let mut options = MqttOptions::new("subscriber", "127.0.0.1", port);
    options.set_max_packet_size(1 << 20, 1 << 20);
    let (client, mut connection) = Client::new(options, 10);
    let mut network = connection.eventloop.network_options();
    network.set_tcp_nodelay(true);
    connection.eventloop.set_network_options(network);
    let (sender, receiver) = unbounded();
    let (subscribed, is_subscribed) = unbounded();
    thread::spawn(move || {
        for topic in ["ft/+/extensions", "ft/+/I1"] {
            client.subscribe(topic, QoS::AtLeastOnce).expect("the queue has room");
        }
        for event in connection.iter() {
            match event {
                Ok(Event::Incoming(Packet::SubAck(_))) => {
                    let _ = subscribed.send(());
                }
                Ok(Event::Incoming(Packet::Publish(message))) => {
                    let now = Instant::now();
                    let parts: Vec<&str> = message.topic.split('/').collect();
                    let controller = parts[1].strip_prefix('c').and_then(|name| name.parse().ok());
                    let controller = controller.expect("c0 to c49");
                    let arrival = Arrival { controller, tail: parts[2].to_owned(), at: now };
                    if sender.send(arrival).is_err() {
                        return;
                    }
                }
                Ok(_) => {}
                // The broker has ended.
                Err(_) => return,
            }
        }
    });
    for _ in 0..2 {
        is_subscribed.recv().expect("the broker answers");
    }
    receiver
}

fn print_row(processes: usize, latencies: &[Duration]) {
    let mut sorted = latencies.to_vec();
    sorted.sort();
    let total = CONTROLLERS * CHANGES;
    let at = |part: f64| {
        let index = (sorted.len() as f64 * part) as usize;
        let latency = sorted.get(index.min(sorted.len().saturating_sub(1)));
        latency.map_or(0.0, |latency| latency.as_secs_f64() * 1000.0)
    };
    println!(
        "{:<17} {total:>7}  {:>7}  {:>4}  {:>4.1} ms  {:>4.1} ms  {:>5.1} ms",
        if processes == 1 { "one program" } else { "50 programs" },
        sorted.len(),
        total - sorted.len(),
        at(0.5),
        at(0.99),
        at(1.0),
    );
    if sorted.len() < total {
        std::process::exit(1);
    }
}
