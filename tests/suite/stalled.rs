//! A motor that should turn and does not.

use std::time::Duration;

use ft_transfer_area::channel::RecvTimeoutError;
use ft_transfer_area::transfer_area::LOCAL_IO;
use ft_transfer_area::tx::{Direction, Motor};
use ft_transfer_area::{Error, Event, EventKind, TransferAreaComHandler};
use ft_transfer_area_simulator::world::World;
use ft_transfer_area_simulator::SimulatedTxt;

use crate::support::handler_for;

/// A slide that blocks M1 at both ends, of 60 pulses.
const SLIDE: &str = "
    [master.motors.M1]
    pulses_per_turn = 63.3
    top_speed = 3
    time_constant = 0.05

    [master.motors.M1.slide]
    travel = { pulses = 60 }
    position = 30
";
const LIMIT: Duration = Duration::from_millis(300);
const LONG: Duration = Duration::from_secs(10);

#[test]
fn a_motor_that_is_blocked_is_told_once_by_the_machines_time_and_a_free_one_never() {
    let world = World::from_toml(SLIDE).unwrap();
    let txt = SimulatedTxt::builder().world(world).lock_step().start().unwrap();
    let handler = handler_for(&txt).lock_step().build().unwrap();
    handler.areas().set_stall_limit(LOCAL_IO, Motor::M1, LIMIT).unwrap();
    // M2 has no encoder, and the events of M2 are not asked for.
    handler.areas().lock()[LOCAL_IO].output.duty[2] = 512;
    let events = handler.areas().events(&[EventKind::MotorStalled], 10).unwrap();
    handler.begin_transfer().unwrap();
    assert_eq!(events.recv_timeout(LONG), Err(RecvTimeoutError::Timeout), "it has no duty");
    for duty in [[512, 0], [0, 512]] {
        handler.areas().lock()[LOCAL_IO].output.duty[..2].copy_from_slice(&duty);
        let (mut last_pulse, mut count) = (handler.areas().lock().arrived(), i16::MIN);
        let reported = loop {
            let areas = handler.areas().wait_cycle().unwrap();
            if areas[LOCAL_IO].input.counter[0] != count {
                (last_pulse, count) = (areas.arrived(), areas[LOCAL_IO].input.counter[0]);
            }
            if let Ok(reported) = events.try_recv() {
                break reported;
            }
        };
        assert_eq!(reported.arrived - last_pulse, LIMIT);
        let Event::MotorStalled { area, motor, position, .. } = reported.event else {
            panic!("{reported:?}");
        };
        assert_eq!((area, motor, position), (LOCAL_IO, Motor::M1, count as u16));
        assert_eq!(events.recv_timeout(LONG), Err(RecvTimeoutError::Timeout), "reported twice");
    }
    // A distance that ends before the end of the slide.
    let mut areas = handler.areas().lock();
    areas[LOCAL_IO].start_motor_ex_cmd(Motor::M1, 512, Direction::Cw, &[], 20).unwrap();
    drop(areas);
    drop(handler.areas().wait_motor_ex(LOCAL_IO, Motor::M1, LONG).unwrap());
    assert_eq!(events.recv_timeout(LONG), Err(RecvTimeoutError::Timeout), "it has arrived");
    handler.end_transfer().unwrap();
}

#[test]
fn an_area_that_does_not_exist_has_no_motors() {
    let handler = TransferAreaComHandler::builder("127.0.0.1").build().unwrap();
    let error = handler.areas().set_stall_limit(1, Motor::M1, LIMIT).unwrap_err();
    assert!(matches!(error, Error::OutOfRange { given: 1, .. }), "{error}");
}
