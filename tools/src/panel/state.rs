//! What a page is told of a controller.

use ft_transfer_area::transfer_area::{CounterMode, InputMode, IrInput};
use ft_transfer_area::tx::{Counter, Input, Motor};
use ft_transfer_area::FishX1Transfer;
use serde::Serialize;

use super::camera::CameraState;
use super::trouble::Trouble;
use super::world::WorldReport;

/// Everything of one controller except who drives it, which differs from page to page.
#[derive(Serialize)]
pub(super) struct HostState<'a> {
    /// Milliseconds since the program began.
    pub(super) at: u128,
    pub(super) link: Link<'a>,
    pub(super) areas: Vec<AreaState>,
    pub(super) world: Option<WorldReport>,
    pub(super) camera: CameraState,
    pub(super) i2c: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Phase {
    Connecting,
    Running,
    Gap,
}

#[derive(Serialize)]
pub(super) struct Link<'a> {
    pub(super) phase: Phase,
    pub(super) name: Option<String>,
    pub(super) firmware: Option<String>,
    pub(super) error: Option<&'a Trouble>,
    pub(super) cycle_ms: f64,
    pub(super) histogram: &'a [u64],
    pub(super) cycles: u64,
    pub(super) late: u64,
    pub(super) gaps: u64,
}

#[derive(Serialize)]
pub(super) struct AreaState {
    name: String,
    alive: bool,
    inputs: Vec<InputState>,
    counters: Vec<CounterState>,
    motors: Vec<MotorState>,
    remotes: Vec<RemoteState>,
    sound: SoundState,
    microphone: [u16; 2],
}

#[derive(Serialize)]
struct InputState {
    mode: &'static str,
    digital: bool,
    value: i16,
    unit: &'static str,
    overrun: bool,
}

#[derive(Serialize)]
struct CounterState {
    mode: &'static str,
    value: u16,
    level: bool,
    resetting: bool,
}

#[derive(Serialize)]
struct MotorState {
    outputs: bool,
    duty: [i16; 2],
    distance: u16,
    done: u16,
    ready: bool,
    with: Option<u8>,
}

#[derive(Serialize)]
struct SoundState {
    index: u16,
    repeat: u16,
    playing: bool,
}

#[derive(Serialize)]
struct RemoteState {
    left_x: i16,
    left_y: i16,
    right_x: i16,
    right_y: i16,
    on: bool,
    off: bool,
    dip1: bool,
    dip2: bool,
}

/// The areas of a controller and its extensions.
pub(super) fn areas(areas: &[FishX1Transfer], running: bool) -> Vec<AreaState> {
    let Some(master) = areas.first() else { return Vec::new() };
    let extensions = master.state.io_slave_alive.map(|alive| alive != 0);
    let alive = std::iter::once(true).chain(extensions);
    let state = |(index, (area, alive))| area_state(index, area, running && alive);
    areas.iter().zip(alive).enumerate().map(state).collect()
}

fn area_state(index: usize, area: &FishX1Transfer, alive: bool) -> AreaState {
    AreaState {
        name: if index == 0 { "TXT".to_owned() } else { format!("E{index}") },
        alive,
        inputs: Input::ALL.map(|input| input_state(area, input)).into(),
        counters: Counter::ALL.map(|counter| counter_state(area, counter)).into(),
        motors: Motor::ALL.map(|motor| motor_state(area, motor)).into(),
        remotes: area.txt_inputs.ir_input.iter().map(remote_state).collect(),
        sound: SoundState {
            index: area.txt_outputs.sound_index,
            repeat: area.txt_outputs.sound_repeat,
            playing: !area.is_sound_ready(),
        },
        microphone: [area.get_mic_lin(), area.get_mic_log()],
    }
}

fn input_state(area: &FishX1Transfer, input: Input) -> InputState {
    let config = area.config.uni[input.index()];
    let (mode, unit) = match InputMode::try_from(config.mode) {
        Ok(InputMode::Voltage) => ("voltage", "mV"),
        Ok(InputMode::Resistance) => ("resistance", "Ω"),
        Ok(InputMode::Resistance15k) => ("resistance15k", "Ω"),
        Ok(InputMode::Ultrasonic) => ("ultrasonic", "cm"),
        _ => ("", ""),
    };
    let digital = config.digital != 0;
    let value = area.get_in_io_value(input);
    let unit = if digital { "" } else { unit };
    InputState { mode, digital, value: value.value, unit, overrun: value.over_range }
}

fn counter_state(area: &FishX1Transfer, counter: Counter) -> CounterState {
    let inverted = area.config.cnt[counter.index()].mode == u8::from(CounterMode::Inverted);
    CounterState {
        mode: if inverted { "inverted" } else { "normal" },
        value: area.get_in_cnt_count(counter),
        level: area.get_in_cnt_state(counter),
        resetting: !area.is_cnt_reset_ready(counter),
    }
}

fn motor_state(area: &FishX1Transfer, motor: Motor) -> MotorState {
    let index = motor.index();
    let distance = area.output.distance[index];
    // A command with a distance resets the motor's counter.
    let done = if distance == 0 { 0 } else { area.get_in_cnt_count(motor.counter()) };
    MotorState {
        outputs: area.config.motor[index] == 0,
        duty: motor.outputs().map(|output| area.output.duty[output.index()]),
        distance,
        done,
        ready: area.is_motor_ex_ready(motor),
        // Motors are counted from 1; with 5 on there is an injected error, too.
        with: area.output.master[index].checked_sub(1).map(|master| master % 4),
    }
}

fn remote_state(remote: &IrInput) -> RemoteState {
    RemoteState {
        left_x: remote.joy_left_x,
        left_y: remote.joy_left_y,
        right_x: remote.joy_right_x,
        right_y: remote.joy_right_y,
        on: remote.button_on != 0,
        off: remote.button_off != 0,
        dip1: remote.dip_switch_1 != 0,
        dip2: remote.dip_switch_2 != 0,
    }
}
