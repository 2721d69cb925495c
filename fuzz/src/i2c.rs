//! Both sides of the I2C port.

use std::collections::VecDeque;

use arbitrary::{Result, Unstructured};
use ft_transfer_area::fuzzing;
use ft_transfer_area::wire::{I2cRequestHeader, I2cResponseHeader};
use ft_transfer_area::Error;
use ft_transfer_area_simulator::{Machine, I2C_REGISTERS};

use super::take;

/// The response of a missing device.
const NO_DEVICE: [u8; I2cResponseHeader::LEN] = [0x87, 0xFD, 0x0D, 0x90, 0, 0, 0, 0, 0, 0, 0, 0];

/// What a client reads from a response.
#[derive(Debug, PartialEq)]
enum Outcome {
    Read(Vec<u8>),
    NoDevice,
    WrongId,
    Surplus { expected: usize, found: usize },
    Closed { received: usize },
}

/// Sends requests to a controller that answers with arbitrary bytes, in pieces and with signals
/// between them. A simpler reader of the same pieces must read the same.
pub fn i2c_client(data: &[u8]) {
    // The input ends when there are no more bytes.
    let _ = ask(&mut Unstructured::new(data));
}

fn ask(input: &mut Unstructured) -> Result<()> {
    let mut pieces = VecDeque::new();
    for _ in 0..input.int_in_range(0..=30)? {
        pieces.push_back(match input.int_in_range(0..=3)? {
            0 => I2cResponseHeader::ID.to_le_bytes().to_vec(),
            1 => NO_DEVICE.to_vec(),
            _ => take(input, 320)?.to_vec(),
        });
    }
    let (mut client, sent) = fuzzing::i2c_client(pieces.iter().cloned().collect());
    let mut before = 0;
    while !input.is_empty() {
        let device = input.int_in_range(0..=127)?;
        let write = take(input, 255)?;
        let least = usize::from(write.is_empty());
        let untouched = vec![0xA5; input.int_in_range(least..=300)?];
        let mut buffer = untouched.clone();
        let result = client.write_read(device, write, &mut buffer);

        let sent = sent();
        let (header, written) = sent[before..].split_at(I2cRequestHeader::LEN);
        let header = I2cRequestHeader::parse(header).expect("a request");
        assert_eq!((header.device, written), (device, write));
        assert_eq!(
            (header.data_len as usize, header.write_len as usize, header.read_len as usize),
            (write.len(), write.len(), buffer.len())
        );
        before = sent.len();

        let outcome = match result {
            Ok(()) => Outcome::Read(buffer.clone()),
            Err(Error::I2cNoDevice { device: named }) if named == device => Outcome::NoDevice,
            Err(Error::WrongId { .. }) => Outcome::WrongId,
            Err(Error::WrongSize { expected, found, .. }) => Outcome::Surplus { expected, found },
            Err(Error::ConnectionClosed { received, .. }) => Outcome::Closed { received },
            Err(error) => panic!("{error}"),
        };
        assert_eq!(outcome, respond(&mut pieces, buffer.len()));
        match outcome {
            Outcome::Read(_) => {}
            Outcome::NoDevice => assert_eq!(buffer, untouched),
            _ => {
                assert_eq!(buffer, untouched);
                // The connection is closed, and the client would make another one.
                return Ok(());
            }
        }
    }
    Ok(())
}

/// The outcome of the next pieces as the response to a request that reads `read` bytes.
fn respond(pieces: &mut VecDeque<Vec<u8>>, read: usize) -> Outcome {
    let mut response = Vec::new();
    let mut size = None;
    loop {
        if let (None, Some(header)) = (size, response.get(..I2cResponseHeader::LEN)) {
            size = match header {
                [0x87, 0xFD, 0x0D, 0x90, _, _, _, _, 0, 0, ..] => Some(I2cResponseHeader::LEN),
                [0x87, 0xFD, 0x0D, 0x90, ..] => Some(I2cResponseHeader::LEN + read),
                _ => return Outcome::WrongId,
            };
        }
        match size {
            Some(expected) if response.len() > expected => {
                return Outcome::Surplus { expected, found: response.len() }
            }
            Some(expected) if response.len() == expected => {
                return match response[8..10] == [0, 0] {
                    true => Outcome::NoDevice,
                    false => Outcome::Read(response[I2cResponseHeader::LEN..].to_vec()),
                }
            }
            _ => {}
        }
        let Some(mut piece) = pieces.pop_front() else {
            return Outcome::Closed { received: response.len() };
        };
        // The client has room for one byte more than expected.
        let room = I2cResponseHeader::LEN + read + 1 - response.len();
        if piece.len() > room {
            pieces.push_front(piece.split_off(room));
        }
        response.extend(piece);
    }
}

/// A second copy of the registers of a simulated device.
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
                let wrong_len = u32::from(input.arbitrary::<u8>()? == u8::MAX);
                let device = input.int_in_range(0..=200)?;
                let write_len = input.int_in_range(0..=300)?;
                let read_len = input.int_in_range(0..=600)?;
                let data_len = u32::from(write_len) ^ wrong_len;
                I2cRequestHeader { data_len, device, write_len, read_len }.emit(&mut request);
                request.extend_from_slice(write);
                check_request(&request, &mut machine, &mut models);
            }
        }
    }
    Ok(())
}

fn check_request(request: &[u8], machine: &mut Machine, models: &mut [Option<Model>]) {
    let before = machine.clone();
    let response = match ft_transfer_area_simulator::fuzzing::i2c_response(request, machine) {
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
    let model = models.get_mut(usize::from(header.device)).and_then(Option::as_mut);
    let nothing_to_do = header.write_len == 0 && header.read_len == 0;
    let Some(model) = model.filter(|_| !nothing_to_do) else {
        assert_eq!(response, NO_DEVICE);
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
    let good = I2cResponseHeader { read_len: header.read_len, is_ok: true };
    assert_eq!(I2cResponseHeader::parse(header_bytes), Ok(good));
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
