//! Connections that nobody uses any more do not add up.

use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::process::{Command, Stdio};
use std::thread;
use std::time::Duration;

use ft_transfer_area::wire::{
    CommandId, I2cRequestHeader, I2cResponseHeader, ResponseId, StartOnline,
};
use ft_transfer_area_simulator::SimulatedTxt;

use super::support::{accept, command, connect, listener, listening, KitClient, Watch};
use crate::running::Running;

const LONGER_THAN_THE_TEST: Duration = Duration::from_secs(600);

#[test]
fn a_connection_ends_soon_when_its_program_is_gone_and_the_controller_never_ends_it() {
    let (listener, address) = listener();
    let watch = Watch::with_lines(address);
    let mut program = watch.connect();
    program.write_all(&CommandId::QueryStatus.id().to_le_bytes()).unwrap();
    let mut controller = accept(&listener);
    controller.read_exact(&mut [0; 4]).unwrap();
    drop(program);
    watch.line_where(|line| line["what"] == "closed");
    drop(controller);
}

#[test]
fn strangers_do_not_end_the_connection_to_i2c_of_a_program_that_drives() {
    // The program sends nothing over that connection while the strangers come.
    let txt = SimulatedTxt::builder().idle_limit(LONGER_THAN_THE_TEST).start().unwrap();
    txt.with_machine(|machine| machine.i2c_device(0x18)[7] = 99);
    let watch = Watch::start(txt.address(), &["--no-page"]);
    let mut program = KitClient::online(([127, 0, 0, 1], watch.port).into());
    let to = ([127, 0, 0, 1], watch.port + 2).into();
    let mut i2c = connect(to);
    assert_eq!(read_i2c(&mut i2c), 99);
    // Each one after the 31st ends another one.
    let strangers: Vec<_> = (0..34)
        .map(|_| {
            program.exchange([1; 8]);
            let mut stranger = connect(to);
            // The controller serves one connection, and reads nothing of this one.
            stranger.write_all(&[0]).unwrap();
            stranger
        })
        .collect();
    assert!(!matches!((&strangers[1]).read(&mut [0]), Ok(1..)));
    assert_eq!(read_i2c(&mut i2c), 99);
    program.end();
}

/// Reads a register over this connection. An `I2cClient` takes another one after a pause of 4 s.
fn read_i2c(connection: &mut TcpStream) -> u8 {
    let mut request = Vec::new();
    I2cRequestHeader { data_len: 1, device: 0x18, write_len: 1, read_len: 1 }.emit(&mut request);
    request.push(7);
    connection.write_all(&request).unwrap();
    let mut response = [0; I2cResponseHeader::LEN + 1];
    connection.read_exact(&mut response).unwrap();
    response[I2cResponseHeader::LEN]
}

/// Answers StartOnline on the first connection, and keeps all open.
fn keep_all(listener: &TcpListener) {
    let mut kept = vec![accept(listener)];
    kept[0].read_exact(&mut [0; StartOnline::LEN]).unwrap();
    kept[0].write_all(&ResponseId::StartOnline.id().to_le_bytes()).unwrap();
    loop {
        let mut stream = accept(listener);
        if stream.read(&mut [0]).is_ok_and(|count| count > 0) {
            stream.write_all(b"hello").unwrap();
        }
        kept.push(stream);
    }
}

#[cfg_attr(not(unix), ignore = "the limit for open files is set by a shell")]
#[test]
fn a_program_is_served_however_many_connections_were_left_open() {
    one_that_drives_stays(&[]);
    one_that_drives_stays(&["--leave-outputs"]);
}

/// When other programs leave as many connections open as there is room for.
fn one_that_drives_stays(arguments: &[&str]) {
    let (listener, address) = listener();
    thread::spawn(move || keep_all(&listener));
    let watch = command(address, &[&["--no-page", "--json"], arguments].concat());
    let mut limited = Command::new("sh");
    limited.args(["-c", "ulimit -n 128 && exec \"$@\"", "sh"]).stdin(Stdio::null());
    let watch = Running::start(limited.arg(watch.get_program()).args(watch.get_args()));
    let to = ([127, 0, 0, 1], listening(&watch.line())).into();
    let mut drives = connect(to);
    let mut start = Vec::new();
    StartOnline::new().emit(&mut start);
    drives.write_all(&start).unwrap();
    drives.read_exact(&mut [0; 4]).unwrap();
    let used: Vec<_> = (0..150)
        .map(|_| {
            let mut program = connect(to);
            program.write_all(b"x").unwrap();
            program.read_exact(&mut [0; 5]).unwrap();
            program
        })
        .collect();
    // The first one to end is the first of these, and not the one that drives.
    assert!(!matches!((&used[0]).read(&mut [0]), Ok(1..)));
    drives.set_nonblocking(true).unwrap();
    assert!(drives
        .read(&mut [0])
        .is_err_and(|error| error.kind() == std::io::ErrorKind::WouldBlock));
}
