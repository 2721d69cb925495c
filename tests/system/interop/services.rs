//! All except inputs and motors: name and version, lamps, counter inputs, sounds, remotes, the camera
//! and I2C.

use std::time::{Duration, Instant};

use ft_transfer_area::{CameraFrame, CameraOptions, Error};
use serde_json::{json, Value};

use super::ftrobopy::Ftrobopy;
use super::own::Own;
use super::{assert_alike, end_well, start, Exchange};
use crate::program::{Program, DEADLINE};

const OPTIONS: [&str; 4] = ["--name", "Scenario TXT", "--camera-start-up", "300"];

/// The number that the blocks at the bottom edge of the test card show, in a complete picture of
/// 320 × 240.
fn number_shown(frame: &CameraFrame) -> u16 {
    let picture = frame.to_rgb().unwrap();
    let [width, height] = [picture.width, picture.height].map(usize::from);
    assert_eq!((width, height), (320, 240));
    let y = height - 1 - height / 16;
    (0..16).fold(0, |number, block| {
        let x = block * width / 16 + width / 32;
        let green = picture.data[3 * (y * width + x) + 1];
        number << 1 | u16::from(green >= 128)
    })
}

/// Decodes three frames; their numbers increase.
fn assert_pictures(frames: &[CameraFrame]) {
    let numbers: Vec<u16> = frames.iter().map(number_shown).collect();
    assert!(numbers.is_sorted_by(|a, b| a < b) && numbers.len() == 3, "{numbers:?}");
}

/// A frame that ftrobopy received; it passes frames on unchanged.
fn frame(hex: &Value) -> CameraFrame {
    let byte = |pair: &[u8]| u8::from_str_radix(std::str::from_utf8(pair).unwrap(), 16).unwrap();
    let data = hex.as_str().unwrap().as_bytes().chunks(2).map(byte).collect();
    CameraFrame::new(data)
}

/// Checks that the log names the lamps of this number of controllers.
fn assert_lamps(log: &str, areas: usize) {
    for reported in &["the master: O7 is set to 300", "extension 1: O7 is set to 301"][..areas] {
        assert!(log.contains(reported), "{reported} is not reported in {log}");
    }
}

impl Own {
    /// The script's `counter_input`.
    fn counter_input(&self, program: &mut Program, area: usize) -> Value {
        let name = if area == 0 { "C4" } else { "E1.C4" };
        let levels = [1, 0].map(|level| {
            program.type_line(&format!("{name} {level}"));
            self.until(|areas| areas[area].input.cnt_in[3] == level);
            level
        });
        json!(levels)
    }

    fn sound(&self, index: u16, repeat: u16) {
        self.together(0, |master| {
            let outputs = &mut master.txt_outputs;
            (outputs.sound_index, outputs.sound_repeat) = (index, repeat);
            master.raise_sound_cmd_id();
        });
    }

    fn sound_finished(&self) -> bool {
        self.master(|master| master.txt_inputs.sound_cmd_id == master.txt_outputs.sound_cmd_id)
    }

    /// The script's `sounds`.
    fn sounds(&self) -> Value {
        let begin = Instant::now();
        self.sound(3, 1);
        self.until(|areas| areas[0].txt_inputs.sound_cmd_id == 1);
        let lasted = begin.elapsed() >= Duration::from_millis(900);
        self.sound(5, 0);
        self.cycles(20);
        let went_on = !self.sound_finished();
        self.sound(0, 1);
        self.until(|areas| areas[0].txt_inputs.sound_cmd_id == 3);
        json!([lasted, went_on])
    }

    /// The script's `remote`, twice.
    fn remote_and_any(&self, number: usize) -> Vec<i64> {
        self.master(|master| {
            let remotes = [number, 0].map(|number| master.txt_inputs.ir_input[number]);
            let values = remotes.map(|remote| {
                let axes =
                    [remote.joy_left_x, remote.joy_left_y, remote.joy_right_x, remote.joy_right_y];
                let buttons = [remote.button_on, remote.button_off];
                axes.map(i64::from).into_iter().chain(buttons.map(i64::from)).collect::<Vec<_>>()
            });
            values.concat()
        })
    }

