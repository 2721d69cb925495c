//! Connections that nobody uses any more do not add up.

use std::io::{Read, Write};
use std::net::TcpListener;
use std::process::{Command, Stdio};
use std::thread;

use ft_transfer_area::wire::{CommandId, ResponseId, StartOnline};
use ft_transfer_area::{I2cClient, TimeLimits};
use ft_transfer_area_simulator::SimulatedTxt;

use super::support::{accept, command, connect, listener, listening, KitClient, Watch};
use crate::running::Running;

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
    let txt = SimulatedTxt::builder().start().unwrap();
    txt.with_machine(|machine| machine.i2c_device(0x18)[7] = 99);
    let watch = Watch::start(txt.address(), &["--no-page"]);
    let mut program = KitClient::online(([127, 0, 0, 1], watch.port).into());
    let host = format!("127.0.0.1:{}", watch.port + 2);
    let mut i2c = I2cClient::connect(host.as_str(), TimeLimits::default()).unwrap();
    i2c.read(0x18, 7, &mut [0]).unwrap();
    // Each one after the 31st ends another one.
    let to = ([127, 0, 0, 1], watch.port + 2).into();
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
    i2c.read(0x18, 7, &mut [0]).unwrap();
    program.end();
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
