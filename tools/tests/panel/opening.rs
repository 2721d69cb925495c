//! How the page comes to a browser: by a file for the one of this computer, by a code for a phone, and over a slow network.

use std::io::ErrorKind;
use std::net::TcpStream;
use std::time::Duration;

use tungstenite::client::IntoClientRequest;
use tungstenite::{Error, Message};

use super::program::{command, Panel};
use super::LIMIT;
use crate::running::Running;

/// A page opens its connection while the rest of it is still on its way: more would be in the way of that.
#[test]
fn a_page_that_is_not_whole_gets_its_first_state_and_more_when_it_says_something() {
    let panel = Panel::start(&[]);
    panel.page().wait_until_running();
    let address = format!("ws://{}/ws?token={}&early=true", panel.address, panel.token);
    let stream = TcpStream::connect(&panel.address).unwrap();
    stream.set_read_timeout(Some(LIMIT)).unwrap();
    let (mut socket, _) =
        tungstenite::client(address.into_client_request().unwrap(), stream).unwrap();
    for kind in ["\"hello\"", "\"state\""] {
        let said = socket.read().unwrap();
        assert!(said.to_text().unwrap().contains(kind), "{said}");
    }
    // States come each 50 ms.
    socket.get_ref().set_read_timeout(Some(Duration::from_millis(500))).unwrap();
    let next = socket.read();
    assert!(matches!(next, Err(Error::Io(_))), "{next:?}");

    socket.get_ref().set_read_timeout(Some(LIMIT)).unwrap();
    socket.send(Message::text("{\"do\":\"alive\"}")).unwrap();
    for _ in 0..3 {
        let said = socket.read().unwrap();
        assert!(said.to_text().unwrap().contains("\"state\""), "{said}");
    }
}

/// It has one of the places of pages.
#[test]
fn a_page_that_never_becomes_whole_is_closed() {
    let panel = Panel::start(&[]);
    let address = format!("ws://{}/ws?token={}&early=true", panel.address, panel.token);
    let stream = TcpStream::connect(&panel.address).unwrap();
    stream.set_read_timeout(Some(LIMIT)).unwrap();
    let (mut socket, _) =
        tungstenite::client(address.into_client_request().unwrap(), stream).unwrap();
    let end = loop {
        if let Err(end) = socket.read() {
            break end;
        }
    };
    let is_timeout = |error: &std::io::Error| {
        matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut)
    };
    assert!(!matches!(&end, Error::Io(error) if is_timeout(error)), "{end}");
}

/// A browser that writes down with what it was started.
#[cfg(unix)]
#[test]
fn the_token_is_in_a_file_that_only_the_user_can_read() {
    use std::os::unix::fs::PermissionsExt;
    use std::path::Path;
    use std::time::Instant;
    use std::{fs, thread};

    let folder = tempfile::tempdir().unwrap();
    let browser = folder.path().join("browser");
    let reported = folder.path().join("reported");
    let script =
        format!("#!/bin/sh\necho \"$@\" > '{0}.part'\nmv '{0}.part' '{0}'\n", reported.display());
    fs::write(&browser, script).unwrap();
    fs::set_permissions(&browser, fs::Permissions::from_mode(0o700)).unwrap();

    let mut command = command(&[]);
    command.env("BROWSER", &browser).env("TMPDIR", folder.path()).env("HOME", folder.path());
    let panel = Running::start(&mut command);
    let url = panel.line();
    let deadline = Instant::now() + LIMIT;
    while !reported.exists() {
        assert!(Instant::now() < deadline, "no browser was started");
        thread::sleep(Duration::from_millis(20));
    }
    let reported = fs::read_to_string(reported).unwrap();
    assert!(!reported.contains("token"), "{reported}");
    let file = Path::new(reported.trim().strip_prefix("file://").expect("it opens a file"));
    assert!(fs::read_to_string(file).unwrap().contains(&format!("0; url={url}\"")));
    for (path, mode) in [(file, 0o600), (file.parent().unwrap(), 0o700)] {
        let permissions = fs::metadata(path).unwrap().permissions();
        assert_eq!(permissions.mode() & 0o777, mode, "{}", path.display());
    }

    panel.signal("INT");
    assert!(panel.end().status.success());
    assert!(!file.exists() && !file.parent().unwrap().exists(), "the file is still there");
}

#[test]
fn a_phone_can_read_the_address_from_the_screen() {
    let running = Running::start(command(&["--bind", "0.0.0.0"]).arg("--no-browser"));
    let _own = running.line();
    let next = running.line();
    // A computer without a network has no address for others.
    if !next.starts_with("from other computers: http://") {
        assert!(next.contains("can drive the machine"), "{next}");
        return;
    }
    let mut lines = vec![running.line()];
    while !lines[lines.len() - 1].contains("can drive the machine") {
        lines.push(running.line());
    }
    let width = lines[0].chars().count();
    let code = &lines[..lines.len() - 1];
    assert!(width > 21 && code.len() > 10, "{lines:#?}");
    assert!(code.iter().all(|line| line.chars().count() == width), "{code:#?}");
    // It goes to a file here, which has no colours.
    assert!(code.iter().all(|line| line.chars().all(|one| " ▀▄█".contains(one))), "{code:#?}");
}

#[test]
fn this_computer_alone_needs_no_code() {
    let panel = Panel::start(&[]);
    assert!(panel.running.line().starts_with("Ctrl-C"));
}
