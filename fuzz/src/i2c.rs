//! Both sides of the I2C port.

use std::io::{Read, Write};
use std::net::{Ipv4Addr, Shutdown, TcpListener, TcpStream};
use std::sync::mpsc::{channel, Sender};
use std::thread;
use std::time::Duration;

use arbitrary::{Result, Unstructured};
use ft_transfer_area::fuzzing::i2c_response;
use ft_transfer_area::simulator::{Machine, I2C_REGISTERS};
use ft_transfer_area::wire::{I2cRequestHeader, I2cResponseHeader, I2C_NO_DEVICE};
use ft_transfer_area::{Error, I2cClient, TimeLimits};

use super::take;

/// What a controller answers to a request.
struct Answer {
    pieces: Vec<Vec<u8>>,
    /// Whether the connection is closed behind it.
    close: bool,
}

/// What the client is to do, and what it meets.
struct Transfer<'a> {
    device: u8,
    write: &'a [u8],
    read: usize,
    response: Vec<u8>,
}

/// Asks a controller that answers with arbitrary bytes, in pieces.
pub fn i2c_client(data: &[u8]) {
    // The input ends when there are no more bytes.
    let _ = ask(&mut Unstructured::new(data));
}

fn ask(input: &mut Unstructured) -> Result<()> {
    let (mut transfers, mut answers) = (Vec::new(), Vec::new());
    while !input.is_empty() && transfers.len() < 20 {
        let device = input.int_in_range(0..=127)?;
        let write = match take(input, 255)? {
            [] => &[0],
            bytes => bytes,
        };
        let read = input.int_in_range(0..=300)?;
        let mut pieces = match input.int_in_range(0..=3)? {
            0 => vec![I2cResponseHeader::ID.to_be_bytes().to_vec()],
            1 => vec![I2C_NO_DEVICE.to_vec()],
            _ => vec![],
        };
        while !input.is_empty() && input.ratio(3, 4)? {
            pieces.push(take(input, 320)?.to_vec());
        }
        let response = pieces.concat();
        let transfer = Transfer { device, write, read, response };
        // Whoever has not got all bytes would wait for them.
        let close = transfer.is_too_short() || input.arbitrary()?;
        answers.push(Answer { pieces, close });
        transfers.push(transfer);
    }

    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).expect("a port is free");
    let port = listener.local_addr().expect("it listens").port();
    let (sender, answered) = channel();
    let server = thread::spawn(move || serve(&listener, answers, &sender));
    // Nothing is waited for but a busy machine.
    let limit = Duration::from_secs(60);
    let limits = TimeLimits { connect: limit, read: limit, write: limit };
    let mut client = I2cClient::connect("127.0.0.1", port, limits).expect("it listens");
    for transfer in transfers {
        transfer.check(&mut client);
        answered.recv().expect("it has answered");
    }
    drop(client);
    server.join().expect("it does not panic");
    Ok(())
}

/// Gives one answer after another, on as many connections as are made.
fn serve(listener: &TcpListener, answers: Vec<Answer>, answered: &Sender<()>) {
    let mut answers = answers.into_iter().peekable();
    while answers.peek().is_some() {
        let (mut stream, _) = listener.accept().expect("a client comes");
        stream.set_nodelay(true).expect("a connection");
        while answers.peek().is_some() && read_request(&mut stream).is_some() {
            let Some(answer) = answers.next() else { return };
            for piece in answer.pieces {
                // The client closes the connection when it reads what is no response.
                let _ = stream.write_all(&piece);
            }
            if answer.close {
                let _ = stream.shutdown(Shutdown::Write);
            }
            let _ = answered.send(());
            if answer.close {
                break;
            }
        }
    }
}

fn read_request(stream: &mut TcpStream) -> Option<()> {
    let mut header = [0; I2cRequestHeader::LEN];
    stream.read_exact(&mut header).ok()?;
    let header = I2cRequestHeader::parse(&header).expect("a request");
    assert_eq!(u32::from(header.command), header.write_len);
    stream.read_exact(&mut vec![0; header.write_len as usize]).ok()
}

