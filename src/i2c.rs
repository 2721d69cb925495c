//! I2C devices at the controller, over a connection of their own.

use crate::client::{found_host, Endpoint, I2cLine, Network, TimeLimits, TxtClient, PORT, TCP};
use crate::error::Error;
use crate::fuzzing::{nowhere, Pieces};
use crate::wire::{I2cRequestHeader, I2cResponseHeader};

/// The highest address of a device: it has 7 bits.
const ADDRESS_MAX: i64 = 0x7F;

/// The most bytes to write: the firmware closes the connection at more.
const WRITE_MAX: i64 = 1024;

/// The most bytes to read: the firmware sends no more.
const READ_MAX: i64 = 1024;

/// Reads and writes the I2C devices that are plugged into the controller.
///
/// Get one from [`TransferAreaComHandler::i2c`](crate::TransferAreaComHandler::i2c) or [`TxtClient::i2c`]. Each call
/// sends one request, waits for its response, and returns within the [`TimeLimits`]. I2C has a connection of its own
/// (port 65002), so a running transfer goes on meanwhile. All clients of a handler share that connection: a call waits
/// until those before it are answered.
///
/// The maker's firmware 4.7.0 (measured under emulation) accepts one I2C connection in each transfer, within 5 s after
/// its beginning, and closes it after 5 s of silence; then it refuses others until the next transfer begins. So the
/// transfer makes the connection when it begins, and holds it open: a program may come late and pause for as long as
/// it likes. Without a transfer, and while a lost connection is re-established, calls fail with [`Error::NotOnline`];
/// afterwards they work again, perhaps at another controller that answers at this address: of a gap between two calls
/// only the areas tell, by [`Error::ConnectionLost`], and [`Event::ConnectionRestored`](crate::Event::ConnectionRestored).
/// After an error on the wire, for instance a device that does not answer within the limit for reading, the next call
/// makes a new connection, which this firmware refuses.
///
/// **No request is sent twice.** After an error of connecting, nothing was sent. After another error
/// on the wire, it is not known whether the device has carried out the request. Whether a program may
/// repeat it depends on the device.
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
    line: I2cLine,
    request: Vec<u8>,
    response: Vec<u8>,
}

/// The port of I2C on a controller.
const I2C_PORT: u16 = PORT + 2;

impl I2cClient {
    /// Connects to an I2C port without a handler, for a controller that another program has online. Blocks up to
    /// `limits.connect`.
    ///
    /// A TXT refuses while no program is online. The program that is online must leave I2C alone: those of this
    /// library, ftrobopy with I2C and others connect themselves, and the firmware answers the first connection only.
    /// Nothing holds this connection open: before a request, the client makes a new one if the old one was closed
    /// or has been silent for 4 s, and a TXT refuses that one. So use it for the simulated TXT, and for other servers
    /// that accept connections at any time.
    ///
    /// `address` is a host, with an I2C port behind it unless that is 65002: `"192.168.7.2"`, `"[::1]:4002"`. The host
    /// `auto` means the only controller that [`find_controllers`](crate::find_controllers) finds. For slow devices, set
    /// a longer time limit for reading.
    ///
    /// # Errors
    ///
    /// [`Error::OutOfRange`] for a limit; [`Error::NoController`] or [`Error::SeveralControllers`] for `auto`;
    /// [`Error::BadAddress`], [`Error::HostNotFound`], [`Error::LookupTimedOut`], [`Error::ConnectionRefused`],
    /// [`Error::ConnectTimedOut`], [`Error::ConnectFailed`], or [`Error::ThreadNotStarted`] when no thread
    /// could be started to look for a host name.
    pub fn connect(address: impl ToString, limits: TimeLimits) -> Result<Self, Error> {
        limits.check()?;
        Self::connect_in(&TCP, &address.to_string(), I2C_PORT, limits)
    }

    pub(crate) fn connect_in(
        network: &'static dyn Network,
        host: &str,
        port: u16,
        limits: TimeLimits,
    ) -> Result<Self, Error> {
        let mut endpoint = Endpoint::new(network, host, port)?;
        endpoint.host = found_host(network, &endpoint.host, PORT, limits.connect)?;
        Ok(Self::over(I2cLine::without_sessions(endpoint, limits)?))
    }

    /// A client that shares this line.
    pub(crate) fn over(line: I2cLine) -> Self {
        Self { line, request: Vec::new(), response: Vec::new() }
    }

