//! `I2cClient`: devices at the controller.

use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use ft_transfer_area::wire::I2cRequestHeader;
use ft_transfer_area::{Error, I2cClient, TimeLimits};
use ft_transfer_area_simulator::SimulatedTxt;

use crate::support::{check_client, handler_for, unpaced, unused_ports, wait_until};

const DEVICE: u8 = 0x18;

/// The start of a good response, and the firmware's for a missing device. How many bytes follow a good one is known
/// from the request.
const GOOD: [u8; 12] = [0x87, 0xFD, 0x0D, 0x90, 2, 0, 0, 0, 1, 0, 2, 0];
const NO_DEVICE: [u8; 12] = [0x87, 0xFD, 0x0D, 0x90, 0, 0, 0, 0, 0, 0, 0, 0];

fn client_of(txt: &SimulatedTxt) -> I2cClient {
    I2cClient::connect(format!("127.0.0.1:{}", txt.i2c_port()), TimeLimits::default()).unwrap()
}

fn i2c_connections(txt: &SimulatedTxt) -> u64 {
    txt.with_machine(|machine| machine.i2c_connections())
}

/// What a controller made by the test does on one connection.
struct Serve {
    /// Its answers, one for each request.
    answers: Vec<Vec<u8>>,
    /// Whether it then waits for the client to close, instead of closing itself.
    waits: bool,
}

impl Serve {
    fn then_close(answers: &[&[u8]]) -> Self {
        Self { answers: answers.iter().map(|answer| answer.to_vec()).collect(), waits: false }
    }

    fn then_wait(answers: &[&[u8]]) -> Self {
        Self { waits: true, ..Self::then_close(answers) }
    }

    /// Serves a client; returns the requests that it sent.
    fn run(self, mut stream: TcpStream) -> Vec<Vec<u8>> {
        let mut requests = Vec::new();
        for answer in self.answers {
            requests.push(read_request(&mut stream));
            stream.write_all(&answer).unwrap();
        }
        if self.waits {
            let mut rest = Vec::new();
            // A reset is also an end.
            let _ = stream.read_to_end(&mut rest);
            assert!(rest.is_empty(), "{rest:?} came too much");
        }
        requests
    }
}

fn read_request(stream: &mut TcpStream) -> Vec<u8> {
    let mut request = vec![0; I2cRequestHeader::LEN];
    stream.read_exact(&mut request).unwrap();
    let header = I2cRequestHeader::parse(&request).unwrap();
    let mut write = vec![0; header.write_len as usize];
    stream.read_exact(&mut write).unwrap();
    request.extend(write);
    request
}

/// A client of a controller made by the test, with these connections, and the requests on each.
fn controller(
    connections: Vec<Serve>,
    limits: TimeLimits,
) -> (I2cClient, JoinHandle<Vec<Vec<Vec<u8>>>>) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = listener.local_addr().unwrap().port();
    let server = thread::spawn(move || {
        let serve = |connection: Serve| connection.run(listener.accept().unwrap().0);
        connections.into_iter().map(serve).collect()
    });
    (I2cClient::connect(format!("127.0.0.1:{port}"), limits).unwrap(), server)
}

#[test]
fn registers_are_read_and_written_while_a_transfer_runs() {
    let txt = unpaced().start().unwrap();
    txt.with_machine(|machine| machine.i2c_device(DEVICE)[0x3F..0x42].copy_from_slice(&[7, 8, 9]));
    let handler = handler_for(&txt).build().unwrap();
    handler.begin_transfer().unwrap();
    let mut i2c = handler.i2c().unwrap();
    let mut values = [0; 3];
    i2c.read(DEVICE, 0x3F, &mut values).unwrap();
    assert_eq!(values, [7, 8, 9]);
    i2c.write(DEVICE, 0x10, &[0x80, 1, 2]).unwrap();
    let written = txt.with_machine(|machine| machine.i2c_device(DEVICE)[0x10..0x13].to_vec());
    assert_eq!(written, [0x80, 1, 2]);
    i2c.write_read(DEVICE, &[0x11, 5], &mut values[..1]).unwrap();
    assert_eq!(values, [2, 8, 9]);
    i2c.write_read(DEVICE, &[0x11], &mut []).unwrap();
    drop(handler.areas().wait_cycle().unwrap());
    handler.i2c().unwrap().read(DEVICE, 0x11, &mut values[..1]).unwrap();
    assert_eq!(values, [5, 8, 9]);
    assert_eq!(i2c_connections(&txt), 1);
    handler.end_transfer().unwrap();
    check_client(&txt);
}