impl Transfer<'_> {
    /// The bytes of a response that says yes.
    fn size(&self) -> usize {
        I2cResponseHeader::LEN + self.read
    }

    fn is_no_device(&self) -> bool {
        self.response.starts_with(&I2C_NO_DEVICE)
    }

    /// Whether it begins as a response that says yes.
    fn has_id(&self) -> bool {
        self.response.starts_with(&I2cResponseHeader::ID.to_be_bytes())
    }

    fn is_too_short(&self) -> bool {
        self.response.len() < I2cResponseHeader::LEN
            || self.has_id() && self.response.len() < self.size()
    }

    fn check(&self, client: &mut I2cClient) {
        let untouched = vec![0xA5; self.read];
        let mut buffer = untouched.clone();
        let result = client.write_read(self.device, self.write, &mut buffer);
        let received = self.response.len();
        if result.is_err() {
            assert_eq!(buffer, untouched, "after {result:?}");
        }
        match result {
            Ok(()) => {
                assert!(self.has_id() && received >= self.size());
                assert_eq!(buffer, self.response[I2cResponseHeader::LEN..self.size()]);
            }
            Err(Error::I2cNoDevice { device }) => {
                assert!(self.is_no_device() && device == self.device);
            }
            Err(Error::WrongId { .. }) => assert!(!self.is_no_device() && !self.has_id()),
            Err(Error::WrongSize { expected, found, .. }) => {
                let size = if self.has_id() { self.size() } else { I2cResponseHeader::LEN };
                assert!(expected == size && size < found && found <= received);
            }
            Err(Error::ConnectionClosed { received: found, .. }) => {
                assert!(self.is_too_short() && found == received);
            }
            Err(error) => panic!("{error}"),
        }
    }
}

/// The registers of a device, kept beside the simulated one's.
struct Model {
    registers: [u8; I2C_REGISTERS],
    next: u8,
}

/// Sends requests to the simulated port: right ones and arbitrary ones.
pub fn i2c_server(data: &[u8]) {
    // The input ends when there are no more bytes.
    let _ = answer(&mut Unstructured::new(data));
}

fn answer(input: &mut Unstructured) -> Result<()> {
    let mut machine = Machine::new(0);
    let mut models: Vec<Option<Model>> = (0..=255).map(|_| None).collect();
    while !input.is_empty() {
        match input.int_in_range(0..=4)? {
            0 => {
                let (device, register) = (input.int_in_range(0..=127)?, input.arbitrary::<u8>()?);
                let value = input.arbitrary()?;
                machine.i2c_device(device)[usize::from(register)] = value;
                let model = models[usize::from(device)].get_or_insert_with(Model::new);
                model.registers[usize::from(register)] = value;
            }
            1 => {
                let device: u8 = input.int_in_range(0..=127)?;
                let was_there = models[usize::from(device)].take().is_some();
                assert_eq!(machine.remove_i2c_device(device), was_there);
            }
            2 => check_request(take(input, 600)?, &mut machine, &mut models),
            _ => {
                let write = take(input, 300)?;
                let mut request = Vec::new();
                I2cRequestHeader {
                    command: input.arbitrary()?,
                    device: input.int_in_range(0..=200)?,
                    write_len: input.int_in_range(0..=300)?,
                    read_len: input.int_in_range(0..=600)?,
                }
                .emit(&mut request);
                request.extend_from_slice(write);
                check_request(&request, &mut machine, &mut models);
            }
        }
    }
    Ok(())
}

fn check_request(request: &[u8], machine: &mut Machine, models: &mut [Option<Model>]) {
    let before = machine.clone();
    let response = match i2c_response(request, machine) {
        Ok(response) => response,
        Err(reason) => {
            assert!(!reason.is_empty());
            assert_eq!(format!("{machine:?}"), format!("{before:?}"), "after {reason}");
            return;
        }
    };
    let header = I2cRequestHeader::parse(&request[..I2cRequestHeader::LEN]).expect("a request");
    let mut write = request[I2cRequestHeader::LEN..].to_vec();
    write.resize(header.write_len as usize, 0);
    let model = models.get_mut(header.device as usize).and_then(Option::as_mut);
    let Some(model) = model else {
        assert_eq!(response, I2C_NO_DEVICE);
        return;
    };
    if let Some((register, values)) = write.split_first() {
        model.next = *register;
        for value in values {
            let register = model.advance();
            model.registers[register] = *value;
        }
    }
    let (header_bytes, read) = response.split_at(I2cResponseHeader::LEN);
    assert_eq!(I2cResponseHeader::parse(header_bytes), Ok(I2cResponseHeader::default()));
    assert_eq!(read.len(), usize::from(header.read_len));
    for value in read {
        let register = model.advance();
        assert_eq!(*value, model.registers[register]);
    }
}

impl Model {
    fn new() -> Self {
        Self { registers: [0; I2C_REGISTERS], next: 0 }
    }

    fn advance(&mut self) -> usize {
        let register = self.next;
        self.next = register.wrapping_add(1);
        usize::from(register)
    }
}
