//! Faults before there is a connection.

use std::net::{Ipv4Addr, TcpListener};
use std::time::{Duration, Instant};

use ft_transfer_area::{
    Error, FirmwareVersion, TimeLimits, TransferAreaComHandler, TransferAreaComHandlerBuilder,
};

use super::controller::{is_on, txt, Controller, DUTY};
use super::fake::{closed_port, Deaf};
use super::row::{By, Outcome, Row, Seen};

const SECTION: &str = "Connecting";

const CONNECT_LIMIT: Duration = Duration::from_secs(1);
const READ_LIMIT: Duration = Duration::from_secs(1);

pub(crate) fn rows() -> Vec<Row> {
    let row = |fault, sees, limit| {
        Row::new(SECTION, fault, "`begin_transfer`").sees(sees, limit).by(&[By::NeverOn])
    };
    vec![
        row("nothing listens", "`ConnectionRefused`", "immediately").test(|| {
            let (_socket, port) = closed_port();
            Ok(begin(TransferAreaComHandler::builder(format!("127.0.0.1:{port}"))))
        }),
        row("SYN dropped", "`ConnectTimedOut`", "the connect limit (1 s)").test(|| {
            let deaf = Deaf::start();
            Ok(begin(TransferAreaComHandler::builder(format!("127.0.0.1:{}", deaf.port()))))
        }),
        row("connected, but never accepted", "`NoAnswer` to QueryStatus", "the read limit (1 s)")
            .test(|| {
                let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).unwrap();
                let port = listener.local_addr().unwrap().port();
                Ok(begin(TransferAreaComHandler::builder(format!("127.0.0.1:{port}"))))
            }),
        row("unknown name", "`HostNotFound`", "the connect limit").test(|| {
            // No part of a name has more than 63 characters, so no server is asked for this name.
            Ok(begin(TransferAreaComHandler::builder("x".repeat(64))))
        }),
        row("another program is online", "`NoAnswer`", "the read limit (1 s)").test(|| Ok(busy())),
        row("firmware below 4.1.6", "`FirmwareTooOld`", "immediately").test(|| {
            let txt = txt().firmware(FirmwareVersion::new(4, 1, 5)).start().unwrap();
            Ok(begin(TransferAreaComHandler::builder(txt.address())))
        }),
    ]
}

/// The outcome of a transfer that can't begin.
pub(crate) fn begin(builder: TransferAreaComHandlerBuilder) -> Outcome {
    let limits = TimeLimits::default().connect(CONNECT_LIMIT).read(READ_LIMIT);
    let handler = builder.time_limits(limits).build().unwrap();
    let begin = Instant::now();
    let error = handler.begin_transfer().expect_err("there is no controller");
    let soon = Some(begin.elapsed());
    assert!(!handler.areas().is_running());
    assert_eq!(handler.end_transfer(), Err(error.clone()), "the error stays");
    assert_eq!(handler.areas().wait_cycle().unwrap_err(), error, "the error stays");
    Outcome { seen: Seen::Error(error), soon, by: By::NeverOn, stopped: None }
}

/// A controller serves only one program, whose motor goes on.
fn busy() -> Outcome {
    let controller = Controller::start(txt());
    let first = controller.handler().build().unwrap();
    first.areas().lock()[0].output.duty[0] = DUTY;
    first.begin_transfer().unwrap();
    controller.wait_on();
    let outcome = begin(controller.handler());
    drop(first.areas().wait_cycle().unwrap());
    assert!(controller.txt.with_machine(|machine| is_on(machine)));
    assert_eq!(first.end_transfer(), Ok::<(), Error>(()));
    outcome
}
