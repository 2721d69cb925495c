//! When the simulated camera serves, and how it ends.

use std::io::{ErrorKind, Read, Write};
use std::net::{Ipv4Addr, TcpStream};
use std::thread;
use std::time::{Duration, Instant};

use ft_transfer_area::wire::{CommandId, ResponseId};
use ft_transfer_area_simulator::{CameraConnection, Machine, SimulatedTxt};

use crate::camera::with_camera;
use crate::camera_client::{settings, CameraClient};
use crate::endings::assert_drops;
use crate::unpaced;
use crate::wire_client::{Client, LIMIT};

/// Whether a camera client gets only a closed connection.
fn assert_closed(txt: &SimulatedTxt) {
    assert_eq!(CameraClient::connect(txt).until_closed(), 0);
}

#[test]
fn nothing_is_served_before_the_camera_is_started_and_after_it_is_stopped() {
    let txt = with_camera().start().unwrap();
    assert_closed(&txt);
    let mut main = Client::online(&txt);
    assert_closed(&txt);
    main.stop_camera();
    assert_closed(&txt);
    main.start_camera(settings(160, 120, 15));
    CameraClient::connect(&txt).receive();
    main.stop_camera();
    assert_closed(&txt);
    assert_eq!(txt.with_machine(|machine| machine.camera_frames()), 1);
}

#[test]
fn nothing_is_served_before_the_start_up_time_has_passed() {
    let start_up = Duration::from_millis(200);
    let txt = unpaced().camera_start_up(start_up).start().unwrap();
    let mut main = Client::online(&txt);
    let begin = Instant::now();
    main.start_camera(settings(160, 120, 15));
    assert!(txt.with_machine(|machine| machine.camera().is_some()));
    // A client that takes a connection as a sign that the camera serves waits for its first frame.
    CameraClient::connect(&txt).receive();
    assert!(begin.elapsed() >= start_up);

    let txt = unpaced().camera_start_up(Duration::from_secs(3600)).start().unwrap();
    let mut main = Client::online(&txt);
    main.start_camera(settings(160, 120, 15));
    let camera = CameraClient::connect(&txt);
    main.stop_camera();
    assert_eq!(camera.until_closed(), 0);
}

#[test]
fn each_way_to_stop_the_camera_ends_its_connection() {
    let stop_online = |mut main: Client| {
        main.command(CommandId::StopOnline);
        ResponseId::StopOnline.check(&main.receive(4)).unwrap();
    };
    let ends: [fn(Client); 5] = [
        |mut main| main.stop_camera(),
        stop_online,
        |mut main| main.start_online(),
        |mut main| main.start_camera(settings(0, 0, 0)),
        drop,
    ];
    for end in ends {
        let txt = with_camera().start().unwrap();
        let mut main = Client::online(&txt);
        main.start_camera(settings(160, 120, 15));
        let mut camera = CameraClient::connect(&txt);
        camera.receive();
        end(main);
        assert_eq!(camera.until_closed(), 0);
        assert!(txt.wait_until(|machine| machine.camera().is_none(), LIMIT));
        assert_closed(&txt);
    }
}

#[test]
fn starting_again_ends_the_connection_and_serves_the_next() {
    let txt = with_camera().start().unwrap();
    let mut main = Client::online(&txt);
    main.start_camera(settings(160, 120, 15));
    let mut camera = CameraClient::connect(&txt);
    camera.receive();
    main.start_camera(settings(160, 120, 15));
    assert_eq!(camera.until_closed(), 0);
    main.start_camera(settings(320, 240, 15));
    assert_eq!(CameraClient::connect(&txt).receive().header.width, 320);
}

#[test]
fn a_wrong_acknowledgement_ends_the_camera_connection_and_no_other() {
    let txt = with_camera().start().unwrap();
    let mut main = Client::online(&txt);
    main.start_camera(settings(160, 120, 15));
    let mut camera = CameraClient::connect(&txt);
    camera.receive();
    camera.stream.write_all(&[0xBA, 0x9F, 0xA0, 0xAC]).unwrap();
    assert_eq!(camera.until_closed(), 0);
    assert_eq!(txt.with_machine(|machine| machine.camera_acknowledges()), 0);
    main.exchange_compressed(&[[0; 27]], 0);
    CameraClient::connect(&txt).receive();
}

#[test]
fn a_stalled_camera_is_silent_and_open_until_it_is_stopped() {
    let txt = with_camera().camera_stall_after(2).start().unwrap();
    let mut main = Client::online(&txt);
    main.start_camera(settings(160, 120, 200));
    // Every connection gets its two frames.
    for connections in 1..=2 {
        let mut camera = CameraClient::connect(&txt);
        for _ in 0..2 {
            camera.receive();
            camera.acknowledge();
        }
        let acknowledged = |machine: &Machine| machine.camera_acknowledges() == 2 * connections;
        assert!(txt.wait_until(acknowledged, LIMIT));
        camera.stream.set_read_timeout(Some(Duration::from_millis(50))).unwrap();
        let silence = camera.stream.peek(&mut [0]).unwrap_err().kind();
        // The system decides which of the two.
        assert!(matches!(silence, std::io::ErrorKind::WouldBlock | std::io::ErrorKind::TimedOut));
        camera.stream.set_read_timeout(Some(LIMIT)).unwrap();
        if connections == 2 {
            main.stop_camera();
            assert_eq!(camera.until_closed(), 0);
        }
    }
}

