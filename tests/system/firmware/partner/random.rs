//! Random requests, whose answers must be the same bytes from the firmware and from the simulated TXT. Both have the
//! same machine, which moves 10 ms with each exchange.
//!
//! A difference is made smaller before it is reported. `SEED=N .ci/firmware FOLDER random` makes other requests.

use std::env;
use std::io::{Read, Write};
use std::net::{Ipv4Addr, TcpStream};
use std::time::Duration;

use ft_transfer_area::transfer_area::{Config as AreaConfig, InputMode, UniConfig};
use ft_transfer_area::wire::{
    CmprHeader, CommandId, Compressor, ExchangeData, ExchangeDataResponse, I2cRequestHeader,
    QueryStatusResponse, StartOnline, UpdateConfig,
};
use ft_transfer_area::FirmwareVersion;
use ft_transfer_area_simulator::world::World;
use ft_transfer_area_simulator::SimulatedTxt;
use proptest::collection::vec;
use proptest::prelude::*;
use proptest::test_runner::{Config, RngAlgorithm, TestCaseError, TestRng, TestRunner};

use super::{check, Check};
use crate::controller::Controller;

/// How many sequences are compared; ten take about a second.
const SEQUENCES: u32 = 300;

/// Longer than any answer takes.
const LIMIT: Duration = Duration::from_secs(10);

/// What is plugged in. The firmware has one extension at most.
const WORLDS: [&str; 7] =
    ["slide", "car", "sorting_line", "processing_station", "high_bay_warehouse", "default", "kit"];

/// The firmware's board is asked for these modes. In the mode of 15 kΩ it measures the voltage, and ultrasonic is never
/// digital.
const MODES: [UniConfig; 5] = [
    UniConfig::digital(InputMode::Voltage),
    UniConfig::analog(InputMode::Voltage),
    UniConfig::digital(InputMode::Resistance),
    UniConfig::analog(InputMode::Resistance),
    UniConfig::analog(InputMode::Ultrasonic),
];

pub(super) fn checks() -> Vec<(String, Check)> {
    vec![check("random requests, compared with the simulated TXT", compare_all)]
}

#[derive(Clone, Debug)]
enum Request {
    Status,
    /// The modes of the inputs, as indices of `MODES`.
    Config([usize; 8]),
    Simple(Change),
    Compressed(Change),
    /// Device, register, bytes to write, number of bytes to read.
    I2c(u8, u8, Vec<u8>, u16),
}

/// What changes at one motor in an exchange.
#[derive(Clone, Debug)]
struct Change {
    motor: usize,
    forward: bool,
    /// Of the 255 steps of which the board knows.
    speed: i16,
    master: i16,
    distance: u16,
    /// What is added to the id of its command; 0 is none.
    command: u16,
    /// The same for the reset of its counter.
    reset: u16,
}

fn change() -> impl Strategy<Value = Change> {
    let speed = prop_oneof![Just(0), Just(255), 1..255_i16];
    let values =
        (speed, prop_oneof![3 => Just(0), 1 => 1..=8_i16], prop_oneof![Just(0), 1..50_u16]);
    let step = || prop_oneof![3 => Just(0), 3 => Just(1), 1 => any::<u16>()];
    (0..4_usize, any::<bool>(), values, step(), step()).prop_map(
        |(motor, forward, (speed, master, distance), command, reset)| Change {
            motor,
            forward,
            speed,
            master,
            distance,
            command,
            reset,
        },
    )
}

fn request() -> impl Strategy<Value = Request> {
    let i2c = (prop_oneof![Just(0x18), 0..0x80_u8], any::<u8>(), vec(any::<u8>(), 0..4), 0..40_u16);
    prop_oneof![
        1 => Just(Request::Status),
        1 => prop::array::uniform8(0..MODES.len()).prop_map(Request::Config),
        4 => change().prop_map(Request::Simple),
        12 => change().prop_map(Request::Compressed),
        2 => i2c.prop_map(|(device, register, values, read)| Request::I2c(device, register, values, read)),
    ]
}

