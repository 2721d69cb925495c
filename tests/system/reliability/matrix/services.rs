//! Faults of the camera's and of the I2C connection. The transfer goes on.

use std::io::Read;
use std::time::{Duration, Instant};

use ft_transfer_area::wire::{
    CameraFrameHeader, CommandId, I2cRequestHeader, I2cResponseHeader, CAMERA_FRAME_ACKNOWLEDGE,
};
use ft_transfer_area::{
    CameraOptions, Error, TimeLimits, TransferAreaComHandler, TransferAreaComHandlerBuilder,
};
use ft_transfer_area_simulator::{FaultKind, Machine};

use super::controller::{is_on, txt, Controller, DUTY};
use super::fake::{closed_port, Client, Deaf, Fake, Script};
use super::row::{By, Outcome, Row, Seen, DEADLINE};

/// How long the camera's start and a frame may take.
const LIMIT: Duration = Duration::from_secs(1);

/// The bytes of a frame.
const SIZE: usize = 1000;

pub(crate) fn rows() -> Vec<Row> {
    camera_rows().into_iter().chain(i2c_rows()).collect()
}

fn camera_rows() -> Vec<Row> {
    const SECTION: &str = "The camera";
    const START: &str = "the start limit (1 s)";
    const FRAME: &str = "the frame limit (1 s)";
    let refused = Row::new(SECTION, "refused", "connecting")
        .sees("`ConnectionRefused` from `camera_error`", START)
        .test(|| {
            let (_socket, port) = closed_port();
            Ok(camera(port))
        });
    let deaf = Row::new(SECTION, "SYN dropped", "connecting")
        .sees("`ConnectTimedOut` from `camera_error`", START)
        .test(|| {
            let deaf = Deaf::start();
            Ok(camera(deaf.port()))
        });
    let scripts: [(_, _, _, _, Script); 8] = [
        ("closed", "before the first frame", "`ConnectionClosed`", START, |_| {}),
        ("stalled", "before the first frame", "`NoAnswer`", FRAME, |client| client.hold()),
        ("stalled", "within a frame", "`NoAnswer`", FRAME, |client| {
            client.send(&frame()[..SIZE / 2]);
            client.hold();
        }),
        ("one byte at a time, too slowly", "within a frame", "`NoAnswer`", FRAME, |client| {
            for byte in frame() {
                std::thread::sleep(Duration::from_millis(5));
                if !client.send(&[byte]) {
                    return;
                }
            }
        }),
        ("closed", "within a frame", "`ConnectionClosed`", "immediately", |client| {
            client.send(&frame()[..SIZE / 2]);
        }),
        ("garbage", "instead of a frame", "`WrongId`", "immediately", |client| {
            client.send(b"HTTP/1.1 404 Not Found\r\n\r\n");
            client.hold();
        }),
        ("an implausible size", "of a frame", "`FrameSize`", "immediately", |client| {
            let mut bytes = Vec::new();
            CameraFrameHeader { size_compressed: i32::MAX, ..header() }.emit(&mut bytes);
            client.send(&bytes);
            client.hold();
        }),
        ("endless bytes", "after a frame", "`WrongId`", "immediately", |client| {
            client.send(&frame());
            while client.send(&[0xA5; 4096]) {}
        }),
    ];
    let rows = scripts.into_iter().map(|(fault, place, sees, limit, script)| {
        Row::new(SECTION, fault, place).sees(sees, limit).test(move || {
            let fake = Fake::start(script);
            Ok(camera(fake.port()))
        })
    });
    let flood = Row::new(SECTION, "endless frames", "faster than they are read")
        .sees("nothing: the oldest frames are dropped", "–")
        .test(|| Ok(flood()));
    let restarts = Row::new(SECTION, "SYN dropped", "connecting, after a gap")
        .sees("nothing: the exchanges go on meanwhile", "–")
        .test(|| Ok(restarts_deaf()));
    [refused, deaf, restarts].into_iter().chain(rows).chain([flood]).collect()
}

fn i2c_rows() -> Vec<Row> {
    const SECTION: &str = "I2C";
    const READ: &str = "the read limit (1 s)";
    let refused = Row::new(SECTION, "refused", "connecting")
        .sees("`ConnectionRefused`", "immediately")
        .test(|| {
            let (_socket, port) = closed_port();
            Ok(i2c(port))
        });
    let deaf = Row::new(SECTION, "SYN dropped", "connecting")
        .sees("`ConnectTimedOut`", "the connect limit (1 s)")
        .test(|| {
            let deaf = Deaf::start();
            Ok(i2c(deaf.port()))
        });
    let scripts: [(_, _, _, _, Script); 6] = [
        ("stalled", "instead of a response", "`NoAnswer`", READ, |client| client.hold()),
        ("half a response", "then silence", "`NoAnswer`", READ, |client| {
            read_request(client);
            client.send(&response()[..7]);
            client.hold();
        }),
        ("half a response", "then FIN", "`ConnectionClosed`", "immediately", |client| {
            read_request(client);
            client.send(&response()[..7]);
        }),
        ("closed", "instead of a response", "`ConnectionClosed`", "immediately", |client| {
            read_request(client);
        }),
        ("garbage", "instead of a response", "`WrongId`", "immediately", |client| {
            read_request(client);
            client.send(b"HTTP/1.1 404 Not Found\r\n\r\n");
            client.hold();
        }),
        ("endless bytes", "after a response", "`WrongSize`", "immediately", |client| {
            read_request(client);
            let mut bytes = response();
            bytes.resize(4096, 0xA5);
            while client.send(&bytes) {}
        }),
    ];
    let rows = scripts.into_iter().map(|(fault, place, sees, limit, script)| {
        Row::new(SECTION, fault, place).sees(sees, limit).test(move || {
            let fake = Fake::start(script);
            Ok(i2c(fake.port()))
        })
    });
    let no_device = Row::new(SECTION, "no device", "at this address")
        .sees("`I2cNoDevice`", "immediately")
        .test(|| {
            let other = txt().start().unwrap();
            Ok(i2c(other.i2c_port()))
        });
    [refused, deaf].into_iter().chain(rows).chain([no_device]).collect()
}

