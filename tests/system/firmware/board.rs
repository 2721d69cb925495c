//! The I/O board of the firmware's controller: a simulated machine that the firmware's program drives.
//!
//! The frames were seen on the serial line of the maker's firmware 4.7.0. What a real board decides is assumed: that it
//! answers 10 ms after its last answer, and that its outputs stay when no frame comes.

use std::collections::VecDeque;
use std::io::{Read, Write};
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::Path;
use std::sync::{Arc, Mutex, MutexGuard};
use std::thread;
use std::time::{Duration, Instant};

use ft_transfer_area::transfer_area::{Config, InputMode, UniConfig, DUTY_MAX};
use ft_transfer_area::wire::{ExchangeData, ExchangeDataResponse};
use ft_transfer_area_simulator::Machine;

/// The time between two answers, and of a step when time does not matter.
const PACE: Duration = Duration::from_millis(10);

/// More than this does not pass in the machine between two frames, so its script waits for the next client.
const LONGEST_STEP: Duration = Duration::from_millis(100);

/// The part of a frame for one controller, and of its answer.
const OUTPUTS: usize = 26;
const INPUTS: usize = 38;

/// Bytes of a frame and of an answer that are for no controller.
const FRAME: usize = 6;

/// The frames that are kept.
const NEWEST: usize = 100_000;

/// The board, as the checks see it.
#[derive(Clone)]
pub(crate) struct Board(Arc<Mutex<State>>);

/// What is behind the serial line and the I2C bus.
pub(crate) struct State {
    pub(crate) machine: Machine,
    /// Without it each frame is a step of 10 ms, and is answered at once.
    pub(crate) by_the_clock: bool,
    /// How many frames with outputs have come.
    pub(crate) frames: u64,
    /// The outputs of the master in the newest frames.
    pub(crate) duties: VecDeque<[i16; 8]>,
    last_frame: Instant,
    last_answer: Instant,
}

impl Board {
    /// A board at this socket of the file system.
    pub(crate) fn listen(socket: &Path) -> std::io::Result<Self> {
        let state = State {
            machine: Machine::new(0),
            by_the_clock: true,
            frames: 0,
            duties: VecDeque::new(),
            last_frame: Instant::now(),
            last_answer: Instant::now(),
        };
        let board = Self(Arc::new(Mutex::new(state)));
        let listener = UnixListener::bind(socket)?;
        let served = board.clone();
        thread::spawn(move || {
            for connection in listener.incoming().map_while(Result::ok) {
                let board = served.clone();
                // An error is the end of the firmware's program.
                thread::spawn(move || board.serve(connection));
            }
        });
        Ok(board)
    }

    pub(crate) fn state(&self) -> MutexGuard<'_, State> {
        self.0.lock().unwrap()
    }

    /// Plugs in another machine.
    pub(crate) fn plug_in(&self, machine: Machine, by_the_clock: bool) {
        let mut state = self.state();
        state.machine = machine;
        state.by_the_clock = by_the_clock;
    }

    fn serve(&self, mut connection: UnixStream) -> std::io::Result<()> {
        let mut kind = [0];
        connection.read_exact(&mut kind)?;
        loop {
            let mut length = [0; 2];
            connection.read_exact(&mut length)?;
            let mut frame = vec![0; usize::from(u16::from_le_bytes(length))];
            connection.read_exact(&mut frame)?;
            let answer = match kind {
                [b'I'] => self.state().i2c(&frame),
                _ => {
                    let (answer, wait) = self.state().answer(&frame);
                    thread::sleep(wait);
                    answer
                }
            };
            connection.write_all(&answer)?;
        }
    }
}

impl State {
    /// The answer to a frame, and how long it takes.
    fn answer(&mut self, frame: &[u8]) -> (Vec<u8>, Duration) {
        let answer = match frame {
            [b'T', _, cycle, mask, ..] if frame.len() >= FRAME + OUTPUTS => {
                self.take_outputs(frame);
                self.pass_time();
                self.inputs(*cycle, *mask, frame.len())
            }
            [b'Q', cycle, controller, modes @ ..] if modes.len() >= 4 => {
                self.configure(usize::from(*controller), modes);
                padded(&[b'Q', *cycle, 0], if modes.len() == 4 { 3 } else { 15 })
            }
            [b'`', what, cycle, ..] => self.look_for(*what, *cycle),
            _ => padded(&frame[..frame.len().min(2)], 15),
        };
        (answer, self.until_next_answer())
    }

    fn take_outputs(&mut self, frame: &[u8]) {
        self.frames += 1;
        for (controller, part) in frame[4..].chunks_exact(OUTPUTS).enumerate() {
            let outputs = outputs(part);
            if controller == 0 {
                self.duties.push_back(outputs.duty);
                if self.duties.len() > NEWEST {
                    self.duties.pop_front();
                }
            }
            self.machine.set_outputs(controller, outputs);
        }
    }

    fn pass_time(&mut self) {
        let now = Instant::now();
        let passed = (now - self.last_frame).min(LONGEST_STEP);
        self.last_frame = now;
        self.machine.step(if self.by_the_clock { passed } else { PACE });
    }

    fn until_next_answer(&mut self) -> Duration {
        if !self.by_the_clock {
            return Duration::ZERO;
        }
        let now = Instant::now();
        self.last_answer = now.max(self.last_answer + PACE);
        self.last_answer - now
    }

