//! The three ports: those that were asked for, or free ones.

use std::io::{self, ErrorKind};
use std::iter;
use std::net::{IpAddr, TcpListener};
use std::ops::Range;

use crate::error::Error;

/// How often three free ports in a row are tried from a port that the system chooses.
const ATTEMPTS: usize = 20;

/// The ports that are tried then, three by three. Systems rarely give these to clients, whose ports
/// stay taken for a minute after they close. So they are free even with thousands of clients.
const ELSEWHERE: Range<u16> = 10_000..20_000;

/// The ports that were asked for.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ports {
    /// The address of this computer.
    pub(crate) ip: IpAddr,
    /// 0 for any free port.
    pub(crate) main: u16,
    /// 0 for any free port, `None` for the main port plus 1.
    pub(crate) camera: Option<u16>,
    /// 0 for any free port, `None` for the main port plus 2.
    pub(crate) i2c: Option<u16>,
}

impl Ports {
    /// An error when there is no room for the others after the main port.
    pub(crate) fn check(self) -> Result<(), Error> {
        let behind = match (self.camera, self.i2c) {
            (_, None) => 2,
            (None, Some(_)) => 1,
            (Some(_), Some(_)) => 0,
        };
        Error::check_range("main port", self.main, 0..=i64::from(u16::MAX - behind))
    }

    /// Listens on all three, the main one first.
    pub(crate) fn listen(self) -> io::Result<[TcpListener; 3]> {
        if self.main != 0 {
            return self.try_to_listen();
        }
        // When the system chooses the main port, another program may have one of the next two.
        self.listen_behind(iter::repeat_n(0, ATTEMPTS).chain(ELSEWHERE.step_by(3)))
    }

    /// Listens on all three, with the first of these main ports for which that is possible.
    fn listen_behind(self, main: impl IntoIterator<Item = u16>) -> io::Result<[TcpListener; 3]> {
        let mut result = Err(io::ErrorKind::AddrInUse.into());
        for main in main {
            result = Self { main, ..self }.try_to_listen();
            if !result.as_ref().is_err_and(is_of_port) {
                break;
            }
        }
        result
    }

    fn try_to_listen(self) -> io::Result<[TcpListener; 3]> {
        let main = listen_on(self.ip, self.main)?;
        let port = main.local_addr()?.port();
        let camera = listen_on(self.ip, behind(port, 1, self.camera)?)?;
        let i2c = listen_on(self.ip, behind(port, 2, self.i2c)?)?;
        Ok([main, camera, i2c])
    }
}

/// The port that was asked for, or the main port plus this distance.
fn behind(main: u16, distance: u16, asked_for: Option<u16>) -> io::Result<u16> {
    asked_for
        .or(main.checked_add(distance))
        .ok_or_else(|| io::Error::other(format!("too few ports follow port {main}")))
}

/// Whether it may be otherwise with another port.
fn is_of_port(error: &io::Error) -> bool {
    use ErrorKind::*;
    matches!(error.kind(), AddrInUse | AddrNotAvailable | PermissionDenied)
}

fn listen_on(ip: IpAddr, port: u16) -> io::Result<TcpListener> {
    let in_context = |error: io::Error| match is_of_port(&error) {
        true => io::Error::new(error.kind(), format!("port {port}: {error}")),
        false => error,
    };
    let listener = TcpListener::bind((ip, port)).map_err(in_context)?;
    listener.set_nonblocking(true)?;
    Ok(listener)
}

#[cfg(test)]
mod tests {
    use std::net::Ipv4Addr;

    use super::*;

    const HERE: IpAddr = IpAddr::V4(Ipv4Addr::LOCALHOST);

    fn ports(listeners: &[TcpListener; 3]) -> [u16; 3] {
        listeners.each_ref().map(|listener| listener.local_addr().unwrap().port())
    }

    #[test]
    fn the_ports_are_in_a_row_unless_asked_for() {
        let free = Ports { ip: HERE, main: 0, camera: None, i2c: None };
        let listeners = free.listen().unwrap();
        let [main, camera, i2c] = ports(&listeners);
        assert_eq!([camera, i2c], [main + 1, main + 2]);
        drop(listeners);
        let any = Ports { camera: Some(0), i2c: Some(0), ..free }.listen().unwrap();
        assert!(ports(&any).iter().all(|port| *port != 0));
        assert_eq!(behind(7, 1, Some(99)).unwrap(), 99);
    }

    #[test]
    fn ports_are_looked_for_until_three_in_a_row_are_free() {
        let any = Ports { ip: HERE, main: 0, camera: None, i2c: None };
        let taken = any.listen().unwrap();
        let [main, camera, _] = ports(&taken);
        // The port after the first one is taken.
        let candidates = [main - 1, main, camera];
        let error = any.listen_behind(candidates).unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::AddrInUse);
        let found = any.listen_behind(candidates.into_iter().chain(ELSEWHERE)).unwrap();
        let [main, camera, i2c] = ports(&found);
        assert!(ELSEWHERE.contains(&main) && [camera, i2c] == [main + 1, main + 2]);
    }

    #[test]
    fn the_last_ports_have_none_after_them() {
        assert_eq!(behind(65_533, 2, None).unwrap(), 65_535);
        behind(65_534, 2, None).unwrap_err();
        for (camera, i2c, last) in
            [(None, None, 65_533), (Some(0), None, 65_533), (None, Some(0), 65_534)]
        {
            Ports { ip: HERE, main: last, camera, i2c }.check().unwrap();
            let error = Ports { ip: HERE, main: last + 1, camera, i2c }.check().unwrap_err();
            let sentence = format!("the main port is {}, but has to be 0 to {last}", last + 1);
            assert_eq!(error.to_string(), sentence);
        }
        Ports { ip: HERE, main: 65_535, camera: Some(0), i2c: Some(0) }.check().unwrap();
    }
}
