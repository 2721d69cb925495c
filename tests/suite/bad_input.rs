//! Every mistake of a controller, a network or a caller ends in a typed error with a helpful sentence,
//! and leaves the areas unchanged.

use std::net::TcpListener;
use std::time::Duration;

use ft_transfer_area::transfer_area::{Timer, LOCAL_IO};
use ft_transfer_area::wire::{ResponseId, MAX_EXTRA_SIZE};
use ft_transfer_area::{
    Error, FirmwareVersion, FishX1Transfer, TimeLimits, TransferAreaComHandler, TransferMode,
};
use ft_transfer_area_simulator::{Fault, FaultKind, SimulatedTxt};

use crate::support::{check_client, handler_for, unpaced, unused_ports, wait_until};

/// The responses of a connection with one area: the handshake's, then the exchanges'.
const RESPONSES: [(ResponseId, usize); 5] = [
    (ResponseId::QueryStatus, 24),
    (ResponseId::StartOnline, 4),
    (ResponseId::UpdateConfig, 4),
    (ResponseId::ExchangeDataCmpr, 17),
    (ResponseId::ExchangeDataCmpr, 17),
];

/// How many responses come before the first exchange's.
const HANDSHAKE: u64 = 3;

/// The inputs change with the first bad response, so that the test sees whether it reaches the area.
fn faulty_txt(response: u64, kind: FaultKind) -> SimulatedTxt {
    let whole = kind == FaultKind::Close { after: usize::MAX };
    let first_bad = response + u64::from(whole);
    unpaced()
        .fault(Fault::at_response(response, kind))
        .on_exchange(move |machine| {
            let bad = HANDSHAKE + machine.exchanges() >= first_bad;
            machine.controllers[0].uni = [if bad { 9999 } else { 1 }; 8];
        })
        .start()
        .unwrap()
}

/// Runs a transfer until it fails, and checks what all failures have in common.
fn failure_of(txt: &SimulatedTxt, mode: TransferMode) -> Error {
    let limits = TimeLimits::default().read(Duration::from_secs(20));
    let handler = handler_for(txt).mode(mode).time_limits(limits).build().unwrap();
    let before = handler.areas().lock()[LOCAL_IO];
    let error = match handler.begin_transfer() {
        Ok(()) => {
            let mut responses = (0..1000).map(|_| handler.areas().wait_cycle().map(drop));
            responses.find_map(Result::err).expect("the transfer has failed")
        }
        Err(error) => error,
    };
    assert_eq!(handler.areas().wait_cycle().unwrap_err(), error, "the error stays");
    assert_eq!(handler.areas().update_config(), Err(error.clone()), "the error stays");
    assert_eq!(handler.end_transfer(), Err(error.clone()), "the error stays");
    assert_eq!(handler.areas().error(), Some(error.clone()), "the error stays");
    let mut after = handler.areas().lock()[LOCAL_IO];
    assert!(after.input.uni.iter().all(|&value| value != 9999), "a bad response came through");
    // The end of a transfer switches the motors off; all else is as it was.
    if after.input.uni == [1; 8] {
        after.input.uni = before.input.uni;
    }
    after.output.motor_ex_cmd_id = before.output.motor_ex_cmd_id;
    after.timer = Timer::default();
    assert_eq!(after, before);
    wait_until(txt, "the closed connection", |machine| !machine.connected());
    check_client(txt);
    error
}

#[test]
fn a_host_that_does_not_exist() {
    // No part of a name has more than 63 characters, so no name server is asked for this one.
    let host = "x".repeat(64);
    let handler = TransferAreaComHandler::builder(host.as_str()).build().unwrap();
    let error = handler.begin_transfer().unwrap_err();
    assert!(matches!(&error, Error::HostNotFound { host: named, .. } if *named == host));
    assert!(error.to_string().contains("192.168.7.2 for USB"), "{error}");
}

#[test]
fn a_port_without_a_listener() {
    let port = unused_ports();
    let handler = TransferAreaComHandler::builder(format!("127.0.0.1:{port}")).build().unwrap();
    let error = handler.begin_transfer().unwrap_err();
    let address = format!("127.0.0.1:{port}");
    assert!(error.to_string().contains(&address), "{error}");
    assert_eq!(error, Error::ConnectionRefused { address });
}

