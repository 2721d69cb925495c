//! I2C: reads acceleration and temperature from a Bosch BMX055, the chip of fischertechnik's
//! combination sensor.
//!
//! Wiring: the sensor's cable in the TXT's EXT socket, which has the I2C bus (3.3 V). For other devices,
//! look up the addresses and registers in their data sheets.
//!
//! ```text
//! cargo run --example i2c                  # a simulated TXT
//! cargo run --example i2c -- 192.168.7.2   # a TXT on USB
//!
//! in your own project, where FOLDER is the folder of ft-transfer-area:
//! cargo add ft-transfer-area --path FOLDER
//! cargo add ft-transfer-area-simulator --path FOLDER/simulator
//! cargo add ctrlc@3 --features termination
//! ```
//!
//! It prints a line four times a second. Ctrl-C ends the transfer. Next: `camera`.

use std::env;
use std::thread;
use std::time::Duration;

use ft_transfer_area::prelude::*;
use ft_transfer_area::I2cClient;
use ft_transfer_area_simulator::world::World;
use ft_transfer_area_simulator::SimulatedTxt;

/// The address of the chip's acceleration sensor.
const DEVICE: u8 = 0x18;

/// The register with the id of the chip, and this id.
const CHIP_ID_REGISTER: u8 = 0x00;
const CHIP_ID: u8 = 0xFA;

/// The register of the range, its value for up to 2 g, and the value of 1 g in this range.
const RANGE_REGISTER: u8 = 0x0F;
const RANGE_2_G: u8 = 0x03;
const G: f64 = 1024.0;

/// The first of six registers: x, y and z, two bytes each, the lower one first. After them comes the
/// temperature in half degrees, which is 0 at 23 °C.
const MEASURED_REGISTER: u8 = 0x02;
const TEMPERATURE_0: f64 = 23.0;
const DEGREE: f64 = 2.0;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let (address, simulated) = controller()?;
    let handler = TransferAreaComHandler::builder(address).build()?;
    let areas = handler.areas();
    handler.begin_transfer()?;

    // Ctrl-C ends the transfer.
    let on_ctrl_c = handler.areas().clone();
    ctrlc::set_handler(move || on_ctrl_c.ask_to_end())?;

    drop(areas.wait_cycle()?); // the exchange has begun
    let mut i2c = handler.i2c()?;

    // Check that it is the right device, and set it up. A missing device is an error.
    let mut id = [0];
    i2c.read(DEVICE, CHIP_ID_REGISTER, &mut id)?;
    if id != [CHIP_ID] {
        return Err(format!("the device at {DEVICE:#04x} is not a BMX055, its id is {id:?}").into());
    }
    i2c.write(DEVICE, RANGE_REGISTER, &[RANGE_2_G])?;

    println!("Acceleration in three directions, and temperature. Turn the sensor.");
    let lines = if simulated.is_some() { 20 } else { u64::MAX };
    for _ in 0..lines {
        if !areas.is_running() {
            break;
        }
        let ([x, y, z], temperature) = measure(&mut i2c)?;
        println!("x {x:5.2} g  y {y:5.2} g  z {z:5.2} g  {temperature:4.1} °C");
        thread::sleep(Duration::from_millis(250));
    }
    // This returns the error, if one has ended the transfer.
    handler.end_transfer()?;
    Ok(())
}

/// Reads the accelerations in g, and the temperature in °C.
fn measure(i2c: &mut I2cClient) -> Result<([f64; 3], f64), Error> {
    let mut values = [0; 7];
    i2c.read(DEVICE, MEASURED_REGISTER, &mut values)?;
    let [x0, x1, y0, y1, z0, z1, temperature] = values;
    // A value has 12 bits, in the upper part of the two bytes.
    let axes = [[x0, x1], [y0, y1], [z0, z1]].map(|axis| i16::from_le_bytes(axis) >> 4);
    let temperature = f64::from(temperature as i8) / DEGREE + TEMPERATURE_0;
    Ok((axes.map(|axis| f64::from(axis) / G), temperature))
}

/// The controller on the command line, or a simulated TXT, which runs as long as the second value lives.
fn controller() -> Result<(String, Option<SimulatedTxt>), ft_transfer_area_simulator::Error> {
    if let Some(address) = env::args().nth(1) {
        return Ok((address, None));
    }
    println!(
        "No address is given, so this is a simulated TXT. Its buttons are pressed by a script."
    );
    let txt = SimulatedTxt::builder().world(World::default()).start()?;
    Ok((txt.address().to_string(), Some(txt)))
}
