//! Programs that go online several times on one connection: the recording has all of it, and a replay compares all.

use std::io::{Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::process::Stdio;
use std::time::{Duration, Instant};

use ft_transfer_area::wire::CommandId;
use ft_transfer_area_recorder::{FailureKind, Transfer};
use ft_transfer_area_simulator::SimulatedTxt;

use super::clients::transfers;
use super::support::{command, connect, KitClient, Watch};
use super::LIMIT;
use crate::recording::{said, txt};
use crate::running::Running;

/// How often a program exchanges with its motor on, before it stops the motor.
const EXCHANGES: usize = 5;

/// Goes online once for each of these duties. Between them it goes offline, or not.
fn program(port: u16, goes_offline: bool, duties: &[i16]) {
    let mut stream = connect(([127, 0, 0, 1], port).into());
    for (number, duty) in duties.iter().enumerate() {
        if goes_offline && number > 0 {
            stop_online(&mut stream);
        }
        let mut client = KitClient::without_question(stream);
        (0..EXCHANGES).for_each(|_| client.exchange([*duty, 0, 0, 0, 0, 0, 0, 0]));
        client.exchange([0; 8]);
        stream = client.stream;
    }
    stop_online(&mut stream);
}

fn stop_online(stream: &mut TcpStream) {
    stream.write_all(&CommandId::StopOnline.id().to_le_bytes()).unwrap();
    stream.read_exact(&mut [0; 4]).unwrap();
}

/// Records this program by `txt watch`.
fn record(path: &Path, goes_offline: bool, duties: &[i16]) {
    let txt = SimulatedTxt::builder().pace(Duration::ZERO).start().unwrap();
    let watch = Watch::start(txt.address(), &["--no-page", "--record", path.to_str().unwrap()]);
    program(watch.port, goes_offline, duties);
    watch.running.signal("INT");
    assert!(watch.running.end().status.success());
}

/// What a replay says of this program, and whether it ends well.
fn replay(path: &Path, goes_offline: bool, duties: &[i16]) -> (bool, String) {
    let arguments = ["replay", path.to_str().unwrap(), "--port", "0", "--fast", "--once"];
    let running = Running::start(&mut txt(&arguments));
    let line = running.line();
    let port = line.split("127.0.0.1:").nth(1).and_then(|rest| rest.split('.').next());
    program(port.unwrap().parse().unwrap(), goes_offline, duties);
    let output = running.end();
    (output.status.success(), said(&output))
}

#[cfg_attr(not(unix), ignore = "only Unix can end another program like Ctrl-C")]
#[test]
fn a_program_that_goes_offline_and_online_again_does_the_same_against_a_replay() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    record(&path, true, &[512, 300]);
    let (well, said) = replay(&path, true, &[512, 300]);
    assert!(well && said.contains("after 12 recorded cycles. It did the same."), "{said}");
    let (well, said) = replay(&path, true, &[512, 400]);
    assert!(!well && said.contains("differed in cycle 1, "), "{said}");
    assert!(said.contains("O1 was 300 and is 400."), "{said}");
    let (well, said) = replay(&path, true, &[512, 300, 200]);
    assert!(!well && said.contains("it goes online again, and the recorded one left."), "{said}");
}

#[cfg_attr(not(unix), ignore = "only Unix can end another program like Ctrl-C")]
#[test]
fn a_program_that_goes_online_twice_without_an_end_has_two_transfers() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    record(&path, false, &[512, 300]);
    let recorded = transfers(&path);
    let [Transfer::Began { .. }, Transfer::EndedBy(failure), Transfer::Began { .. }, Transfer::Ended] =
        &recorded[..]
    else {
        panic!("{recorded:?}")
    };
    assert_eq!(failure.kind, FailureKind::Other);
    assert_eq!(failure.error, "the program went online again while it was online");
    let (well, said) = replay(&path, false, &[512, 300]);
    assert!(well && said.contains("after 12 recorded cycles. It did the same."), "{said}");
    let (well, said) = replay(&path, false, &[512, 400]);
    assert!(!well && said.contains("O1 was 300 and is 400."), "{said}");
}

#[cfg_attr(not(unix), ignore = "only Unix can end another program like Ctrl-C")]
#[test]
fn the_cycles_of_all_parts_are_told_with_the_first_and_the_last_one() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    let txt = SimulatedTxt::builder().start().unwrap();
    let arguments = ["--no-page", "--record", path.to_str().unwrap(), "--parts", "1s"];
    let mut command = command(txt.address(), &arguments);
    let running = Running::start(command.stderr(Stdio::piped()));
    let main = running.line();
    let address = main.strip_prefix("main ").unwrap().parse().unwrap();
    let mut client = KitClient::without_question(connect(address));
    let begin = Instant::now();
    // When the third one is there, the second one is known.
    while !folder.path().join("run-0003.mcap").exists() {
        client.exchange([0; 8]);
        assert!(begin.elapsed() < LIMIT, "there is no third part");
    }
    stop_online(&mut client.stream);
    running.signal("INT");
    let said = said(&running.end());
    let first = folder.path().join("run-0001.mcap");
    assert!(
        said.contains(&format!("{} to {}", first.display(), folder.path().display())),
        "{said}"
    );
}