#[test]
fn a_connection_closed_before_and_inside_each_packet() {
    for (response, (kind, size)) in (0..).zip(RESPONSES) {
        for after in [0, 1, size - 1] {
            if (kind, after) == (ResponseId::StartOnline, 0) {
                // Then it is tried again.
                continue;
            }
            let txt = faulty_txt(response, FaultKind::Close { after });
            let command = kind.name().trim_end_matches(" response");
            match failure_of(&txt, TransferMode::Compressed) {
                Error::ConnectionClosed { command: during, received } => {
                    assert_eq!(during, command);
                    assert!(received <= after, "{received} bytes of {after}");
                }
                error => panic!("closed after {after} bytes of the {kind}: {error:?}"),
            }
        }
    }
}

#[test]
fn a_connection_closed_after_each_packet() {
    // After the first one it is tried again.
    for response in 1..RESPONSES.len() - 1 {
        let txt = faulty_txt(response as u64, FaultKind::Close { after: usize::MAX });
        let (next, _) = RESPONSES[response + 1];
        match failure_of(&txt, TransferMode::Compressed) {
            Error::ConnectionClosed { command, received: 0 } => {
                assert_eq!(command, next.name().trim_end_matches(" response"));
            }
            error => panic!("closed after response {response}: {error:?}"),
        }
    }
}

#[test]
fn a_wrong_id_in_each_packet() {
    for (response, (kind, _)) in (0..).zip(RESPONSES) {
        let txt = faulty_txt(response, FaultKind::WrongId);
        match failure_of(&txt, TransferMode::Compressed) {
            Error::WrongId { packet, expected, found } => {
                assert_eq!((packet, expected), (kind.name(), kind.id()));
                assert_ne!(found, expected);
            }
            error => panic!("wrong id in the {kind}: {error:?}"),
        }
    }
}

#[test]
fn more_bytes_than_the_packet_has() {
    for (response, (kind, _)) in (0..).zip(RESPONSES) {
        let txt = faulty_txt(response, FaultKind::Surplus(5));
        match failure_of(&txt, TransferMode::Compressed) {
            Error::WrongSize { packet, expected, found } => {
                assert_eq!((packet, found), (kind.name(), expected + 5));
            }
            // Bytes after the packet are the start of the next one.
            Error::WrongId { .. } => {}
            error => panic!("surplus behind the {kind}: {error:?}"),
        }
    }
}

#[test]
fn a_firmware_below_4_1_6() {
    let found = FirmwareVersion::new(4, 1, 5);
    let txt = unpaced().firmware(found).start().unwrap();
    let error = failure_of(&txt, TransferMode::Compressed);
    assert_eq!(error, Error::FirmwareTooOld { found, required: FirmwareVersion::new(4, 1, 6) });
    let message = error.to_string();
    assert!(message.contains("4.1.5") && message.contains("4.1.6"), "{message}");
}

#[test]
fn an_announced_size_above_the_limit() {
    for announced in [MAX_EXTRA_SIZE as u32 + 1, 0x8000_0000, u32::MAX] {
        let txt = faulty_txt(5, FaultKind::ExtraSize(announced));
        let packet = ResponseId::ExchangeDataCmpr.name();
        assert_eq!(
            failure_of(&txt, TransferMode::Compressed),
            Error::TooLarge { packet, announced, limit: MAX_EXTRA_SIZE }
        );
    }
}

#[test]
fn compressed_data_that_ends_early() {
    // The first exchange sends the most changes, so half of its data is too little.
    let txt = faulty_txt(3, FaultKind::CutData);
    match failure_of(&txt, TransferMode::Compressed) {
        Error::DataEndsEarly { expected: 52, found } => assert!(found < 52),
        error => panic!("{error:?}"),
    }
}

