//! What the controller had at one exchange.

use std::time::{Duration, Instant};

use ft_transfer_area::tx::{Counter, Motor, Output};
use ft_transfer_area_simulator::Machine;

/// How much of a pause between two exchanges certainly was the program's time. They come each 10 ms; in a longer pause
/// the computer may have stood still, and the program with it.
const COUNTED: Duration = Duration::from_millis(50);

/// The outputs and the positions of slides at one exchange.
#[derive(Clone, Copy, Debug)]
pub(super) struct Moment {
    /// The time of the machine.
    pub(super) at: Duration,
    /// The time of the clock, which goes on when the machine waits for a program that stands still.
    pub(super) clock: Instant,
    /// The time without what was too long in the pauses between exchanges.
    pub(super) counted: Duration,
    /// The number of the connection that it came on.
    pub(super) connection: u64,
    duty: [i16; 8],
    /// How far the slide of each motor has gone, in pulses; 0 without one.
    ways: [f64; 4],
    /// What C1 to C4 have counted.
    counts: [i16; 4],
}

impl Moment {
    /// The present one, after `before`.
    pub(super) fn of(machine: &Machine, before: Option<&Self>) -> Self {
        let way = |motor| machine.world().and_then(|world| world.slide(0, motor)).unwrap_or(0.0);
        let controller = &machine.controllers[0];
        let (duty, counts) = (controller.outputs.duty, controller.counter);
        let at = machine.time();
        let counted = before.map_or(Duration::ZERO, |before| {
            before.counted + at.saturating_sub(before.at).min(COUNTED)
        });
        let (clock, connection) = (Instant::now(), machine.connections());
        Self { at, clock, counted, connection, duty, ways: Motor::ALL.map(way), counts }
    }

    /// How long it took from an earlier moment to this one.
    pub(super) fn since(&self, earlier: &Self) -> Lasted {
        Lasted {
            least: self.counted.saturating_sub(earlier.counted).as_secs_f64(),
            most: self.clock.saturating_duration_since(earlier.clock).as_secs_f64(),
        }
    }

    /// The duty of an output, 0 to 512.
    pub(super) fn duty(&self, output: Output) -> i16 {
        self.duty[output.index()]
    }

    pub(super) fn is_on(&self, output: Output) -> bool {
        self.duty(output) > 0
    }

    pub(super) fn all_off(&self) -> bool {
        self.duty == [0; 8]
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

    /// What this counter has counted.
    pub(super) fn count(&self, counter: Counter) -> i16 {
        self.counts[counter.index()]
    }

    /// The outputs that are on, as in "O3, O4"; empty when all are off.
    pub(super) fn outputs_on(&self) -> String {
        let on = Output::ALL.into_iter().filter(|output| self.is_on(*output));
        on.map(|output| output.to_string()).collect::<Vec<_>>().join(", ")
    }
}

/// How long something lasted, in seconds. When the computer stood still meanwhile, the time for the program is somewhere
/// between the two.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Lasted {
    pub(super) least: f64,
    pub(super) most: f64,
}

impl Lasted {
    /// The time if it is certainly shorter or longer than this.
    pub(super) fn outside(self, least: f64, most: f64) -> Option<f64> {
        if self.least > most {
            return Some(self.least);
        }
        (self.most < least).then_some(self.most)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_time_in_which_the_computer_stood_still_is_not_certain() {
        let lasted = |least, most| Lasted { least, most }.outside(0.3, 0.8);
        assert_eq!(lasted(0.5, 0.5), None);
        assert_eq!(lasted(0.51, 0.97), None);
        assert_eq!(lasted(0.1, 0.4), None);
        assert_eq!(lasted(0.97, 0.98), Some(0.97));
        assert_eq!(lasted(0.1, 0.2), Some(0.2));
    }

    #[test]
    fn a_long_pause_between_two_exchanges_counts_little() {
        let mut machine = Machine::new(0);
        let first = Moment::of(&machine, None);
        machine.step(Duration::from_millis(10));
        let second = Moment::of(&machine, Some(&first));
        machine.step(Duration::from_millis(700));
        let third = Moment::of(&machine, Some(&second));
        assert_eq!(third.since(&first).least, 0.06);
    }
}