#[test]
fn without_a_transfer_there_is_no_i2c_and_a_client_waits_for_the_next_one() {
    let txt = unpaced().start().unwrap();
    txt.with_machine(|machine| machine.i2c_device(DEVICE)[1] = 5);
    let handler = handler_for(&txt).build().unwrap();
    let not_online = Error::NotOnline { command: "an I2C request" };
    assert_eq!(handler.i2c().unwrap_err(), not_online);
    handler.begin_transfer().unwrap();
    let mut i2c = handler.i2c().unwrap();
    for transfers in 1..=2 {
        let mut value = [0];
        i2c.read(DEVICE, 1, &mut value).unwrap();
        assert_eq!(value, [5]);
        assert_eq!(i2c_connections(&txt), transfers);
        handler.end_transfer().unwrap();
        assert_eq!(i2c.read(DEVICE, 1, &mut value), Err(not_online.clone()));
        handler.begin_transfer().unwrap();
    }
}

/// The controller closes a connection that is silent for 5 s, and a TXT accepts no other one.
#[test]
fn a_pause_of_more_than_five_seconds_loses_nothing_while_a_transfer_runs() {
    let txt = SimulatedTxt::builder().i2c_port(0).start().unwrap();
    txt.with_machine(|machine| machine.i2c_device(DEVICE)[1] = 5);
    let handler = handler_for(&txt).i2c_port(txt.i2c_port()).build().unwrap();
    handler.begin_transfer().unwrap();
    wait_until(&txt, "the connection of I2C", |machine| machine.i2c_connections() == 1);
    thread::sleep(Duration::from_secs(6));
    let mut value = [0];
    handler.i2c().unwrap().read(DEVICE, 1, &mut value).unwrap();
    assert_eq!((value, i2c_connections(&txt)), ([5], 1));
    handler.end_transfer().unwrap();
    check_client(&txt);
}

/// As on the I2C bus: a device knows the register that comes next.
#[test]
fn a_read_that_writes_nothing_goes_on_where_the_device_is() {
    let txt = unpaced().start().unwrap();
    txt.with_machine(|machine| {
        machine.i2c_device(DEVICE)[0x3F..0x43].copy_from_slice(&[7, 8, 9, 10])
    });
    let mut i2c = client_of(&txt);
    let mut values = [0; 2];
    i2c.write_read(DEVICE, &[0x3F], &mut values[..1]).unwrap();
    i2c.write_read(DEVICE, &[], &mut values).unwrap();
    assert_eq!(values, [8, 9]);
    i2c.write_read(DEVICE, &[], &mut values[..1]).unwrap();
    assert_eq!(values[0], 10);
    let none = Err(Error::I2cNoDevice { device: DEVICE + 1 });
    assert_eq!(i2c.write_read(DEVICE + 1, &[], &mut values), none);
}

#[test]
fn i2c_has_the_second_port_after_the_main_one_or_its_own() {
    for own_port in [false, true] {
        let mut builder = unpaced();
        if own_port {
            builder = builder.i2c_port(0);
        }
        let txt = builder.start().unwrap();
        assert_eq!(txt.i2c_port() == txt.port() + 2, !own_port);
        txt.with_machine(|machine| machine.i2c_device(DEVICE)[1] = 5);
        let mut handler = handler_for(&txt);
        if own_port {
            handler = handler.i2c_port(txt.i2c_port());
        }
        let handler = handler.build().unwrap();
        handler.begin_transfer().unwrap();
        let mut value = [0];
        handler.i2c().unwrap().read(DEVICE, 1, &mut value).unwrap();
        assert_eq!(value, [5]);
    }
}

