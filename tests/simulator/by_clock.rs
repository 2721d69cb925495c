//! A simulated TXT with a pace goes by the clock, however often its client exchanges.
//!
//! What a client measures is compared with the time that it measures itself. A busy computer makes the time
//! between two responses longer, and the pulses as many more.

use std::thread;
use std::time::{Duration, Instant};

use ft_transfer_area::wire::ExchangeData;
use ft_transfer_area_simulator::{Machine, SimulatedTxt};

use crate::unpaced;
use crate::wire_client::{Client, LIMIT};

/// What an ideal motor gives at full speed.
const PULSES_PER_SECOND: f64 = 200.0;

const MOMENT: Duration = Duration::from_millis(50);

/// M1 forward at this duty.
fn m1(duty: i16) -> ExchangeData {
    let mut outputs = ExchangeData::default();
    outputs.duty[0] = duty;
    outputs
}

/// The counter C1, and between which times it was that.
struct Seen {
    begin: Instant,
    pulses: i16,
    end: Instant,
}

impl Seen {
    /// In the response to these outputs.
    fn by(client: &mut Client, outputs: &ExchangeData) -> Self {
        Self::with(|| client.exchange(outputs).counter[0])
    }

    /// In the machine.
    fn at(txt: &SimulatedTxt) -> Self {
        Self::with(|| state(txt).0)
    }

    fn with(look: impl FnOnce() -> i16) -> Self {
        let begin = Instant::now();
        let pulses = look();
        Self { begin, pulses, end: Instant::now() }
    }

    /// Fails unless M1 has turned at full speed from this time to that one.
    fn assert_full_speed_until(&self, later: &Self) {
        let pulses = f64::from(later.pulses - self.pulses);
        let [shortest, longest] = [(self.end, later.begin), (self.begin, later.end)]
            .map(|(from, to)| PULSES_PER_SECOND * (to - from).as_secs_f64());
        assert!(
            (shortest - 1.0..=longest + 1.0).contains(&pulses),
            "{pulses} pulses in the time of {shortest} to {longest}"
        );
    }
}

#[test]
fn motors_turn_by_the_clock_for_a_client_of_any_speed() {
    let txt = SimulatedTxt::builder().start().unwrap();
    let mut client = Client::online(&txt);
    client.exchange(&m1(512));
    for (pause, count) in [(0, 40), (3, 40), (10, 40), (20, 20), (50, 10), (500, 2)] {
        let seen: Vec<Seen> = (0..count)
            .map(|_| {
                thread::sleep(Duration::from_millis(pause));
                Seen::by(&mut client, &m1(512))
            })
            .collect();
        for pair in seen.windows(2) {
            pair[0].assert_full_speed_until(&pair[1]);
        }
        seen[0].assert_full_speed_until(&seen[count - 1]);
    }
}

#[test]
fn outputs_count_from_their_exchange_on_until_the_next_one() {
    let txt = SimulatedTxt::builder().start().unwrap();
    let mut client = Client::online(&txt);
    client.exchange(&m1(0));
    thread::sleep(MOMENT);
    let on = Seen::by(&mut client, &m1(512));
    let most = PULSES_PER_SECOND * (on.end - on.begin).as_secs_f64() + 1.0;
    assert!(f64::from(on.pulses) <= most, "it turned before it was switched on");
    thread::sleep(MOMENT);
    let off = Seen::by(&mut client, &m1(0));
    on.assert_full_speed_until(&off);
    thread::sleep(MOMENT);
    assert_eq!(client.exchange(&m1(0)).counter[0], off.pulses);
}

#[test]
fn outputs_count_before_they_are_answered() {
    let hour = Duration::from_secs(3600);
    let txt = SimulatedTxt::builder().pace(hour).start().unwrap();
    let mut client = Client::online(&txt);
    client.exchange(&m1(0));
    // The response to this one comes in an hour.
    let mut outputs = m1(512);
    outputs.counter_reset_id[3] = 7;
    client.send_exchange(&outputs);
    wait_for_pulses(&txt, 10);
    let (exchanges, report) =
        txt.with_machine(|machine| (machine.exchanges(), machine.report(0).unwrap()));
    // However often somebody looks, a reset is not reported before the next exchange.
    assert_eq!((exchanges, report.counter_reset_id[3]), (1, 0));
}

/// Waits until M1 has turned this far. Nobody has to exchange for that.
fn wait_for_pulses(txt: &SimulatedTxt, pulses: i16) {
    let begin = Instant::now();
    while txt.with_machine(|machine| machine.controllers[0].counter[0]) < pulses {
        assert!(begin.elapsed() < LIMIT, "M1 does not turn");
        thread::sleep(Duration::from_millis(5));
    }
}

