//! What is plugged into one controller: in a file, at the start, and at present.

use std::collections::{BTreeMap, BTreeSet};

use ft_transfer_area::transfer_area::{DUTY_MAX, IZ_MOTOR};
use ft_transfer_area::tx::{Input, Motor, Output};
use toml::de::DeValue;

use super::input;
use super::lamp::LampColour;
use super::mistake::{at, expect, Checked};
use super::motor_model::MotorModel;
use super::read::{list, map, terminal, terminal_value, Keys, Read};
use super::sensor::Sensor;
use super::shaft::Shaft;
use super::slide::Slide;
use crate::machine::controller::Controller;
use crate::machine::motor::Pulses;

const BOARD: &str = "expected a table, as in [master]";
const INPUTS: &str = "expected a table, as in [master.inputs]";
const MOTORS: &str = "expected a table, as in [master.motors.M1]";
const LAMPS: &str = "expected a list, as in lamps = [\"O7\"], or a table with colours";

/// What is plugged into one controller.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Board {
    /// The sensors. The other inputs are empty.
    pub inputs: BTreeMap<Input, Sensor>,
    /// The motors.
    pub motors: BTreeMap<Motor, MotorModel>,
    /// The lamps, on terminals that no motor uses.
    pub lamps: BTreeSet<Output>,
    /// The colours of lamps, for pages; a lamp without one is like a bulb.
    pub lamp_colours: BTreeMap<Output, LampColour>,
}

impl Board {
    /// Plugs a sensor into this input, in place of an earlier one.
    pub fn input(mut self, input: Input, sensor: Sensor) -> Self {
        self.inputs.insert(input, sensor);
        self
    }

    /// Plugs a motor into this output, in place of an earlier one.
    pub fn motor(mut self, output: Motor, motor: MotorModel) -> Self {
        self.motors.insert(output, motor);
        self
    }

    /// Plugs a lamp into this output, which must not be a terminal of a motor.
    pub fn lamp(mut self, output: Output) -> Self {
        self.lamps.insert(output);
        self
    }

    /// Plugs a lamp with a coloured cap into this output, which must not be a terminal of a motor.
    pub fn coloured_lamp(mut self, output: Output, colour: LampColour) -> Self {
        self.lamp_colours.insert(output, colour);
        self.lamp(output)
    }

    pub(super) fn read(value: &DeValue<'_>) -> Read<Self> {
        let keys = Keys::of(value, BOARD, &["inputs", "motors", "lamps"])?;
        let inputs = |value: &DeValue<'_>| {
            map(value, INPUTS, |name| terminal(&Input::ALL, name), Sensor::read)
        };
        let motors = |value: &DeValue<'_>| {
            map(value, MOTORS, |name| terminal(&Motor::ALL, name), MotorModel::read)
        };
        let (lamps, lamp_colours) = keys.optional("lamps", read_lamps)?.unwrap_or_default();
        Ok(Self {
            inputs: keys.optional("inputs", inputs)?.unwrap_or_default(),
            motors: keys.optional("motors", motors)?.unwrap_or_default(),
            lamps,
            lamp_colours,
        })
    }

    pub(super) fn check(&self) -> Checked {
        for (input, sensor) in &self.inputs {
            at("inputs", at(input, sensor.check()))?;
        }
        for (output, motor) in &self.motors {
            at("motors", at(output, motor.check()))?;
        }
        for lamp in &self.lamps {
            let motor = lamp.motor();
            let reason = || format!("{lamp} is a terminal of the motor on {motor}");
            at("lamps", at(lamp, expect(!self.motors.contains_key(&motor), reason)))?;
        }
        for lamp in self.lamp_colours.keys() {
            let reason = || format!("there is no lamp on {lamp}");
            at("lamps", at(lamp, expect(self.lamps.contains(lamp), reason)))?;
        }
        Ok(())
    }
}

/// A list of lamps, or a table of them with their colours.
fn read_lamps(value: &DeValue<'_>) -> Read<(BTreeSet<Output>, BTreeMap<Output, LampColour>)> {
    if value.as_table().is_none() {
        let lamps = list(LAMPS, terminal_value(&Output::ALL))(value)?;
        return Ok((lamps.into_iter().collect(), BTreeMap::new()));
    }
    let colours = map(value, LAMPS, |name| terminal(&Output::ALL, name), LampColour::read)?;
    Ok((colours.keys().copied().collect(), colours))
}