#[test]
fn the_maximum_number_of_bytes_is_read_and_written() {
    let txt = unpaced().start().unwrap();
    let registers: [u8; 256] = std::array::from_fn(|index| index as u8 ^ 0x55);
    txt.with_machine(|machine| *machine.i2c_device(DEVICE) = registers);
    let mut i2c = client_of(&txt);
    let mut values = vec![0; 1024];
    i2c.read(DEVICE, 3, &mut values).unwrap();
    let expected = registers.iter().cycle().skip(3);
    assert!(values.iter().eq(expected.take(1024)));
    i2c.write(DEVICE, 0, &[9; 254]).unwrap();
    let [before @ .., last_but_one, last] = txt.with_machine(|machine| *machine.i2c_device(DEVICE));
    assert_eq!((before, last_but_one, last), ([9; 254], 254 ^ 0x55, 255 ^ 0x55));
    i2c.write(DEVICE, 0, &[8; 1023]).unwrap();
    assert_eq!(txt.with_machine(|machine| *machine.i2c_device(DEVICE)), [8; 256]);
    i2c.write_read(DEVICE, &[7; 1024], &mut []).unwrap();
    assert_eq!(txt.with_machine(|machine| *machine.i2c_device(DEVICE)), [7; 256]);
}

#[test]
fn requests_are_byte_for_byte_ftrobopys() {
    let read = [&GOOD[..], &[10, 20, 30, 40, 50, 60]].concat();
    let answers = [&read[..], &GOOD, &GOOD];
    let serve = vec![Serve::then_close(&answers)];
    let (mut i2c, server) = controller(serve, TimeLimits::default());
    let mut values = [0; 6];
    i2c.read(0x18, 0x3F, &mut values).unwrap();
    assert_eq!(values, [10, 20, 30, 40, 50, 60]);
    i2c.write(0x18, 0x3E, &[0x80]).unwrap();
    i2c.write_read(0x18, &[0x40, 1, 2, 3], &mut []).unwrap();
    let recorded = [
        // i2c_read(0x18, 0x3f, data_len=6)
        vec![0xB9, 0xDB, 0x3B, 0x39, 1, 0, 0, 0, 0x18, 0, 0, 0, 1, 0, 6, 0, 0x3F],
        // i2c_write(0x18, 0x3e, 0x80)
        vec![0xB9, 0xDB, 0x3B, 0x39, 2, 0, 0, 0, 0x18, 0, 0, 0, 2, 0, 0, 0, 0x3E, 0x80],
        // i2c_write_buffer(0x18, b"\x40\x01\x02\x03", 4)
        vec![0xB9, 0xDB, 0x3B, 0x39, 4, 0, 0, 0, 0x18, 0, 0, 0, 4, 0, 0, 0, 0x40, 1, 2, 3],
    ];
    assert_eq!(server.join().unwrap(), [recorded]);
}

#[test]
fn a_device_that_is_not_there_is_an_error_and_the_connection_goes_on() {
    let txt = unpaced().start().unwrap();
    let mut i2c = client_of(&txt);
    let mut values = [7; 6];
    let error = Error::I2cNoDevice { device: 0x19 };
    assert_eq!(i2c.read(0x19, 0x3F, &mut values), Err(error.clone()));
    assert_eq!(values, [7; 6]);
    assert_eq!(i2c.write(0x19, 0x10, &[1]), Err(error.clone()));
    assert_eq!(i2c.write_read(0x19, &[1], &mut values), Err(error.clone()));
    assert!(error.to_string().contains("at the address 0x19"), "{error}");
    txt.with_machine(|machine| machine.i2c_device(0x19)[1] = 5);
    i2c.read(0x19, 1, &mut values[..1]).unwrap();
    assert_eq!((values[0], i2c_connections(&txt)), (5, 1));
}

