//! Every input in every mode.

use serde_json::{json, Value};

use super::ftrobopy::Ftrobopy;
use super::own::Own;
use super::{assert_alike, end_well, start, Exchange};

/// The modes as pairs of `mode` and `digital`, in the order of the script.
const MODES: [(u8, u8); 8] = [(0, 1), (1, 1), (2, 1), (0, 0), (1, 0), (2, 0), (3, 1), (3, 0)];

/// The values of the inputs of the master and of the extension in each mode, according to the kit:
/// digital voltage, 5 kΩ and 15 kΩ, then the same modes analog, then ultrasonic, digital and analog.
const EXPECTED: [[[i16; 8]; 8]; 2] = [
    [
        [0, 1, 1, 0, 10, 30, 4096, 4096],            // I1: a closed switch
        [0, 0, 0, 0, 5000, 15_000, 4096, 4096],      // I2: an open switch
        [0, 1, 1, 0, 2200, 2200, 4096, 4096],        // I3: 2200 Ω
        [0, 0, 1, 0, 5000, 7000, 4096, 4096],        // I4: 7000 Ω, over the smaller range
        [0, 0, 0, 4500, 5000, 15_000, 4096, 4096],   // I5: 4500 mV
        [1, 0, 0, 10_000, 5000, 15_000, 4096, 4096], // I6: 12 V, over range
        [0, 0, 0, 0, 5000, 15_000, 37, 37],          // I7: 37 cm
        [0, 0, 0, 0, 5000, 15_000, 4096, 4096],      // I8: nothing
    ],
    [
        [0, 1, 1, 0, 10, 30, 4096, 4096], // I1: a button whose contact opens when it is pressed
        [0, 0, 0, 0, 5000, 15_000, 4096, 4096], // I2: 20 kΩ, over both ranges
        [0, 0, 0, 0, 5000, 12_345, 4096, 4096], // I3: 12345 Ω
        [0, 1, 1, 0, 1500, 1500, 4096, 4096], // I4: an NTC at 25 °C
        [1, 0, 0, 9000, 5000, 15_000, 4096, 4096], // I5: a trail sensor over white
        [1, 0, 0, 9999, 5000, 15_000, 4096, 4096], // I6: a colour sensor at its limit
        [0, 0, 0, 0, 5000, 15_000, 1024, 1024], // I7: no echo
        [0, 1, 1, 0, 199, 199, 4096, 4096], // I8: a photo transistor in half the light
    ],
];

/// The expected values of each controller, for each mode.
fn expected(exchange: Exchange) -> Value {
    let controllers = &EXPECTED[..exchange.areas()];
    let in_mode = |mode: usize| -> Value {
        controllers.iter().map(|inputs| json!(inputs.map(|values| values[mode]))).collect()
    };
    (0..MODES.len()).map(in_mode).collect()
}

fn read_by_this_crate(own: &Own) -> Value {
    let read = |mode: (u8, u8)| {
        (0..own.areas).for_each(|area| own.configure(area, [mode; 8]));
        own.cycles(2);
        own.each(|own, area| json!(*own.look(area, |area| area.input.uni)))
    };
    MODES.into_iter().map(read).collect()
}

fn compare(exchange: Exchange) -> Option<Value> {
    let ftrobopy = Ftrobopy::find()?;
    let mut program = start("inputs.toml", &[]);
    let read = ftrobopy.run(&mut program, "inputs", exchange);
    assert_alike("ftrobopy", &read["modes"], &expected(exchange));
    program.interrupt();

    let program = start("inputs.toml", &[]);
    let own = Own::begin(&program, exchange);
    assert_alike("this crate", &read_by_this_crate(&own), &expected(exchange));
    own.end();
    end_well(program);
    Some(read["objects"].clone())
}

#[cfg_attr(not(unix), ignore = "ftrobopy is only compared on Unix")]
#[test]
fn every_input_reads_alike_in_every_mode_by_the_simple_exchange() {
    let Some(objects) = compare(Exchange::Simple) else { return };
    let expected =
        json!({ "switches": [1, 0], "resistor": 2200, "voltage": 4500, "ultrasonic": 37 });
    assert_alike("ftrobopy", &objects, &expected);
}

#[cfg_attr(not(unix), ignore = "ftrobopy is only compared on Unix")]
#[test]
fn every_input_reads_alike_in_every_mode_by_the_compressed_exchange() {
    let Some(objects) = compare(Exchange::Compressed) else { return };
    let expected = json!({
        "switches": [1, 0],
        "resistor": 2200,
        "voltage": 4500,
        "ultrasonic": 37,
        "celsius": 25,
        "trail": 1,
        "colour": 9999,
    });
    assert_alike("ftrobopy", &objects, &expected);
}
