//! Camera frames come in on a channel while the transfer runs.

use std::sync::mpsc;
use std::thread;
use std::time::{Duration, Instant};

use crossbeam_channel::Receiver;
use ft_transfer_area::transfer_area::LOCAL_IO;
use ft_transfer_area::wire::StartCameraOnline;
use ft_transfer_area::{
    CameraFrame, CameraOptions, CameraStatistics, Error, PowerLine, TransferAreaComHandler,
};
use ft_transfer_area_simulator::{Fault, FaultKind, SimulatedTxt, SimulatedTxtBuilder};

use crate::support::{handler_for, unpaced, unused_ports, wait_until, DEADLINE};

/// A transfer with a simulated TXT whose camera starts without a delay.
fn begin(txt: SimulatedTxtBuilder) -> (SimulatedTxt, TransferAreaComHandler) {
    let txt = txt.camera_start_up(Duration::ZERO).start().unwrap();
    let handler = handler_for(&txt).camera_port(txt.camera_port()).build().unwrap();
    handler.begin_transfer().unwrap();
    (txt, handler)
}

fn receive(frames: &Receiver<CameraFrame>) -> CameraFrame {
    frames.recv_timeout(DEADLINE).expect("no frame came in")
}

/// Waits until this number of frames has come in, read or not.
fn wait_for_frames(handler: &TransferAreaComHandler, count: u64) -> CameraStatistics {
    loop {
        let statistics = handler.camera_statistics();
        if statistics.frames >= count {
            return statistics;
        }
        assert_eq!(handler.camera_error(), None);
        drop(handler.areas().wait_cycle_for(DEADLINE).unwrap());
    }
}

fn check_end(frames: &Receiver<CameraFrame>) {
    while frames.recv_timeout(DEADLINE).is_ok() {}
    let end = frames.recv_timeout(DEADLINE);
    assert_eq!(end, Err(crossbeam_channel::RecvTimeoutError::Disconnected));
}

#[test]
fn frames_come_in_and_decode_while_the_exchange_goes_on() {
    let (txt, handler) = begin(unpaced().camera_tables(false));
    let options = CameraOptions::default().framerate(60).power_line(PowerLine::Hz60);
    let frames = handler.start_camera(options).unwrap();
    assert_eq!(
        txt.with_machine(|machine| machine.camera()),
        Some(StartCameraOnline {
            width: 320,
            height: 240,
            framerate: 60,
            power_line_frequency: 60
        })
    );
    let cycles = handler.areas().statistics().cycles;
    let mut last: Option<CameraFrame> = None;
    for _ in 0..20 {
        let frame = receive(&frames);
        assert_eq!((frame.width, frame.height, frame.size_raw), (320, 240, 320 * 240 * 2));
        assert!(frame.frames_ready <= 1);
        let rgb = frame.to_rgb().unwrap();
        assert_eq!((rgb.width, rgb.height), (320, 240));
        if let Some(last) = last {
            assert!(frame.sequence > last.sequence && frame.arrived > last.arrived);
            assert_ne!(rgb, last.to_rgb().unwrap(), "the picture moves");
        }
        last = Some(frame);
    }
    assert!(handler.areas().statistics().cycles > cycles + 20, "the exchange stopped");
    handler.stop_camera().unwrap();
    handler.end_transfer().unwrap();
}

#[test]
fn a_consumer_that_keeps_up_gets_every_frame() {
    let (txt, handler) = begin(SimulatedTxt::builder());
    // A bigger channel than the default, because a busy machine may delay the consumer.
    let options = CameraOptions::default().size(640, 480).channel_frames(20);
    let channel = handler.start_camera(options).unwrap();
    let frames: Vec<_> = (0..30).map(|_| receive(&channel)).collect();
    let sent = txt.with_machine(|machine| machine.camera_frames());
    let statistics = handler.camera_statistics();
    assert_eq!(statistics.dropped, 0);
    // Another frame may be on its way.
    assert!((30..=statistics.frames + 2).contains(&sent), "{sent} sent, {statistics:?}");
    // An emulated processor may need longer for this than there is from frame to frame.
    for (sequence, frame) in (0..).zip(frames) {
        assert_eq!(frame.sequence, sequence, "a frame was dropped");
        assert_eq!(frame.to_yuv422().unwrap().data.len(), 640 * 480 * 2);
    }
}

