//! Inputs over range, and counters that jump.

use std::time::Duration;

use ft_transfer_area::transfer_area::{
    UniConfig, IZ_COUNTER, IZ_UNI_INPUT, MAX_AREAS, NO_ULTRASONIC,
};
use ft_transfer_area::tx::{Counter, Input};
use ft_transfer_area::FishX1Transfer;

use super::{Kind, Sentence};

/// For so many cycles after a new configuration or a reset, values may be those from before.
const SETTLE: u8 = 10;

/// More pulses than this in a second come from no motor. The time of a cycle is known only to some milliseconds, so a
/// few are always possible.
const PULSES_PER_SECOND: f64 = 1000.0;
const ALWAYS_POSSIBLE: f64 = 20.0;

/// After this time a counter may have begun again at 0, by going on.
const FORGET: Duration = Duration::from_secs(30);

#[derive(Debug, Default)]
pub(super) struct Terminals {
    areas: [Area; MAX_AREAS],
    /// Whether there was a cycle.
    has_begun: bool,
}

#[derive(Debug, Default)]
struct Area {
    inputs: [Watched; IZ_UNI_INPUT],
    counters: [Counted; IZ_COUNTER],
}

/// An input.
#[derive(Debug, Default)]
struct Watched {
    config: Option<UniConfig>,
    /// Cycles since this configuration, or the connection, began.
    cycles: u8,
    is_over: bool,
    /// Whether it was so when the file began, within a transfer, and is until now.
    was_over: bool,
}

#[derive(Debug, Default)]
struct Counted {
    count: Option<u16>,
    /// Commands that reset it: given, done.
    ids: [u16; 4],
    /// For so many cycles more a reset may be under way.
    quiet: u8,
    /// When the last two cycles were.
    times: [Duration; 2],
}

impl Terminals {
    /// Looks at a cycle, which may be the first of its connection.
    pub(super) fn look(
        &mut self,
        at: Duration,
        is_first: bool,
        areas: &[FishX1Transfer],
        mut found: impl FnMut(Kind, Sentence),
    ) {
        let alive = areas[0].state.io_slave_alive;
        let is_within = !std::mem::replace(&mut self.has_begun, true) && !is_first;
        for (index, (known, area)) in self.areas.iter_mut().zip(areas).enumerate() {
            let takes_part = index.checked_sub(1).is_none_or(|extension| alive[extension] != 0);
            if is_first || !takes_part {
                known.begin_again();
            }
            if takes_part {
                let name = if index == 0 { String::new() } else { format!("E{index}.") };
                known.look_at_inputs(area, is_within, |what| {
                    found(Kind::OverRange, what.of_area(&name))
                });
                known.look_at_counters(at, area, |what| {
                    found(Kind::CounterJump, what.of_area(&name));
                });
            }
        }
    }
}

impl Area {
    /// What comes next is of another connection.
    fn begin_again(&mut self) {
        *self = Self::default();
    }

    fn look_at_inputs(
        &mut self,
        area: &FishX1Transfer,
        is_within: bool,
        mut found: impl FnMut(Sentence),
    ) {
        for (input, watched) in Input::ALL.into_iter().zip(&mut self.inputs) {
            let (value, config) = (area.input.uni[input.index()], area.config.uni[input.index()]);
            let was_over = watched.was_over;
            if watched.gets_over_range(value, config, is_within) {
                let unit = config.unit();
                let is_gone = value == NO_ULTRASONIC && unit == "cm";
                let [en, de] = if is_gone { [": no sensor", ": kein Sensor"] } else { [""; 2] };
                let since =
                    if was_over { [" from the beginning", " von Anfang an"] } else { [""; 2] };
                found(Sentence::new(
                    format!("{input} is over range{}, {value} {unit}{en}", since[0]),
                    format!("{input} ist{} außerhalb des Bereichs, {value} {unit}{de}", since[1]),
                ));
            }
        }
    }

    fn look_at_counters(
        &mut self,
        at: Duration,
        area: &FishX1Transfer,
        mut found: impl FnMut(Sentence),
    ) {
        for (counter, counted) in Counter::ALL.into_iter().zip(&mut self.counters) {
            let index = counter.index();
            let (input, output) = (&area.input, &area.output);
            let ids = [
                output.cnt_reset_cmd_id[index],
                input.cnt_reset_cmd_id[index],
                output.motor_ex_cmd_id[index],
                input.motor_ex_cmd_id[index],
            ];
            // A distance resets the counter of its motor, too.
            let is_pending = ids[0] != ids[1] || output.distance[index] != 0 && ids[2] != ids[3];
            let count = input.counter[index] as u16;
            if let Some(jump) = counted.jump(at, count, ids, is_pending) {
                found(jump.of_area(&format!("{counter} ")));
            }
        }
    }
}

impl Watched {
    /// Whether it gets over range with this value, which may be the first of a file that begins within a transfer.
    fn gets_over_range(&mut self, value: i16, config: UniConfig, is_within: bool) -> bool {
        if self.config != Some(config) {
            *self = Self { config: Some(config), was_over: is_within, ..Self::default() };
        }
        let is_over = config.is_over_range(value);
        self.was_over &= is_over;
        if self.cycles < SETTLE {
            self.cycles += 1;
            return false;
        }
        !std::mem::replace(&mut self.is_over, is_over) && is_over
    }
}

