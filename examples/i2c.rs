//! I2C: reads acceleration and temperature from a Bosch BMX055, the chip of fischertechnik's
//! combination sensor.
//!
//! Wiring: the sensor's cable in the TXT's EXT socket, which carries the I2C bus (3.3 V). Other
//! devices have their addresses and registers in their data sheets.
//!
//! ```text
//! cargo run --example i2c                        # a simulated TXT with a sensor that is turned
//! cargo run --example i2c -- 192.168.7.2         # a TXT on USB
//! cargo run --example i2c -- --seconds 60 127.0.0.1:65000
//! ```
//!
//! Four times a second a line is printed. Ctrl-C goes offline before the program exits. The sample
//! motor_on_off_switch shows inputs and outputs.

mod common;

use std::f64::consts::TAU;
use std::process::ExitCode;
use std::thread;
use std::time::Duration;

use common::Example;
use ft_transfer_area::simulator::{Machine, SimulatedTxt, SimulatedTxtBuilder};
use ft_transfer_area::I2cClient;

const USAGE: &str = "usage: i2c [--seconds N] [HOST[:PORT]]";

/// The address of the chip's acceleration sensor.
const DEVICE: u8 = 0x18;

/// The register that tells which chip it is, and what it tells.
const CHIP_ID_REGISTER: u8 = 0x00;
const CHIP_ID: u8 = 0xFA;

/// The register of the range, its value for up to 2 g, and what 1 g is then.
const RANGE_REGISTER: u8 = 0x0F;
const RANGE_2_G: u8 = 0x03;
const G: f64 = 1024.0;

/// The first of six registers: x, y and z, two bytes each, the lower one first. Behind them is the
/// temperature, which is 0 at 23 °C and counts half degrees.
const MEASURED_REGISTER: u8 = 0x02;
const TEMPERATURE_0: f64 = 23.0;
const DEGREE: f64 = 2.0;

fn main() -> ExitCode {
    common::main(run)
}

fn run() -> common::Result {
    let example = Example::start(USAGE, simulated)?;
    let handler = example.handler().build()?;
    handler.begin_transfer()?;
    drop(handler.wait_cycle()?); // the controller exchanges
    let mut i2c = handler.i2c()?;

    // Check that it is the right device, and set it up.
    let mut id = [0];
    i2c.read(DEVICE, CHIP_ID_REGISTER, &mut id)?;
    if id != [CHIP_ID] {
        return Err(format!("the device at {DEVICE:#04x} is no BMX055, its id is {id:?}").into());
    }
    i2c.write(DEVICE, RANGE_REGISTER, &[RANGE_2_G])?;

    while example.goes_on() {
        let ([x, y, z], temperature) = measure(&mut i2c)?;
        println!("x {x:5.2} g  y {y:5.2} g  z {z:5.2} g  {temperature:4.1} °C");
        thread::sleep(Duration::from_millis(250));
    }
    handler.end_transfer()?;
    Ok(())
}

/// Reads the accelerations in g, and the temperature in °C.
fn measure(i2c: &mut I2cClient) -> Result<([f64; 3], f64), ft_transfer_area::Error> {
    let mut values = [0; 7];
    i2c.read(DEVICE, MEASURED_REGISTER, &mut values)?;
    let [x0, x1, y0, y1, z0, z1, temperature] = values;
    // A value has 12 bits, in the upper part of the two bytes.
    let axes = [[x0, x1], [y0, y1], [z0, z1]].map(|axis| i16::from_le_bytes(axis) >> 4);
    let temperature = f64::from(temperature as i8) / DEGREE + TEMPERATURE_0;
    Ok((axes.map(|axis| f64::from(axis) / G), temperature))
}

/// A sensor that is turned once in four seconds, and slowly gets warmer.
fn simulated() -> common::Result<SimulatedTxtBuilder> {
    Ok(SimulatedTxt::builder().on_exchange(turn))
}

fn turn(machine: &mut Machine) {
    // An exchange takes 10 ms.
    let seconds = machine.exchanges() as f64 / 100.0;
    let angle = TAU * seconds / 4.0;
    let registers = machine.i2c_device(DEVICE);
    registers[usize::from(CHIP_ID_REGISTER)] = CHIP_ID;
    let axes = [angle.sin(), 0.0, angle.cos()].map(|axis| ((axis * G) as i16) << 4);
    let temperature = (seconds.min(20.0) * DEGREE) as u8;
    let measured = axes.into_iter().flat_map(i16::to_le_bytes).chain([temperature]);
    for (register, value) in registers[usize::from(MEASURED_REGISTER)..].iter_mut().zip(measured) {
        *register = value;
    }
}
