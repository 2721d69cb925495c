//! `txt stop`.

use ft_transfer_area_simulator::SimulatedTxt;

#[cfg(target_os = "linux")]
use crate::ending::full_pipe;
use crate::recording::{run, said};
use crate::watch::support::{listener, logged, KitClient};

/// Longer than anything takes on a busy machine; only a failing test waits this long.
const LIMIT: std::time::Duration = std::time::Duration::from_secs(60);

#[test]
fn a_controller_that_a_killed_client_left_on_is_stopped() {
    let (txt, duties) = logged(SimulatedTxt::builder().extensions(1));
    let mut client = KitClient::online(txt.address());
    client.exchange_all(&[[512, 0, 0, 0, 0, 0, 0, 0], [0, 0, 0, 0, 0, 0, 0, 300]]);
    let left = duties.lock().unwrap().len();
    // It sends no last exchange.
    drop(client);
    assert!(txt.wait_until(|machine| !machine.online(), LIMIT));
    let address = txt.address().to_string();
    let output = run(&["stop", &address]);
    assert!(output.status.success(), "{}", said(&output));
    let expected = format!("all outputs of TX2013 at {address} are off\n");
    assert_eq!(String::from_utf8_lossy(&output.stdout), expected);
    let duties = duties.lock().unwrap();
    assert_eq!(duties[left - 1][0][0], 512);
    assert!(duties.len() > left, "nothing was sent");
    assert_eq!(duties.last().unwrap()[..], [[0; 8]; 2]);
    assert!(txt.wait_until(|machine| !machine.online(), LIMIT));
}

#[test]
fn a_controller_that_is_not_there_is_an_error() {
    let (free, address) = listener();
    drop(free);
    let output = run(&["stop", &address.to_string()]);
    assert_eq!(output.status.code(), Some(1), "{}", said(&output));
    assert!(output.stdout.is_empty(), "{}", said(&output));
}

#[test]
fn a_guardian_needs_the_address_of_its_controller() {
    for hosts in [&["127.0.0.1:1", "AUTO:1"][..], &[]] {
        let output = run(&[&["stop", "--guard"], hosts].concat());
        assert_eq!(output.status.code(), Some(1), "{}", said(&output));
        assert!(said(&output).contains("needs the address"), "{}", said(&output));
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_guardian_ends_when_nobody_reads_what_it_says() {
    use std::process::Stdio;

    let (txt, duties) = logged(SimulatedTxt::builder());
    let mut client = KitClient::online(txt.address());
    client.exchange([512; 8]);
    drop(client);
    assert!(txt.wait_until(|machine| !machine.online(), LIMIT));
    let (_folder, (_, pipe)) = full_pipe();
    let mut guardian = crate::recording::txt(&["stop", "--guard", &txt.address().to_string()]);
    guardian.stdout(pipe.try_clone().unwrap()).stderr(pipe);
    // Its standard input is closed, as when the program that has started it was killed.
    let status = guardian.stdin(Stdio::null()).status().unwrap();
    assert!(status.success(), "{status}");
    assert_eq!(duties.lock().unwrap().last().unwrap()[..], [[0; 8]]);
}

#[cfg(target_os = "linux")]
#[test]
fn a_guardian_outlives_signals_that_end_other_programs() {
    use std::process::{Command, Stdio};

    let (txt, duties) = logged(SimulatedTxt::builder());
    let mut client = KitClient::online(txt.address());
    client.exchange([512; 8]);
    drop(client);
    assert!(txt.wait_until(|machine| !machine.online(), LIMIT));
    let mut guardian = crate::recording::txt(&["stop", "--guard", &txt.address().to_string()]);
    let guardian = guardian.stdin(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let id = guardian.id().to_string();
    // All that may be blocked are, from its beginning on.
    let is_ready = || {
        let status = std::fs::read_to_string(format!("/proc/{id}/status")).unwrap();
        status
            .lines()
            .any(|line| line.strip_prefix("SigBlk:").is_some_and(|set| set.contains("ff")))
    };
    crate::running::wait_for("its beginning", is_ready);
    for signal in ["USR1", "USR2", "ALRM", "VTALRM", "PROF", "XCPU", "IO", "PWR", "TERM", "RTMIN"] {
        assert!(Command::new("kill").args(["-s", signal, &id]).status().unwrap().success());
    }
    // Closes its input.
    let output = guardian.wait_with_output().unwrap();
    assert!(output.status.success(), "{}", said(&output));
    assert_eq!(duties.lock().unwrap().last().unwrap()[..], [[0; 8]]);
}

/// The panel and the bridge connect by a name, which leads nowhere when the network is away.
#[cfg(target_os = "linux")]
#[test]
fn a_guardian_knows_the_address_of_a_name_that_is_forgotten() {
    use std::process::{Command, Stdio};

    let folder = tempfile::tempdir().unwrap();
    let hosts = folder.path().join("hosts");
    std::fs::write(&hosts, "127.0.0.1 mytxt\n").unwrap();
    let inside = "mount --bind \"$0\" /etc/hosts && exec \"$@\"";
    let unshare = |program: &[&str]| {
        let mut command = Command::new("unshare");
        command.args(["--user", "--map-root-user", "--mount", "sh", "-c", inside]);
        command.arg(&hosts).args(program).stdin(Stdio::piped()).stderr(Stdio::piped());
        command
    };
    let known = unshare(&["getent", "hosts", "mytxt"]).output();
    if !known.is_ok_and(|output| output.status.success()) {
        let note = "SKIPPED: no names of its own for a test of txt stop (unshare is needed)\n";
        std::io::Write::write_all(&mut std::io::stderr(), note.as_bytes()).unwrap();
        return;
    }
    let (txt, duties) = logged(SimulatedTxt::builder());
    let mut client = KitClient::online(txt.address());
    client.exchange([512; 8]);
    drop(client);
    assert!(txt.wait_until(|machine| !machine.online(), LIMIT));
    let host = format!("mytxt:{}", txt.address().port());
    let guardian = unshare(&[env!("CARGO_BIN_EXE_txt"), "stop", "--guard", &host]).spawn().unwrap();
    let waits_for_its_input = || {
        let call = std::fs::read_to_string(format!("/proc/{}/syscall", guardian.id())).unwrap();
        let name = std::fs::read_to_string(format!("/proc/{}/comm", guardian.id())).unwrap();
        name == "txt\n" && call.starts_with(&format!("{} 0x0 ", nix::libc::SYS_read))
    };
    crate::running::wait_for("its beginning", waits_for_its_input);
    std::fs::write(&hosts, "").unwrap();
    // Closes its input.
    let output = guardian.wait_with_output().unwrap();
    assert!(output.status.success(), "{}", said(&output));
    assert_eq!(duties.lock().unwrap().last().unwrap()[..], [[0; 8]]);
}
