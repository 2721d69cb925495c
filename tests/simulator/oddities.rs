//! The oddities that the simulated TXT notes, and that a correct client causes none.

use std::net::{Ipv4Addr, Shutdown, TcpStream};
use std::time::{Duration, Instant};
use std::{io, thread};

use ft_transfer_area::transfer_area::Config;
use ft_transfer_area::wire::{CmprHeader, CommandId, ExchangeData, ResponseId, StartCameraOnline};
use ft_transfer_area::{TimeLimits, TransferAreaComHandler, TransferMode};
use ft_transfer_area_simulator::world::World;
use ft_transfer_area_simulator::{Fault, FaultKind, Machine, SimulatedTxt};

use crate::unpaced;
use crate::wire_client::{Client, LIMIT};

fn oddities(txt: &SimulatedTxt) -> Vec<String> {
    txt.with_machine(|machine| machine.oddities().map(String::from).collect())
}

/// Fails unless there is one oddity, and its sentence contains this.
fn assert_odd(txt: &SimulatedTxt, part: &str) {
    let found = oddities(txt);
    assert!(found.len() == 1 && found[0].contains(part), "{found:?}");
}

/// A client in online mode that has configured the master and one extension.
fn configured(txt: &SimulatedTxt) -> Client {
    let mut client = Client::online(txt);
    client.update_config(1, 0, Config::default());
    client.update_config(1, 1, Config::default());
    client
}

fn with_duty(duty: [i16; 8]) -> ExchangeData {
    ExchangeData { duty, ..ExchangeData::default() }
}

#[test]
fn an_exchange_without_configuration_is_odd_once_per_session() {
    let txt = unpaced().extensions(1).start().unwrap();
    let mut client = Client::online(&txt);
    // As what only stops a controller does.
    client.exchange(&ExchangeData::default());
    client.exchange_compressed(&[[0; 27]], 0);
    assert_eq!(oddities(&txt), [""; 0]);
    client.exchange(&ExchangeData::default());
    assert_odd(&txt, "before any UpdateConfig for the master");
    client.start_online();
    client.update_config(1, 0, Config::default());
    client.exchange_compressed(&[[0; 27]], 0);
    assert_eq!(oddities(&txt).len(), 1);
    let mut on = [0; 27];
    on[0] = 512;
    client.exchange_compressed(&[[0; 27], on], 1);
    assert_eq!(oddities(&txt)[1], "an exchange came before any UpdateConfig for extension 1");
}

#[test]
fn an_extension_that_was_not_reported_is_odd() {
    let txt = unpaced().extensions(1).start().unwrap();
    let mut client = configured(&txt);
    client.exchange_compressed(&[[0; 27]; 2], 1);
    assert_odd(&txt, "extension mask 0x0001");

    drop(client);
    let mut client = configured(&txt);
    client.exchange_compressed(&[[0; 27]], 0);
    txt.with_machine(|machine| machine.alive[0] = false);
    client.exchange_compressed(&[[0; 27]; 2], 1);
    assert_eq!(oddities(&txt).len(), 1);
    client.exchange_compressed(&[[0; 27]; 2], 1);
    assert_eq!(oddities(&txt).len(), 2);
}

#[test]
fn duties_out_of_place_are_odd() {
    for (duty, part) in [(-1, "duty -1"), (513, "duty 513")] {
        let txt = unpaced().start().unwrap();
        configured(&txt).exchange(&with_duty([0, 0, 0, duty, 0, 0, 0, 0]));
        assert_odd(&txt, part);
    }
    let world = World::from_toml("[master.motors]\nM2 = {}\n").unwrap();
    let txt = unpaced().world(world).start().unwrap();
    let mut client = configured(&txt);
    let both = with_duty([0, 0, 512, 1, 0, 0, 0, 0]);
    client.update_config(2, 0, Config { motor: [1, 0, 1, 1].into(), ..Config::default() });
    client.exchange(&both);
    assert_eq!(oddities(&txt), [""; 0]);
    client.update_config(3, 0, Config::default());
    client.exchange(&both);
    assert_odd(&txt, "M2 of the master got duty 512 and 1");
}

