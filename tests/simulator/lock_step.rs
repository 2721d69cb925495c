//! The lock-step mode: machine time moves with exchanges, not with the clock.

use std::thread;
use std::time::{Duration, Instant};

use ft_transfer_area::transfer_area::LOCAL_IO;
use ft_transfer_area::wire::{ExchangeData, ExchangeDataResponse};
use ft_transfer_area::TransferAreaComHandler;
use ft_transfer_area_simulator::world::World;
use ft_transfer_area_simulator::{Fault, FaultKind, SimulatedTxt, SimulatedTxtBuilder};

use crate::camera_client::{settings, CameraClient};
use crate::wire_client::{Client, LIMIT};

const HOUR: Duration = Duration::from_secs(3600);
const STEP: Duration = Duration::from_millis(10);

fn lock_step() -> SimulatedTxtBuilder {
    SimulatedTxt::builder().world(World::default()).lock_step()
}

/// The inputs of a program that sends the slide back at its ends, and the machine time at the end. Now and
/// then the program pauses for this long.
fn run(pause: Duration) -> (Vec<ExchangeDataResponse>, Duration) {
    let jitter = Fault::at_each_exchange(FaultKind::Jitter(Duration::from_millis(30)));
    let txt = lock_step().fault(jitter).seed(7).start().unwrap();
    let mut client = Client::online(&txt);
    let mut outputs = ExchangeData::default();
    let mut reported = Vec::new();
    for number in 0..500 {
        let response = client.exchange(&outputs);
        outputs.duty[0] = 512 * response.uni[0];
        match response.uni[3..5] {
            [1, _] => outputs.duty[4..6].copy_from_slice(&[512, 0]),
            [_, 1] => outputs.duty[4..6].copy_from_slice(&[0, 512]),
            _ => {}
        }
        reported.push(response);
        if number % 100 == 0 {
            thread::sleep(pause);
        }
    }
    (reported, txt.with_machine(|machine| machine.time()))
}

#[test]
fn the_same_requests_get_the_same_responses_in_every_run() {
    let (reported, time) = run(Duration::ZERO);
    assert_eq!(run(Duration::from_millis(20)), (reported.clone(), time));
    let pressed = reported.iter().filter(|response| response.uni[0] == 1).count();
    assert!((50..450).contains(&pressed) && reported[499].counter[2] > 500, "nothing happens");
    // The delays are machine time.
    assert!(time > 500 * STEP + Duration::from_secs(2), "{time:?}");
}

#[test]
fn an_exchange_is_a_step_of_the_pace_and_is_answered_immediately() {
    for (pace, step) in [(None, STEP), (Some(Duration::ZERO), STEP), (Some(HOUR), HOUR)] {
        let builder = SimulatedTxt::builder().lock_step();
        let builder = match pace {
            Some(pace) => builder.pace(pace),
            None => builder,
        };
        let txt = builder.start().unwrap();
        let begin = Instant::now();
        let mut client = Client::online(&txt);
        for number in 1..=3 {
            client.exchange(&ExchangeData::default());
            assert_eq!(txt.with_machine(|machine| machine.time()), number * step);
        }
        assert!(begin.elapsed() < LIMIT);
    }
}

#[test]
fn a_delayed_response_is_sent_immediately_and_time_passes_in_the_machine() {
    let delay = Fault::at_exchange(1, FaultKind::Delay(HOUR));
    let txt = SimulatedTxt::builder().lock_step().fault(delay).start().unwrap();
    let mut client = Client::online(&txt);
    let outputs = ExchangeData { duty: [512, 0, 0, 0, 0, 0, 0, 0], ..Default::default() };
    let counted = [(); 3].map(|()| client.exchange(&outputs).counter[0]);
    // 200 pulses per second. The counter has 16 bits, so it wraps several times in an hour.
    assert_eq!(counted, [2, 4, (6 + 3600 * 200) as i16]);
    assert_eq!(txt.with_machine(|machine| machine.time()), 3 * STEP + HOUR);
}

#[test]
fn a_program_may_pause_for_as_long_as_it_likes() {
    let idle_limit = Duration::from_millis(20);
    let txt = lock_step().idle_limit(idle_limit).start().unwrap();
    let mut client = Client::online(&txt);
    client.exchange(&ExchangeData::default());
    thread::sleep(10 * idle_limit);
    client.exchange(&ExchangeData::default());
}

#[test]
fn the_camera_starts_up_by_machine_time() {
    let txt = SimulatedTxt::builder().lock_step().pace(HOUR).camera_start_up(HOUR).start().unwrap();
    let mut main = Client::online(&txt);
    main.start_camera(settings(160, 120, 15));
    let mut camera = CameraClient::connect(&txt);
    assert_eq!(txt.with_machine(|machine| machine.camera_frames()), 0);
    main.exchange(&ExchangeData::default());
    assert_eq!(camera.receive().number(), 0);
    camera.acknowledge();
    // An hour of frames; the client gets the newest.
    main.exchange(&ExchangeData::default());
    let frame = camera.receive();
    assert_eq!(frame.number(), 15 * 3600);
}

/// What a program sees that lets M1 of both controllers follow I1 for six seconds and moves the slide to
/// and fro. Now and then it pauses for this long, which is longer than a connection may be idle.
fn run_program(pause: Duration) -> Vec<String> {
    let txt = lock_step().idle_limit(Duration::from_millis(5)).start().unwrap();
    let builder = TransferAreaComHandler::builder(txt.address());
    let handler = builder.areas(2).lock_step().build().unwrap();
    handler.begin_transfer().unwrap();
    let mut seen = Vec::new();
    while handler.areas().lock()[LOCAL_IO].timer.timer_1s < 6 {
        let mut areas = handler.areas().wait_cycle().unwrap();
        for area in areas.iter_mut() {
            area.output.duty[0] = 512 * area.input.uni[0];
        }
        match areas[LOCAL_IO].input.uni[3..5] {
            [1, _] => areas[LOCAL_IO].output.duty[4..6].copy_from_slice(&[512, 0]),
            [_, 1] => areas[LOCAL_IO].output.duty[4..6].copy_from_slice(&[0, 512]),
            _ => {}
        }
        seen.push(format!("{} {:?}", areas.cycle(), &areas[..]));
        drop(areas);
        if seen.len() % 100 == 0 {
            thread::sleep(pause);
        }
    }
    handler.end_transfer().unwrap();
    seen
}

#[test]
fn a_handler_in_lock_step_sees_the_same_in_every_run() {
    let seen = run_program(Duration::ZERO);
    assert_eq!(run_program(Duration::from_millis(40)), seen);
    assert!((590..610).contains(&seen.len()), "{} cycles in six seconds", seen.len());
}
