//! The present state of what is plugged into one controller.

use std::collections::BTreeMap;

use super::motor_model::Slide;
use super::sensor::{self, Sensor};
use super::shaft::Shaft;
use super::Board;
use crate::controller::Controller;
use ft_transfer_area::transfer_area::{DUTY_MAX, IZ_MOTOR};
use ft_transfer_area::tx::{Input, Motor, Output};

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

    /// Lets the motors turn for one tick with the power from their controller.
    pub(super) fn tick(&mut self, controller: &mut Controller) {
        let rates =
            self.shafts.each_ref().map(|shaft| shaft.as_ref().map_or(0.0, Shaft::pulse_rate));
        let powers = controller.powers(rates);
        let mut pulses = [0; IZ_MOTOR];
        for ((shaft, power), pulses) in self.shafts.iter_mut().zip(powers).zip(&mut pulses) {
            *pulses = shaft.as_mut().map_or(0, |shaft| shaft.turn(power));
        }
        controller.count(pulses);
    }

    /// Updates the controller's inputs and the brightness of the lamps.
    pub(super) fn show(&mut self, controller: &mut Controller) {
        self.move_sensors();
        for (output, brightness) in &mut self.lamps {
            let duty = controller.outputs.duty[output.index()];
            *brightness = f64::from(duty.clamp(0, DUTY_MAX)) / f64::from(DUTY_MAX);
        }
        for input in Input::ALL {
            let config = controller.config.uni[input.index()];
            controller.uni[input.index()] = sensor::report(self.inputs.get(&input), config);
        }
    }

    /// The motor whose slide sets what is plugged in here.
    pub(super) fn moved_by(&self, input: Input) -> Option<Motor> {
        let sensor = self.inputs.get(&input)?;
        Motor::ALL.into_iter().find(|motor| {
            let shaft = self.shafts[motor.index()].as_ref();
            shaft.and_then(Shaft::slide).is_some_and(|slide| match sensor {
                Sensor::Switch { .. } | Sensor::Button { .. } => {
                    [slide.start_switch, slide.end_switch].contains(&Some(input))
                }
                Sensor::Ultrasonic { .. } => {
                    slide.seen_by.is_some_and(|seen_by| seen_by.input == input)
                }
                _ => false,
            })
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