#[test]
fn a_wrong_checksum() {
    for response in [3, 4, 10] {
        let txt = faulty_txt(response, FaultKind::WrongCrc);
        match failure_of(&txt, TransferMode::Compressed) {
            Error::WrongCrc { announced, computed } => assert_ne!(announced, computed),
            error => panic!("{error:?}"),
        }
    }
}

#[test]
fn a_wrong_packet_in_the_simple_mode() {
    let txt = faulty_txt(8, FaultKind::WrongId);
    let packet = ResponseId::ExchangeData.name();
    let error = failure_of(&txt, TransferMode::Simple);
    assert!(matches!(error, Error::WrongId { packet: named, .. } if named == packet), "{error:?}");
    let txt = faulty_txt(8, FaultKind::Close { after: 79 });
    let error = failure_of(&txt, TransferMode::Simple);
    assert!(matches!(error, Error::ConnectionClosed { .. }), "{error:?}");
}

#[test]
fn bytes_that_arrive_one_at_a_time_are_no_error() {
    let builder = (0..8).fold(unpaced(), |builder, response| {
        builder.fault(Fault::at_response(response, FaultKind::Dribble))
    });
    let txt = builder.start().unwrap();
    txt.with_machine(|machine| machine.controllers[0].uni = [1, 22, 333, 4444, 5, 6, 7, 8]);
    let handler = handler_for(&txt).build().unwrap();
    handler.begin_transfer().unwrap();
    for _ in 0..10 {
        let areas = handler.areas().wait_cycle().unwrap();
        assert_eq!(areas[LOCAL_IO].input.uni, [1, 22, 333, 4444, 5, 6, 7, 8]);
    }
    handler.end_transfer().unwrap();
}

#[test]
fn a_response_that_trickles_in_for_longer_than_the_limit() {
    // Each byte comes well within the limit, but all 24 of them together do not.
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = listener.local_addr().unwrap().port();
    let server = std::thread::spawn(move || {
        use std::io::Write;
        let (mut stream, _) = listener.accept().unwrap();
        let mut response = Vec::new();
        ResponseId::QueryStatus.emit(&mut response);
        response.resize(4000, 0);
        for byte in response.chunks(1) {
            if stream.write_all(byte).is_err() {
                break;
            }
            std::thread::sleep(Duration::from_millis(50));
        }
    });
    let limits = TimeLimits::default().read(Duration::from_secs(1));
    let builder = TransferAreaComHandler::builder(format!("127.0.0.1:{port}")).time_limits(limits);
    let error = builder.build().unwrap().begin_transfer().unwrap_err();
    assert!(matches!(error, Error::NoAnswer { received: 1..24, .. }), "{error:?}");
    server.join().unwrap();
}

#[test]
fn no_areas_or_more_than_9() {
    for given in [0, 10, usize::MAX] {
        let result = TransferAreaComHandler::builder("127.0.0.1").areas(given).build();
        assert_eq!(result.unwrap_err(), Error::AreaCount { given });
    }
    for areas in 1..=9 {
        let handler = TransferAreaComHandler::builder("127.0.0.1").areas(areas).build().unwrap();
        assert_eq!(handler.areas().lock().len(), areas);
    }
}

#[test]
fn beginning_twice_leaves_the_transfer_alone() {
    let txt = unpaced().start().unwrap();
    let handler = handler_for(&txt).build().unwrap();
    handler.begin_transfer().unwrap();
    assert_eq!(handler.begin_transfer(), Err(Error::AlreadyStarted));
    handler.areas().wait_cycle().unwrap();
    assert_eq!(handler.areas().error(), None);
    handler.end_transfer().unwrap();
}

#[test]
fn waiting_and_updating_before_the_beginning() {
    let handler = TransferAreaComHandler::builder("127.0.0.1").build().unwrap();
    assert_eq!(handler.areas().wait_cycle().unwrap_err(), Error::NotStarted);
    assert_eq!(handler.areas().wait_cycle_for(Duration::ZERO).unwrap_err(), Error::NotStarted);
    assert_eq!(handler.areas().update_config(), Err(Error::NotStarted));
    assert_eq!(handler.end_transfer(), Ok(()));
    assert_eq!(handler.areas().lock()[..], [FishX1Transfer::default()]);
}