#[test]
fn a_slow_consumer_gets_one_of_the_newest_frames() {
    let (_txt, handler) = begin(unpaced());
    let options = CameraOptions::default().framerate(200);
    let frames = handler.start_camera(options).unwrap();
    let mut received = 0;
    for round in 1..5 {
        let before = wait_for_frames(&handler, 20 * round).frames;
        let frame = receive(&frames);
        received += 1;
        // Numbers begin with 0, so the newest of the two in the channel is `before` − 1.
        assert!(frame.sequence + 2 >= before, "frame {} of {before}", frame.sequence);
    }
    handler.stop_camera().unwrap();
    received += frames.iter().count() as u64;
    let statistics = handler.camera_statistics();
    assert_eq!(statistics.frames, received + statistics.dropped, "each frame is counted");
}

#[test]
fn the_server_may_start_slowly() {
    let txt = unpaced().camera_start_up(Duration::from_millis(300)).start().unwrap();
    let handler = handler_for(&txt).camera_port(txt.camera_port()).build().unwrap();
    handler.begin_transfer().unwrap();
    let frames = handler.start_camera(CameraOptions::default()).unwrap();
    receive(&frames);
}

#[test]
fn a_camera_may_deliver_another_size() {
    let (_txt, handler) = begin(unpaced());
    let options = CameraOptions::default().size(1280, 960);
    let frames = handler.start_camera(options).unwrap();
    let frame = receive(&frames);
    // The frame says what was asked for, the picture what was delivered.
    assert_eq!((frame.width, frame.height), (1280, 960));
    let picture = frame.to_rgb().unwrap();
    assert_eq!((picture.width, picture.height), (1280, 720));
}

#[test]
fn stopping_ends_the_channel_and_the_camera_starts_again() {
    let (txt, handler) = begin(unpaced());
    for _ in 0..3 {
        let frames = handler.start_camera(CameraOptions::default()).unwrap();
        receive(&frames);
        handler.stop_camera().unwrap();
        check_end(&frames);
        assert_eq!(handler.camera_error(), None);
        assert_eq!(txt.with_machine(|machine| machine.camera()), None);
    }
    handler.stop_camera().unwrap();
    handler.areas().wait_cycle().unwrap();
}

/// The firmware's camera looks with each picture whether it should stop.
#[test]
fn before_the_camera_starts_another_one_has_a_second_to_stop_while_the_exchange_goes_on() {
    let (txt, handler) = begin(unpaced());
    let mut start = Instant::now();
    for _ in 0..2 {
        let before = txt.with_machine(|machine| machine.exchanges());
        let frames = handler.start_camera(CameraOptions::default()).unwrap();
        assert!(start.elapsed() >= Duration::from_secs(1));
        assert!(txt.with_machine(|machine| machine.exchanges()) > before + 10);
        receive(&frames);
        start = Instant::now();
        handler.stop_camera().unwrap();
    }
}

#[test]
fn the_camera_stops_with_the_transfer() {
    let (txt, handler) = begin(unpaced());
    let frames = handler.start_camera(CameraOptions::default()).unwrap();
    receive(&frames);
    handler.areas().lock()[LOCAL_IO].output.duty[0] = 1;
    handler.end_transfer().unwrap();
    check_end(&frames);
    assert_eq!(txt.with_machine(|machine| machine.camera()), None);
    assert_eq!(handler.camera_error(), None);
    assert!(handler.camera_statistics().frames >= 1, "figures stay after the end");
    assert_eq!(handler.stop_camera(), Ok(()));

    handler.begin_transfer().unwrap();
    let frames = handler.start_camera(CameraOptions::default()).unwrap();
    receive(&frames);
    drop(handler);
    check_end(&frames);
}

/// The controller closes the camera's connection when it stops the camera. That is not a failure of the
/// stream, even when the controller goes offline only some time later.
#[test]
fn the_end_of_a_transfer_is_no_error_of_the_camera() {
    let delay = FaultKind::Delay(Duration::from_millis(20));
    let slow =
        (0..1000).fold(unpaced(), |txt, response| txt.fault(Fault::at_response(response, delay)));
    let (_txt, handler) = begin(slow);
    let frames = handler.start_camera(CameraOptions::default()).unwrap();
    receive(&frames);
    handler.end_transfer().unwrap();
    assert_eq!(handler.camera_error(), None);
}