fn header() -> CameraFrameHeader {
    CameraFrameHeader {
        frames_ready: 1,
        width: 16,
        height: 16,
        size_raw: 512,
        size_compressed: (SIZE - CameraFrameHeader::LEN) as i32,
    }
}

fn frame() -> Vec<u8> {
    let mut bytes = Vec::new();
    header().emit(&mut bytes);
    bytes.resize(SIZE, 0xA5);
    bytes
}

fn response() -> Vec<u8> {
    let mut bytes = Vec::new();
    I2cResponseHeader { read_len: 1, is_ok: true }.emit(&mut bytes);
    bytes.push(5);
    bytes
}

fn read_request(client: &mut Client) {
    let _ = client.stream.read_exact(&mut [0; I2cRequestHeader::LEN + 1]);
}

/// A program with a motor on, its camera and its I2C port.
struct Program {
    controller: Controller,
    handler: TransferAreaComHandler,
}

impl Program {
    fn start(camera_port: u16, i2c_port: u16) -> Self {
        Self::with(|builder| builder.camera_port(camera_port).i2c_port(i2c_port))
    }

    fn with(
        set: impl FnOnce(TransferAreaComHandlerBuilder) -> TransferAreaComHandlerBuilder,
    ) -> Self {
        let controller = Controller::start(txt());
        let limits = TimeLimits::default().connect(LIMIT).read(LIMIT);
        let handler = set(controller.handler().time_limits(limits)).build().unwrap();
        handler.areas().lock()[0].output.duty[0] = DUTY;
        handler.begin_transfer().unwrap();
        controller.wait_on();
        Self { controller, handler }
    }

    /// Checks that the transfer goes on, and ends it.
    fn finish(self, error: Option<Error>, soon: Option<Duration>) -> Outcome {
        for _ in 0..3 {
            drop(self.handler.areas().wait_cycle().unwrap());
        }
        assert!(self.controller.txt.with_machine(|machine| is_on(machine)));
        assert_eq!(self.handler.end_transfer(), Ok(()));
        let seen = error.map_or(Seen::Nothing, Seen::Error);
        Outcome { seen, soon, by: By::GoesOn, stopped: None }
    }
}

/// The outcome of a camera whose server is at this port.
fn camera(port: u16) -> Outcome {
    let program = Program::start(port, 0);
    let options = CameraOptions::default().start_limit(LIMIT).frame_limit(LIMIT);
    let begin = Instant::now();
    let frames = program.handler.start_camera(options).unwrap();
    // Until the channel ends.
    for _ in frames {}
    let soon = begin.elapsed();
    let error = program.handler.camera_error();
    assert!(error.is_some(), "the stream has ended without an error");
    program.finish(error, Some(soon))
}

/// The camera is started again after a gap, and its port does not answer.
fn restarts_deaf() -> Outcome {
    // A busy machine may hold up an exchange for as long as connecting takes, but not each time.
    for _ in 0..4 {
        let deaf = Deaf::start();
        let program = Program::with(|builder| builder.camera_port(deaf.port()).reconnect(DEADLINE));
        let _frames = program.handler.start_camera(CameraOptions::default()).unwrap();
        let close = FaultKind::Close { after: 0 };
        program.controller.txt.with_machine(|machine| machine.disturb(close));
        let error = program.handler.areas().wait_until(|_| false, DEADLINE).map(drop).unwrap_err();
        assert!(matches!(error, Error::ConnectionLost { .. }), "{error}");
        program.handler.areas().wait_cycle().unwrap()[0].output.duty[0] = DUTY;
        let starts = |machine: &Machine| {
            machine.commands().filter(|command| *command == CommandId::StartCameraOnline).count()
        };
        program.controller.wait("the second start", |machine| starts(machine) == 2);
        let longest = program.handler.areas().statistics().longest_cycle;
        if longest < Duration::from_millis(300) {
            return program.finish(None, None);
        }
    }
    panic!("no exchange comes while it connects");
}

/// Frames that nobody reads, from a server that waits for no acknowledgement.
fn flood() -> Outcome {
    let fake = Fake::start(|client| {
        while client.send(&frame()) {
            // The acknowledgements must not fill the buffers.
            let mut acknowledgement = [0; CAMERA_FRAME_ACKNOWLEDGE.len()];
            let _ = client.stream.read(&mut acknowledgement);
        }
    });
    let program = Program::start(fake.port(), 0);
    let frames = program.handler.start_camera(CameraOptions::default()).unwrap();
    let begin = Instant::now();
    while program.handler.camera_statistics().dropped < 1000 {
        assert!(begin.elapsed() < super::row::DEADLINE, "nothing is dropped");
        drop(program.handler.areas().wait_cycle().unwrap());
    }
    assert_eq!(program.handler.stop_camera(), Ok(()));
    assert!(frames.iter().count() <= 2, "more than the channel holds");
    program.finish(None, None)
}

/// The outcome of reading from a device at this port.
fn i2c(port: u16) -> Outcome {
    let program = Program::start(0, port);
    let begin = Instant::now();
    let mut value = [0];
    let result = program.handler.i2c().and_then(|mut i2c| i2c.read(0x18, 0, &mut value));
    let soon = begin.elapsed();
    program.finish(result.err(), Some(soon))
}
