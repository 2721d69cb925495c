//! A controller that does not answer when a connection is made.

use std::io::{Read, Write};
use std::net::{Ipv4Addr, SocketAddr, TcpStream};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use ft_transfer_area::wire::CommandId;
use ft_transfer_area_simulator::SimulatedTxt;
use socket2::{Domain, Socket, Type};

use super::away::at_free_ports;
use super::support::{is_reset, KitClient, Watch};
use crate::recording::{run, said};

/// A port at which connections are neither made nor refused, because as many wait there as it takes.
struct Unanswered {
    address: SocketAddr,
    _listener: Socket,
    _waiting: Vec<TcpStream>,
}

impl Unanswered {
    fn at(port: u16) -> Self {
        let listener = Socket::new(Domain::IPV4, Type::STREAM, None).unwrap();
        listener.bind(&SocketAddr::from((Ipv4Addr::LOCALHOST, port)).into()).unwrap();
        listener.listen(0).unwrap();
        let address = listener.local_addr().unwrap().as_socket().unwrap();
        // On one computer a connection that can be made is made at once.
        let connect = || TcpStream::connect_timeout(&address, Duration::from_millis(500)).ok();
        let waiting = std::iter::from_fn(connect).collect();
        Self { address, _listener: listener, _waiting: waiting }
    }
}

#[cfg_attr(
    not(target_os = "linux"),
    ignore = "only Linux leaves a connection unanswered when as many wait as it takes"
)]
#[test]
fn a_connection_that_its_program_has_given_up_is_closed() {
    let controller = Unanswered::at(0);
    let watch = Watch::with_lines(controller.address);
    let mut program = watch.connect();
    program.write_all(&CommandId::QueryStatus.id().to_le_bytes()).unwrap();
    drop(program);
    watch.line_where(|line| line["what"] == "connected");
    watch.line_where(|line| line["what"] == "closed");
}

#[cfg_attr(
    not(target_os = "linux"),
    ignore = "only Linux leaves a connection unanswered when as many wait as it takes"
)]
#[test]
fn commands_pass_while_connections_to_the_camera_are_tried_again_and_again() {
    let txt = at_free_ports(|port| {
        SimulatedTxt::builder().pace(Duration::ZERO).port(port).camera_port(0)
    });
    let _camera = Unanswered::at(txt.port() + 1);
    let watch = Watch::start(txt.address(), &["--no-page"]);
    let done = AtomicBool::new(false);
    std::thread::scope(|scope| {
        // One of them is always young enough to be waited for.
        scope.spawn(|| {
            while !done.load(Ordering::Relaxed) {
                let camera = TcpStream::connect((Ipv4Addr::LOCALHOST, watch.port + 1));
                std::thread::sleep(Duration::from_millis(5));
                drop(camera);
            }
        });
        let exchanges = scope.spawn(|| {
            let mut program = KitClient::online(([127, 0, 0, 1], watch.port).into());
            for duty in 0..100 {
                program.exchange([duty; 8]);
            }
            program.end();
        });
        let exchanged = exchanges.join();
        done.store(true, Ordering::Relaxed);
        exchanged.unwrap();
    });
}

#[test]
fn its_own_ports_are_no_controller() {
    let port = at_free_ports(|port| SimulatedTxt::builder().port(port)).port().to_string();
    let controller = format!("127.0.0.1:{port}");
    let output = run(&["watch", &controller, "--port", &port, "--no-page"]);
    assert_eq!(output.status.code(), Some(1), "{}", said(&output));
    assert!(said(&output).contains("txt watch listens there itself"), "{}", said(&output));
}

#[cfg_attr(not(target_os = "linux"), ignore = "only Linux reports at once that there is no route")]
#[test]
fn a_controller_that_can_not_be_reached_is_a_reset() {
    // No connection leads there.
    let watch = Watch::with_lines(([255, 255, 255, 255], 65000).into());
    // What was sent and not read would make a reset of every end.
    assert!(is_reset(watch.connect().read(&mut [0])));
    watch.line_where(|line| line["what"] == "refused");
    watch.line_where(|line| line["what"] == "closed");
}
