//! `TxtClient`: one blocking call per command.

use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use ft_transfer_area::transfer_area::Config;
use ft_transfer_area::wire::{ExchangeData, QueryStatusResponse, ResponseId, UpdateConfig};
use ft_transfer_area::{
    CameraOptions, Error, Exchange, FirmwareVersion, FishX1Transfer, I2cClient, TimeLimits,
    TransferAreaComHandler, TransferMode, TxtClient,
};
use ft_transfer_area_simulator::{Fault, FaultKind, SimulatedTxt};

use crate::support::{unpaced, DEADLINE};

fn client_of(txt: &SimulatedTxt) -> TxtClient {
    TxtClient::connect(txt.address(), TimeLimits::default()).unwrap()
}

#[test]
fn a_port_after_the_host_is_used() {
    let txt = unpaced().start().unwrap();
    let at = |port: u16| format!("127.0.0.1:{port}");
    let limits = TimeLimits::default();
    let mut client = TxtClient::connect(at(txt.port()), limits).unwrap();
    assert_eq!(client.query_status().unwrap().name(), "TX2013");
    drop(client);
    I2cClient::connect(at(txt.i2c_port()), limits).unwrap();
    let handler = TransferAreaComHandler::builder(at(txt.port())).build().unwrap();
    handler.begin_transfer().unwrap();
    handler.i2c().unwrap();
    handler.end_transfer().unwrap();

    let given = "127.0.0.1:65k".to_owned();
    let bad = Error::BadAddress { given: given.clone() };
    assert_eq!(TxtClient::connect(&given, limits).unwrap_err(), bad);
    assert_eq!(I2cClient::connect(&given, limits).unwrap_err(), bad);
    assert_eq!(TransferAreaComHandler::builder(given).build().unwrap_err(), bad);
}

#[test]
fn each_command_gets_its_answer() {
    let txt = unpaced().start().unwrap();
    txt.with_machine(|machine| machine.controllers[0].uni[3] = 42);
    let mut client = client_of(&txt);
    assert_eq!(client.query_status().unwrap().name(), "TX2013");
    client.start_online().unwrap();
    let mut config = Config::default();
    config.motor[1] = 0;
    client.update_config(&UpdateConfig { config_id: 1, extension_id: 0, config }).unwrap();
    assert_eq!(txt.with_machine(|machine| machine.controllers[0].config), config);
    let mut outputs = ExchangeData::default();
    outputs.duty[2] = 256;
    assert_eq!(client.exchange_data(&outputs).unwrap().uni[3], 42);
    assert_eq!(txt.with_machine(|machine| machine.controllers[0].outputs), outputs);
    client.stop_online().unwrap();
    assert!(!txt.with_machine(|machine| machine.online()));
}

#[test]
fn do_transfer_is_the_c_samples_cycle() {
    for mode in [TransferMode::Compressed, TransferMode::Simple] {
        let txt = unpaced().start().unwrap();
        let mut client = client_of(&txt);
        let mut exchange = Exchange::new(mode, client.query_status().unwrap().version);
        let mut areas = [FishX1Transfer::default()];
        client.start_online().unwrap();
        for cycle in 0..20 {
            areas[0].output.duty[0] = cycle;
            areas[0].state.config_id = 1 + (cycle / 10) as u8;
            txt.with_machine(|machine| machine.controllers[0].uni[0] = 100 + cycle);
            client.do_transfer(&mut exchange, &mut areas).unwrap();
            assert_eq!(areas[0].input.uni[0], 100 + cycle);
            assert_eq!(txt.with_machine(|m| m.controllers[0].outputs.duty[0]), cycle);
        }
        assert_eq!(txt.with_machine(|machine| machine.controllers[0].config_id), 2);
    }
}