fn compare_all(controller: &Controller) {
    let seed: u64 = env::var("SEED").map_or(0, |seed| seed.parse().expect("SEED is a number"));
    let mut bytes = [0; 32];
    bytes[..8].copy_from_slice(&seed.to_le_bytes());
    let rng = TestRng::from_seed(RngAlgorithm::ChaCha, &bytes);
    let config = Config {
        cases: SEQUENCES,
        max_shrink_iters: 200,
        failure_persistence: None,
        ..Config::default()
    };
    let sequences = (0..WORLDS.len(), vec(request(), 1..60));
    let compared = TestRunner::new_with_rng(config, rng)
        .run(&sequences, |(world, requests)| compare(controller, WORLDS[world], &requests));
    assert!(compared.is_ok(), "with SEED={seed}: {}", compared.unwrap_err());
}

/// Sends the same requests to both.
fn compare(
    controller: &Controller,
    world: &str,
    requests: &[Request],
) -> Result<(), TestCaseError> {
    let world = || {
        let mut world = World::shipped(world).expect("it is shipped");
        world.i2c = World::default().i2c;
        world
    };
    let mut real = Client::connect([65_000, 65_002])?;
    let status = QueryStatusResponse::parse(&real.status()?).map_err(fail)?;
    let name = status.device_name;
    let name: String =
        name.iter().take_while(|letter| **letter != 0).map(|letter| *letter as char).collect();
    let txt = SimulatedTxt::builder()
        .world(world())
        .pace(Duration::ZERO)
        .device_name(&name)
        .firmware(FirmwareVersion::new(4, 7, 0))
        .start()
        .map_err(fail)?;
    let mut simulated = Client::connect([txt.port(), txt.i2c_port()])?;
    controller.plug_in_unpaced(world());
    simulated.go_online()?;
    real.go_online()?;
    // So far the firmware has exchanged with its board by itself.
    controller.plug_in_unpaced(world());
    for (number, request) in requests.iter().enumerate() {
        let (expected, found) = (simulated.ask(request)?, real.ask(request)?);
        let same = expected == found;
        prop_assert!(same, "answer {number}, to {request:?}:\n{found}\nsimulated:\n{expected}");
    }
    simulated.go_offline()?;
    real.go_offline()
}

fn fail(error: impl ToString) -> TestCaseError {
    TestCaseError::fail(error.to_string())
}

/// A client with its own state of the outputs and the compression.
struct Client {
    main: TcpStream,
    i2c_port: u16,
    /// After StartOnline.
    i2c: Option<TcpStream>,
    outputs: ExchangeData,
    config_id: i16,
    compressor: Compressor,
}

impl Client {
    /// To the main port; the one for I2C follows.
    fn connect([main, i2c_port]: [u16; 2]) -> Result<Self, TestCaseError> {
        Ok(Self {
            main: connection(main)?,
            i2c_port,
            i2c: None,
            outputs: ExchangeData::default(),
            config_id: 0,
            compressor: Compressor::new(),
        })
    }

    fn status(&mut self) -> Result<Vec<u8>, TestCaseError> {
        self.main.write_all(&CommandId::QueryStatus.id().to_le_bytes())?;
        read(&mut self.main, QueryStatusResponse::LEN)
    }

    /// With an I2C connection, without which the firmware would end at the next StartOnline.
    fn go_online(&mut self) -> Result<(), TestCaseError> {
        let mut start = Vec::new();
        StartOnline::new().emit(&mut start);
        self.main.write_all(&start)?;
        read(&mut self.main, 4)?;
        self.i2c = Some(connection(self.i2c_port)?);
        self.i2c(0, &[], 0)?;
        Ok(())
    }

    fn go_offline(&mut self) -> Result<(), TestCaseError> {
        self.i2c = None;
        self.main.write_all(&CommandId::StopOnline.id().to_le_bytes())?;
        read(&mut self.main, 4)?;
        Ok(())
    }

