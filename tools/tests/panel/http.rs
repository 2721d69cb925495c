//! Requests, byte by byte.

use std::io::{Read, Write};
use std::net::TcpStream;

use super::program::Panel;
use super::LIMIT;

pub(crate) fn connect(panel: &Panel) -> TcpStream {
    let stream = TcpStream::connect(&panel.address).unwrap();
    stream.set_read_timeout(Some(LIMIT)).unwrap();
    stream.set_write_timeout(Some(LIMIT)).unwrap();
    stream
}

/// Sends bytes, and returns all that comes back until the panel closes the connection.
pub(crate) fn exchange(panel: &Panel, bytes: &[u8]) -> String {
    let mut stream = connect(panel);
    // The panel may close the connection before it has read everything.
    let _ = stream.write_all(bytes);
    let mut response = Vec::new();
    let _ = stream.read_to_end(&mut response);
    String::from_utf8_lossy(&response).into_owned()
}

/// Sends a request without a body, with these further lines in its head.
pub(crate) fn request(panel: &Panel, line: &str, host: &str, more: &str) -> String {
    let head = format!("{line} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n{more}\r\n");
    exchange(panel, head.as_bytes())
}

/// The status of a response.
pub(crate) fn status(response: &str) -> u16 {
    let status = response.split(' ').nth(1).and_then(|status| status.parse().ok());
    status.unwrap_or_else(|| panic!("{response:?} is not a response"))
}

/// A stop on a connection of its own.
pub(crate) fn post_stop(panel: &Panel, token: &str, more: &str) -> u16 {
    let line = format!("POST /stop?token={token}");
    status(&request(panel, &line, &panel.address, &format!("Content-Length: 0\r\n{more}")))
}
