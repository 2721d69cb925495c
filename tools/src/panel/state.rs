//! What a page learns about a controller.

use std::sync::Arc;
use std::time::Duration;

use ft_transfer_area::tx::{Counter, Input, Motor};
use ft_transfer_area::FishX1Transfer;
use serde::Serialize;
use tokio::sync::watch;

use super::camera::CameraState;
use super::course::Progress;
use super::problem::Problem;
use super::world::WorldReport;
use crate::commands::Pair;
use crate::recording::on_demand::RecordingState;
use crate::values::{CounterValue, InputValue, RemoteValue, SoundValue};

/// How often the state is published.
pub(super) const STATE_PERIOD: Duration = Duration::from_millis(50);

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
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) watched: Option<WatchedState<'a>>,
    /// How far the pupil is in a lesson.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) lesson: Option<Progress>,
    /// Where it can be recorded.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) recording: Option<RecordingState>,
}

impl HostState<'_> {
    /// Tells all pages.
    pub(super) fn publish(&self, to: &watch::Sender<Newest>) {
        match serde_json::to_string(self) {
            Ok(text) => drop(to.send_replace(Some(inner(&text)))),
            Err(error) => log::error!("the state can't be written: {error}"),
        }
    }
}

/// The newest state of a controller without the braces around it, `None` before the first.
pub(crate) type Newest = Option<Arc<str>>;

/// The members of an object, without its braces.
fn inner(object: &str) -> Arc<str> {
    Arc::from(object.trim_start_matches('{').strip_suffix('}').unwrap_or_default())
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Phase {
    Connecting,
    /// No program is connected to a simulated TXT that others drive.
    Idle,
    Running,
    Gap,
    /// What passes is not understood.
    Unclear,
}

#[derive(Serialize)]
pub(super) struct Link<'a> {
    pub(super) phase: Phase,
    pub(super) name: Option<String>,
    pub(super) firmware: Option<String>,
    pub(super) error: Option<&'a Problem>,
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
    inputs: Vec<InputValue>,
    counters: Vec<CounterValue>,
    motors: Vec<MotorState>,
    remotes: Vec<RemoteValue>,
    sound: SoundValue,
    microphone: [u16; 2],
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

/// What a page shows only of a controller that is watched.
#[derive(Serialize)]
pub(super) struct WatchedState<'a> {
    /// Another one with each program that is shown.
    pub(super) program: u64,
    /// `None` before the first.
    pub(super) answer: Option<AnswerState>,
    /// Commands that were not an exchange.
    pub(super) commands: u64,
    pub(super) i2c: Option<I2cState>,
    /// Whether programs are refused.
    pub(super) shut: bool,
    /// What is told of a connection that need not be the program's.
    pub(super) beside: Option<&'a Problem>,
}

/// How long the program took from a response to its next request, in ms.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(super) struct AnswerState {
    pub(super) last: f64,
    /// Of the last few hundred.
    pub(super) median: f64,
    pub(super) longest: f64,
}

#[derive(Serialize)]
pub(super) struct I2cState {
    pub(super) device: u32,
    pub(super) written: Vec<u8>,
    pub(super) read: Option<Vec<u8>>,
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
        inputs: Input::ALL.map(|input| InputValue::of(area, input)).into(),
        counters: Counter::ALL.map(|counter| CounterValue::of(area, counter)).into(),
        motors: Motor::ALL.map(|motor| motor_state(area, motor)).into(),
        remotes: area.txt_inputs.ir_input.iter().map(RemoteValue::from).collect(),
        sound: SoundValue::of(area),
        microphone: [area.get_mic_lin(), area.get_mic_log()],
    }
}

fn motor_state(area: &FishX1Transfer, motor: Motor) -> MotorState {
    let index = motor.index();
    let distance = area.output.distance[index];
    // A command with a distance resets the motor's counter.
    let done = if distance == 0 { 0 } else { area.get_in_cnt_count(motor.counter()) };
    MotorState {
        outputs: Pair::of(area, motor) == Pair::Outputs,
        duty: motor.outputs().map(|output| area.output.duty[output.index()]),
        distance,
        done,
        ready: area.is_motor_ex_ready(motor),
        // Motors are counted from 1; with 5 on there is an injected error, too.
        with: area.output.master[index].checked_sub(1).map(|master| master % 4),
    }
}
