//! Motors that should turn while their counters do not change.

use std::time::{Duration, Instant};

use super::comparison::Comparison;
use super::event::Event;
use crate::exchange::Outgoing;
use crate::terminals::Motor;
use crate::transfer_area::{IZ_MOTOR, LOCAL_IO, MAX_AREAS};
use crate::wire::ExchangeDataResponse;

/// Which motors are watched, and since when each of them stands still.
#[derive(Debug, Default)]
pub(crate) struct Stalls {
    motors: [[Watched; IZ_MOTOR]; MAX_AREAS],
    /// The last response that was checked; a standstill goes on only from one response to the next.
    response: u64,
}

#[derive(Clone, Copy, Debug)]
struct Watched {
    /// [`Duration::MAX`] if the motor is not watched.
    limit: Duration,
    standstill: Option<Standstill>,
}

impl Default for Watched {
    fn default() -> Self {
        Self { limit: Duration::MAX, standstill: None }
    }
}

/// A motor that should turn but has not done so since then.
#[derive(Clone, Copy, Debug)]
struct Standstill {
    order: Order,
    count: i16,
    since: Instant,
    reported: bool,
}

/// What a motor should do. Another duty in the same direction is the same order, because a control loop
/// changes it all the time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Order {
    forward: bool,
    command_id: u16,
}

impl Order {
    /// What was sent to a motor; `None` if it should not turn, or not any more.
    fn new(sent: &Outgoing, now: &ExchangeDataResponse, motor: Motor) -> Option<Self> {
        let index = motor.index();
        let [plus, minus] = [2 * index, 2 * index + 1].map(|pin| sent.output.duty[pin]);
        let command_id = sent.output.motor_ex_cmd_id[index];
        let has_arrived =
            sent.output.distance[index] != 0 && now.motor_command_id[index] == command_id;
        // Two equal pins are a brake.
        (plus != minus && !has_arrived).then_some(Self { forward: plus > minus, command_id })
    }
}

impl Stalls {
    /// Sets the limit for a motor; with [`Duration::MAX`] it is not watched.
    pub(crate) fn set_limit(&mut self, area: usize, motor: Motor, limit: Duration) {
        if let Some(motors) = self.motors.get_mut(area) {
            motors[motor.index()] = Watched { limit, standstill: None };
        }
    }