#[test]
fn who_looks_at_the_machine_sees_it_as_it_is_now() {
    let txt = SimulatedTxt::builder().start().unwrap();
    let mut client = Client::online(&txt);
    client.exchange(&m1(512));
    wait_for_pulses(&txt, 10);
    // No command comes, so it looks at the beginning and at the end.
    assert!(txt.wait_until(|machine| machine.controllers[0].counter[0] >= 15, MOMENT));
}

/// How far M1 has turned, and the machine's time.
fn state(txt: &SimulatedTxt) -> (i16, Duration) {
    txt.with_machine(|machine| (machine.controllers[0].counter[0], machine.time()))
}

#[test]
fn a_motor_turns_by_the_clock_while_its_client_is_silent_and_when_it_is_cut_off() {
    let pace = Duration::from_millis(10);
    // Longer than this program may stand still between two lines.
    let limit = Duration::from_secs(1);
    let txt = SimulatedTxt::builder().pace(pace).idle_limit(limit).start().unwrap();
    let mut client = Client::online(&txt);
    let on = Seen::by(&mut client, &m1(512));
    assert!(txt.wait_until(|machine| !machine.connected(), LIMIT));
    let cut_off = Seen::at(&txt);
    assert!(cut_off.pulses >= 190, "it was cut off after {} pulses", cut_off.pulses);
    on.assert_full_speed_until(&cut_off);
    thread::sleep(MOMENT);
    on.assert_full_speed_until(&Seen::at(&txt));
}

#[test]
fn all_stands_still_while_nobody_is_online() {
    let txt = SimulatedTxt::builder().start().unwrap();
    let mut first = Client::online(&txt);
    first.exchange(&m1(512));
    wait_for_pulses(&txt, 10);
    first.exchange(&m1(0));
    drop(first);
    assert!(txt.wait_until(|machine| !machine.connected(), LIMIT));
    let before = state(&txt);
    thread::sleep(MOMENT);
    assert_eq!(state(&txt), before);
    let mut second = Client::connect(&txt);
    assert!(txt.wait_until(|machine| machine.connected(), LIMIT));
    thread::sleep(MOMENT);
    assert_eq!(state(&txt), before);
    let begin = Instant::now();
    second.start_online();
    thread::sleep(MOMENT);
    let (pulses, time) = state(&txt);
    assert_eq!(pulses, before.0);
    let passed = time - before.1;
    assert!((MOMENT..=begin.elapsed()).contains(&passed), "{passed:?}");
}

#[test]
fn a_motor_that_is_on_turns_on_when_its_client_is_gone_until_the_next_exchange() {
    let txt = SimulatedTxt::builder().start().unwrap();
    let mut first = Client::online(&txt);
    first.exchange(&m1(512));
    drop(first);
    assert!(txt.wait_until(|machine| !machine.connected(), LIMIT));
    let (before, _) = state(&txt);
    wait_for_pulses(&txt, before + 10);
    let mut second = Client::connect(&txt);
    let (before, _) = state(&txt);
    wait_for_pulses(&txt, before + 10);
    second.start_online();
    let (before, _) = state(&txt);
    wait_for_pulses(&txt, before + 10);
    second.exchange(&m1(0));
    let (before, _) = state(&txt);
    thread::sleep(MOMENT);
    assert_eq!(state(&txt).0, before, "the exchange stops it");
}

#[test]
fn a_watchdog_of_the_board_stops_a_motor_after_its_time_without_an_exchange() {
    let limit = Duration::from_millis(200);
    let txt = SimulatedTxt::builder().board_watchdog(limit).start().unwrap();
    let mut client = Client::online(&txt);
    client.exchange(&m1(512));
    drop(client);
    let is_on = |machine: &Machine| machine.controllers[0].outputs.duty != [0; 8];
    assert!(txt.wait_until(|machine| !machine.connected(), LIMIT));
    assert!(txt.wait_until(|machine| !is_on(machine), LIMIT));
    // 200 pulses per second until then, however late this computer notices it.
    let (pulses, _) = state(&txt);
    assert!((38..=41).contains(&pulses), "{pulses} pulses");
}

#[test]
fn without_a_pace_time_passes_only_with_exchanges() {
    let txt = unpaced().start().unwrap();
    let mut client = Client::online(&txt);
    for exchange in 1..=3 {
        assert_eq!(client.exchange(&m1(512)).counter[0], 2 * exchange);
        thread::sleep(MOMENT);
    }
    assert_eq!(txt.with_machine(|machine| machine.time()), Duration::from_millis(30));
}
