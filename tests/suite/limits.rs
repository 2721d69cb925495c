//! Times that a program gives: each has a range that is checked, or may be as long as there is.

use std::time::Duration;

use ft_transfer_area::transfer_area::LOCAL_IO;
use ft_transfer_area::tx::{Counter, Input, Motor};
use ft_transfer_area::{
    controller_address, find_controllers, CameraOptions, Error, EventKind, FishX1Transfer,
    I2cClient, SearchOptions, TimeLimits, TransferAreaComHandler, TransferAreaComHandlerBuilder,
    TxtClient,
};
use ft_transfer_area_simulator::world::World;
use ft_transfer_area_simulator::{Fault, FaultKind, Machine, SimulatedTxt, SimulatedTxtBuilder};

use crate::support::{handler_for, unpaced};

const MS: Duration = Duration::from_millis(1);
const MINUTE: Duration = Duration::from_secs(60);
const HOUR: Duration = Duration::from_secs(3600);

/// No server gets this port by chance.
const NOBODY: (&str, u16) = ("127.0.0.1", 1);

/// What it is, its range, and a call with it.
type Call<'a> = (&'a str, Duration, Duration, &'a dyn Fn(Duration) -> Result<(), Error>);

fn build(
    set: impl Fn(TransferAreaComHandlerBuilder) -> TransferAreaComHandlerBuilder,
) -> Result<(), Error> {
    set(TransferAreaComHandler::builder(format!("{}:{}", NOBODY.0, NOBODY.1))).build().map(drop)
}

/// Gives these limits to all calls that take some; returns the first error.
fn limits(limits: TimeLimits) -> Result<(), Error> {
    TxtClient::connect(format!("{}:{}", NOBODY.0, NOBODY.1), limits)
        .map(drop)
        .or_else(unless_refused)?;
    I2cClient::connect(format!("{}:{}", NOBODY.0, NOBODY.1), limits)
        .map(drop)
        .or_else(unless_refused)?;
    build(|builder| builder.time_limits(limits))
}

fn unless_refused(error: Error) -> Result<(), Error> {
    match error {
        Error::ConnectionRefused { .. } | Error::NoController { .. } | Error::NotStarted => Ok(()),
        // Where it takes long to find out.
        Error::ConnectTimedOut { .. } => Ok(()),
        error => Err(error),
    }
}

fn camera(options: CameraOptions) -> Result<(), Error> {
    let handler = TransferAreaComHandler::builder(NOBODY.0).build()?;
    handler.start_camera(options).map(drop).or_else(unless_refused)
}

#[test]
fn a_time_out_of_its_range_is_refused_by_the_first_call_that_can() {
    let address = &[format!("{}:{}", NOBODY.0, NOBODY.1)];
    let calls: [Call<'_>; 13] = [
        ("reaction_window", Duration::ZERO, MINUTE, &|time| build(|b| b.reaction_window(time))),
        ("watchdog", MS, HOUR, &|time| build(|b| b.watchdog(time))),
        ("connect", MS, HOUR, &|time| limits(TimeLimits::default().connect(time))),
        ("read", MS, HOUR, &|time| limits(TimeLimits::default().read(time))),
        ("write", MS, HOUR, &|time| limits(TimeLimits::default().write(time))),
        ("start_limit", MS, HOUR, &|time| camera(CameraOptions::default().start_limit(time))),
        ("frame_limit", MS, HOUR, &|time| camera(CameraOptions::default().frame_limit(time))),
        ("controller_address", MS, HOUR, &|time| controller_address("127.0.0.1", time).map(drop)),
        ("find_controllers", MS, HOUR, &|time| {
            let options = SearchOptions::default().addresses(address).limit(time);
            find_controllers(&options).map(drop).or_else(unless_refused)
        }),
        // Any port is free, and nothing connects.
        ("pace", Duration::ZERO, HOUR, &|time| simulated(|b| b.pace(time))),
        ("pace in lock-step", Duration::ZERO, HOUR, &|time| {
            simulated(|b| b.pace(time).lock_step())
        }),
        ("delay", Duration::ZERO, HOUR, &|time| fault(FaultKind::Delay(time))),
        ("jitter", Duration::ZERO, HOUR, &|time| fault(FaultKind::Jitter(time))),
    ];
    let mut mistakes = Vec::new();
    for (name, least, most, call) in calls {
        for time in [least, most] {
            if let Err(error) = call(time) {
                mistakes.push(format!("{name} of {time:?}: {error}"));
            }
        }
        let below = least.checked_sub(Duration::from_nanos(1));
        let wrong = [Some(Duration::ZERO).filter(|_| !least.is_zero()), below];
        let wrong = wrong.into_iter().flatten();
        for time in wrong.chain([most + Duration::from_nanos(1), most + MS, Duration::MAX]) {
            let range = [least, most].map(|time| time.as_millis() as i64);
            match call(time) {
                Err(Error::OutOfRange { least, most, given, .. })
                    if [least, most] == range && !(least..=most).contains(&given) => {}
                other => mistakes.push(format!("{name} of {time:?}: {other:?}")),
            }
        }
    }
    assert!(mistakes.is_empty(), "{mistakes:#?}");
    // This one would ask the usual addresses, so only with a wrong limit.
    let error = find_controllers(&SearchOptions::default().limit(Duration::MAX)).unwrap_err();
    assert!(matches!(error, Error::OutOfRange { .. }), "{error}");
}

