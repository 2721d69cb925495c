//! I2C devices behind the controller, over a connection of their own.

use std::time::{Duration, Instant};

use log::debug;

use crate::client::{Connection, PacketNames, TimeLimits};
use crate::error::Error;
use crate::wire::{I2cRequestHeader, I2cResponseHeader, I2C_NO_DEVICE};

/// The greatest address of a device, which has 7 bits.
const ADDRESS_MAX: i64 = 0x7F;

/// The most bytes to write: their number has to fit into the request's command, too.
const WRITE_MAX: i64 = u8::MAX as i64;

/// The most bytes to read.
const READ_MAX: i64 = u16::MAX as i64;

/// How old a connection's last request may be when the next goes out. The controller closes a
/// connection that was silent for 5 s, and it should not do so with a request on its way.
const SILENCE_LIMIT: Duration = Duration::from_secs(4);

/// What errors call a request and its response.
const NAMES: PacketNames =
    PacketNames { request: "an I2C request", response: I2cResponseHeader::NAME };

/// Reads and writes the I2C devices that are plugged into the controller.
///
/// Made by [`TransferAreaComHandler::i2c`](crate::TransferAreaComHandler::i2c), or by
/// [`connect`](Self::connect) where there is no handler. Each call sends one request, waits for its
/// response, and returns within the [`TimeLimits`]. It has a connection of its own (port 65002), so
/// a running transfer goes on meanwhile.
///
/// The controller closes a connection that is silent for 5 s, and nothing could be sent that leaves
/// every device as it is. So before each request the client looks whether the connection was closed
/// or is silent for 4 s, and makes a new one if so. A program notices nothing of that, however long
/// it pauses. It does the same after an error on the wire.
///
/// **No request is sent twice.** After an error of connecting nothing was sent. After another error
/// on the wire it is not known whether the device has carried the request out; whether it may be
/// repeated depends on the device.
///
/// Only ftrobopy's use of this port is known. It connects while it is online and reads and writes
/// registers with numbers of one byte, so whether a controller answers before `begin_transfer` is
/// not known. The simulated TXT does.
///
/// ```no_run
/// use ft_transfer_area::TransferAreaComHandler;
///
/// # fn main() -> Result<(), ft_transfer_area::Error> {
/// let handler = TransferAreaComHandler::builder("192.168.7.2").build()?;
/// handler.begin_transfer()?;
/// let mut i2c = handler.i2c()?;
/// i2c.write(0x18, 0x0F, &[0x0C])?; // register 0x0F of the device 0x18
/// let mut values = [0; 6];
/// i2c.read(0x18, 0x02, &mut values)?; // registers 0x02 to 0x07
/// # Ok(())
/// # }
/// ```
#[derive(Debug)]
pub struct I2cClient {
    host: String,
    port: u16,
    limits: TimeLimits,
    /// `None` after an error on the wire.
    connection: Option<Connection>,
    /// When the connection had its last request, or was made.
    last_request: Instant,
    request: Vec<u8>,
    response: Vec<u8>,
}

impl I2cClient {
    /// Connects to the controller. Blocks up to `limits.connect`.
    ///
    /// `host` is a name or a numeric address; `port` is 65002 for a real controller. For devices
    /// that take long, allow a longer time for reading.
    ///
    /// # Errors
    ///
    /// [`Error::HostNotFound`], [`Error::LookupTimedOut`], [`Error::ConnectionRefused`],
    /// [`Error::ConnectTimedOut`], [`Error::ConnectFailed`], or [`Error::Thread`] when no thread
    /// could be started to look for a host name.
    #[doc(alias = "InitI2C")]
    #[doc(alias = "StartI2C")]
    pub fn connect(host: &str, port: u16, limits: TimeLimits) -> Result<Self, Error> {
        Ok(Self {
            host: host.to_owned(),
            port,
            limits,
            last_request: Instant::now(),
            connection: Some(Connection::connect(host, port, limits)?),
            request: Vec::new(),
            response: Vec::new(),
        })
    }

    /// Reads a device's register, and with a longer buffer those behind it, as most devices do.
    /// Blocks until the response.
    ///
    /// `device` is the address of 7 bits, 0..=127; `buffer` has 1 to 65535 bytes and is filled, or
    /// after an error unchanged.
    ///
    /// # Errors
    ///
    /// [`Error::OutOfRange`], with nothing sent; [`Error::I2cNoDevice`]; any error of connecting or
    /// talking to the controller.
    #[doc(alias = "i2c_read")]
    #[doc(alias = "ftxI2cRead")]
    #[doc(alias = "I2cRead")]
    pub fn read(&mut self, device: u8, register: u8, buffer: &mut [u8]) -> Result<(), Error> {
        Error::check_range("number of bytes to read", buffer.len(), 1..=READ_MAX)?;
        self.transact(device, &[register], &[], buffer)
    }

