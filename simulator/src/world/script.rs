//! What happens in a world by itself.

use ft_transfer_area::tx::Input;
use toml::de::DeValue;

use super::check::SetInputs;
use super::i2c_device::{self, DEVICE};
use super::mistake::{at, each, expect, not_negative, Checked, Mistake};
use super::plug::CONTROLLERS;
use super::read::{list, number, terminal_value, text, truth, whole, Keys, Read};
use super::shaft::TICK_MICROS;
use super::{Board, Piece, Remote, Sensor, World};

const SCRIPT: &str = "expected a table, as in [script]";
const EVENTS: &str = "expected a list, as in [[script.events]]";
const EVENT: &str = "expected an event, as in { at = 1, input = \"I3\", pressed = true }";

/// What happens at which time.
///
/// ```
/// use ft_transfer_area_simulator::world::{Script, ScriptEvent};
/// use ft_transfer_area::tx::Input;
///
/// let script = Script::default()
///     .event(ScriptEvent::press(0.5, 0, Input::I1, true))
///     .event(ScriptEvent::press(1.5, 0, Input::I1, false))
///     .period(2.0);
/// assert_eq!(script.events.len(), 2);
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Script {
    /// After this many seconds it begins again, at least 0.001; `None` when it is played once.
    pub period: Option<f64>,
    /// What happens, in any order.
    pub events: Vec<ScriptEvent>,
}

impl Script {
    /// Repeats the script with this period in seconds, at least 0.001.
    pub fn period(mut self, seconds: f64) -> Self {
        self.period = Some(seconds);
        self
    }

    /// Adds an event.
    pub fn event(mut self, event: ScriptEvent) -> Self {
        self.events.push(event);
        self
    }

    pub(super) fn read(value: &DeValue<'_>) -> Read<Self> {
        let keys = Keys::of(value, SCRIPT, &["period", "events"])?;
        Ok(Self {
            period: keys.optional("period", number)?,
            events: keys.or("events", Vec::new(), list(EVENTS, ScriptEvent::read))?,
        })
    }

    /// The inputs are those that something else in the world sets.
    pub(super) fn check(&self, world: &World, set: &SetInputs) -> Checked {
        let period = self.period.unwrap_or(1.0);
        let right = period >= 0.001 && period.is_finite();
        at("period", expect(right, || format!("expected 0.001 or more, not {period}")))?;
        each("events", &self.events, |event| event.check(world, set))
    }
}

/// Something that happens at some time.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct ScriptEvent {
    /// The machine time in seconds since the start, or since the script began again; at least 0, and at
    /// least 0.001 less than the period. It is rounded to milliseconds.
    pub at: f64,
    /// What happens.
    pub action: ScriptAction,
}

/// What happens at an event.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum ScriptAction {
    /// A button or switch is pressed or released.
    Press {
        /// The controller: 0 the master, 1..=8 an extension.
        controller: usize,
        /// Where the button or switch is plugged in.
        input: Input,
        /// Whether it is pressed from then on, or released.
        pressed: bool,
    },
    /// A sensor measures something else. The world has to have a sensor of this kind there.
    Sensor {
        /// The controller: 0 the master, 1..=8 an extension.
        controller: usize,
        /// Where the sensor is plugged in.
        input: Input,
        /// The sensor with what it measures from then on.
        sensor: Sensor,
    },
    /// A new workpiece or container is put at a place, or a workpiece into the container there.
    Put {
        /// What is put there.
        piece: Piece,
        /// The name of the place.
        place: String,
    },
    /// The infrared remote with the same switch setting sends this from then on. It has to be one of
    /// the world's remotes.
    Remote(Remote),
    /// Registers of an I2C device get other values, if it is plugged in. It has to be one of the
    /// world's devices.
    I2c {
        /// The address of the device, 0..=127.
        address: u8,
        /// The first register.
        register: u8,
        /// The values for it and the following registers. After register 255 comes 0.
        values: Vec<u8>,
    },
}

impl ScriptEvent {
    /// At this time, in seconds, a button or switch is pressed or released. The controller is 0 for the
    /// master, 1..=8 for an extension.
    pub fn press(at: f64, controller: usize, input: Input, pressed: bool) -> Self {
        Self { at, action: ScriptAction::Press { controller, input, pressed } }
    }

    /// At this time, in seconds, a sensor begins to measure this. The controller is 0 for the master,
    /// 1..=8 for an extension.
    pub fn sensor(at: f64, controller: usize, input: Input, sensor: Sensor) -> Self {
        Self { at, action: ScriptAction::Sensor { controller, input, sensor } }
    }

    /// At this time, in seconds, a new workpiece or container is put at a place.
    pub fn put(at: f64, piece: Piece, place: &str) -> Self {
        Self { at, action: ScriptAction::Put { piece, place: place.to_owned() } }
    }

    /// At this time, in seconds, the remote with the same switch setting begins to send this.
    pub fn remote(at: f64, remote: Remote) -> Self {
        Self { at, action: ScriptAction::Remote(remote) }
    }

    /// At this time, in seconds, this register of an I2C device and the following ones get these values.
    pub fn i2c(at: f64, address: u8, register: u8, values: &[u8]) -> Self {
        Self { at, action: ScriptAction::I2c { address, register, values: values.to_vec() } }
    }