    /// Reads a device's register. With a longer buffer, most devices also send the next registers.
    /// Blocks until the response.
    ///
    /// `device` is the address of 7 bits, 0..=127. `buffer` has 1 to 1024 bytes. It is filled, or
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

    /// Writes a value into a device's register. Most devices write further values into the next
    /// registers. Blocks until the response.
    ///
    /// `device` is the address of 7 bits, 0..=127; there are 1 to 1023 values.
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

    /// Writes bytes to a device, then reads. For devices without registers, or with register numbers
    /// longer than a byte. Blocks until the response.
    ///
    /// `device` is the address of 7 bits, 0..=127. `write` has 0 to 1024 bytes. With none the device reads
    /// on where it is, in most devices from the register after the last one; no other client is known that
    /// asks a controller for this. `read` has 0 to 1024 bytes, and at least 1 when nothing is written. It
    /// is filled, or after an error unchanged.
    ///
    /// # Errors
    ///
    /// [`Error::OutOfRange`], with nothing sent; [`Error::I2cNoDevice`]; any error of connecting or
    /// talking to the controller.
    #[doc(alias = "i2c_write_bytes")]
    #[doc(alias = "KeLibI2cTransfer")]
    #[doc(alias = "i2c_write_buffer")]
    pub fn write_read(&mut self, device: u8, write: &[u8], read: &mut [u8]) -> Result<(), Error> {
        Error::check_range("number of bytes to write", write.len(), 0..=WRITE_MAX)?;
        let least = i64::from(write.is_empty());
        Error::check_range("number of bytes to read", read.len(), least..=READ_MAX)?;
        self.transact(device, write, &[], read)
    }

    /// Sends a request to write the bytes of `write` and then those of `behind`, and fills the buffer
    /// from its response.
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
            // These fit: the callers have checked them.
            data_len: write_len as u32,
            device,
            write_len: write_len as u16,
            read_len: buffer.len() as u16,
        };
        self.request.clear();
        header.emit(&mut self.request);
        self.request.extend_from_slice(write);
        self.request.extend_from_slice(behind);
        let expected = I2cResponseHeader::LEN + buffer.len();
        // A byte more, to detect a longer response.
        self.response.resize(expected + 1, 0);

        let size = |start: &[u8]| response_size(start, expected);
        self.line.transact(&self.request, &mut self.response, size)?;
        if !I2cResponseHeader::parse(&self.response[..I2cResponseHeader::LEN])?.is_ok {
            return Err(Error::I2cNoDevice { device });
        }
        buffer.copy_from_slice(&self.response[I2cResponseHeader::LEN..expected]);
        Ok(())
    }
}

impl TxtClient {
    /// The I2C devices at this controller, while it is in online mode. Does not block.
    ///
    /// The connection is held open by the commands of this client, so send one at least every 3 s.
    pub fn i2c(&self) -> I2cClient {
        I2cClient::over(self.i2c_access().line.clone())
    }
}

/// A client that receives these pieces (an empty one is a signal) and then the end of the connection;
/// and what it has sent so far.
pub fn i2c_client(pieces: Vec<Vec<u8>>) -> (I2cClient, impl Fn() -> Vec<u8>) {
    let server = Pieces::new(pieces);
    let line = I2cLine::over(server.connection(), nowhere(), TimeLimits::default());
    (I2cClient::over(line), move || server.sent())
}

/// The size of a response, as soon as its first bytes show it. `expected` is the size of a successful
/// response.
fn response_size(start: &[u8], expected: usize) -> Result<Option<usize>, Error> {
    let Some(header) = start.get(..I2cResponseHeader::LEN) else { return Ok(None) };
    let header = I2cResponseHeader::parse(header)?;
    Ok(Some(if header.is_ok { expected } else { I2cResponseHeader::LEN }))
}

#[cfg(test)]
mod tests {
    use std::io::{Read, Write};
    use std::net::{Shutdown, TcpListener, TcpStream};
    use std::sync::mpsc;
    use std::thread;
    use std::time::{Duration, Instant};

    use super::*;
    use crate::client::scripted::{
        at_once, storm, Event, Script, Scripted, ScriptedNetwork, LIMITS,
    };
    use crate::client::I2C_NAMES;
    use crate::wire::QueryStatusResponse;