#[test]
fn a_script_that_panics_ends_the_camera_too() {
    let txt = with_camera().on_exchange(|_| panic!("as the test wants it")).start().unwrap();
    let mut main = Client::online(&txt);
    main.start_camera(settings(160, 120, 15));
    let mut camera = CameraClient::connect(&txt);
    camera.receive();
    main.send_compressed(&[[0; 27]], 0);
    assert_eq!(main.until_closed(), []);
    assert_eq!(camera.until_closed(), 0);
}

#[test]
fn dropping_does_not_wait_for_the_cameras_client() {
    // One client that has to acknowledge, and one that gets nothing.
    for (stall_after, frames) in [(9, 1), (0, 0)] {
        let txt = with_camera().camera_stall_after(stall_after).start().unwrap();
        let mut main = Client::online(&txt);
        main.start_camera(settings(160, 120, 15));
        let camera = CameraClient::connect(&txt);
        assert!(txt.wait_until(|machine| machine.camera_frames() == frames, LIMIT));
        assert_drops(txt);
        drop(camera);
    }
}

/// A simulated TXT whose camera accepts connections in this way.
fn connecting(connection: CameraConnection) -> SimulatedTxt {
    with_camera().camera_connection(connection).start().unwrap()
}

fn is_refused(txt: &SimulatedTxt) -> bool {
    let result = TcpStream::connect((Ipv4Addr::LOCALHOST, txt.camera_port()));
    result.is_err_and(|error| error.kind() == ErrorKind::ConnectionRefused)
}

#[test]
fn a_camera_like_the_txts_refuses_clients_before_it_serves_and_after_it_has_stopped() {
    let txt = connecting(CameraConnection::Txt);
    assert!(is_refused(&txt), "it is not online");
    let mut main = Client::online(&txt);
    for _ in 0..3 {
        assert!(is_refused(&txt), "it is not started");
        main.start_camera(settings(160, 120, 15));
        let begin = Instant::now();
        let stream = loop {
            // It serves soon after the command.
            match TcpStream::connect((Ipv4Addr::LOCALHOST, txt.camera_port())) {
                Ok(stream) => break stream,
                Err(error) => assert!(begin.elapsed() < LIMIT, "{error}"),
            }
        };
        let mut camera = CameraClient::over(stream);
        camera.receive();
        main.stop_camera();
        assert_eq!(camera.until_closed(), 0);
        let begin = Instant::now();
        while !is_refused(&txt) {
            assert!(begin.elapsed() < LIMIT, "it accepts connections though it is stopped");
        }
    }
}

#[test]
fn a_camera_like_the_txt_40s_serves_who_is_connected_when_it_is_started() {
    let txt = connecting(CameraConnection::Txt40);
    let mut main = Client::online(&txt);
    for _ in 0..3 {
        let mut camera = CameraClient::connect(&txt);
        main.start_camera(settings(160, 120, 15));
        camera.receive();
        camera.acknowledge();
        camera.receive();
        main.stop_camera();
        assert_eq!(camera.until_closed(), 0);
    }
}

#[test]
fn a_camera_like_the_txt_40s_never_serves_a_client_that_comes_later() {
    let txt = connecting(CameraConnection::Txt40);
    let mut main = Client::online(&txt);
    main.start_camera(settings(160, 120, 60));
    let camera = CameraClient::connect(&txt);
    // A camera that serves other clients has sent frames by then.
    camera.stream.set_read_timeout(Some(Duration::from_millis(300))).unwrap();
    let error = (&camera.stream).read(&mut [0]).unwrap_err();
    assert!(matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut), "{error}");
    assert_eq!(txt.with_machine(|machine| machine.camera_frames()), 0);
    // The next start finds it.
    camera.stream.set_read_timeout(Some(LIMIT)).unwrap();
    main.start_camera(settings(160, 120, 60));
    CameraClient::over(camera.stream).receive();
}

#[test]
fn of_clients_that_starts_find_meanwhile_only_the_newest_waits() {
    let builder = with_camera().camera_connection(CameraConnection::Txt40);
    let txt = builder.camera_start_up(Duration::from_secs(3600)).start().unwrap();
    let mut main = Client::online(&txt);
    let clients = [(); 5].map(|()| {
        let client = CameraClient::connect(&txt).stream;
        main.start_camera(settings(160, 120, 15));
        client.set_nonblocking(true).unwrap();
        client
    });
    let is_closed = |mut client: &TcpStream| matches!(client.read(&mut [0]), Ok(0));
    // One, mostly the first, is taken and waits for the camera.
    let (newest, others) = clients.split_last().unwrap();
    let begin = Instant::now();
    while others.iter().filter(|client| is_closed(client)).count() < others.len() - 1 {
        assert!(begin.elapsed() < LIMIT, "others wait, too");
        thread::sleep(Duration::from_millis(5));
    }
    assert!(!is_closed(newest));
}
