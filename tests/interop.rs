//! Another client than this crate's: ftrobopy, against the simulated TXT, and the same scenario
//! by this crate's own handler, which must read the same.
//!
//! It runs when `FTROBOPY_PYTHON` names a Python that has `tests/interop/requirements.txt`
//! installed, as `.ci/run` does, and says so when it does not run.

use std::process::Command;
use std::time::{Duration, Instant};

use ft_transfer_area::simulator::{Machine, SimulatedTxt};
use ft_transfer_area::transfer_area::{UniConfig, DUTY_MAX, LOCAL_IO};
use ft_transfer_area::wire::IrRemote;
use ft_transfer_area::{
    CameraOptions, FirmwareVersion, FishX1Transfer, TransferAreaComHandler, TransferMode,
};
use serde_json::{json, Value};

/// Far more than anything takes.
const LIMIT: Duration = Duration::from_secs(60);

/// The remote of switch setting 3, whose DIP switch 2 is on and whose ON button is pressed.
const REMOTE: IrRemote =
    IrRemote { left_x: 15, left_y: -15, right_x: 7, right_y: -1, bits: 0b1001 };

/// The inputs of a controller, mode and digital, as the script has them too.
const MODES: [(u8, u8); 8] = [(1, 1), (0, 1), (0, 0), (1, 0), (2, 0), (3, 0), (1, 1), (0, 0)];

/// The Python that has ftrobopy, if this is to be tested here.
fn python() -> Option<String> {
    let python = std::env::var("FTROBOPY_PYTHON").ok().filter(|python| !python.is_empty());
    if python.is_none() {
        // Past the test's captured output, so that whoever runs the tests sees it.
        use std::io::Write;
        let note = "SKIPPED: set FTROBOPY_PYTHON to a Python with ftrobopy for tests/interop.rs";
        let _ = writeln!(std::io::stderr(), "{note}");
    }
    python
}

/// A simulated TXT with one extension whose inputs depend on how they are configured.
fn txt() -> SimulatedTxt {
    let txt = SimulatedTxt::builder()
        .extensions(1)
        .firmware(FirmwareVersion::new(4, 6, 6))
        .device_name("Scenario TXT")
        .camera_start_up(Duration::from_millis(300))
        .on_exchange(measure)
        .start()
        .unwrap();
    txt.with_machine(|machine| {
        machine.i2c_device(0x18)[0x3F..0x42].copy_from_slice(&[200, 0, 1]);
        for (index, controller) in (0..).zip(&mut machine.controllers) {
            controller.counter_input[3] = 1;
            controller.counter[3] = 77 + index;
        }
        // A remote that sends is "any remote" as well.
        machine.controllers[0].ir[0] = REMOTE;
        machine.controllers[0].ir[3] = REMOTE;
    });
    txt
}

/// Sets each input to what its mode makes of what is plugged in.
fn measure(machine: &mut Machine) {
    for (index, controller) in (0..).zip(&mut machine.controllers) {
        for (input, value) in controller.uni.iter_mut().enumerate().take(7) {
            let UniConfig { mode, digital, .. } = controller.config.uni[input];
            *value = match (mode, digital) {
                (_, 1) => 1,
                (0, _) => 9000 + index,
                (1, _) => 4000 + index,
                (2, _) => 14_000 + index,
                (3, _) => 100 + index,
                _ => -1,
            };
        }
        controller.uni[7] = controller.outputs.duty[4];
    }
}

/// What the script reads in a scenario.
fn run(python: &str, txt: &SimulatedTxt, scenario: &str) -> Value {
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/interop/ftrobopy_scenario.py");
    let port = txt.port().to_string();
    let output = Command::new(python).args(["-u", script, &port, scenario]).output().unwrap();
    let stdout = String::from_utf8_lossy(&output.stdout);
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{scenario}: {stdout}\n{stderr}");
    let result = stdout.lines().find_map(|line| line.strip_prefix("RESULT "));
    serde_json::from_str(result.unwrap_or_else(|| panic!("no result: {stdout}"))).unwrap()
}