    /// The result of a client whose connection has this script, and how long it took.
    fn write_over(reads: Script, writes: Script) -> (Result<(), Error>, Duration) {
        let transport = Scripted::new(reads, writes);
        let mut client = scripted_client([Ok(transport.clone())]).0;
        let result = client.write(0x18, 1, &[2]);
        assert!(!client.line.is_held(), "it is used again");
        let time = transport.state().time;
        (result, time)
    }

    #[test]
    fn the_limits_hold_in_a_storm_of_signals() {
        let (command, limit) = (I2C_NAMES.request, LIMITS.read);
        let no_answer = Error::NoAnswer { command, limit, received: 0 };
        // After an interruption what has come in is still read, which takes the shortest time that can be waited for.
        let over = Duration::from_millis(1);
        assert_eq!(write_over(storm(), vec![]), (Err(no_answer), limit + over));
        let limit = LIMITS.write;
        let not_taken = Error::NotTaken { command, limit };
        assert_eq!(write_over(vec![], storm()), (Err(not_taken), limit));
    }

    /// A client whose connections are opened like this, and its network.
    fn scripted_client<const N: usize>(
        openings: [Result<Scripted, Error>; N],
    ) -> (I2cClient, &'static ScriptedNetwork) {
        let network = ScriptedNetwork::new(openings);
        (I2cClient::connect_in(network, "txt", 65_002, LIMITS).unwrap(), network)
    }

    /// A connection on which every register holds this.
    fn answering(value: u8) -> Scripted {
        let mut response = Vec::new();
        I2cResponseHeader { read_len: 1, is_ok: true }.emit(&mut response);
        response.push(value);
        Scripted::new(at_once([Event::Bytes(response)]), vec![])
    }

    #[test]
    fn the_only_controller_is_found_also_with_a_port() {
        let mut response = Vec::new();
        let status = QueryStatusResponse {
            device_name: [0; 16],
            version: crate::FirmwareVersion::OLDEST_SUPPORTED,
        };
        status.emit(&mut response);
        let controller = Scripted::new(at_once([Event::Bytes(response)]), vec![]);
        let network = ScriptedNetwork::new([Ok(controller), Ok(answering(4))]);
        let mut client = I2cClient::connect_in(network, "auto:65010", 65_002, LIMITS).unwrap();
        assert_eq!(read(&mut client), 4);
        let asked: Vec<_> = network.asked().into_iter().map(|(address, _)| address).collect();
        // The scripted connection is to 192.168.7.2, wherever it was made to.
        assert_eq!(asked, ["127.0.0.1:65000", "192.168.7.2:65010"]);
    }

    #[test]
    fn a_connection_that_is_not_silent_is_not_used_again() {
        let (first, second) = (answering(1), answering(2));
        first.state().silent = false;
        let (mut client, network) = scripted_client([Ok(first.clone()), Ok(second)]);
        assert_eq!(read(&mut client), 2);
        assert!(first.state().written.is_empty());
        let asked = ("txt:65002".to_owned(), LIMITS);
        assert_eq!(network.asked(), [asked.clone(), asked]);
    }

    #[test]
    fn after_an_error_of_connecting_nothing_was_sent_and_the_next_call_connects() {
        let old = answering(1);
        old.state().silent = false;
        let address = "txt:65002".to_owned();
        let timed_out = Error::ConnectTimedOut { address, limit: LIMITS.connect };
        let openings = [Ok(old.clone()), Err(timed_out.clone()), Ok(answering(3))];
        let (mut client, network) = scripted_client(openings);
        assert_eq!(client.write(0x18, 1, &[2]), Err(timed_out));
        assert!(old.state().written.is_empty());
        assert_eq!(read(&mut client), 3);
        assert_eq!(network.asked().len(), 3);
    }

    /// A client of a controller that answers this number of requests, and the controller's side of each
    /// connection. Every register holds the number of the connection, counted from 0.
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
                    I2cResponseHeader { read_len: 1, is_ok: true }.emit(&mut response);
                    response.push(number);
                    stream.write_all(&response).unwrap();
                    answered += 1;
                    if answered == requests {
                        return;
                    }
                }
            }
        });
        (I2cClient::connect(format!("127.0.0.1:{port}"), TimeLimits::default()).unwrap(), streams)
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
        client.line.age(Duration::from_secs(4));
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
            while client.line.is_silent() {
                assert!(begin.elapsed() < Duration::from_secs(30), "nothing came");
                thread::sleep(Duration::from_millis(1));
            }
            assert_eq!([read(&mut client), read(&mut client)], [1, 1]);
        }
    }
}