/// What is plugged into one controller, and its present state.
#[derive(Clone, Debug, Default)]
pub(super) struct BoardState {
    pub(super) inputs: BTreeMap<Input, Sensor>,
    pub(super) shafts: [Option<Shaft>; IZ_MOTOR],
    /// The brightness of each lamp, 0.0..=1.0.
    pub(super) lamps: BTreeMap<Output, f64>,
}

impl BoardState {
    pub(super) fn new(board: &Board) -> Self {
        let shaft = |output| board.motors.get(&output).map(Shaft::new);
        let mut state = Self {
            inputs: board.inputs.clone(),
            shafts: Motor::ALL.map(shaft),
            lamps: board.lamps.iter().map(|output| (*output, 0.0)).collect(),
        };
        state.move_sensors();
        state
    }

    /// Stops all motors and switches all lamps off.
    pub(super) fn halt(&mut self) {
        self.shafts.iter_mut().flatten().for_each(Shaft::halt);
        self.lamps.values_mut().for_each(|brightness| *brightness = 0.0);
    }

    /// Lets the motors turn with the power from their controller, for one tick, or for more if they have no inertia and
    /// no task.
    pub(super) fn turn(&mut self, controller: &mut Controller, ticks: u64) {
        let turning = self.shafts.each_ref().map(|shaft| shaft.as_ref().map(Shaft::turning));
        let powers = controller.powers(turning.map(Option::unwrap_or_default));
        let mut pulses = [Pulses::default(); IZ_MOTOR];
        for ((shaft, power), pulses) in self.shafts.iter_mut().zip(powers).zip(&mut pulses) {
            *pulses = shaft.as_mut().map_or(Pulses::default(), |shaft| shaft.turn(power, ticks));
        }
        controller.count(pulses);
    }

    /// Whether no motor has turned in the last tick.
    pub(super) fn is_at_rest(&self) -> bool {
        self.shafts.iter().flatten().all(|shaft| shaft.speed() == 0.0)
    }

    /// Updates the controller's inputs and the brightness of the lamps.
    pub(super) fn show(&mut self, controller: &mut Controller) {
        self.move_sensors();
        for (output, brightness) in &mut self.lamps {
            let duty = controller.effective_duty(output.index());
            *brightness = f64::from(duty) / f64::from(DUTY_MAX);
        }
        for input in Input::ALL {
            let config = controller.config.uni[input.index()];
            controller.uni[input.index()] = input::report(self.inputs.get(&input), config);
        }
    }

    /// Its motor whose slide sets what is plugged in on this input, without the switches along its travel.
    pub(super) fn moved_by(&self, input: Input) -> Option<Motor> {
        let sensor = self.inputs.get(&input)?;
        Motor::ALL.into_iter().find(|motor| {
            let shaft = self.shafts[motor.index()].as_ref();
            let mut moved = shaft.and_then(Shaft::slide).into_iter().flat_map(Slide::moved_inputs);
            moved.any(|(key, moved)| moved == input && sensor.is_moved_as(key))
        })
    }

    /// Sets the sensors that look at slides to the present distances.
    fn move_sensors(&mut self) {
        for shaft in self.shafts.iter().flatten() {
            let Some(Slide { start_switch, end_switch, seen_by, .. }) = shaft.slide() else {
                continue;
            };
            for (input, at_stop) in [start_switch, end_switch].into_iter().zip(shaft.at_stops()) {
                let sensor = input.and_then(|input| self.inputs.get_mut(&input));
                if let Some(pressed) = sensor.and_then(Sensor::pressed_mut) {
                    *pressed = at_stop;
                }
            }
            let sensor = seen_by.and_then(|seen_by| self.inputs.get_mut(&seen_by.input));
            if let (Some(Sensor::Ultrasonic { cm }), Some(seen_at)) = (sensor, shaft.seen_at()) {
                *cm = seen_at;
            }
        }
    }
}