/// Programs switch lamps and valves so, and leave the configuration of motors.
#[test]
fn both_outputs_of_a_pair_without_a_motor_are_not_odd() {
    let world = World::from_toml("[master.motors]\nM2 = {}\n").unwrap();
    for builder in [unpaced().world(world), unpaced()] {
        let txt = builder.start().unwrap();
        configured(&txt).exchange(&with_duty([0, 0, 0, 0, 512, 512, 0, 0]));
        assert_eq!(oddities(&txt), [""; 0]);
    }
}

#[test]
fn data_after_the_last_word_is_odd() {
    let txt = unpaced().start().unwrap();
    let mut client = configured(&txt);
    let mut command = Vec::new();
    // The 27 words are sent as unchanged: 01, 11, 1111, then 8 bits for 27 - 20.
    let header = CmprHeader { extra_size: 3, crc: 0x4049_3A53, active_extensions: 0 };
    header.emit_command(&mut command);
    command.extend([0xFD, 0x07, 0x00]);
    client.send(&command);
    client.receive_compressed();
    assert_odd(&txt, "after the last word");
}

#[test]
fn a_command_ahead_of_a_response_is_odd_but_not_a_farewell() {
    let mut exchange = Vec::new();
    ExchangeData::default().emit(&mut exchange);
    let stop = CommandId::StopOnline.id().to_le_bytes();
    let query = CommandId::QueryStatus.id().to_le_bytes();
    // During the delay the second command arrives.
    let delay = FaultKind::Delay(Duration::from_millis(50));
    for (behind, odd) in [
        ([&exchange[..], &stop].concat(), None),
        (stop.to_vec(), None),
        (exchange.clone(), Some("ExchangeData")),
        (query.to_vec(), Some("QueryStatus")),
    ] {
        let txt = unpaced().fault(Fault::at_response(3, delay)).start().unwrap();
        let mut client = configured(&txt);
        client.send(&[&exchange[..], &behind].concat());
        client.receive(80);
        match odd {
            None => assert_eq!(oddities(&txt), [""; 0]),
            Some(command) => assert_odd(&txt, &format!("{command} came before the response")),
        }
    }
}

#[test]
fn a_motor_that_can_not_be_counted_is_odd_once_per_session() {
    let world = World::from_toml("[master.motors]\nM1.pulses_per_turn = 60\nM2 = {}\n").unwrap();
    let txt = unpaced().world(world).start().unwrap();
    let mut client = Client::connect(&txt);
    let mut reported = |distance, master| {
        let before = oddities(&txt).len();
        client.start_online();
        client.update_config(1, 0, Config::default());
        for id in [1, 2] {
            let motor_command_id = [id; 4];
            client.exchange(&ExchangeData {
                distance,
                master,
                motor_command_id,
                ..with_duty([512, 0, 512, 0, 512, 0, 512, 0])
            });
        }
        oddities(&txt).split_off(before)
    };
    for (distance, master, expected) in [
        ([0; 4], [0; 4], &[][..]),
        ([9, 0, 0, 0], [0; 4], &[]),
        // Here a motor would follow only itself.
        ([0; 4], [0, 2, 0, 8], &[]),
        ([0, 9, 0, 0], [0; 4], &["M2 of the master has no encoder, so its distance never ends"]),
        ([0; 4], [0, 1, 0, 0], &["M2 of the master has no encoder, so it can't follow M1"]),
        ([0, 9, 0, 0], [0, 5, 0, 0], &["M2 of the master has no encoder, so it can't follow M1"]),
        ([0; 4], [2, 0, 0, 0], &["M2 of the master has no encoder, so M1 can't follow it"]),
        ([0; 4], [3, 0, 0, 0], &["there is no motor on M3 of the master, so M1 can't follow it"]),
        (
            [9; 4],
            [0; 4],
            &[
                "M2 of the master has no encoder, so its distance never ends",
                "there is no motor on M3 of the master, so its distance never ends",
                "there is no motor on M4 of the master, so its distance never ends",
            ],
        ),
    ] {
        assert_eq!(reported(distance, master), expected, "{distance:?} {master:?}");
    }
}

