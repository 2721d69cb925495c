//! A camera server that listens all the time, and looks for a connection only once: when the camera is
//! started. The server program for the TXT 4.0 does so.

use std::time::Duration;

use ft_transfer_area::CameraOptions;
use ft_transfer_area_simulator::{CameraConnection, Fault, FaultKind, SimulatedTxtBuilder};

use crate::support::{check_client, handler_for, unpaced, DEADLINE};

/// A simulated TXT whose camera takes connections this way.
fn txt(connection: CameraConnection) -> SimulatedTxtBuilder {
    unpaced().camera_start_up(Duration::ZERO).camera_connection(connection)
}

/// A short limit, for a connection that a server that looks once never serves.
fn options() -> CameraOptions {
    CameraOptions::default().size(16, 16).frame_limit(Duration::from_secs(5))
}

#[test]
fn a_server_that_looks_once_when_the_camera_starts_serves_the_client_each_time() {
    let txt = txt(CameraConnection::Txt40).start().unwrap();
    let handler = handler_for(&txt).camera_port(txt.camera_port()).build().unwrap();
    handler.begin_transfer().unwrap();
    for start in 0..5 {
        let frames = handler.start_camera(options()).unwrap();
        for _ in 0..3 {
            frames.recv_timeout(DEADLINE).unwrap_or_else(|_| panic!("start {start} had no frame"));
        }
        handler.stop_camera().unwrap();
    }
    handler.end_transfer().unwrap();
    check_client(&txt);
}

#[test]
fn after_a_gap_frames_come_from_servers_that_look_once_and_from_those_that_refuse_at_first() {
    for connection in [CameraConnection::Txt40, CameraConnection::Txt, CameraConnection::Waits] {
        // The first connection ends some exchanges after the camera's start.
        let end = Fault::at_exchange(300, FaultKind::Close { after: 0 });
        let pace = Duration::from_millis(1);
        let txt = txt(connection).pace(pace).fault(end).start().unwrap();
        let handler = handler_for(&txt)
            .camera_port(txt.camera_port())
            .reconnect(DEADLINE)
            .reaction_window(Duration::ZERO)
            .build()
            .unwrap();
        handler.begin_transfer().unwrap();
        let frames = handler.start_camera(options()).unwrap();
        frames.recv_timeout(DEADLINE).expect("a frame before the gap");
        while handler.areas().statistics().gaps == 0 {
            let _ = handler.areas().wait_cycle();
        }
        // Another controller may answer by now.
        assert!(frames.try_recv().is_err(), "a frame of before the gap");
        while handler.areas().wait_cycle().is_err() {}
        let before = handler.camera_statistics().frames;
        while handler.camera_statistics().frames == before {
            assert_eq!(handler.camera_error(), None, "{connection:?}");
            std::thread::sleep(Duration::from_millis(1));
        }
        handler.end_transfer().unwrap();
    }
}
