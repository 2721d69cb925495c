//! What needs no Mosquitto.

use std::io::{Read, Write};
use std::net::TcpListener;
use std::process::Command;
use std::thread;

use ft_transfer_area_simulator::SimulatedTxt;

use super::support::{wait_machine, Bridge};

/// What `txt bridge` with these arguments prints before it fails.
fn refused(arguments: &[&str]) -> String {
    let mut command = Command::new(env!("CARGO_BIN_EXE_txt"));
    let output = command.arg("bridge").args(arguments).output().unwrap();
    assert!(!output.status.success(), "{arguments:?}");
    String::from_utf8(output.stderr).unwrap()
}

#[cfg_attr(not(unix), ignore = "the tests end the bridge by a signal")]
#[test]
fn wrong_arguments_are_a_sentence() {
    for (arguments, sentence) in [
        (&["--mqtt", "", "txt"][..], "is not a broker's address"),
        (&["--mqtt", "b", "txt:x"], "is not a controller's address"),
        (&["--mqtt", "b", "--prefix", "a/#", "txt"], "can't begin a topic"),
        (&["--mqtt", "b", "txt", "txt"], "two controllers have the name \"txt\""),
        (&["--mqtt", "b", "--name", "a", "one", "two"], "2 controllers, but 1 times --name"),
        (&["--mqtt", "b", "--name", "stop", "one"], "\"stop\" can't be the name"),
        (&["--mqtt", "b", "--name", "ext8", "one"], "extensions are called so"),
        (&["--mqtt", "b", "--user", "me", "one"], "the password of me is missing"),
        (&["--mqtt", "b", "--simulate", "moon"], "moon"),
        (&["--mqtt", "b", "--broker-limit", "5", "txt"], "5 is not in 2000..=60000"),
        (&["txt"], "--mqtt"),
    ] {
        let printed = refused(arguments);
        assert!(printed.contains(sentence), "{arguments:?}: {printed}");
    }
}

#[cfg_attr(not(unix), ignore = "the tests end the bridge by a signal")]
#[test]
fn without_a_broker_the_bridge_says_so_and_tries_again_until_it_is_ended() {
    // Nobody listens here, and nobody else takes the port meanwhile.
    let port = 1;
    let txt = SimulatedTxt::builder().start().unwrap();
    let host = txt.address().to_string();
    let mut bridge = Bridge::start(port, [&*host]);
    bridge.wait_for("can't be reached");
    bridge.wait_for("trying again");
    wait_machine(&txt, "online", |machine| machine.online());
    bridge.interrupt();
    assert!(bridge.wait().success());
    wait_machine(&txt, "offline", |machine| !machine.online());
}

/// Each connection is lost after an exchange, and made again at once.
#[cfg_attr(not(unix), ignore = "the tests end the bridge by a signal")]
#[test]
fn a_controller_that_comes_and_goes_fills_no_disk_with_lines() {
    let lost = (0..60).map(|_| "cut@exchange:1".parse().unwrap());
    let txt = lost.fold(SimulatedTxt::builder(), |txt, fault| txt.fault(fault)).start().unwrap();
    let mut bridge = Bridge::start(1, [&*txt.address().to_string()]);
    bridge.wait_for("too many changes");
    bridge.interrupt();
    // Whether it could stop the motors depends on the moment.
    bridge.wait();
    let printed = bridge.count("online as") + bridge.count("was lost");
    assert!(printed <= 40, "{printed}");
}

#[cfg_attr(not(unix), ignore = "the tests end the bridge by a signal")]
#[test]
fn a_broker_that_sends_garbage_is_left_and_tried_again() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = listener.local_addr().unwrap().port();
    let (tried, tries) = crossbeam_channel::unbounded();
    thread::spawn(move || {
        // No MQTT; after CONNACK an acknowledgement of nothing; a packet that announces far too much.
        let garbage: [&[u8]; 3] = [
            &[0xFF; 64],
            &[0x20, 2, 0, 0, 0x40, 2, 0, 9],
            &[0x20, 2, 0, 0, 0x30, 0xFF, 0xFF, 0xFF, 0x7F],
        ];
        for (stream, garbage) in listener.incoming().zip(garbage.into_iter().cycle()) {
            let Ok(mut stream) = stream else { return };
            let mut request = [0; 1024];
            let _ = stream.read(&mut request);
            let _ = stream.write_all(garbage);
            if tried.send(()).is_err() {
                return;
            }
            // Until the bridge has had enough.
            let _ = stream.read_to_end(&mut Vec::new());
        }
    });
    let txt = SimulatedTxt::builder().start().unwrap();
    let host = txt.address().to_string();
    let mut bridge = Bridge::start(port, [&*host, "--broker-limit", "2000"]);
    bridge.wait_for("sent what is not MQTT");
    tries.recv_timeout(super::support::LONGEST_WAIT).unwrap();
    tries.recv_timeout(super::support::LONGEST_WAIT).unwrap();
    wait_machine(&txt, "online", |machine| machine.online());
    bridge.interrupt();
    assert!(bridge.wait().success());
}

/// Whoever asks a name server that does not answer waits for longer than the broker may be silent.
#[cfg(target_os = "linux")]
#[test]
fn lookups_of_a_brokers_name_that_take_long_do_not_add_up() {
    use std::process::Stdio;
    use std::time::Duration;

    // Only root may listen where name servers do.
    let Ok(_silent) = std::net::UdpSocket::bind("127.53.53.53:53") else {
        eprintln!("skipped: no name server can be made here");
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    let servers = folder.path().join("resolv.conf");
    std::fs::write(&servers, "nameserver 127.53.53.53\noptions timeout:30\n").unwrap();
    let script = "mount --bind \"$1\" /etc/resolv.conf && exec \"$2\" bridge --mqtt broker.example --simulate \
        --broker-limit 2000";
    let mut unshare = Command::new("unshare");
    unshare.args(["--mount", "sh", "-c", script, "sh"]).arg(&servers);
    unshare.arg(env!("CARGO_BIN_EXE_txt")).stdin(Stdio::null()).stdout(Stdio::null());
    let mut bridge = unshare.stderr(Stdio::null()).spawn().unwrap();
    // An attempt takes 3 s. A thread that looks up names has this beginning of a name.
    let lookups = || {
        let tasks = std::fs::read_dir(format!("/proc/{}/task", bridge.id())).unwrap();
        let names = tasks
            .flatten()
            .filter_map(|task| std::fs::read_to_string(task.path().join("comm")).ok());
        names.filter(|name| name.starts_with("tokio-r")).count()
    };
    let counts: Vec<_> = (0..24)
        .map(|_| {
            thread::sleep(Duration::from_millis(500));
            lookups()
        })
        .collect();
    if bridge.try_wait().unwrap().is_some() {
        eprintln!("skipped: a file can't be put in place of another one here");
        return;
    }
    bridge.kill().unwrap();
    bridge.wait().unwrap();
    assert_eq!(counts.iter().max(), Some(&1), "{counts:?}");
}