    /// Writes values into a device's register, and with more than one into those behind it, as most
    /// devices do. Blocks until the response.
    ///
    /// `device` is the address of 7 bits, 0..=127; there are 1 to 254 values.
    ///
    /// # Errors
    ///
    /// [`Error::OutOfRange`], with nothing sent; [`Error::I2cNoDevice`]; any error of connecting or
    /// talking to the controller.
    #[doc(alias = "i2c_write")]
    #[doc(alias = "ftxI2cWrite")]
    #[doc(alias = "I2cWrite")]
    pub fn write(&mut self, device: u8, register: u8, values: &[u8]) -> Result<(), Error> {
        Error::check_range("number of bytes to write", values.len(), 1..=WRITE_MAX - 1)?;
        self.transact(device, &[register], values, &mut [])
    }

    /// Writes bytes to a device, then reads. For devices without registers, or with numbers of
    /// registers that are longer than a byte. Blocks until the response.
    ///
    /// `device` is the address of 7 bits, 0..=127. There are 1 to 255 bytes to write, because no
    /// client is known that reads without writing first, and 0 to 65535 to read; `read` is filled,
    /// or after an error unchanged.
    ///
    /// # Errors
    ///
    /// [`Error::OutOfRange`], with nothing sent; [`Error::I2cNoDevice`]; any error of connecting or
    /// talking to the controller.
    #[doc(alias = "i2c_write_bytes")]
    #[doc(alias = "KeLibI2cTransfer")]
    #[doc(alias = "i2c_write_buffer")]
    pub fn write_read(&mut self, device: u8, write: &[u8], read: &mut [u8]) -> Result<(), Error> {
        Error::check_range("number of bytes to write", write.len(), 1..=WRITE_MAX)?;
        Error::check_range("number of bytes to read", read.len(), 0..=READ_MAX)?;
        self.transact(device, write, &[], read)
    }

    /// Sends a request to write these bytes and those behind them, and fills the buffer from its
    /// response.
    fn transact(
        &mut self,
        device: u8,
        write: &[u8],
        behind: &[u8],
        buffer: &mut [u8],
    ) -> Result<(), Error> {
        Error::check_range("I2C device's address", device, 0..=ADDRESS_MAX)?;
        let write_len = write.len() + behind.len();
        let header = I2cRequestHeader {
            // These fit, as the callers have checked.
            command: write_len as u8,
            device: device.into(),
            write_len: write_len as u32,
            read_len: buffer.len() as u16,
        };
        self.request.clear();
        header.emit(&mut self.request);
        self.request.extend_from_slice(write);
        self.request.extend_from_slice(behind);
        let expected = I2cResponseHeader::LEN + buffer.len();
        // A byte more, by which a longer response shows.
        self.response.resize(expected + 1, 0);

        let mut connection = self.take_connection()?;
        self.last_request = Instant::now();
        let size = |start: &[u8]| response_size(start, expected);
        // After an error bytes of the response may still come, so the connection is not kept.
        connection.transact(NAMES, &self.request, &mut self.response, size)?;
        self.connection = Some(connection);
        if self.response.starts_with(&I2C_NO_DEVICE) {
            return Err(Error::I2cNoDevice { device });
        }
        buffer.copy_from_slice(&self.response[I2cResponseHeader::LEN..expected]);
        Ok(())
    }

    /// The connection if it is still good, or else a new one.
    fn take_connection(&mut self) -> Result<Connection, Error> {
        let is_young = self.last_request.elapsed() < SILENCE_LIMIT;
        let connection = self.connection.take();
        if let Some(connection) = connection.filter(|old| is_young && old.is_silent()) {
            return Ok(connection);
        }
        let Self { host, port, limits, .. } = self;
        debug!("a new I2C connection to {host}:{port} is made");
        Connection::connect(host, *port, *limits)
    }
}

/// A client to which these pieces come, with a signal in place of an empty one, and then the end of
/// the connection; and what it has sent so far.
#[cfg(feature = "__fuzzing")]
pub fn i2c_client(pieces: Vec<Vec<u8>>) -> (I2cClient, impl Fn() -> Vec<u8>) {
    let server = crate::client::scripted::Scripted::sending(pieces);
    let client = I2cClient {
        host: "127.0.0.1".to_owned(),
        port: 0,
        limits: TimeLimits::default(),
        last_request: Instant::now(),
        connection: Some(server.connection()),
        request: Vec::new(),
        response: Vec::new(),
    };
    (client, move || server.state().written.clone())
}