    fn read(value: &DeValue<'_>) -> Read<Self> {
        let known =
            ["at", "controller", "input", "pressed", "sensor", "remote", "i2c", "piece", "place"];
        let all = Keys::of(value, EVENT, &known)?;
        let at = all.required("at", number)?;
        // Each kind has its own keys besides the time.
        let action = if all.has("remote") {
            let keys = Keys::of(value, EVENT, &["at", "remote"])?;
            ScriptAction::Remote(keys.required("remote", Remote::read)?)
        } else if all.has("i2c") {
            Keys::of(value, EVENT, &["at", "i2c"])?.required("i2c", ScriptAction::read_i2c)?
        } else if all.has("piece") {
            let keys = Keys::of(value, EVENT, &["at", "piece", "place"])?;
            ScriptAction::Put {
                piece: keys.required("piece", Piece::read)?,
                place: keys.required("place", text)?,
            }
        } else if all.has("sensor") {
            let keys = Keys::of(value, EVENT, &["at", "controller", "input", "sensor"])?;
            ScriptAction::Sensor {
                controller: keys.or("controller", 0, whole(0..=CONTROLLERS))?,
                input: keys.required("input", terminal_value(&Input::ALL))?,
                sensor: keys.required("sensor", Sensor::read)?,
            }
        } else {
            ScriptAction::Press {
                controller: all.or("controller", 0, whole(0..=CONTROLLERS))?,
                input: all.required("input", terminal_value(&Input::ALL))?,
                pressed: all.required("pressed", truth)?,
            }
        };
        Ok(Self { at, action })
    }

    fn check(&self, world: &World, set: &SetInputs) -> Checked {
        let time = self.at;
        not_negative("at", time)?;
        if let Some(period) = world.script.period {
            // Rounded to the period, it would never happen.
            let reason = || format!("expected at least 0.001 less than the period, {period}");
            at("at", expect(ticks(time) < ticks(period), reason))?;
        }
        match &self.action {
            ScriptAction::Press { controller, input, .. } => {
                check_press(world, *controller, *input)?;
                check_free(world, set, *controller, *input)
            }
            ScriptAction::Sensor { controller, input, sensor } => {
                at("sensor", sensor.check())?;
                check_sensor(world, *controller, *input, sensor)?;
                check_free(world, set, *controller, *input)
            }
            // Whether there is such a place is known when all names are.
            ScriptAction::Put { .. } => Ok(()),
            ScriptAction::Remote(remote) => {
                let known = world.remotes.iter().any(|known| known.is_set_like(remote));
                let reason = || String::from("expected dip1 and dip2 of a remote in this world");
                at("remote", remote.check().and_then(|()| expect(known, reason)))
            }
            ScriptAction::I2c { address, .. } => {
                let known = world.i2c.iter().any(|device| device.address == *address);
                let reason = || format!("expected a device of this world, not {address:#04x}");
                at("i2c", at("address", expect(known, reason)))
            }
        }
    }
}

/// A time in ticks. One out of range is never due.
fn ticks(seconds: f64) -> u64 {
    (seconds * 1e6 / TICK_MICROS as f64).round() as u64
}

/// A script in ticks.
#[derive(Clone, Debug)]
pub(super) struct ScriptState {
    period: Option<u64>,
    /// What happens at which tick, in order.
    events: Vec<(u64, ScriptAction)>,
}

impl ScriptState {
    pub(super) fn new(script: &Script) -> Self {
        let events = script.events.iter();
        let mut events: Vec<_> =
            events.map(|event| (ticks(event.at), event.action.clone())).collect();
        // Events at the same time keep their order.
        events.sort_by_key(|event| event.0);
        Self { period: script.period.map(|period| ticks(period).max(1)), events }
    }

    /// What happens at the beginning of a tick.
    pub(super) fn due(&self, tick: u64) -> impl Iterator<Item = &ScriptAction> {
        let now = self.period.map_or(tick, |period| tick % period);
        let first = self.events.partition_point(|event| event.0 < now);
        let due = self.events[first..].iter().take_while(move |event| event.0 == now);
        due.map(|(_, action)| action)
    }
}

fn check_press(world: &World, controller: usize, input: Input) -> Checked {
    let board = board(world, controller)?;
    let presses = board.inputs.get(&input).is_some_and(Sensor::is_pressable);
    at("input", expect(presses, || format!("expected a button or switch on {input}")))
}

fn check_sensor(world: &World, controller: usize, input: Input, sensor: &Sensor) -> Checked {
    let board = board(world, controller)?;
    let kind = sensor.kind();
    let known = board.inputs.get(&input).is_some_and(|plugged| plugged.kind() == kind);
    at("input", expect(known, || format!("expected a sensor of the kind {kind} on {input}")))
}

fn board(world: &World, controller: usize) -> Result<&Board, Mistake> {
    world.board(controller).ok_or_else(|| {
        let reason = format!("expected a controller of this world, not {controller}");
        Mistake::new(reason).within("controller")
    })
}

/// Checks that nothing else in the world sets what is plugged in here.
fn check_free(world: &World, set: &SetInputs, controller: usize, input: Input) -> Checked {
    if !set.contains(&(controller, input)) {
        return Ok(());
    }
    let setter = world.setter(controller, input);
    at("input", setter.map_or(Ok(()), |setter| Err(Mistake::new(format!("{input} is {setter}")))))
}

impl ScriptAction {
    fn read_i2c(value: &DeValue<'_>) -> Read<Self> {
        let keys = Keys::of(value, DEVICE, &["address", "register", "values"])?;
        let address = keys.required("address", i2c_device::address())?;
        let (register, values) = i2c_device::register_keys(&keys)?;
        Ok(Self::I2c { address, register, values })
    }
}