/// A handler for two areas that waits at most half a second for an answer.
fn hasty_handler(txt: &SimulatedTxt) -> TransferAreaComHandler {
    // Long enough for a busy machine.
    let limits = TimeLimits::default().read(Duration::from_secs(1));
    TransferAreaComHandler::builder(txt.address()).areas(2).time_limits(limits).build().unwrap()
}

/// The extension is cut off and comes back all the time.
fn flicker(machine: &mut Machine) {
    machine.alive[0] = machine.exchanges() % 3 != 0;
}

#[test]
fn this_crates_client_is_not_odd() {
    for mode in [TransferMode::Compressed, TransferMode::Simple] {
        let txt = unpaced().extensions(1).on_exchange(flicker).start().unwrap();
        let handler =
            TransferAreaComHandler::builder(txt.address()).areas(2).mode(mode).build().unwrap();
        for _ in 0..2 {
            handler.begin_transfer().unwrap();
            for cycle in 0..20 {
                let mut areas = handler.areas().wait_cycle().unwrap();
                areas[0].output.duty[cycle % 8] = 512;
                areas[0].output.duty[(cycle % 8) ^ 1] = 0;
                areas[1].raise_config_id();
            }
            handler.end_transfer().unwrap();
        }
        assert_eq!(oddities(&txt), [""; 0]);
    }
}

#[test]
fn this_crates_farewell_is_not_odd() {
    let kinds = [
        FaultKind::Delay(Duration::from_millis(1250)),
        FaultKind::Silence,
        FaultKind::WrongId,
        FaultKind::WrongCrc,
        FaultKind::Surplus(3),
    ];
    // Each waits for a time limit, so they run in parallel.
    thread::scope(|scope| {
        for kind in kinds {
            for response in 6..9 {
                scope.spawn(move || assert_farewell_is_not_odd(kind, response));
            }
        }
    });
}

fn assert_farewell_is_not_odd(kind: FaultKind, response: u64) {
    let fault = Fault::at_response(response, kind);
    let txt = unpaced().extensions(1).on_exchange(flicker).fault(fault).start().unwrap();
    let handler = hasty_handler(&txt);
    handler.begin_transfer().unwrap();
    // On a busy machine, what is late for the controller may still be in time for the client.
    let is_in_time = (0..1000).all(|_| handler.areas().wait_cycle().is_ok());
    if is_in_time {
        assert!(matches!(kind, FaultKind::Delay(_)), "{kind:?} {response} ends nothing");
        return;
    }
    assert!(txt.wait_until(|machine| !machine.connected(), LIMIT));
    assert_eq!(oddities(&txt), [""; 0], "{kind:?} {response}");
    let said = txt.with_machine(|machine| machine.commands().next_back());
    assert_eq!(said, Some(CommandId::StopOnline), "{kind:?} {response}");
}

#[test]
fn a_start_while_the_i2c_server_of_the_session_before_waits_is_odd() {
    let txt = SimulatedTxt::builder().start().unwrap();
    drop(Client::online(&txt));
    // This is soon, unless the computer is very busy.
    let begin = Instant::now();
    let mut client = Client::online(&txt);
    if begin.elapsed() < Duration::from_secs(4) {
        assert_odd(&txt, "StartOnline came less than 5 s after the one before");
    }
    // An I2C client that has come and gone ends the server.
    drop(TcpStream::connect((Ipv4Addr::LOCALHOST, txt.i2c_port())).unwrap());
    let gone = |machine: &Machine| machine.i2c_connections() == 1 && !machine.i2c_connected();
    assert!(txt.wait_until(gone, LIMIT));
    let before = oddities(&txt).len();
    client.start_online();
    assert_eq!(oddities(&txt).len(), before);
}