impl Counted {
    /// What it has done that no motor does.
    fn jump(
        &mut self,
        at: Duration,
        count: u16,
        ids: [u16; 4],
        is_pending: bool,
    ) -> Option<Sentence> {
        let is_reset = is_pending || self.ids != ids;
        self.quiet = if is_reset { SETTLE } else { self.quiet.saturating_sub(1) };
        self.ids = ids;
        let [since, last] = self.times;
        self.times = [last, at];
        let before = self.count.replace(count)?;
        let passed = at.saturating_sub(last);
        if self.quiet > 0 || passed > FORGET {
            return None;
        }
        // It is 0 after 65535.
        let change = count.wrapping_sub(before) as i16;
        // A response that was late on its way has pulses of a moment before it came.
        let possible = PULSES_PER_SECOND * at.saturating_sub(since).as_secs_f64() + ALWAYS_POSSIBLE;
        if change < 0 {
            Some(Sentence::new(
                format!("goes back from {before} to {count} without a reset"),
                format!(
                    "geht von {before} auf {count} zurück, ohne dass ihn etwas zurückgesetzt hat"
                ),
            ))
        } else if f64::from(change) > possible {
            let passed = passed.as_millis();
            Some(Sentence::new(
                format!("jumps from {before} to {count} within {passed} ms"),
                format!("springt in {passed} ms von {before} auf {count}"),
            ))
        } else {
            None
        }
    }
}

#[cfg(test)]
mod tests {
    use ft_transfer_area::transfer_area::InputMode;

    use super::*;

    /// A machine, cycle after cycle.
    #[derive(Default)]
    struct Night {
        area: FishX1Transfer,
        terminals: Terminals,
        cycles: u32,
        found: Vec<String>,
    }

    impl Night {
        fn cycles(&mut self, count: u32) {
            for _ in 0..count {
                self.cycles += 1;
                let (at, is_first) = (self.cycles * Duration::from_millis(10), self.cycles == 1);
                let areas = std::slice::from_ref(&self.area);
                self.terminals.look(at, is_first, areas, |_, what| self.found.push(what.en));
            }
        }
    }

    #[test]
    fn what_is_over_range_where_a_file_begins_within_a_transfer_is_so_from_the_beginning() {
        let mut night = Night { cycles: 500, ..Night::default() };
        night.area.config.uni[3] = UniConfig::analog(InputMode::Ultrasonic);
        night.area.config.uni[4] = UniConfig::analog(InputMode::Ultrasonic);
        night.area.input.uni[3] = 4096;
        night.area.input.uni[4] = 30;
        night.cycles(5);
        night.area.input.uni[4] = 1024;
        night.cycles(20);
        night.area.input.uni[3] = 30;
        night.cycles(1);
        night.area.input.uni[3] = 4096;
        night.cycles(20);
        let expected = [
            "I4 is over range from the beginning, 4096 cm: no sensor",
            "I5 is over range, 1024 cm",
            "I4 is over range, 4096 cm: no sensor",
        ];
        assert_eq!(night.found, expected);
    }

    #[test]
    fn what_is_over_range_is_told_of_each_connection() {
        let mut night = Night::default();
        night.area.config.uni[3] = UniConfig::analog(InputMode::Ultrasonic);
        night.area.input.uni[3] = 1024;
        night.cycles(20);
        night.cycles = 0;
        night.cycles(20);
        assert_eq!(night.found, ["I4 is over range, 1024 cm"; 2]);
    }

    #[test]
    fn an_input_is_over_range_once_until_it_was_not() {
        let mut night = Night::default();
        night.area.config.uni[3] = UniConfig::analog(InputMode::Ultrasonic);
        night.cycles(20);
        for value in [1024, 30, 4096, 30] {
            night.area.input.uni[3] = value;
            night.cycles(20);
        }
        // Until the controller measures in the new mode, the value is that of the old one.
        night.area.input.uni[3] = 14_000;
        night.area.config.uni[3].mode = InputMode::Resistance.into();
        night.cycles(3);
        night.area.input.uni[3] = 300;
        night.cycles(20);
        let over = ["I4 is over range, 1024 cm", "I4 is over range, 4096 cm: no sensor"];
        assert_eq!(night.found, over);
    }

    #[test]
    fn counters_jump_and_go_back_but_not_by_a_reset_or_a_distance() {
        let mut night = Night::default();
        night.area.input.counter[1] = -200;
        night.cycles(20);
        // At full speed, and once around.
        for count in (0..100).map(|cycle| (-200 + 8 * cycle) as i16) {
            night.area.input.counter[1] = count;
            night.cycles(1);
        }
        night.area.output.cnt_reset_cmd_id[1] = 1;
        night.cycles(2);
        night.area.input.counter[1] = 0;
        night.area.input.cnt_reset_cmd_id[1] = 1;
        night.cycles(20);
        night.area.input.counter[1] = 500;
        night.cycles(20);
        night.area.input.counter[1] = 499;
        night.cycles(20);
        night.area.output.distance[1] = 50;
        night.area.output.motor_ex_cmd_id[1] = 1;
        night.cycles(1);
        night.area.input.counter[1] = 0;
        night.cycles(20);
        let jumps =
            ["C2 jumps from 0 to 500 within 10 ms", "C2 goes back from 500 to 499 without a reset"];
        assert_eq!(night.found, jumps);
    }
}