#[test]
fn what_no_request_can_hold_is_refused_and_nothing_is_sent() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = listener.local_addr().unwrap().port();
    let mut i2c = I2cClient::connect(format!("127.0.0.1:{port}"), TimeLimits::default()).unwrap();
    let out_of_range =
        |what, given, least, most| Err(Error::OutOfRange { what, given, least, most });
    let (read, write) = ("number of bytes to read", "number of bytes to write");
    let address = |given| out_of_range("I2C device's address", given, 0, 127);
    let mut long = vec![7; 1025];

    for device in [128, 255] {
        assert_eq!(i2c.read(device, 0, &mut [0]), address(device.into()));
        assert_eq!(i2c.write(device, 0, &[0]), address(device.into()));
        assert_eq!(i2c.write_read(device, &[0], &mut [0]), address(device.into()));
    }
    assert_eq!(i2c.read(DEVICE, 0, &mut []), out_of_range(read, 0, 1, 1024));
    assert_eq!(i2c.read(DEVICE, 0, &mut long), out_of_range(read, 1025, 1, 1024));
    assert_eq!(i2c.write(DEVICE, 0, &[]), out_of_range(write, 0, 1, 1023));
    assert_eq!(i2c.write(DEVICE, 0, &long[..1024]), out_of_range(write, 1024, 1, 1023));
    assert_eq!(i2c.write_read(DEVICE, &[], &mut []), out_of_range(read, 0, 1, 1024));
    assert_eq!(i2c.write_read(DEVICE, &[], &mut long), out_of_range(read, 1025, 1, 1024));
    let refused = i2c.write_read(DEVICE, &[0; 1025], &mut [0]);
    assert_eq!(refused, out_of_range(write, 1025, 0, 1024));
    let refused = i2c.write_read(DEVICE, &[0], &mut long);
    assert_eq!(refused, out_of_range(read, 1025, 0, 1024));
    assert!(long.iter().all(|value| *value == 7));

    drop(i2c);
    let mut sent = Vec::new();
    listener.accept().unwrap().0.read_to_end(&mut sent).unwrap();
    assert!(sent.is_empty(), "{sent:?} was sent");
}

#[test]
fn a_wrong_answer_is_an_error_and_the_next_request_has_a_new_connection() {
    let good = [&GOOD[..], &[1, 2]].concat();
    let packet = "response to an I2C request";
    let wrong_id = |found| Error::WrongId { packet, expected: 0x900D_FD87, found };
    let closed = |received| Error::ConnectionClosed { command: "an I2C request", received };
    let answer = |bytes: &[&[u8]]| bytes.concat();
    let cases = [
        (answer(&[&[0x90, 0x0D, 0xFD, 0x87], &GOOD[4..], &[1, 2]]), wrong_id(0x87FD_0D90)),
        (answer(&[&[0; 12], &[1, 2]]), wrong_id(0)),
        (answer(&[&good, &[3]]), Error::WrongSize { packet, expected: 14, found: 15 }),
        (answer(&[&NO_DEVICE, &[1]]), Error::WrongSize { packet, expected: 12, found: 13 }),
        (answer(&[&GOOD, &[1]]), closed(13)),
        (GOOD.to_vec(), closed(12)),
        (GOOD[..5].to_vec(), closed(5)),
        (Vec::new(), closed(0)),
    ];
    for (answer, error) in cases {
        let connections = vec![Serve::then_close(&[&answer]), Serve::then_close(&[&good])];
        let (mut i2c, server) = controller(connections, TimeLimits::default());
        let mut values = [7; 2];
        assert_eq!(i2c.read(DEVICE, 5, &mut values), Err(error));
        assert_eq!(values, [7; 2]);
        i2c.read(DEVICE, 6, &mut values).unwrap();
        assert_eq!(values, [1, 2]);
        // Each request went out once.
        let requests = server.join().unwrap();
        let registers = requests.iter().map(|requests| {
            let [request] = &requests[..] else { panic!("{requests:?}") };
            request[16]
        });
        assert!(registers.eq([5, 6]));
    }
}

