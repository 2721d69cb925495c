//! Motors of a world: counters, distances, pairs, and the slide.

use ft_transfer_area::transfer_area::DUTY_MAX;
use ft_transfer_area::tx::{Counter, Motor};
use ft_transfer_area::FishX1Transfer;
use serde_json::{json, Value};

use super::ftrobopy::Ftrobopy;
use super::own::Own;
use super::{assert_alike, end_well, start, Exchange};

/// As fast as the clients go, and each exchange is 10 ms in the world.
const UNPACED: [&str; 2] = ["--pace", "0"];

/// The number of exchanges until a motor has stopped.
const SETTLED: usize = 150;

/// The script's `order`: both motors follow each other if they are paired.
fn order(area: &mut FishX1Transfer, motor: usize, distance: u16, master: u8) {
    area.input.motor_ex_reached[motor] = 0;
    area.output.distance[motor] = distance;
    area.output.master[motor] = master;
    area.raise_motor_ex_cmd_id(Motor::ALL[motor]);
}

/// Sets a motor's speed, negative backwards.
fn set_speed(area: &mut FishX1Transfer, motor: usize, speed: i16) {
    area.output.duty[2 * motor] = speed.max(0);
    area.output.duty[2 * motor + 1] = (-speed).max(0);
}

impl Own {
    fn counts(&self, area: usize, motors: &[usize]) -> Vec<i16> {
        self.look(area, |area| motors.iter().map(|&motor| area.input.counter[motor]).collect())
    }

    /// The script's `drive`.
    fn drive(
        &self,
        area: usize,
        motors: &[usize],
        speed: i16,
        distance: u16,
        paired: bool,
    ) -> Value {
        self.together(area, |area| {
            for &motor in motors {
                // M1 and M2, counted from 1.
                let master = if paired { 2 - motor as u8 } else { 0 };
                order(area, motor, distance, master);
                set_speed(area, motor, speed);
            }
        });
        let (mut in_time, mut apart) = (true, 0);
        self.until(|areas| {
            let input = &areas[area].input;
            let counts = motors.iter().map(|&motor| input.counter[motor]);
            let done = motors.iter().map(|&motor| input.motor_ex_reached[motor] == 1);
            let there = counts.clone().map(|count| count >= distance as i16);
            in_time &= done.clone().eq(there);
            apart = apart.max(counts.clone().max().unwrap() - counts.min().unwrap());
            done.into_iter().all(|done| done)
        });
        self.cycles(SETTLED);
        json!([self.counts(area, motors), in_time, apart])
    }

    /// The script's `leave`.
    fn leave(&self, area: usize) -> Value {
        let motors = [0, 1];
        let before = self.counts(area, &motors);
        self.together(area, |area| order(area, 0, 0, 0));
        let done = self.look(area, |area| area.input.motor_ex_reached[0] == 1);
        self.until(|areas| areas[area].input.counter[0] >= before[0] + 50);
        let other = self.counts(area, &motors)[1] - before[1];
        self.together(area, |area| {
            for motor in motors {
                order(area, motor, 0, 0);
                set_speed(area, motor, 0);
            }
        });
        self.cycles(SETTLED);
        let stopped = self.counts(area, &motors);
        self.cycles(2);
        json!([done, [other], stopped == self.counts(area, &motors)])
    }

    /// The script's `count_and_reset`.
    fn count_and_reset(&self, area: usize) -> Value {
        for speed in [300, -DUTY_MAX] {
            let goal = self.counts(area, &[3])[0] + 60;
            self.together(area, |area| set_speed(area, 3, speed));
            self.until(|areas| areas[area].input.counter[3] >= goal);
        }
        self.together(area, |area| set_speed(area, 3, 0));
        self.cycles(SETTLED);
        let before = self.counts(area, &[3])[0];
        self.handler.areas().lock()[area].start_counter_reset(Counter::C4);
        self.until(|areas| areas[area].input.cnt_resetted[3] == 1);
        json!([before, self.counts(area, &[3])[0]])
    }

    /// The script's `slide`.
    fn slide(&self) -> Value {
        let mut inputs = [(1, 1); 8];
        inputs[3] = (3, 0);
        self.configure(0, inputs);
        let sensors = || self.master(|master| [0, 1, 3].map(|input| master.input.uni[input]));
        self.together(0, |master| set_speed(master, 2, DUTY_MAX));
        let before = sensors();
        self.until(|areas| areas[0].input.uni[1] == 1);
        self.together(0, |master| set_speed(master, 2, 0));
        self.cycles(SETTLED);
        let between = sensors();
        let back = self.drive(0, &[2], -DUTY_MAX, 400, false);
        json!([before[..2], between, sensors(), [back[0], back[1]]])
    }

