//! What the controller had at one exchange.

use std::time::Duration;

use ft_transfer_area::tx::{Motor, Output};
use ft_transfer_area_simulator::Machine;

/// The outputs and the positions of slides at one exchange.
#[derive(Clone, Copy, Debug)]
pub(super) struct Moment {
    /// The time of the machine.
    pub(super) at: Duration,
    duty: [i16; 8],
    /// How far the slide of each motor has gone, in pulses; 0 without one.
    ways: [f64; 4],
}

impl Moment {
    pub(super) fn of(machine: &Machine) -> Self {
        let way = |motor| machine.world().and_then(|world| world.slide(0, motor)).unwrap_or(0.0);
        let duty = machine.controllers[0].outputs.duty;
        Self { at: machine.time(), duty, ways: Motor::ALL.map(way) }
    }

    /// The duty of an output, 0 to 512.
    pub(super) fn duty(&self, output: Output) -> i16 {
        self.duty[output.index()]
    }

    pub(super) fn is_on(&self, output: Output) -> bool {
        self.duty(output) > 0
    }

    /// The power of a motor, -512 to 512.
    pub(super) fn motor(&self, motor: Motor) -> i16 {
        let [first, second] = motor.outputs();
        self.duty(first).saturating_sub(self.duty(second))
    }

    /// Whether both outputs of the motor are on, which turns it in no direction.
    pub(super) fn is_torn(&self, motor: Motor) -> bool {
        motor.outputs().into_iter().all(|output| self.is_on(output))
    }

    /// How far the slide of this motor has gone.
    pub(super) fn way(&self, motor: Motor) -> f64 {
        self.ways[motor.index()]
    }

    /// The outputs that are on, as in "O3, O4"; empty when all are off.
    pub(super) fn outputs_on(&self) -> String {
        let on = Output::ALL.into_iter().filter(|output| self.is_on(*output));
        on.map(|output| output.to_string()).collect::<Vec<_>>().join(", ")
    }
}