#[test]
fn no_answer_in_time_is_an_error_and_the_next_request_has_a_new_connection() {
    let connections = vec![
        // One byte is missing.
        Serve::then_wait(&[&[&GOOD[..], &[1]].concat()]),
        Serve::then_close(&[&[&GOOD[..], &[3, 4]].concat()]),
    ];
    let limit = Duration::from_millis(500);
    let limits = TimeLimits::default().read(limit);
    let (mut i2c, server) = controller(connections, limits);
    let mut values = [7; 2];
    let no_answer = Error::NoAnswer { command: "an I2C request", limit, received: 13 };
    assert_eq!(i2c.read(DEVICE, 5, &mut values), Err(no_answer));
    assert_eq!(values, [7; 2]);
    i2c.read(DEVICE, 6, &mut values).unwrap();
    assert_eq!(values, [3, 4]);
    let requests = server.join().unwrap();
    assert!(requests.iter().map(Vec::len).eq([1, 1]), "{requests:?}");
}

#[test]
fn a_connection_that_the_controller_has_closed_for_its_silence_is_made_again() {
    let txt = unpaced().idle_limit(Duration::from_millis(500)).start().unwrap();
    txt.with_machine(|machine| machine.i2c_device(DEVICE)[1] = 5);
    let mut i2c = client_of(&txt);
    let mut value = [0];
    for connections in 1..=2 {
        i2c.read(DEVICE, 1, &mut value).unwrap();
        assert_eq!(value, [5]);
        assert_eq!(i2c_connections(&txt), connections);
        wait_until(&txt, "the end of a silent connection", |machine| !machine.i2c_connected());
    }
    // A device that is not there does not change that.
    assert_eq!(i2c.read(0x19, 1, &mut value), Err(Error::I2cNoDevice { device: 0x19 }));
    assert_eq!(i2c_connections(&txt), 3);
}

#[test]
fn a_controller_that_is_away_is_an_error_until_it_is_back() {
    let port = unused_ports();
    let away = Error::ConnectionRefused { address: format!("127.0.0.1:{port}") };
    let refused = I2cClient::connect(format!("127.0.0.1:{port}"), TimeLimits::default());
    assert_eq!(refused.unwrap_err(), away);

    let start = || unpaced().i2c_port(port).start().unwrap();
    let txt = start();
    let mut i2c = client_of(&txt);
    drop(txt);
    assert_eq!(i2c.write(DEVICE, 1, &[5]), Err(away.clone()));
    assert_eq!(i2c.write(DEVICE, 1, &[6]), Err(away));
    let txt = start();
    txt.with_machine(|machine| machine.i2c_device(DEVICE)[1] = 1);
    i2c.write(DEVICE, 2, &[7]).unwrap();
    assert_eq!(txt.with_machine(|machine| machine.i2c_device(DEVICE)[1..3].to_vec()), [1, 7]);
}

#[test]
fn reading_and_writing_allocates_nothing() {
    let txt = unpaced().start().unwrap();
    txt.with_machine(|machine| machine.i2c_device(DEVICE)[1] = 5);
    let mut i2c = client_of(&txt);
    let mut values = [0; 6];
    i2c.read(DEVICE, 1, &mut values).unwrap();
    let allocations = allocation_counter::measure(|| {
        for value in 0..100 {
            i2c.write(DEVICE, 1, &[value, 1]).unwrap();
            i2c.read(DEVICE, 1, &mut values).unwrap();
        }
    });
    assert_eq!((allocations.count_total, values[0]), (0, 99));
}