    /// The script's `motors`.
    fn motors(&self) -> Value {
        let both = [0, 1];
        let mut result = json!({ "slide": self.slide() });
        result["alone"] = self.each(|own, area| {
            json!([
                own.drive(area, &[0], DUTY_MAX, 150, false),
                own.drive(area, &[0], -400, 90, false)
            ])
        });
        result["unpaired"] = self.each(|own, area| own.drive(area, &both, DUTY_MAX, 200, false));
        result["paired"] = self.each(|own, area| own.drive(area, &both, DUTY_MAX, 200, true));
        // From here on, the distances depend on time.
        result["left"] = self.each(Self::leave);
        result["c4"] = self.each(Self::count_and_reset);
        result
    }
}

/// Removes the values that depend on the time at which a client reads, after a check of their range.
fn check_ranges(result: &mut Value, areas: usize) {
    for area in 0..areas {
        // A client sees the greatest distance between two motors only in the exchanges that it reads.
        let apart = |kind: &str| result[kind][area][2].as_i64().unwrap();
        assert!(apart("paired") <= 5, "{} pulses apart", apart("paired"));
        assert!(apart("unpaired") > 20, "{} pulses apart", apart("unpaired"));
        for kind in ["paired", "unpaired"] {
            result[kind][area][2].take();
        }
        let turned = result["c4"][area][0].take();
        assert!(turned.as_i64().unwrap() >= 120, "C4 counted {turned}");
    }
}

/// Checks the values that every client must read.
fn assert_right(result: &Value, areas: usize) {
    let slide = json!([[0, 0], [0, 1, 25], [0, 0, 17]]);
    assert_eq!(result["slide"].as_array().unwrap()[..3], slide.as_array().unwrap()[..]);
    assert_near(&result["slide"][3], 400);
    for area in 0..areas {
        assert_near(&result["alone"][area][0], 150);
        assert_near(&result["alone"][area][1], 90);
        assert_near(&result["unpaired"][area], 200);
        assert_near(&result["paired"][area], 200);
        assert_eq!(result["left"][area], json!([true, [0], true]));
        assert_eq!(result["c4"][area][1], 0, "C4 after its reset");
    }
}

/// A motor may turn a little too far, but never stops early, and its command is reported as done in time.
fn assert_near(driven: &Value, distance: i64) {
    for count in driven[0].as_array().unwrap() {
        let count = count.as_i64().unwrap();
        assert!((distance..distance + 4).contains(&count), "{count} pulses, not {distance}");
    }
    assert_eq!(driven[1], true, "the command was done early or late");
}

fn compare(exchange: Exchange) {
    let Some(ftrobopy) = Ftrobopy::find() else { return };
    let mut program = start("motors.toml", &UNPACED);
    let mut read = ftrobopy.run(&mut program, "motors", exchange);
    program.interrupt();
    if let Exchange::Compressed = exchange {
        for c4 in read["c4"].as_array_mut().unwrap() {
            // ftrobopy reads the toggle code as 1 unless the value was 1 before, so it reads 1 for a
            // counter that is reset. The code means 0.
            assert_eq!(c4[1], 1);
            c4[1] = json!(0);
        }
    }

    let program = start("motors.toml", &UNPACED);
    let own = Own::begin(&program, exchange);
    let mut expected = own.motors();
    own.end();
    end_well(program);

    for result in [&mut read, &mut expected] {
        assert_right(result, exchange.areas());
        check_ranges(result, exchange.areas());
    }
    // The world goes by exchanges, and each command goes out in one exchange, so the counts are the same.
    assert_alike("ftrobopy", &read, &expected);
}

/// Pulses per second of a motor without a load at full speed: 3 turns.
const FULL_SPEED: f64 = 3.0 * 63.3;

/// With a pace, motors turn by the clock. ftrobopy exchanges less often than 100 times a second, and sees a real
/// motor's speed all the same.
fn measure_speeds(exchange: Exchange) {
    let Some(ftrobopy) = Ftrobopy::find() else { return };
    let mut program = start("motors.toml", &[]);
    let read = ftrobopy.run(&mut program, "speeds", exchange);
    program.interrupt();
    for measured in read.as_array().unwrap() {
        let [pulses, shortest, longest] = [0, 1, 2].map(|index| measured[index].as_f64().unwrap());
        let possible = FULL_SPEED * shortest - 2.0..=FULL_SPEED * longest + 2.0;
        assert!(possible.contains(&pulses), "{pulses} pulses in {shortest} to {longest} s: {read}");
    }
}

#[cfg_attr(not(unix), ignore = "ftrobopy is only compared on Unix")]
#[test]
fn motors_turn_by_the_clock_in_simple_exchanges() {
    measure_speeds(Exchange::Simple);
}

#[cfg_attr(not(unix), ignore = "ftrobopy is only compared on Unix")]
#[test]
fn motors_turn_by_the_clock_in_compressed_exchanges() {
    measure_speeds(Exchange::Compressed);
}

#[cfg_attr(not(unix), ignore = "ftrobopy is only compared on Unix")]
#[test]
fn motors_turn_alike_by_the_simple_exchange() {
    compare(Exchange::Simple);
}

#[cfg_attr(not(unix), ignore = "ftrobopy is only compared on Unix")]
#[test]
fn motors_turn_alike_by_the_compressed_exchange() {
    compare(Exchange::Compressed);
}