/// The size of a response of which the first bytes have come in, once they tell it. `expected` is
/// that of a success.
fn response_size(start: &[u8], expected: usize) -> Result<Option<usize>, Error> {
    let Some(header) = start.get(..I2cResponseHeader::LEN) else { return Ok(None) };
    if header == I2C_NO_DEVICE {
        return Ok(Some(header.len()));
    }
    I2cResponseHeader::parse(header)?;
    Ok(Some(expected))
}

#[cfg(test)]
mod tests {
    use std::io::{Read, Write};
    use std::net::{Shutdown, TcpListener, TcpStream};
    use std::sync::mpsc;
    use std::thread;

    use super::*;
    use crate::client::scripted::{storm, Script, Scripted, LIMITS};

    /// What a client says whose connection has this script, and how long it took.
    fn write_over(reads: Script, writes: Script) -> (Result<(), Error>, Duration) {
        let (mut client, _streams) = client_of(1);
        let transport = Scripted::new(reads, writes);
        client.connection = Some(transport.connection());
        let result = client.write(0x18, 1, &[2]);
        assert!(client.connection.is_none(), "it is used again");
        let time = transport.state().time;
        (result, time)
    }

    #[test]
    fn the_limits_hold_in_a_storm_of_signals() {
        let (command, limit) = (NAMES.request, LIMITS.read);
        let no_answer = Error::NoAnswer { command, limit, received: 0 };
        assert_eq!(write_over(storm(), vec![]), (Err(no_answer), limit));
        let limit = LIMITS.write;
        let not_taken = Error::NotTaken { command, limit };
        assert_eq!(write_over(vec![], storm()), (Err(not_taken), limit));
    }

    #[test]
    fn a_connection_that_is_not_silent_is_not_used_again() {
        let (mut client, _streams) = client_of(1);
        let transport = Scripted::new(vec![], vec![]);
        transport.state().silent = false;
        client.connection = Some(transport.connection());
        assert_eq!(read(&mut client), 1);
        assert!(transport.state().written.is_empty());
    }

    /// A client of a controller that answers to so many requests, and the controller's side of each
    /// connection. Every register of a connection holds its number, counted from 0.
    fn client_of(requests: u32) -> (I2cClient, mpsc::Receiver<TcpStream>) {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let port = listener.local_addr().unwrap().port();
        let (sender, streams) = mpsc::channel();
        thread::spawn(move || {
            let mut request = [0; I2cRequestHeader::LEN + 1];
            let mut answered = 0;
            for number in 0.. {
                let mut stream = listener.accept().unwrap().0;
                sender.send(stream.try_clone().unwrap()).unwrap();
                while stream.read_exact(&mut request).is_ok() {
                    let mut response = Vec::new();
                    I2cResponseHeader::default().emit(&mut response);
                    response.push(number);
                    stream.write_all(&response).unwrap();
                    answered += 1;
                    if answered == requests {
                        return;
                    }
                }
            }
        });
        (I2cClient::connect("127.0.0.1", port, TimeLimits::default()).unwrap(), streams)
    }

    fn read(client: &mut I2cClient) -> u8 {
        let mut value = [0xFF];
        client.read(0x18, 0, &mut value).unwrap();
        value[0]
    }

    #[test]
    fn a_connection_is_used_again_unless_it_was_silent_for_4_seconds() {
        let (mut client, _streams) = client_of(4);
        assert_eq!([read(&mut client), read(&mut client)], [0, 0]);
        let long_ago = client.last_request.checked_sub(Duration::from_secs(4));
        client.last_request = long_ago.unwrap();
        assert_eq!([read(&mut client), read(&mut client)], [1, 1]);
    }

    #[test]
    fn a_connection_that_was_closed_or_has_stray_bytes_is_not_used_again() {
        let close = |stream: &TcpStream| stream.shutdown(Shutdown::Both).unwrap();
        let stray = |mut stream: &TcpStream| stream.write_all(&[1]).unwrap();
        for disturb in [close, stray] {
            let (mut client, streams) = client_of(3);
            assert_eq!(read(&mut client), 0);
            disturb(&streams.recv().unwrap());
            let begin = Instant::now();
            while client.connection.as_ref().unwrap().is_silent() {
                assert!(begin.elapsed() < Duration::from_secs(30), "nothing came");
                thread::sleep(Duration::from_millis(1));
            }
            assert_eq!([read(&mut client), read(&mut client)], [1, 1]);
        }
    }
}
