//! A world with several controllers, started as a user starts it.

use std::io::{BufRead, BufReader, Write};
use std::process::{Command, Stdio};
use std::time::Instant;

use ft_transfer_area::TransferAreaComHandler;

use crate::program::{read_all, simulate, DEADLINE};

#[cfg_attr(not(unix), ignore = "Ctrl-C can't be sent to a single program there")]
#[test]
fn a_factory_says_which_port_belongs_to_which_controller() {
    let mut child = simulate()
        .args(["--world", "factory", "--port", "0"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let log = read_all(child.stderr.take().unwrap());
    let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
    let ports = ["warehouse", "robot", "processing", "sorting"].map(|name| {
        ["main", "camera", "i2c"].map(|port| {
            let line = lines.next().unwrap().unwrap();
            let number = line.strip_prefix(&format!("{name} {port} 127.0.0.1:"));
            number.unwrap_or_else(|| panic!("{line:?}")).parse::<u16>().unwrap()
        })
    });
    let mut typed = child.stdin.take().unwrap();
    // Lines are carried out in their order, so the wrong one is before the other one.
    writeln!(typed, "PUT red delivery\nrobot PUT red delivery").unwrap();

    let [main, ..] = ports[1];
    let handler = TransferAreaComHandler::builder(format!("127.0.0.1:{main}")).build().unwrap();
    handler.begin_transfer().unwrap();
    assert_eq!(handler.device_name().as_deref(), Some("robot"));
    let begin = Instant::now();
    while handler.areas().wait_cycle().unwrap()[0].input.uni[6] != 0 {
        assert!(begin.elapsed() < DEADLINE, "the line does nothing");
    }
    handler.end_transfer().unwrap();
    let id = child.id().to_string();
    assert!(Command::new("kill").args(["-INT", &id]).status().unwrap().success());
    assert!(child.wait().unwrap().success());
    let log = log.join().unwrap();
    assert!(
        log.contains("there is no controller \"PUT\"; a line begins with warehouse, robot"),
        "{log}"
    );
}