#[test]
fn an_i2c_client_is_odd_unless_it_is_the_first_one_in_a_session() {
    let txt = SimulatedTxt::builder().start().unwrap();
    let connect = |count: u64| {
        drop(TcpStream::connect((Ipv4Addr::LOCALHOST, txt.i2c_port())).unwrap());
        let gone =
            |machine: &Machine| machine.i2c_connections() == count && !machine.i2c_connected();
        assert!(txt.wait_until(gone, LIMIT));
    };
    connect(1);
    assert_odd(&txt, "an I2C client came that is not the first one");
    let begin = Instant::now();
    let _client = Client::online(&txt);
    connect(2);
    if begin.elapsed() < Duration::from_secs(4) {
        assert_eq!(oddities(&txt).len(), 1);
    }
    connect(3);
    assert_eq!(oddities(&txt).len(), 2);
}

#[test]
fn a_command_in_pieces_is_odd_unless_it_is_cut_after_its_id() {
    let txt = unpaced().start().unwrap();
    let mut client = Client::online(&txt);
    let mut exchange = Vec::new();
    ExchangeData::default().emit(&mut exchange);
    for cut in [4, 30] {
        client.update_config(1, 0, Config::default());
        client.send(&exchange[..cut]);
        // Each part arrives on its own.
        thread::sleep(Duration::from_millis(50));
        client.send(&exchange[cut..]);
        client.receive(80);
        assert_eq!(oddities(&txt).len(), usize::from(cut == 30));
    }
    assert_odd(&txt, "a command came in pieces");
}

#[test]
fn a_camera_that_is_started_twice_or_left_open_is_odd() {
    let settings =
        StartCameraOnline { width: 16, height: 16, framerate: 15, power_line_frequency: 50 };
    let stop = |client: &mut Client| {
        client.command(CommandId::StopCameraOnline);
        client.receive(4);
    };
    let served = |txt: &SimulatedTxt, frames: u64| {
        let stream = TcpStream::connect((Ipv4Addr::LOCALHOST, txt.camera_port())).unwrap();
        assert!(txt.wait_until(|machine| machine.camera_frames() == frames, LIMIT));
        stream
    };
    let txt = unpaced().camera_start_up(Duration::ZERO).start().unwrap();
    let mut client = Client::online(&txt);
    client.start_camera(settings);
    // Dropping is not enough: while another test starts a program, this has the connection, too.
    served(&txt, 1).shutdown(Shutdown::Both).unwrap();
    stop(&mut client);
    client.start_camera(settings);
    assert_eq!(oddities(&txt), [""; 0]);
    let mut open = served(&txt, 2);
    stop(&mut client);
    // It is closed when the camera's thread has seen the stop.
    io::copy(&mut open, &mut io::sink()).unwrap();
    client.start_camera(settings);
    assert_odd(&txt, "the camera was stopped while its client was connected");
    client.start_camera(settings);
    assert_eq!(oddities(&txt).len(), 2);
    assert!(oddities(&txt)[1].starts_with("StartCameraOnline came twice"));
}

#[test]
fn oddities_outlast_the_client() {
    let txt = unpaced().start().unwrap();
    let mut client = Client::online(&txt);
    client.exchange(&with_duty([512; 8]));
    client.command(CommandId::StopOnline);
    ResponseId::StopOnline.check(&client.receive(4)).unwrap();
    drop(client);
    assert!(txt.wait_until(|machine| !machine.connected(), LIMIT));
    assert_eq!(oddities(&txt).len(), 1);
}