#[test]
fn the_camera_stops_when_the_program_panics() {
    let (_txt, handler) = begin(unpaced());
    let frames = handler.start_camera(CameraOptions::default()).unwrap();
    receive(&frames);
    let area = handler.areas().clone();
    let panicked = std::thread::spawn(move || {
        let _area = area.lock();
        panic!("a program with a mistake");
    });
    panicked.join().unwrap_err();
    check_end(&frames);
    assert_eq!(handler.camera_error(), None);
    let error = handler.start_camera(CameraOptions::default()).unwrap_err();
    assert_eq!(error, Error::ProgramPanicked);
}

#[test]
fn the_default_port_is_the_one_after_the_main_port() {
    let port = unused_ports();
    let txt = unpaced().port(port).camera_start_up(Duration::ZERO).start().unwrap();
    assert_eq!(txt.camera_port(), port + 1);
    let handler = handler_for(&txt).build().unwrap();
    handler.begin_transfer().unwrap();
    let frames = handler.start_camera(CameraOptions::default()).unwrap();
    receive(&frames);
}

#[test]
fn the_camera_stops_when_the_controller_goes_away() {
    let (txt, handler) = begin(unpaced());
    let frames = handler.start_camera(CameraOptions::default()).unwrap();
    receive(&frames);
    drop(txt);
    check_end(&frames);
    while handler.areas().wait_cycle().is_ok() {}
    handler.end_transfer().unwrap_err();
}

#[test]
fn calls_at_the_wrong_time_err_and_change_nothing() {
    let (txt, handler) = begin(unpaced());
    assert_eq!(handler.stop_camera(), Ok(()), "it was never started");
    let defaults = CameraOptions::default();
    let highest = i64::try_from(usize::MAX).unwrap_or(i64::MAX);
    for (option, given, options) in [
        ("camera's width", 0, defaults.size(0, 240)),
        ("camera's height", 0, defaults.size(320, 0)),
        ("camera's framerate", 0, defaults.framerate(0)),
        ("camera's channel_frames", 0, defaults.channel_frames(0)),
        ("camera's channel_frames", highest, defaults.channel_frames(usize::MAX)),
    ] {
        let error = handler.start_camera(options).unwrap_err();
        assert!(
            matches!(error, Error::OutOfRange { what: o, given: g, .. } if (o, g) == (option, given)),
            "{error:?}"
        );
        assert_eq!(txt.with_machine(|machine| machine.camera()), None);
    }
    let frames = handler.start_camera(CameraOptions::default()).unwrap();
    let again = handler.start_camera(CameraOptions::default()).unwrap_err();
    assert_eq!(again, Error::CameraAlreadyStarted);
    receive(&frames);
    handler.end_transfer().unwrap();
    let late = handler.start_camera(CameraOptions::default()).unwrap_err();
    assert_eq!(late, Error::NotStarted);
    wait_until(&txt, "the end", |machine| !machine.connected());
}

#[test]
fn its_state_can_be_read_while_a_start_waits_for_the_end_of_a_gap() {
    let txt = unpaced().start().unwrap();
    let handler = handler_for(&txt).reconnect(DEADLINE).build().unwrap();
    handler.begin_transfer().unwrap();
    txt.with_machine(|machine| {
        machine.set_absent(true);
        machine.disturb(FaultKind::Close { after: 0 });
    });
    while handler.areas().wait_cycle().is_ok() {}
    let (begins, begun) = mpsc::channel();
    thread::scope(|scope| {
        let start = scope.spawn(|| {
            begins.send(()).unwrap();
            handler.start_camera(CameraOptions::default())
        });
        begun.recv().unwrap();
        // The start waits from some round on.
        for _ in 0..50 {
            assert_eq!(handler.camera_statistics(), CameraStatistics::default());
            assert_eq!(handler.camera_error(), None);
            thread::sleep(Duration::from_millis(1));
        }
        assert!(!start.is_finished(), "it did not wait");
        txt.with_machine(|machine| machine.set_absent(false));
        start.join().unwrap().unwrap();
    });
}