/// This crate's handler in the same scenario.
struct Own {
    handler: TransferAreaComHandler,
    areas: usize,
}

impl Own {
    fn begin(txt: &SimulatedTxt, mode: TransferMode, areas: usize) -> Self {
        let mut handler = TransferAreaComHandler::builder("127.0.0.1")
            .port(txt.port())
            .areas(areas)
            .mode(mode)
            .build()
            .unwrap();
        for area in handler.lock().iter_mut() {
            area.config.motor = [1, 1, 0, 0];
            area.config.uni =
                MODES.map(|(mode, digital)| UniConfig { mode, digital, dummy: [0; 2] });
            area.state.config_id += 1;
        }
        handler.begin_transfer().unwrap();
        Self { handler, areas }
    }

    /// Cycles until the condition holds.
    fn until(&self, mut condition: impl FnMut(&[FishX1Transfer]) -> bool) {
        let begin = Instant::now();
        while !condition(&self.handler.wait_cycle().unwrap()) {
            assert!(begin.elapsed() < LIMIT, "waited in vain");
        }
    }

    /// What each area gives, one after the other.
    fn each(&self, f: impl Fn(&Self, usize) -> Value) -> Value {
        (0..self.areas).map(|area| f(self, area)).collect()
    }

    fn light(&self, area: usize) -> Value {
        let level = 300 + area as i16;
        self.handler.lock()[area].output.duty[4] = level;
        self.until(|areas| areas[area].input.uni[7] == level);
        json!(level)
    }

    fn reset_counter(&self, area: usize) -> Value {
        let before = self.handler.lock()[area].input.counter[3];
        self.handler.lock()[area].output.cnt_reset_cmd_id[3] += 1;
        self.until(|areas| areas[area].input.cnt_resetted[3] == 1);
        json!([before, self.handler.lock()[area].input.counter[3]])
    }

    /// Lets motors turn for so many pulses, together if there are two.
    fn drive(&self, area: usize, motors: &[usize], duty: i16, distance: u16) -> Vec<i16> {
        {
            let mut areas = self.handler.lock();
            for &motor in motors {
                areas[area].input.motor_ex_reached[motor] = 0;
                let output = &mut areas[area].output;
                output.duty[2 * motor] = duty;
                output.distance[motor] = distance;
                // The second follows the first.
                output.master[motor] = u8::from(motor > 0);
                output.motor_ex_cmd_id[motor] += 1;
            }
        }
        let reached = |areas: &[FishX1Transfer]| {
            motors.iter().all(|&motor| areas[area].input.motor_ex_reached[motor] == 1)
        };
        self.until(reached);
        let areas = self.handler.lock();
        motors.iter().map(|&motor| areas[area].input.counter[motor]).collect()
    }

    fn play(&self) -> Value {
        {
            let mut areas = self.handler.lock();
            let outputs = &mut areas[LOCAL_IO].txt_outputs;
            (outputs.sound_index, outputs.sound_repeat) = (3, 1);
            outputs.sound_cmd_id = 1;
        }
        let finished = |areas: &[FishX1Transfer]| areas[LOCAL_IO].txt_inputs.sound_cmd_id == 1;
        let mut cycles = 0;
        self.until(|areas| {
            cycles += 1;
            finished(areas)
        });
        json!(cycles > 2)
    }

    fn remote(&self, number: usize) -> Value {
        let remote = self.handler.lock()[LOCAL_IO].txt_inputs.ir_input[number];
        json!([
            remote.joy_left_x,
            remote.joy_left_y,
            remote.joy_right_x,
            remote.joy_right_y,
            remote.button_on,
            remote.button_off
        ])
    }

    fn picture(&mut self) -> Value {
        let frames = self.handler.start_camera(CameraOptions::default()).unwrap();
        let picture = frames.recv_timeout(LIMIT).unwrap().to_rgb().unwrap();
        self.handler.stop_camera().unwrap();
        json!([picture.width, picture.height])
    }

