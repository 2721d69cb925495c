//! The events between two responses.

use super::event::{Event, EventKind, Joystick, KindSet};
use crate::exchange::{Inputs, Outgoing, SentConfigs};
use crate::terminals::{Counter, Input, Motor};
use crate::transfer_area::{IZ_MOTOR, LOCAL_IO, MAX_EXTENSIONS};
use crate::tx::IrDevice;
use crate::wire::ExchangeDataResponse;

/// What two responses say about one area, and the outputs to which the newer one is the response.
struct Pair<'a> {
    area: usize,
    sent: &'a Outgoing,
    before: &'a ExchangeDataResponse,
    now: &'a ExchangeDataResponse,
}

/// A response and the one before it.
#[derive(Debug)]
pub(crate) struct Comparison<'a> {
    /// Whether this is the first response of its transfer; then the one before is from an earlier transfer,
    /// or empty.
    pub(crate) first: bool,
    /// The events that have listeners.
    pub(crate) kinds: KindSet,
    pub(crate) before: &'a Inputs,
    pub(crate) now: &'a Inputs,
    /// The configurations that were sent before each of the two.
    pub(crate) configs_before: &'a SentConfigs,
    pub(crate) configs: &'a SentConfigs,
    /// The outputs to which this is the response.
    pub(crate) sent: &'a [Outgoing],
}

impl Comparison<'_> {
    pub(crate) fn for_each_event(&self, mut send: impl FnMut(Event)) {
        if !self.first && self.asks_for(EventKind::ExtensionChanged) {
            self.compare_extensions(&mut send);
        }
        for (area, sent) in self.sent.iter().enumerate() {
            let (before, now) = (self.before.area(area), self.now.area(area));
            if before == now {
                continue;
            }
            let Some(now) = now else { continue };
            if let (Some(before), false) = (before, self.first) {
                let pair = Pair { area, sent, before, now };
                self.compare_inputs(&pair, &mut send);
                self.compare_counters(&pair, &mut send);
                self.compare_joysticks(&pair, &mut send);
            }
            // Commands can be done in the first response already, but commands for an extension are sent
            // only after it was connected.
            let none = ExchangeDataResponse::default();
            if let Some(before) = before.or((area == LOCAL_IO).then_some(&none)) {
                let pair = Pair { area, sent, before, now };
                self.compare_resets(&pair, &mut send);
                self.compare_motors(&pair, &mut send);
            }
        }
    }

    fn asks_for(&self, kind: EventKind) -> bool {
        self.kinds.contains(kind)
    }

    fn compare_extensions(&self, send: &mut impl FnMut(Event)) {
        let changed = self.before.alive() ^ self.now.alive();
        for extension in
            (1..=MAX_EXTENSIONS).filter(|extension| changed >> (extension - 1) & 1 != 0)
        {
            let alive = self.now.alive() >> (extension - 1) & 1 != 0;
            send(Event::ExtensionChanged { extension, alive });
        }
    }

    fn compare_inputs(&self, pair: &Pair<'_>, send: &mut impl FnMut(Event)) {
        if !self.asks_for(EventKind::InputChanged) {
            return;
        }
        let &Pair { area, before, now, .. } = pair;
        for input in Input::ALL {
            let pressed = now.uni[input.index()] != 0;
            let changed = pressed != (before.uni[input.index()] != 0);
            if changed && self.stays_digital(area, input) {
                send(Event::InputChanged { area, input, pressed });
            }
        }
    }

    /// Whether an input was configured as digital for both responses.
    fn stays_digital(&self, area: usize, input: Input) -> bool {
        let config = |configs: &SentConfigs| {
            configs.get(area)?.map(|update| update.config.uni[input.index()])
        };
        let now = config(self.configs);
        now.is_some_and(|now| now.is_digital()) && now == config(self.configs_before)
    }

    fn compare_counters(&self, pair: &Pair<'_>, send: &mut impl FnMut(Event)) {
        if !self.asks_for(EventKind::CounterChanged) {
            return;
        }
        let &Pair { area, before, now, .. } = pair;
        for counter in Counter::ALL {
            let count = now.counter[counter.index()];
            if count != before.counter[counter.index()] {
                // The value is negative beyond 32767.
                send(Event::CounterChanged { area, counter, count: count as u16 });
            }
        }
    }

    fn compare_joysticks(&self, pair: &Pair<'_>, send: &mut impl FnMut(Event)) {
        if !self.asks_for(EventKind::JoystickMoved) {
            return;
        }
        let &Pair { area, before, now, .. } = pair;
        for device in IrDevice::ALL {
            let (before, now) = (before.ir[device.index()], now.ir[device.index()]);
            let mut compare = |joystick, before, (x, y): (i8, i8)| {
                if (x, y) != before {
                    let (x, y) = (x.into(), y.into());
                    send(Event::JoystickMoved { area, device, joystick, x, y });
                }
            };
            compare(Joystick::Left, (before.left_x, before.left_y), (now.left_x, now.left_y));
            compare(Joystick::Right, (before.right_x, before.right_y), (now.right_x, now.right_y));
        }
    }

    fn compare_resets(&self, pair: &Pair<'_>, send: &mut impl FnMut(Event)) {
        if !self.asks_for(EventKind::CounterReset) {
            return;
        }
        let &Pair { area, sent, before, now } = pair;
        for counter in Counter::ALL {
            let index = counter.index();
            let command_id = now.counter_reset_id[index];
            let changed = command_id != before.counter_reset_id[index];
            if changed && command_id == sent.output.cnt_reset_cmd_id[index] {
                send(Event::CounterReset { area, counter, command_id });
            }
        }
    }

    fn compare_motors(&self, pair: &Pair<'_>, send: &mut impl FnMut(Event)) {
        if !self.asks_for(EventKind::MotorReached) {
            return;
        }
        let &Pair { area, sent, before, now } = pair;
        for motor in Motor::ALL {
            let index = motor.index();
            let output = &sent.output;
            let command_id = now.motor_command_id[index];
            let changed = command_id != before.motor_command_id[index];
            // A higher `master` means that the distance is an error to inject.
            let has_distance =
                output.distance[index] != 0 && usize::from(output.master[index]) <= IZ_MOTOR;
            if changed && command_id == output.motor_ex_cmd_id[index] && has_distance {
                let position = now.counter[motor.counter().index()] as u16;
                send(Event::MotorReached { area, motor, position, command_id });
            }
        }
    }
}

#[cfg(test)]
#[path = "comparison_tests.rs"]
mod tests;