    /// The inputs of as many controllers as the frame had outputs for.
    fn inputs(&self, cycle: u8, mask: u8, frame: usize) -> Vec<u8> {
        let controllers = (frame - FRAME) / OUTPUTS;
        let mut answer = vec![0; FRAME + INPUTS * controllers];
        let length = answer.len() as u8;
        answer[..4].copy_from_slice(&[b'T', length, cycle, mask]);
        for controller in 0..controllers {
            if let Some(report) = self.machine.report(controller) {
                pack(&report, &mut answer[4 + INPUTS * controller..]);
            }
        }
        answer
    }

    /// The modes of eight inputs, four bits each.
    fn configure(&mut self, controller: usize, modes: &[u8]) {
        let uni = std::array::from_fn(|input| match modes[input / 2] >> (4 * (input % 2)) & 0xF {
            0 => UniConfig::digital(InputMode::Voltage),
            1 => UniConfig::digital(InputMode::Resistance),
            3 => UniConfig::analog(InputMode::Resistance),
            4 => UniConfig::analog(InputMode::Ultrasonic),
            // The firmware asks for this in the mode of 15 kΩ, too.
            _ => UniConfig::analog(InputMode::Voltage),
        });
        self.machine.set_config(controller, Config { uni: uni.into(), ..Config::default() });
    }

    /// What the firmware asks for when it begins (3), and at each StartOnline (0): extensions, one bit each.
    fn look_for(&self, what: u8, cycle: u8) -> Vec<u8> {
        let extensions = ((1u16 << (self.machine.controllers.len() - 1)) - 1).to_le_bytes();
        match what {
            0 => padded(&[0, cycle, 0, 2, extensions[0], u8::from(extensions[0] > 0)], 15),
            3 => padded(&[0, cycle, 0, 2], 15),
            _ => padded(&[0, cycle, 0, 32], 15),
        }
    }

    /// A transfer on the I2C bus: address, length to read, and the bytes to write, the register first. What is read comes
    /// after what was written.
    fn i2c(&mut self, request: &[u8]) -> Vec<u8> {
        let (address, length) = (request[0], u16::from_le_bytes([request[1], request[2]]));
        if !self.machine.i2c_addresses().any(|there| there == address) {
            return vec![0];
        }
        let registers = self.machine.i2c_device(address);
        let (first, values) = request[3..].split_first().unwrap_or((&0, &[]));
        for (offset, value) in values.iter().enumerate() {
            registers[(usize::from(*first) + offset) % registers.len()] = *value;
        }
        let read = (usize::from(*first) + values.len()..).take(usize::from(length));
        let read = read.map(|register| registers[register % registers.len()]);
        std::iter::once(1).chain(read).collect()
    }
}

fn padded(bytes: &[u8], length: usize) -> Vec<u8> {
    let mut padded = bytes.to_vec();
    padded.resize(length, 0);
    padded
}

/// The 3 bits at this place of a group of 24.
fn id(bytes: &[u8], place: usize) -> u16 {
    let group = u32::from_le_bytes([bytes[0], bytes[1], bytes[2], 0]);
    (group >> (3 * place) & 7) as u16
}

/// The outputs in the part of a frame: 8 bits of each duty, 4 of each master, 3 of each id.
fn outputs(part: &[u8]) -> ExchangeData {
    use std::array::from_fn;

    ExchangeData {
        duty: from_fn(|output| match part[output] {
            u8::MAX => DUTY_MAX,
            half => 2 * i16::from(half),
        }),
        master: from_fn(|motor| i16::from(part[8 + motor / 2] >> (4 * (motor % 2)) & 0xF)),
        counter_reset_id: from_fn(|counter| id(&part[10..], counter)),
        motor_command_id: from_fn(|motor| id(&part[10..], 4 + motor)),
        distance: from_fn(|motor| u16::from_le_bytes([part[14 + 2 * motor], part[15 + 2 * motor]])),
        ..ExchangeData::default()
    }
}

/// Writes what a controller reports into its part of an answer.
fn pack(report: &ExchangeDataResponse, part: &mut [u8]) {
    // The low bytes of four inputs, and then six more bits of each.
    for (place, inputs) in [(1, &report.uni[..4]), (8, &report.uni[4..])] {
        let mut high = 0u32;
        for (index, input) in inputs.iter().enumerate() {
            part[place + index] = *input as u8;
            high |= u32::from(*input as u16 >> 8 & 0x3F) << (6 * index);
        }
        part[place + 4..place + 7].copy_from_slice(&high.to_le_bytes()[..3]);
    }
    // 9 V of power, 20 °C and other voltages of the board itself, in bits like the inputs.
    part[15..21].copy_from_slice(&[0x28, 0x2C, 0x23, 0xBC, 0x20, 0x02]);
    for counter in 0..4 {
        part[21] |= u8::from(report.counter_input[counter] != 0) << counter;
        let place = 22 + 2 * counter;
        part[place..place + 2].copy_from_slice(&report.counter[counter].to_le_bytes());
    }
    pack_remote(report, &mut part[30..33]);
    let mut done = 0u32;
    for index in 0..4 {
        done |= u32::from(report.counter_reset_id[index] & 7) << (3 * index);
        done |= u32::from(report.motor_command_id[index] & 7) << (12 + 3 * index);
    }
    part[34..37].copy_from_slice(&done.to_le_bytes()[..3]);
}

/// One remote: a bit for each axis that is not negative, the four bits of its buttons and switches, and the axes.
fn pack_remote(report: &ExchangeDataResponse, part: &mut [u8]) {
    let remote = report.ir[0];
    let axes = [remote.right_x, remote.right_y, remote.left_x, remote.left_y];
    part[0] = remote.bits << 4;
    for (place, axis) in axes.iter().enumerate() {
        part[0] |= u8::from(*axis >= 0) << place;
        part[1 + place / 2] |= (axis.unsigned_abs() & 0xF) << (4 * (place % 2));
    }
}