fn simulated(set: impl Fn(SimulatedTxtBuilder) -> SimulatedTxtBuilder) -> Result<(), Error> {
    use ft_transfer_area_simulator::Error as NotStarted;
    set(SimulatedTxt::builder()).start().map(drop).map_err(|error| match error {
        NotStarted::OutOfRange { what, given, least, most } => {
            Error::OutOfRange { what, given, least, most }
        }
        other => panic!("{other}"),
    })
}

fn fault(kind: FaultKind) -> Result<(), Error> {
    simulated(|builder| builder.fault(Fault::at_response(0, kind)))
}

/// A wait without a limit, for what comes soon.
type Wait = (&'static str, fn(&TransferAreaComHandler) -> bool);

#[test]
fn the_longest_time_makes_a_wait_last_until_it_has_what_it_waits_for() {
    const EVER: Duration = Duration::MAX;
    let waits: [Wait; 8] = [
        ("wait_cycle_for", |handler| handler.areas().wait_cycle_for(EVER).is_ok()),
        ("wait_until", |handler| {
            let begin = handler.areas().statistics().cycles;
            let later = |_: &[FishX1Transfer]| handler.areas().statistics().cycles > begin + 2;
            handler.areas().wait_until(later, EVER).is_ok()
        }),
        ("wait_counter_reset", |handler| {
            handler.areas().lock()[LOCAL_IO].start_counter_reset(Counter::C1);
            handler.areas().wait_counter_reset(LOCAL_IO, Counter::C1, EVER).is_ok()
        }),
        ("wait_motor_ex", |handler| {
            handler.areas().wait_motor_ex(LOCAL_IO, Motor::M1, EVER).is_ok()
        }),
        ("wait_sound", |handler| handler.areas().wait_sound(LOCAL_IO, EVER).is_ok()),
        ("wait_input_change", |handler| {
            handler.areas().wait_input_change(LOCAL_IO, Input::I1, EVER).is_ok()
        }),
        ("Events::recv_timeout", |handler| {
            handler.areas().set_stall_limit(LOCAL_IO, Motor::M1, EVER).unwrap();
            handler.areas().set_stall_limit(LOCAL_IO, Motor::M2, Duration::ZERO).unwrap();
            let kinds = [EventKind::InputChanged, EventKind::MotorStalled];
            let events = handler.areas().events(&kinds, 10).unwrap();
            events.recv_timeout(EVER).is_ok()
        }),
        ("CycleLog::recv_timeout", |handler| {
            handler.areas().cycle_log(10).unwrap().recv_timeout(EVER).is_ok()
        }),
    ];
    for lock_step in [false, true] {
        // I1 changes with every exchange.
        let txt = unpaced().idle_limit(EVER).camera_start_up(EVER).on_exchange(|machine| {
            machine.controllers[0].uni[0] ^= 1;
        });
        let txt = if lock_step { txt.lock_step() } else { txt };
        let txt = txt.start().unwrap();
        let builder = handler_for(&txt).reconnect(EVER);
        let builder = if lock_step { builder.lock_step() } else { builder };
        let handler = builder.build().unwrap();
        handler.begin_transfer().unwrap();
        for (name, wait) in waits {
            assert!(wait(&handler), "{name}, in lock-step: {lock_step}");
        }
        assert!(txt.wait_until(|machine| machine.exchanges() > 0, EVER));
        // A lost connection is re-established.
        txt.with_machine(|machine| machine.disturb(FaultKind::Close { after: 0 }));
        while handler.areas().wait_cycle().is_ok() {}
        assert!(handler.areas().wait_cycle_for(EVER).is_ok());
        handler.end_transfer().unwrap();
    }
}

#[test]
fn no_time_is_too_long_for_a_machine() {
    for world in [None, Some(World::default())] {
        let mut machine =
            world.map_or_else(|| Machine::new(0), |world| Machine::with_world(0, world).unwrap());
        let mut areas = [FishX1Transfer::default()];
        areas[0].output.duty[0] = 512;
        machine.exchange(&mut areas, Duration::MAX);
        machine.step(MS);
        assert!(machine.time() > HOUR);
    }
}