    /// The answer, as it is to be shown.
    fn ask(&mut self, request: &Request) -> Result<String, TestCaseError> {
        let answer = match request {
            Request::Status => self.status()?,
            Request::Config(modes) => self.configure(modes)?,
            Request::Simple(change) => self.exchange(change)?,
            Request::Compressed(change) => self.exchange_compressed(change)?,
            Request::I2c(device, register, values, read) => {
                self.i2c(*device, &[&[*register], values.as_slice()].concat(), *read)?
            }
        };
        Ok(answer.iter().map(|byte| format!("{byte:02x}")).collect())
    }

    fn configure(&mut self, modes: &[usize; 8]) -> Result<Vec<u8>, TestCaseError> {
        self.config_id += 1;
        let config =
            AreaConfig { uni: modes.map(|mode| MODES[mode]).into(), ..AreaConfig::default() };
        let mut command = Vec::new();
        UpdateConfig { config_id: self.config_id, extension_id: 0, config }.emit(&mut command);
        self.main.write_all(&command)?;
        read(&mut self.main, 4)
    }

    fn exchange(&mut self, change: &Change) -> Result<Vec<u8>, TestCaseError> {
        self.change(change);
        let mut command = Vec::new();
        self.outputs.emit(&mut command);
        self.main.write_all(&command)?;
        read(&mut self.main, ExchangeDataResponse::LEN)
    }

    fn exchange_compressed(&mut self, change: &Change) -> Result<Vec<u8>, TestCaseError> {
        self.change(change);
        let (mut command, mut data) = (Vec::new(), Vec::new());
        let crc = self.compressor.compress(&words(&self.outputs), &mut data);
        let header = CmprHeader { extra_size: data.len() as u32, crc, active_extensions: 0 };
        header.emit_command(&mut command);
        command.extend(data);
        self.main.write_all(&command)?;
        let mut answer = read(&mut self.main, CmprHeader::LEN)?;
        let header = CmprHeader::parse_response(&answer).map_err(fail)?;
        answer.extend(read(&mut self.main, header.extra_size as usize)?);
        Ok(answer)
    }

    fn change(&mut self, change: &Change) {
        let Change { motor, forward, speed, master, distance, command, reset } = change.clone();
        let outputs = &mut self.outputs;
        let duty = if speed == 255 { 512 } else { 2 * speed };
        let side = usize::from(!forward);
        outputs.duty[2 * motor + side] = duty;
        outputs.duty[2 * motor + 1 - side] = 0;
        if command != 0 {
            outputs.master[motor] = master;
            outputs.distance[motor] = distance;
        }
        let [command_id, reset_id] = [&mut outputs.motor_command_id, &mut outputs.counter_reset_id];
        command_id[motor] = command_id[motor].wrapping_add(command);
        reset_id[motor] = reset_id[motor].wrapping_add(reset);
    }

    fn i2c(&mut self, device: u8, write: &[u8], length: u16) -> Result<Vec<u8>, TestCaseError> {
        let connection = self.i2c.as_mut().ok_or_else(|| fail("not online"))?;
        let mut command = Vec::new();
        I2cRequestHeader {
            data_len: write.len() as u32,
            device,
            write_len: write.len() as u16,
            read_len: length,
        }
        .emit(&mut command);
        command.extend(write);
        connection.write_all(&command)?;
        let mut answer = read(connection, 12)?;
        let follow = usize::from(u16::from_le_bytes([answer[10], answer[11]]));
        answer.extend(read(connection, follow)?);
        Ok(answer)
    }
}

fn connection(port: u16) -> Result<TcpStream, TestCaseError> {
    let connection = TcpStream::connect((Ipv4Addr::LOCALHOST, port))?;
    connection.set_nodelay(true)?;
    connection.set_read_timeout(Some(LIMIT))?;
    Ok(connection)
}

fn read(connection: &mut TcpStream, length: usize) -> Result<Vec<u8>, TestCaseError> {
    let mut answer = vec![0; length];
    connection.read_exact(&mut answer)?;
    Ok(answer)
}

/// The words of the compressed exchange.
fn words(outputs: &ExchangeData) -> Vec<u16> {
    let mut packet = Vec::new();
    outputs.emit(&mut packet);
    // They stand in the same order in the other exchange, after its id.
    packet[4..58].chunks_exact(2).map(|word| u16::from_le_bytes([word[0], word[1]])).collect()
}
