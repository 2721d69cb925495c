//! After any bad input the connection is closed and the next client is served.

use std::io::{ErrorKind, Write};
use std::net::Shutdown;
use std::time::Duration;

use ft_transfer_area::wire::{CmprHeader, CommandId, ExchangeData, StartOnline};
use ft_transfer_area_simulator::{Fault, FaultKind};

use crate::unpaced;
use crate::wire_client::{Client, LIMIT};

/// Every command that has a body.
fn commands() -> Vec<Vec<u8>> {
    let (mut start, mut exchange, mut compressed) = (Vec::new(), Vec::new(), Vec::new());
    StartOnline::new().emit(&mut start);
    ExchangeData::default().emit(&mut exchange);
    let header = CmprHeader { extra_size: 2, crc: 0x4049_3A53, active_extensions: 0 };
    header.emit_command(&mut compressed);
    compressed.extend([0xFD, 0x07]);
    let mut update = CommandId::UpdateConfig.id().to_le_bytes().to_vec();
    update.resize(96, 0);
    let mut camera = CommandId::StartCameraOnline.id().to_le_bytes().to_vec();
    camera.resize(20, 0);
    vec![start, exchange, compressed, update, camera]
}

#[test]
fn truncated_commands_are_not_carried_out() {
    let txt = unpaced().start().unwrap();
    for command in commands() {
        for length in [1, 4, command.len() / 2, command.len() - 1] {
            let mut client = Client::online(&txt);
            client.send(&command[..length]);
            client.stream.shutdown(Shutdown::Write).unwrap();
            assert_eq!(client.until_closed(), []);
        }
    }
    assert_eq!(txt.with_machine(|machine| (machine.exchanges(), machine.camera())), (0, None));
    Client::online(&txt).exchange_compressed(&[[0; 27]], 0);
}

#[test]
fn a_truncated_command_on_an_open_connection_ends_at_the_idle_limit() {
    let txt = unpaced().idle_limit(Duration::from_millis(300)).start().unwrap();
    for command in commands() {
        let mut client = Client::online(&txt);
        client.send(&command[..command.len() - 1]);
        assert_eq!(client.until_closed(), []);
    }
    assert_eq!(txt.with_machine(|machine| machine.exchanges()), 0);
}

#[test]
fn unknown_ids_end_the_connection() {
    let txt = unpaced().start().unwrap();
    // Ids of responses, of the camera, of I2C, and with all bits equal.
    for id in [0, u32::MAX, 0xBAC9_723E, 0x6F3B_54E6, 0xBDC2_D7A1, 0xADA0_9FBA, 0x393B_DBB9] {
        let mut client = Client::online(&txt);
        client.send(&id.to_le_bytes());
        assert_eq!(client.until_closed(), [], "{id:#010x}");
    }
    Client::online(&txt).exchange_compressed(&[[0; 27]], 0);
}

#[test]
fn a_client_that_writes_and_never_reads_is_cut_off() {
    // Long answers, because the buffers of a system can have room for a hundred thousand short ones.
    let surplus = Fault::at_each_exchange(FaultKind::Surplus(1 << 16));
    let txt = unpaced().fault(surplus).start().unwrap();
    let client = Client::online(&txt);
    client.stream.set_write_timeout(Some(LIMIT)).unwrap();
    let mut exchanges = Vec::new();
    (0..100).for_each(|_| ExchangeData::default().emit(&mut exchanges));
    // Its exchanges are answered until the answers fill all buffers, and then not for a second.
    let error = loop {
        if let Err(error) = (&client.stream).write_all(&exchanges) {
            break error;
        }
    };
    use ErrorKind::{BrokenPipe, ConnectionAborted, ConnectionReset};
    let is_cut_off = [BrokenPipe, ConnectionAborted, ConnectionReset].contains(&error.kind());
    assert!(is_cut_off, "{error}");
    assert!(txt.wait_until(|machine| !machine.connected(), LIMIT));
    Client::online(&txt);
}