#[test]
fn commands_that_need_online_mode_are_refused_without_it() {
    let txt = unpaced().start().unwrap();
    let mut client = client_of(&txt);
    let update = UpdateConfig { config_id: 1, extension_id: 0, config: Config::default() };
    assert_eq!(client.update_config(&update), Err(Error::NotOnline { command: "UpdateConfig" }));
    assert_eq!(
        client.exchange_data(&ExchangeData::default()),
        Err(Error::NotOnline { command: "ExchangeData" })
    );
    let mut exchange =
        Exchange::new(TransferMode::Compressed, client.query_status().unwrap().version);
    let mut areas = [FishX1Transfer::default()];
    *areas[0].config.motor = [0; 4];
    let refused = Err(Error::NotOnline { command: "ExchangeDataCmpr" });
    assert_eq!(client.do_transfer(&mut exchange, &mut areas), refused);

    // The connection and the exchange are as they were.
    client.start_online().unwrap();
    assert_eq!(client.do_transfer(&mut exchange, &mut []), Err(Error::AreaCount { given: 0 }));
    client.do_transfer(&mut exchange, &mut areas).unwrap();
    assert_eq!(txt.with_machine(|machine| machine.controllers[0].config.motor), [0; 4]);
    client.stop_online().unwrap();
    assert_eq!(client.do_transfer(&mut exchange, &mut areas), refused);
}

#[test]
fn after_an_error_every_call_returns_it() {
    let fault = Fault::at_response(1, FaultKind::WrongId);
    let txt = unpaced().fault(fault).start().unwrap();
    let mut client = client_of(&txt);
    client.query_status().unwrap();
    let error = client.start_online().unwrap_err();
    assert!(matches!(error, Error::WrongId { .. }), "{error:?}");
    assert_eq!(client.query_status(), Err(error.clone()));
    assert_eq!(client.exchange_data(&ExchangeData::default()), Err(error.clone()));
    assert_eq!(client.stop_online(), Err(error));
}

#[test]
fn the_first_and_the_last_port_work_or_give_a_clear_error() {
    let limits = TimeLimits::default();
    let last = "127.0.0.1:65535";
    let results =
        [TxtClient::connect(last, limits).map(drop), I2cClient::connect(last, limits).map(drop)];
    for result in results {
        // A program may listen on the last port.
        let Err(error) = result else { continue };
        assert!(
            matches!(&error, Error::ConnectionRefused { address } if address == last),
            "{error}"
        );
    }
    let error = TxtClient::connect("127.0.0.1:0", limits).unwrap_err();
    assert!(matches!(error, Error::BadAddress { .. }), "{error}");
}

#[test]
fn a_host_name_is_found_like_its_address() {
    let txt = unpaced().start().unwrap();
    let mut client =
        TxtClient::connect(format!("localhost:{}", txt.port()), TimeLimits::default()).unwrap();
    assert_eq!(client.query_status().unwrap().name(), "TX2013");
}

#[test]
fn the_errors_of_a_slow_network_say_what_to_check() {
    let limit = Duration::from_secs(5);
    let lookup = Error::LookupTimedOut { host: "txt.local".to_owned(), limit }.to_string();
    for part in ["\"txt.local\"", "within 5s", "name servers", "192.168.7.2 for USB"] {
        assert!(lookup.contains(part), "{lookup}");
    }
    let not_taken = Error::NotTaken { command: "ExchangeData", limit }.to_string();
    for part in [
        "did not take ExchangeData within 5s",
        "connection",
        "more time for writing by time_limits",
    ] {
        assert!(not_taken.contains(part), "{not_taken}");
    }
}

#[test]
fn an_exchange_allocates_nothing() {
    let txt = unpaced().extensions(1).start().unwrap();
    let mut client = client_of(&txt);
    let mut exchange =
        Exchange::new(TransferMode::Compressed, client.query_status().unwrap().version);
    let mut areas = [FishX1Transfer::default(); 2];
    client.start_online().unwrap();
    // Memory for the extension's words is allocated when it first takes part.
    for _ in 0..2 {
        client.do_transfer(&mut exchange, &mut areas).unwrap();
    }
    let allocations = allocation_counter::measure(|| {
        for duty in 0..100 {
            *areas[0].output.duty = [duty; 8];
            // Every other duty is out of range.
            *areas[1].output.duty = [-(duty % 2); 8];
            areas[0].state.config_id = duty as u8;
            client.do_transfer(&mut exchange, &mut areas).unwrap();
        }
    });
    assert_eq!(allocations.count_total, 0);
}

/// A listener whose only client is served by `serve`, in a thread that the test has to join.
fn controller(serve: impl FnOnce(TcpStream) + Send + 'static) -> (u16, JoinHandle<()>) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = listener.local_addr().unwrap().port();
    (port, thread::spawn(move || serve(listener.accept().unwrap().0)))
}

