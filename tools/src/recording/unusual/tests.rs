use std::time::Instant;

use ft_transfer_area::transfer_area::{InputMode, UniConfig};
use ft_transfer_area::{FishX1Transfer, LoggedCycle};
use ft_transfer_area_recorder::{Options, Recorder, Recording};

use super::*;

/// Cycles of a machine into a recording, and what is unusual in it.
struct Night {
    areas: Vec<FishX1Transfer>,
    number: u64,
    at: Instant,
    entries: Vec<LoggedCycle>,
}

impl Night {
    fn new() -> Self {
        let mut area = FishX1Transfer::default();
        area.config.uni[3] = UniConfig::analog(InputMode::Ultrasonic);
        area.input.uni[3] = 15;
        Self { areas: vec![area], number: 0, at: Instant::now(), entries: Vec::new() }
    }

    fn area(&mut self) -> &mut FishX1Transfer {
        &mut self.areas[0]
    }

    fn cycle(&mut self, after: u64) {
        self.number += 1;
        self.at += Duration::from_millis(after);
        let mut cycle = LoggedCycle::new(self.number, &self.areas);
        cycle.arrived = self.at;
        cycle.first = self.number == 1;
        cycle.statistics.last_cycle = Duration::from_millis(after);
        self.entries.push(cycle);
    }

    fn cycles(&mut self, count: u64) {
        (0..count).for_each(|_| self.cycle(10));
    }

    /// The cycles and kinds of what is unusual, by what they say.
    fn unusual(self) -> Vec<String> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("night.mcap");
        let options = Options::default().capacity(6_000);
        let (recorder, mut feed) = Recorder::fed(&path, options).unwrap();
        self.entries.into_iter().for_each(|cycle| feed.cycle(cycle));
        recorder.finish().unwrap();
        let mut unusual = Unusual::default();
        let entries = Recording::open(&path).unwrap().map(Result::unwrap);
        let moments = entries.flat_map(|entry| unusual.look(entry.at, &entry.what));
        moments.map(|moment| moment.what).collect()
    }
}

#[test]
fn a_long_cycle_is_unusual() {
    let mut night = Night::new();
    night.cycles(20);
    night.cycle(312);
    night.cycles(20);
    assert_eq!(night.unusual(), ["a cycle took 312 ms, usually 10 ms"]);
}

#[test]
fn an_input_is_over_range_once_until_it_was_not() {
    let mut night = Night::new();
    night.cycles(20);
    for value in [1024, 30, 4096, 30] {
        night.area().input.uni[3] = value;
        night.cycles(20);
    }
    // Until the controller measures in the new mode, the value is that of the old one.
    night.area().input.uni[3] = 14_000;
    night.area().config.uni[3].mode = InputMode::Resistance.into();
    night.cycles(3);
    night.area().input.uni[3] = 300;
    night.cycles(20);
    let over = ["I4 is over range, 1024 cm", "I4 is over range, 4096 cm: no sensor"];
    assert_eq!(night.unusual(), over);
}

#[test]
fn counters_jump_and_go_back_but_not_by_a_reset_or_a_distance() {
    let mut night = Night::new();
    night.area().input.counter[1] = -200;
    night.cycles(20);
    // At full speed, and once around.
    for count in (0..100).map(|cycle| (-200 + 8 * cycle) as i16) {
        night.area().input.counter[1] = count;
        night.cycle(10);
    }
    night.area().output.cnt_reset_cmd_id[1] = 1;
    night.cycles(2);
    night.area().input.counter[1] = 0;
    night.area().input.cnt_reset_cmd_id[1] = 1;
    night.cycles(20);
    night.area().input.counter[1] = 500;
    night.cycles(20);
    night.area().input.counter[1] = 499;
    night.cycles(20);
    night.area().output.distance[1] = 50;
    night.area().output.motor_ex_cmd_id[1] = 1;
    night.cycle(10);
    night.area().input.counter[1] = 0;
    night.cycles(20);
    let jumps =
        ["C2 jumps from 0 to 500 within 10 ms", "C2 goes back from 500 to 499 without a reset"];
    assert_eq!(night.unusual(), jumps);
}

#[test]
fn of_each_kind_the_first_are_listed_and_all_are_counted() {
    let event = |at: u64| {
        let mut event = RecordedEvent::default();
        event.event = "MotorStalled".to_owned();
        event.controller = "E1".to_owned();
        event.terminal = "M2".to_owned();
        event.value = at as i64;
        Recorded::Event(event)
    };
    let mut unusual = Unusual::default();
    let mut numbers = Vec::new();
    for at in 0..15 {
        let moments = unusual.look(Duration::from_secs(at), &event(at));
        numbers.extend(moments.iter().map(|moment| moment.number));
        assert_eq!(moments[0].what, format!("E1.M2 is blocked, at {at} pulses"));
    }
    let expired = Transfer::WatchdogExpired { limit_ms: 500 };
    let expired = unusual.look(Duration::from_secs(15), &Recorded::Transfer(expired));
    assert_eq!(numbers[9..], [Some(10), None, None, None, None, None]);
    assert_eq!(expired[0].number, Some(11));
    let counts: Vec<_> =
        unusual.into_counts().iter().map(|(kind, count)| kind.counted(*count)).collect();
    assert_eq!(counts, ["1 stop by the watchdog", "15 blocked motors"]);
}
