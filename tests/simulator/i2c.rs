//! The I2C port, with requests as ftrobopy makes them.

use std::io::{ErrorKind, Read, Write};
use std::net::{Ipv4Addr, TcpStream};
use std::process::Command;
use std::sync::Arc;
use std::thread;
use std::time::Duration;

use ft_transfer_area::wire::{CommandId, ResponseId};
use ft_transfer_area_simulator::SimulatedTxt;

use crate::endings::assert_drops;
use crate::unpaced;
use crate::wire_client::{Client, LIMIT};

/// The firmware's response to a request that has failed.
const FAILED: [u8; 12] = [0x87, 0xFD, 0x0D, 0x90, 0, 0, 0, 0, 0, 0, 0, 0];

/// The start of the firmware's response with this number of bytes.
fn good(read: u16) -> [u8; 12] {
    let [low, high] = read.to_le_bytes();
    [0x87, 0xFD, 0x0D, 0x90, low, high, 0, 0, 1, 0, low, high]
}

fn connect(txt: &SimulatedTxt) -> TcpStream {
    let stream = TcpStream::connect((Ipv4Addr::LOCALHOST, txt.i2c_port())).unwrap();
    stream.set_read_timeout(Some(LIMIT)).unwrap();
    stream
}

fn request(device: u8, write: &[u8], read: u16) -> Vec<u8> {
    let mut bytes = vec![0xB9, 0xDB, 0x3B, 0x39];
    bytes.extend((write.len() as u32).to_le_bytes());
    bytes.extend([device, 0, 0, 0]);
    bytes.extend((write.len() as u16).to_le_bytes());
    bytes.extend(read.to_le_bytes());
    bytes.extend(write);
    bytes
}

/// Sends a request. Returns whether it was a success, and what was read.
fn transfer(stream: &mut TcpStream, request: &[u8], read: usize) -> Vec<u8> {
    stream.write_all(request).unwrap();
    let mut response = vec![0; 12 + read];
    stream.read_exact(&mut response).unwrap();
    assert_eq!(response[..12], good(read as u16));
    response[12..].to_vec()
}

fn assert_closed(stream: &mut TcpStream) {
    // Unlike `read`, it goes on after a signal, as when a child has ended.
    let closed = stream.read_exact(&mut [0]).unwrap_err().kind();
    assert!([ErrorKind::UnexpectedEof, ErrorKind::ConnectionReset].contains(&closed), "{closed}");
}

/// Also when its threads are late.
#[test]
fn each_session_has_its_i2c_server_at_once_and_no_client_ends_that_of_the_next_one() {
    let txt = Arc::new(unpaced().strict(true).start().unwrap());
    let mut main = Client::connect(&txt);
    // Who has the machine makes all threads wait that need it.
    let late = Arc::downgrade(&txt);
    let look = |txt: Arc<SimulatedTxt>| {
        txt.with_machine(|_| thread::sleep(Duration::from_micros(300)));
    };
    let looker = thread::spawn(move || while late.upgrade().map(look).is_some() {});
    // A process has the listeners of this one until its program begins.
    let others = Arc::downgrade(&txt);
    let starter = thread::spawn(move || {
        while others.strong_count() > 0 {
            // Without such a program, nothing is started.
            let _ = Command::new("true").status();
        }
    });
    for _ in 0..100 {
        main.start_online();
        let mut stream = connect(&txt);
        stream.write_all(&request(0, &[], 0)).unwrap();
        let mut answer = [0; 12];
        stream.read_exact(&mut answer).unwrap();
        assert_eq!(answer, FAILED);
        // No more may be written.
        stream.write_all(&request(0x18, &[0; 1025], 0)).unwrap();
        assert_closed(&mut stream);
        main.command(CommandId::StopOnline);
        ResponseId::StopOnline.check(&main.receive(4)).unwrap();
    }
    drop(txt);
    looker.join().unwrap();
    starter.join().unwrap();
}

#[test]
fn registers_are_read_and_written() {
    let txt = unpaced().start().unwrap();
    txt.with_machine(|machine| machine.i2c_device(0x18)[0x3F..0x42].copy_from_slice(&[7, 8, 9]));
    let mut stream = connect(&txt);
    assert_eq!(transfer(&mut stream, &request(0x18, &[0x3F], 3), 3), [7, 8, 9]);
    assert!(transfer(&mut stream, &request(0x18, &[0x10, 0x80], 0), 0).is_empty());
    assert!(transfer(&mut stream, &request(0x18, &[0x11, 1, 2], 0), 0).is_empty());
    assert_eq!(
        txt.with_machine(|machine| machine.i2c_device(0x18)[0x10..0x13].to_vec()),
        [0x80, 1, 2]
    );
    assert_eq!(txt.with_machine(|machine| machine.i2c_addresses().collect::<Vec<_>>()), [0x18]);
}

#[test]
fn a_missing_device_is_no_success_and_the_connection_goes_on() {
    let txt = unpaced().start().unwrap();
    let mut stream = connect(&txt);
    for read in [0, 6] {
        stream.write_all(&request(0x19, &[0x3F], read)).unwrap();
        let mut response = [0xFF; 12];
        stream.read_exact(&mut response).unwrap();
        assert_eq!(response, FAILED);
    }
    txt.with_machine(|machine| machine.i2c_device(0x19)[1] = 5);
    assert_eq!(transfer(&mut stream, &request(0x19, &[1], 1), 1), [5]);
}

#[test]
fn three_hundred_bytes_are_read_and_a_request_for_nothing_fails() {
    let txt = unpaced().start().unwrap();
    txt.with_machine(|machine| machine.i2c_device(0x18)[0x10] = 0xAB);
    let mut stream = connect(&txt);
    let read = transfer(&mut stream, &request(0x18, &[0x10], 300), 300);
    assert_eq!(
        (read[0], read[256], read.iter().filter(|byte| **byte != 0).count()),
        (0xAB, 0xAB, 2)
    );
    stream.write_all(&request(0x18, &[], 0)).unwrap();
    let mut response = [0xFF; 12];
    stream.read_exact(&mut response).unwrap();
    assert_eq!(response, FAILED);
}

#[test]
fn bytes_that_are_no_request_end_the_connection_and_the_next_is_served() {
    let txt = unpaced().start().unwrap();
    txt.with_machine(|machine| machine.i2c_device(1)[0] = 5);
    let mut other_count = request(1, &[0], 1);
    other_count[4] = 2;
    let garbage = [
        b"GET / HTTP/1.1\r\n\r\n".to_vec(),
        request(0x80, &[0], 1),
        request(1, &[0; 1025], 0),
        other_count,
    ];
    for garbage in garbage {
        let mut stream = connect(&txt);
        stream.write_all(&garbage).unwrap();
        assert_closed(&mut stream);
    }
    let mut stream = connect(&txt);
    assert_eq!(transfer(&mut stream, &request(1, &[0], 1), 1), [5]);
}

#[test]
fn a_connection_without_requests_is_closed() {
    let txt = unpaced().idle_limit(Duration::from_millis(30)).start().unwrap();
    assert_closed(&mut connect(&txt));
    // Half a request does not count.
    let mut stream = connect(&txt);
    stream.write_all(&request(1, &[0], 1)[..9]).unwrap();
    assert_closed(&mut stream);
}

#[test]
fn dropping_does_not_wait_for_the_i2c_client() {
    let txt = unpaced().start().unwrap();
    let mut stream = connect(&txt);
    assert_drops(txt);
    assert_closed(&mut stream);
}