    /// The script's `remotes`.
    fn remotes(&self, program: &mut Program) -> Value {
        let mut seen = vec![self.remote_and_any(3)];
        let mut before = 3;
        for number in [1_i16, 2, 4] {
            let [a, b, c, d] = [3 + number, -3 - number, 7 + number, -7 - number];
            let bits = |number: i16| 4 * (number - 1);
            program.type_line(&format!("IR{number} {a} {b} {c} {d} {}", 2 + bits(number)));
            program.type_line(&format!("IR{before} 0 0 0 0 {}", bits(before)));
            self.until(|areas| areas[0].txt_inputs.ir_input[0].joy_left_x == a);
            seen.push(self.remote_and_any(number as usize));
            before = number;
        }
        json!(seen)
    }

    /// Three frames of the camera.
    fn pictures(&mut self) -> Vec<CameraFrame> {
        let frames = self.handler.start_camera(CameraOptions::default()).unwrap();
        let taken = (0..3).map(|_| frames.recv_timeout(DEADLINE).unwrap()).collect();
        self.handler.stop_camera().unwrap();
        taken
    }

    /// The script's `i2c`.
    fn i2c(&self, program: &mut Program) -> Value {
        for (register, value) in (0x3F..).zip([200, 0, 1]) {
            program.type_line(&format!("I2C 24 {register} {value}"));
        }
        let mut i2c = self.handler.i2c().unwrap();
        let mut there = [0; 3];
        let begin = Instant::now();
        while there[2] != 1 {
            assert!(begin.elapsed() < DEADLINE, "the I2C device is not plugged in");
            // The device exists only after the first line is carried out.
            let _ = i2c.read(0x18, 0x3F, &mut there);
        }
        let written = i2c.write(0x18, 0x10, &[7]).is_ok();
        let mut register = [0];
        i2c.read(0x18, 0x10, &mut register).unwrap();
        let nobody = i2c.read(0x19, 0x3F, &mut [0]).unwrap_err();
        assert!(matches!(nobody, Error::I2cNoDevice { device: 0x19, .. }), "{nobody}");
        json!([there, written, register, null])
    }

    /// The script's `services`, without the camera.
    fn services(&self, program: &mut Program) -> Value {
        for area in 0..self.areas {
            self.together(area, |own| own.output.duty[6] = 300 + area as i16);
        }
        let version = self.handler.version().unwrap();
        json!({
            "name": self.handler.device_name(),
            "version": version.code(),
            "firmware": format!("firmware version {version}"),
            "c4": (0..self.areas).map(|area| self.counter_input(program, area)).collect::<Value>(),
            "sounds": self.sounds(),
            "remotes": self.remotes(program),
            "i2c": self.i2c(program),
        })
    }
}

/// Checks the values that were plugged in, typed and asked for.
fn assert_right(result: &Value) {
    assert_eq!(result["name"], "Scenario TXT");
    assert_eq!(result["version"], 0x0406_0600);
    for area in result["c4"].as_array().unwrap() {
        assert_eq!(area, &json!([1, 0]));
    }
    assert_eq!(result["sounds"], json!([true, true]));
    assert_eq!(result["i2c"], json!([[200, 0, 1], true, [7], null]));
    let remotes = [
        [15, -14, 7, -2, 1, 0],
        [4, -4, 8, -8, 0, 1],
        [5, -5, 9, -9, 0, 1],
        [7, -7, 11, -11, 0, 1],
    ];
    // Each remote is there twice, the second time as any remote.
    assert_eq!(result["remotes"], json!(remotes.map(|remote| [remote, remote].concat())));
}

fn compare(exchange: Exchange) {
    let Some(ftrobopy) = Ftrobopy::find() else { return };
    let mut program = start("inputs.toml", &OPTIONS);
    let mut read = ftrobopy.run(&mut program, "services", exchange);
    assert_lamps(&program.interrupt(), exchange.areas());
    assert_right(&read);
    let pictures = read.as_object_mut().unwrap().remove("pictures").unwrap();
    let frames: Vec<CameraFrame> = pictures.as_array().unwrap().iter().map(frame).collect();
    assert_pictures(&frames);

    let mut program = start("inputs.toml", &OPTIONS);
    let mut own = Own::begin(&program, exchange);
    let expected = own.services(&mut program);
    assert_pictures(&own.pictures());
    own.end();
    assert_lamps(&end_well(program), exchange.areas());
    assert_alike("ftrobopy", &read, &expected);
}

#[cfg_attr(not(unix), ignore = "ftrobopy is only compared on Unix")]
#[test]
fn all_else_is_alike_by_the_simple_exchange() {
    compare(Exchange::Simple);
}

#[cfg_attr(not(unix), ignore = "ftrobopy is only compared on Unix")]
#[test]
fn all_else_is_alike_by_the_compressed_exchange() {
    compare(Exchange::Compressed);
}
