//! Every byte, every end of a direction and every reset passes as it is.

use std::io::{Read, Write};
use std::net::{Shutdown, TcpStream};
use std::thread;

use ft_transfer_area_simulator::world::World;
use ft_transfer_area_simulator::SimulatedTxt;

use super::support::{accept, connect, is_reset, listener, KitClient, Watch};

/// How many exchanges are compared.
const EXCHANGES: i16 = 2000;

/// A simulated TXT that says the same in each run.
fn txt() -> SimulatedTxt {
    let world = World::shipped("slide").unwrap();
    SimulatedTxt::builder().world(world).lock_step().start().unwrap()
}

/// What a client receives that drives the slide back and forth.
fn received_by_client(to: std::net::SocketAddr) -> Vec<u8> {
    let mut client = KitClient::online(to);
    for number in 0..EXCHANGES {
        let duty = if number / 100 % 2 == 0 { [512 - number % 7, 0] } else { [0, 300] };
        let duty = [duty[0], duty[1], 0, 0, 0, 0, number % 513, 0];
        if number % 50 == 49 {
            client.simple_exchange(duty);
        } else {
            client.exchange(duty);
        }
    }
    client.end()
}

#[test]
fn a_client_of_the_kit_receives_the_same_bytes_as_without_it() {
    let (direct, watched) = (txt(), txt());
    let watch = Watch::start(watched.address(), &["--no-page"]);
    let expected = received_by_client(direct.address());
    assert!(expected.len() > 20 * EXCHANGES as usize, "values change: {}", expected.len());
    assert!(received_by_client(([127, 0, 0, 1], watch.port).into()) == expected);
    let exchanges = |txt: &SimulatedTxt| txt.with_machine(|machine| machine.exchanges());
    assert_eq!(exchanges(&watched), exchanges(&direct));
}

/// Bytes that mean nothing.
fn noise(count: usize, seed: u32) -> Vec<u8> {
    let mut state = seed;
    let mut next = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 24) as u8
    };
    (0..count).map(|_| next()).collect()
}

/// Sends these bytes in one direction, ends it, and returns what arrives until the end.
fn pass(mut from: TcpStream, mut to: TcpStream, bytes: Vec<u8>) -> (TcpStream, TcpStream, Vec<u8>) {
    let writer = thread::spawn(move || {
        from.write_all(&bytes).unwrap();
        from.shutdown(Shutdown::Write).unwrap();
        from
    });
    let mut arrived = Vec::new();
    to.read_to_end(&mut arrived).unwrap();
    (writer.join().unwrap(), to, arrived)
}

#[test]
fn what_is_unknown_passes_in_both_directions_and_is_told() {
    let (listener, address) = listener();
    let watch = Watch::with_lines(address);
    let program = watch.connect();
    let controller = accept(&listener);
    // All of it has room while it waits to be looked at.
    let (up, down) = (noise(400_000, 1), noise(400_000, 2));
    let (program, controller, arrived) = pass(program, controller, up.clone());
    assert!(arrived == up);
    // The other direction is still open.
    let (_controller, _program, arrived) = pass(controller, program, down.clone());
    assert!(arrived == down);
    let mut bytes = [0; 2];
    watch.line_where(|line| {
        if line["what"] == "unknown" {
            bytes[usize::from(line["from"] == "program")] += line["bytes"].as_u64().unwrap();
        }
        line["what"] == "closed" && line["connection"] == "main"
    });
    assert_eq!(bytes, [400_000; 2]);
}

#[test]
fn what_the_controller_says_wrong_is_told_as_said_by_it() {
    let (listener, address) = listener();
    let watch = Watch::with_lines(address);
    let (mut program, mut controller) = (watch.connect(), accept(&listener));
    controller.write_all(&noise(1000, 3)).unwrap();
    let mut arrived = vec![0; 1000];
    program.read_exact(&mut arrived).unwrap();
    assert!(arrived == noise(1000, 3));
    let reported = watch.line_where(|line| line["what"] == "unknown");
    assert_eq!(reported["from"], "controller");
}

#[cfg_attr(windows, ignore = "Wine loses a reset when it reports it: the next read is an end")]
#[test]
fn a_reset_is_passed_on_as_a_reset_and_an_end_as_an_end() {
    let (listener, address) = listener();
    let watch = Watch::start(address, &["--no-page"]);
    for reset in [true, false] {
        let (program, mut controller) = (watch.connect(), accept(&listener));
        if reset {
            socket2::SockRef::from(&program).set_linger(Some(std::time::Duration::ZERO)).unwrap();
        }
        drop(program);
        assert_eq!(is_reset(controller.read(&mut [0])), reset, "from the program");
        drop(controller);

        let (mut program, controller) = (watch.connect(), accept(&listener));
        if reset {
            let controller = socket2::SockRef::from(&controller);
            controller.set_linger(Some(std::time::Duration::ZERO)).unwrap();
        }
        drop(controller);
        assert_eq!(is_reset(program.read(&mut [0])), reset, "from the controller");
    }
}

#[test]
fn a_receiver_that_pauses_holds_up_its_sender_and_loses_nothing() {
    let (listener, address) = listener();
    let watch = Watch::start(address, &["--no-page"]);
    let (mut program, mut controller) = (watch.connect(), accept(&listener));
    let bytes = noise(40_000_000, 4);
    let sent = bytes.clone();
    let writer = thread::spawn(move || {
        controller.write_all(&sent).unwrap();
        controller
    });
    // Far more than the buffers of the operating system hold is on its way.
    let mut arrived = Vec::new();
    let mut piece = vec![0; 1 << 20];
    while arrived.len() < bytes.len() {
        thread::sleep(std::time::Duration::from_millis(10));
        let count = program.read(&mut piece).unwrap();
        assert!(count > 0, "{}", arrived.len());
        arrived.extend_from_slice(&piece[..count]);
        if arrived.len() == count {
            // Another connection is not held up by it.
            let (mut other, mut its_controller) = (watch.connect(), accept(&listener));
            other.write_all(b"hello").unwrap();
            its_controller.read_exact(&mut [0; 5]).unwrap();
        }
    }
    assert!(arrived == bytes);
    drop(writer.join().unwrap());
}

#[test]
fn the_ports_of_the_camera_and_of_i2c_are_the_next_two() {
    let txt = SimulatedTxt::builder().start().unwrap();
    assert_eq!(txt.i2c_port(), txt.port() + 2);
    let watch = Watch::start(txt.address(), &["--no-page"]);
    let mut stream = connect(([127, 0, 0, 1], watch.port + 2).into());
    // A request to a device that there is not.
    let request = [0xB9, 0xDB, 0x3B, 0x39, 1, 0, 0, 0, 0x18, 0, 0, 0, 1, 0, 1, 0, 7];
    stream.write_all(&request).unwrap();
    let mut response = [1; 12];
    stream.read_exact(&mut response).unwrap();
    assert_eq!(response, [0x87, 0xFD, 0x0D, 0x90, 0, 0, 0, 0, 0, 0, 0, 0]);
}