#[test]
fn a_command_is_sent_in_one_piece() {
    let (port, server) = controller(|mut stream| {
        let mut buffer = [0; 1000];
        for (size, response) in [(68, ResponseId::StartOnline), (96, ResponseId::UpdateConfig)] {
            assert_eq!(stream.read(&mut buffer).unwrap(), size);
            let mut bytes = Vec::new();
            response.emit(&mut bytes);
            stream.write_all(&bytes).unwrap();
        }
    });
    let mut client =
        TxtClient::connect(format!("127.0.0.1:{port}"), TimeLimits::default()).unwrap();
    client.start_online().unwrap();
    let update = UpdateConfig { config_id: 1, extension_id: 0, config: Config::default() };
    client.update_config(&update).unwrap();
    server.join().unwrap();
}

#[test]
fn the_limit_is_for_the_whole_response() {
    let limit = Duration::from_millis(300);
    let (port, server) = controller(move |mut stream| {
        let mut response = Vec::new();
        QueryStatusResponse { device_name: [b'x'; 16], version: FirmwareVersion::new(4, 7, 0) }
            .emit(&mut response);
        stream.read_exact(&mut [0; 4]).unwrap();
        // Each piece comes in time, but all of them together take eight times as long.
        for piece in response.chunks(1) {
            if stream.write_all(piece).is_err() {
                break;
            }
            thread::sleep(limit / 3);
        }
    });
    let limits = TimeLimits::default().read(limit);
    let mut client = TxtClient::connect(format!("127.0.0.1:{port}"), limits).unwrap();
    let error = client.query_status().unwrap_err();
    assert!(matches!(error, Error::NoAnswer { received: 1.., .. }), "{error:?}");
    drop(client);
    server.join().unwrap();
}

#[test]
fn frames_of_the_camera_come_in_between_the_exchanges_until_the_stream_is_stopped() {
    let txt = unpaced().camera_start_up(Duration::ZERO).start().unwrap();
    let (mut client, camera_port) = (client_of(&txt), txt.camera_port());
    let options = CameraOptions::default().framerate(60);
    let command = "StartCameraOnline";
    assert_eq!(
        client.start_camera(camera_port, options).unwrap_err(),
        Error::NotOnline { command }
    );
    client.start_online().unwrap();
    let wrong = client.start_camera(camera_port, options.size(0, 240)).unwrap_err();
    assert!(matches!(wrong, Error::OutOfRange { given: 0, .. }), "{wrong}");
    assert_eq!(txt.with_machine(|machine| machine.camera()), None);

    // Twice: the second stream begins as the first.
    for _ in 0..2 {
        let (mut stream, frames) = client.start_camera(camera_port, options).unwrap();
        let started = txt.with_machine(|machine| machine.camera()).unwrap();
        assert_eq!((started.width, started.framerate), (320, 60));
        for number in 0..3 {
            let frame = frames.recv_timeout(DEADLINE).unwrap();
            assert!(frame.sequence >= number && frame.jpeg().is_ok());
            client.exchange_data(&ExchangeData::default()).unwrap();
        }
        assert!(!stream.is_finished());
        stream.stop();
        while frames.recv_timeout(DEADLINE).is_ok() {}
        assert!(stream.is_finished());
        assert_eq!(stream.error(), None);
        assert!(stream.statistics().frames >= 3);
        client.stop_camera_online().unwrap();
        assert_eq!(txt.with_machine(|machine| machine.camera()), None);
    }
    client.stop_online().unwrap();
}

#[test]
fn a_camera_that_disappears_ends_its_stream_with_the_error_and_a_dropped_stream_has_ended() {
    let txt = unpaced().camera_start_up(Duration::ZERO).start().unwrap();
    let mut client = client_of(&txt);
    client.start_online().unwrap();
    let (stream, frames) =
        client.start_camera(txt.camera_port(), CameraOptions::default()).unwrap();
    frames.recv_timeout(DEADLINE).unwrap();
    drop(txt);
    while frames.recv_timeout(DEADLINE).is_ok() {}
    assert!(matches!(stream.error(), Some(Error::ConnectionClosed { .. })), "{stream:?}");

    let txt = unpaced().camera_start_up(Duration::ZERO).start().unwrap();
    let mut client = client_of(&txt);
    client.start_online().unwrap();
    let (stream, frames) =
        client.start_camera(txt.camera_port(), CameraOptions::default()).unwrap();
    frames.recv_timeout(DEADLINE).unwrap();
    drop(stream);
    // Those that are in the channel, and then its end.
    assert!(frames.iter().count() <= 2);
}