    /// Checks a response that came in at this time, and reports motors that have not turned for their limits.
    pub(crate) fn look(
        &mut self,
        comparison: &Comparison<'_>,
        response: u64,
        arrived: Instant,
        mut send: impl FnMut(Event),
    ) {
        let is_next = self.response + 1 == response && !comparison.first;
        self.response = response;
        for (area, (sent, motors)) in comparison.sent.iter().zip(&mut self.motors).enumerate() {
            let takes_part = area == LOCAL_IO || comparison.now.alive() >> (area - 1) & 1 != 0;
            let now = comparison.now.area(area).filter(|_| takes_part);
            for (motor, watched) in Motor::ALL.into_iter().zip(motors) {
                if watched.limit == Duration::MAX {
                    continue;
                }
                let order = now.and_then(|now| Some((now, Order::new(sent, now, motor)?)));
                let Some((now, order)) = order else {
                    watched.standstill = None;
                    continue;
                };
                let count = now.counter[motor.counter().index()];
                let goes_on =
                    |before: &Standstill| is_next && before.order == order && before.count == count;
                let mut standstill = watched.standstill.filter(goes_on).unwrap_or(Standstill {
                    order,
                    count,
                    since: arrived,
                    reported: false,
                });
                if !standstill.reported && arrived - standstill.since >= watched.limit {
                    standstill.reported = true;
                    send(Event::MotorStalled { area, motor, position: count as u16 });
                }
                watched.standstill = Some(standstill);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::exchange::{Inputs, SentConfigs};

    const LIMIT: Duration = Duration::from_millis(50);
    const STEP: Duration = Duration::from_millis(10);

    /// A machine whose M2 is watched, one response after the other.
    struct Machine {
        stalls: Stalls,
        response: u64,
        now: Instant,
        sent: Outgoing,
        pair: ExchangeDataResponse,
        first: bool,
    }

    impl Machine {
        fn new() -> Self {
            let mut stalls = Stalls::default();
            stalls.set_limit(LOCAL_IO, Motor::M2, LIMIT);
            let (sent, pair) = (Outgoing::default(), ExchangeDataResponse::default());
            Self { stalls, response: 0, now: Instant::now(), sent, pair, first: false }
        }

        /// Another response; returns whether it reports a standstill.
        fn step(&mut self) -> bool {
            let mut inputs = Inputs::default();
            inputs.take_simple(self.pair);
            let configs = SentConfigs::default();
            let comparison = Comparison {
                first: std::mem::take(&mut self.first),
                kinds: [].into_iter().collect(),
                before: &inputs,
                now: &inputs,
                configs_before: &configs,
                configs: &configs,
                sent: std::slice::from_ref(&self.sent),
            };
            self.response += 1;
            self.now += STEP;
            let mut events = Vec::new();
            self.stalls.look(&comparison, self.response, self.now, |event| events.push(event));
            let position = self.pair.counter[1] as u16;
            let (area, motor) = (LOCAL_IO, Motor::M2);
            let expected = [Event::MotorStalled { area, motor, position }];
            assert!(events.is_empty() || events == expected, "{events:?}");
            !events.is_empty()
        }

        /// The number of responses until one reports a standstill.
        fn steps_until_told(&mut self) -> Option<usize> {
            (1..100).find(|_| self.step())
        }
    }

    #[test]
    fn a_motor_that_should_turn_and_stands_still_is_reported_once_after_its_limit() {
        let mut machine = Machine::new();
        assert_eq!(machine.steps_until_told(), None, "it has no duty");
        machine.sent.output.duty[2] = 300;
        // The limit begins with the first response to that.
        assert_eq!(machine.steps_until_told(), Some(6));
        assert_eq!(machine.steps_until_told(), None, "twice");
        machine.sent.output.duty[2] = 0;
        machine.step();
        machine.sent.output.duty[2] = 300;
        assert_eq!(machine.steps_until_told(), Some(6), "started again");
    }

    #[test]
    fn each_pulse_restarts_the_limit() {
        let mut machine = Machine::new();
        machine.sent.output.duty[3] = 512;
        for count in 0..20 {
            machine.pair.counter[1] = count;
            assert!((0..5).all(|_| !machine.step()));
        }
        assert_eq!(machine.steps_until_told(), Some(1));
        machine.pair.counter[1] = 77;
        assert_eq!(machine.steps_until_told(), Some(6), "it turned and stands again");
    }

    #[test]
    fn another_direction_or_command_restarts_the_limit_and_another_speed_does_not() {
        let mut machine = Machine::new();
        machine.sent.output.duty[2] = 300;
        let changes: [fn(&mut Outgoing); 3] = [
            |sent| sent.output.duty[2..4].swap(0, 1),
            |sent| sent.output.motor_ex_cmd_id[1] += 1,
            |sent| sent.output.duty[2..4].iter_mut().for_each(|duty| *duty /= 2),
        ];
        for (change, expected) in changes.into_iter().zip([Some(6), Some(6), None]) {
            assert!(machine.steps_until_told().is_none_or(|steps| steps == 6));
            change(&mut machine.sent);
            assert_eq!(machine.steps_until_told(), expected);
        }
    }

    #[test]
    fn a_motor_that_has_arrived_or_is_braked_or_is_not_watched_is_not_reported() {
        let mut machine = Machine::new();
        *machine.sent.output.duty = [512, 0, 300, 300, 512, 0, 0, 512];
        assert_eq!(machine.steps_until_told(), None, "braked, and others are not watched");
        machine.sent.output.duty[3] = 0;
        machine.sent.output.distance[1] = 100;
        machine.sent.output.motor_ex_cmd_id[1] = 7;
        machine.pair.motor_command_id[1] = 7;
        assert_eq!(machine.steps_until_told(), None, "it has reached the end of its distance");
        machine.pair.motor_command_id[1] = 6;
        assert_eq!(machine.steps_until_told(), Some(6), "it is stuck on its way");
        machine.pair.counter[1] += 1;
        machine.stalls.set_limit(LOCAL_IO, Motor::M2, Duration::MAX);
        assert_eq!(machine.steps_until_told(), None);
    }

    #[test]
    fn a_new_connection_and_unchecked_responses_restart_the_limit() {
        let mut machine = Machine::new();
        machine.sent.output.duty[2] = 300;
        assert!((0..5).all(|_| !machine.step()));
        machine.first = true;
        assert_eq!(machine.steps_until_told(), Some(6));
        machine.pair.counter[1] += 1;
        assert!((0..5).all(|_| !machine.step()));
        machine.response += 1;
        assert_eq!(machine.steps_until_told(), Some(6));
    }
}
