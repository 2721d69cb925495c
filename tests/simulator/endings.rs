//! How connections and the simulated TXT end.

use std::io::Read;
use std::sync::mpsc;
use std::thread;
use std::time::{Duration, Instant};

use ft_transfer_area::wire::{CmprHeader, CommandId, ExchangeData, ResponseId};
use ft_transfer_area_simulator::Error;
use ft_transfer_area_simulator::{Machine, SimulatedTxt};

use crate::unpaced;
use crate::wire_client::{Client, LIMIT};

/// Whether the next client is served.
fn assert_serves(txt: &SimulatedTxt) {
    let mut client = Client::online(txt);
    assert_eq!(client.exchange_compressed(&[[0; 27]], 0).mask, 0);
}

#[test]
fn a_wrong_checksum_ends_the_connection() {
    let txt = unpaced().start().unwrap();
    let mut client = Client::online(&txt);
    client.exchange_compressed(&[[1; 27]], 0);
    let mut command = Vec::new();
    // The 27 words are sent as unchanged: 01, 11, 1111, then 8 bits for 27 - 20.
    let header = CmprHeader { extra_size: 2, crc: 0x1234_5678, active_extensions: 0 };
    header.emit_command(&mut command);
    command.extend([0xFD, 0x07]);
    client.send(&command);
    assert_eq!(client.until_closed(), []);
    assert!(txt.wait_until(|machine| !machine.online() && !machine.connected(), LIMIT));
    assert_serves(&txt);
}

#[test]
fn what_belongs_to_online_mode_is_answered_without_it_and_odd() {
    let txt = unpaced().start().unwrap();
    let mut update = CommandId::UpdateConfig.id().to_le_bytes().to_vec();
    update.resize(96, 0);
    let mut start_camera = CommandId::StartCameraOnline.id().to_le_bytes().to_vec();
    start_camera.resize(20, 1);
    let stop_camera = CommandId::StopCameraOnline.id().to_le_bytes().to_vec();
    let mut client = Client::connect(&txt);
    for (command, response) in [
        (update, ResponseId::UpdateConfig),
        (start_camera, ResponseId::StartCameraOnline),
        (stop_camera, ResponseId::StopCameraOnline),
    ] {
        client.send(&command);
        response.check(&client.receive(4)).unwrap();
    }
    client.exchange(&ExchangeData::default());
    let oddity = txt.with_machine(|machine| machine.oddities().next().map(str::to_owned));
    assert_eq!(oddity.as_deref(), Some("UpdateConfig came outside online mode"));
}

#[test]
fn garbage_ends_the_connection_and_the_next_client_is_served() {
    let txt = unpaced().start().unwrap();
    let mut oversized = Vec::new();
    CmprHeader { extra_size: u32::MAX, ..CmprHeader::default() }.emit_command(&mut oversized);
    for garbage in [b"GET / HTTP/1.1\r\n\r\n".as_slice(), &oversized] {
        let mut client = Client::online(&txt);
        client.send(garbage);
        assert_eq!(client.until_closed(), []);
    }
    assert_serves(&txt);
}

#[test]
fn a_connection_without_commands_is_closed() {
    let idle_limit = Duration::from_millis(30);
    let txt = unpaced().idle_limit(idle_limit).start().unwrap();
    let begin = Instant::now();
    assert_eq!(Client::connect(&txt).until_closed(), []);
    assert!(begin.elapsed() >= idle_limit);
    assert!(txt.wait_until(|machine| machine.connections() == 1 && !machine.connected(), LIMIT));
}

#[test]
fn only_an_exchange_changes_the_outputs_of_the_session_before() {
    let txt = unpaced().extensions(1).start().unwrap();
    let outputs = |machine: &Machine| {
        let of = |index: usize| machine.controllers[index].outputs.duty;
        [of(0), of(1)]
    };
    for says_goodbye in [false, true] {
        let before = txt.with_machine(|machine| outputs(machine));
        let mut client = Client::online(&txt);
        assert_eq!(txt.with_machine(|machine| outputs(machine)), before);
        client.exchange_compressed(&[[0; 27], [0; 27]], 1);
        assert_eq!(txt.with_machine(|machine| outputs(machine)), [[0; 8]; 2]);
        client.exchange_compressed(&[[1; 27], [1; 27]], 1);
        if says_goodbye {
            client.command(CommandId::StopOnline);
            ResponseId::StopOnline.check(&client.receive(4)).unwrap();
            assert!(!txt.with_machine(|machine| machine.online()));
            assert_eq!(txt.with_machine(|machine| outputs(machine)), [[1; 8]; 2]);
        }
        drop(client);
        assert!(txt.wait_until(|machine| !machine.connected(), LIMIT));
        assert!(!txt.with_machine(|machine| machine.online()));
        assert_eq!(txt.with_machine(|machine| outputs(machine)), [[1; 8]; 2]);
    }
}

#[test]
fn waiting_in_vain_ends_at_the_limit() {
    let txt = unpaced().start().unwrap();
    let limit = Duration::from_millis(20);
    let begin = Instant::now();
    assert!(!txt.wait_until(|machine| machine.connected(), limit));
    assert!(begin.elapsed() >= limit);
}

/// Drops the simulated TXT, and fails when that takes longer than the limit.
pub(crate) fn assert_drops(txt: SimulatedTxt) {
    let (done, is_done) = mpsc::channel();
    thread::spawn(move || {
        drop(txt);
        done.send(()).unwrap();
    });
    is_done.recv_timeout(LIMIT).expect("dropping hangs");
}

#[test]
fn dropping_waits_for_no_client() {
    assert_drops(unpaced().start().unwrap());

    let txt = unpaced().start().unwrap();
    let mut client = Client::online(&txt);
    assert_drops(txt);
    assert_eq!(client.until_closed(), []);

    // During the pause before a response.
    let txt = unpaced().pace(Duration::from_secs(3600)).start().unwrap();
    let mut client = Client::online(&txt);
    client.exchange_compressed(&[[0; 27]], 0);
    client.send_compressed(&[[0; 27]], 0);
    assert_drops(txt);
    assert_eq!(client.stream.read(&mut [0]).unwrap_or(0), 0);
}

#[test]
fn what_can_not_be_started_is_an_error() {
    let error = SimulatedTxt::builder().extensions(9).start().unwrap_err();
    assert_eq!(error, Error::TooManyExtensions { given: 9 });
    let txt = unpaced().start().unwrap();
    for builder in [
        SimulatedTxt::builder().port(txt.port()).camera_port(0),
        SimulatedTxt::builder().camera_port(txt.camera_port()),
        SimulatedTxt::builder().i2c_port(txt.i2c_port()),
    ] {
        assert!(matches!(builder.start().unwrap_err(), Error::NotStarted { .. }));
    }
}