    /// What both modes have.
    fn result(&self) -> Value {
        let version = self.handler.version().unwrap().code();
        self.handler.wait_cycle().unwrap();
        json!({
            "name": self.handler.device_name(),
            "version": version,
            "inputs": self.each(|own, area| json!(own.handler.lock()[area].input.uni[..7])),
            "lamp": self.each(Self::light),
            "c4_input": self.each(|own, area| json!(own.handler.lock()[area].input.cnt_in[3])),
            "c4": self.each(Self::reset_counter),
            "distance":
                self.each(|own, area| json!(own.drive(area, &[0], DUTY_MAX, 30 + area as u16)[0])),
            "both": self.drive(LOCAL_IO, &[0, 1], 400, 40),
            "sound": self.play(),
        })
    }
}

/// What the simulated TXT was set to, and the distances that were ordered.
fn assert_right(result: &Value, areas: usize) {
    assert_eq!(result["name"], "Scenario TXT");
    assert_eq!(result["version"], 0x0406_0600);
    for area in 0..areas {
        let number = area as i64;
        let inputs = json!([1, 1, 9000 + number, 4000 + number, 14_000 + number, 100 + number, 1]);
        assert_eq!(result["inputs"][area], inputs);
        assert_eq!(result["lamp"][area], 300 + number);
        assert_eq!(result["c4_input"][area], 1);
        assert_near(&result["distance"][area], 30 + number);
    }
    assert_near(&result["both"][0], 40);
    assert_near(&result["both"][1], 40);
    assert_eq!(result["sound"], true);
}

/// A motor may turn on a little, but never stops early.
fn assert_near(count: &Value, distance: i64) {
    let count = count.as_i64().unwrap();
    assert!((distance..distance + 5).contains(&count), "{count} pulses instead of {distance}");
}

#[test]
fn ftrobopy_and_this_crate_read_the_same_by_the_simple_exchange() {
    let Some(python) = python() else { return };
    let mut read = run(&python, &txt(), "simple");
    // This crate has no I2C yet.
    let i2c = read.as_object_mut().unwrap().remove("i2c").unwrap();
    assert_eq!(i2c, json!([[200, 0, 1], true, [7], null]));
    assert_right(&read, 1);
    assert_eq!(read["c4"], json!([[77, 0]]));
    assert_eq!(read["remote"], json!([15, -15, 7, -1, 1, 0]));
    assert_eq!(read["picture"], json!([320, 240]));

    let txt = txt();
    let mut own = Own::begin(&txt, TransferMode::Simple, 1);
    let mut expected = own.result();
    expected["remote"] = own.remote(3);
    expected["any_remote"] = own.remote(0);
    expected["picture"] = own.picture();
    assert_eq!(read, expected);
}

#[test]
fn ftrobopy_and_this_crate_read_the_same_by_the_compressed_exchange() {
    let Some(python) = python() else { return };
    let mut read = run(&python, &txt(), "extension");
    assert_right(&read, 2);
    // ftrobopy takes the toggle for a 1 unless the value was 1 before, so a counter that is reset
    // from 77 reads 1 there. The code means 0.
    assert_eq!(read["c4"], json!([[77, 1], [78, 1]]));
    read["c4"] = json!([[77, 0], [78, 0]]);

    let txt = txt();
    let own = Own::begin(&txt, TransferMode::Compressed, 2);
    assert_eq!(read, own.result());
}

#[test]
fn ftrobopys_change_from_another_value_to_1_fails_its_own_checksum() {
    let Some(python) = python() else { return };
    let txt = txt();
    // ftrobopy sends the toggle for it, which makes 0 of anything but 0, along with the checksum
    // of a 1. A controller ends the connection, and so must the simulated one.
    assert_eq!(run(&python, &txt, "toggle"), false);
    assert!(txt.wait_until(LIMIT, |machine| !machine.connected()));
    assert_eq!(txt.with_machine(|machine| machine.controllers[0].playing_sound()), None);
}

#[test]
fn ftrobopy_goes_online_and_offline_a_hundred_times() {
    let Some(python) = python() else { return };
    let txt = txt();
    assert_eq!(run(&python, &txt, "reconnect"), json!([1]));
    assert_eq!(txt.with_machine(|machine| (machine.connections(), machine.refused())), (100, 0));
}
