//! Waiting until a condition holds.
//!
//! Windows are long here, so that the tests also hold on a busy machine.

use std::panic::{catch_unwind, AssertUnwindSafe};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::Duration;

use ft_transfer_area::transfer_area::{FishX1Transfer, LOCAL_IO, REMOTE_IO_1};
use ft_transfer_area::tx::{Counter, Direction, Input, Motor, Sound, SILENCE};
use ft_transfer_area::{Error, TransferAreaComHandler, TransferAreas};
use ft_transfer_area_simulator::{Fault, FaultKind, SimulatedTxt};

use crate::support::{check_client, handler_for, unpaced, wait_until, DEADLINE};

/// Long enough for a few cycles, short enough for a test to wait for.
const SHORT: Duration = Duration::from_millis(50);

/// A simulated TXT whose I1 counts the responses, and O1 of each request: the answer to the count
/// before.
fn counting() -> (SimulatedTxt, Arc<Mutex<Vec<i16>>>) {
    let answers = Arc::new(Mutex::new(Vec::new()));
    let noted = Arc::clone(&answers);
    let txt = unpaced().on_exchange(move |machine| {
        let controller = &mut machine.controllers[LOCAL_IO];
        noted.lock().unwrap().push(controller.outputs.duty[0]);
        controller.uni[0] += 1;
    });
    (txt.start().unwrap(), answers)
}

/// A handler whose transfer has begun.
fn begin(txt: &SimulatedTxt, window: Duration) -> TransferAreaComHandler {
    let handler = handler_for(txt).reaction_window(window).areas(2).build().unwrap();
    handler.begin_transfer().unwrap();
    handler
}

#[test]
fn each_response_is_checked_and_the_answer_goes_out_in_the_very_next_request() {
    let (txt, answers) = counting();
    let handler = begin(&txt, DEADLINE);
    let mut checked = Vec::new();
    for asked in (10..500).step_by(10) {
        let condition = |areas: &[FishX1Transfer]| {
            checked.push(areas[LOCAL_IO].input.uni[0]);
            areas[LOCAL_IO].input.uni[0] >= asked
        };
        let mut areas = handler.areas().wait_until(condition, DEADLINE).unwrap();
        assert_eq!(areas[LOCAL_IO].input.uni[0], asked);
        areas[LOCAL_IO].output.duty[0] = asked;
    }
    // A wait begins with the last response, which another wait may have checked before.
    checked.dedup();
    assert_eq!(checked, (1..=490).collect::<Vec<i16>>());
    wait_until(&txt, "the last answer", |machine| machine.exchanges() > 490);
    assert_eq!(handler.areas().statistics().late_reactions, 0);
    handler.end_transfer().unwrap();
    let answers = answers.lock().unwrap();
    for asked in (10..500).step_by(10) {
        assert_eq!(answers[asked as usize], asked, "an input was not answered in the next request");
    }
    check_client(&txt);
}

#[test]
fn a_condition_that_holds_already_ends_the_wait_immediately_and_is_answered() {
    let (txt, answers) = counting();
    let handler = begin(&txt, 2 * DEADLINE);
    // No thread waits for the first response, so its window stays open for its whole time.
    wait_until(&txt, "the first response", |machine| machine.exchanges() == 1);
    let mut areas = handler.areas().wait_until(|_| true, DEADLINE).unwrap();
    assert_eq!(areas[LOCAL_IO].input.uni[0], 1);
    areas[LOCAL_IO].output.duty[0] = 77;
    drop(areas);
    wait_until(&txt, "the answer", |machine| machine.exchanges() == 2);
    assert_eq!(answers.lock().unwrap()[..], [0, 77]);
    let found =
        handler.areas().wait_until(|_| true, Duration::ZERO).unwrap()[LOCAL_IO].input.uni[0];
    // The handle has returned that response, so a wait for a cycle gets a newer one.
    assert!(handler.areas().wait_cycle().unwrap()[LOCAL_IO].input.uni[0] > found);
    handler.end_transfer().unwrap();
}

#[test]
fn a_condition_that_never_holds_ends_at_the_limit_and_changes_nothing() {
    // Responses come in faster than they are checked, or not at all.
    for pace in [Duration::ZERO, 4 * SHORT] {
        let txt = SimulatedTxt::builder().pace(pace).start().unwrap();
        let handler = begin(&txt, Duration::ZERO);
        handler.areas().lock()[LOCAL_IO].output.duty[3] = 33;
        handler.areas().wait_cycle().unwrap();
        let written = |area: &FishX1Transfer| (area.config, area.output, area.txt_outputs);
        let before = written(&handler.areas().lock()[LOCAL_IO]);
        let mut checks = 0;
        let never = |_: &[FishX1Transfer]| {
            checks += 1;
            thread::sleep(Duration::from_millis(1));
            false
        };
        let error = handler.areas().wait_until(never, SHORT).unwrap_err();
        assert_eq!(error, Error::WaitTimedOut { limit: SHORT });
        assert!(checks > 0);
        assert_eq!(written(&handler.areas().lock()[LOCAL_IO]), before);
        handler.areas().wait_cycle().unwrap();
        handler.end_transfer().unwrap();
    }
}

#[test]
fn a_limit_of_zero_checks_once_and_the_longest_limit_waits_for_ever() {
    let (txt, _) = counting();
    let handler = begin(&txt, Duration::ZERO);
    handler.areas().wait_cycle().unwrap();
    let limit = Duration::ZERO;
    let error = handler.areas().wait_until(|_| false, limit).unwrap_err();
    assert_eq!(error, Error::WaitTimedOut { limit });
    let begin = handler.areas().statistics().cycles as i16;
    let later = |areas: &[FishX1Transfer]| areas[LOCAL_IO].input.uni[0] > begin + 5;
    handler.areas().wait_until(later, Duration::MAX).unwrap();
}

/// Checks the error of each kind of wait.
fn check_errors(area: &TransferAreas, expected: &Error) {
    let errors = [
        area.wait_until(|_| true, DEADLINE).map(drop),
        area.wait_motor_ex(LOCAL_IO, Motor::M1, DEADLINE).map(drop),
        area.wait_counter_reset(LOCAL_IO, Counter::C1, DEADLINE).map(drop),
        area.wait_sound(LOCAL_IO, DEADLINE).map(drop),
        area.wait_input_change(LOCAL_IO, Input::I1, DEADLINE).map(drop),
    ];
    assert_eq!(errors, [(); 5].map(|()| Err(expected.clone())));
}

#[test]
fn without_a_transfer_there_is_nothing_to_wait_for() {
    let txt = unpaced().fault(Fault::at_response(50, FaultKind::WrongCrc)).start().unwrap();
    let handler = handler_for(&txt).build().unwrap();
    let area = handler.areas().clone();
    check_errors(&area, &Error::NotStarted);
    handler.begin_transfer().unwrap();
    // The first error comes during the wait, the later ones before it.
    let error = handler.areas().wait_until(|_| false, DEADLINE).unwrap_err();
    assert!(matches!(error, Error::WrongCrc { .. }), "{error:?}");
    check_errors(&area, &error);
    handler.begin_transfer().unwrap();
    handler.end_transfer().unwrap();
    check_errors(&area, &Error::NotStarted);
}

#[test]
fn a_transfer_that_is_ended_ends_the_wait() {
    let (txt, _) = counting();
    let handler = begin(&txt, DEADLINE);
    let area = handler.areas().clone();
    let waiting = thread::spawn(move || area.wait_until(|_| false, Duration::MAX).map(drop));
    wait_until(&txt, "checks", |machine| machine.exchanges() > 5);
    handler.end_transfer().unwrap();
    assert_eq!(waiting.join().unwrap(), Err(Error::NotStarted));
}

#[test]
fn an_area_that_does_not_exist_is_out_of_range() {
    let (txt, _) = counting();
    let handler = begin(&txt, DEADLINE);
    let highest = i64::try_from(usize::MAX).unwrap_or(i64::MAX);
    for (area, given) in [(2, 2), (9, 9), (usize::MAX, highest)] {
        let expected = Error::OutOfRange { what: "area's index", given, least: 0, most: 1 };
        let errors = [
            handler.areas().wait_motor_ex(area, Motor::M1, DEADLINE).map(drop),
            handler.areas().wait_counter_reset(area, Counter::C1, DEADLINE).map(drop),
            handler.areas().wait_sound(area, DEADLINE).map(drop),
            handler.areas().wait_input_change(area, Input::I1, DEADLINE).map(drop),
        ];
        assert_eq!(errors, [(); 4].map(|()| Err(expected.clone())));
    }
}

#[test]
fn inputs_of_an_earlier_transfer_are_not_looked_at() {
    let held = Arc::new(AtomicBool::new(false));
    let holds = Arc::clone(&held);
    let txt = unpaced().on_exchange(move |machine| {
        while holds.load(Ordering::Relaxed) {
            thread::sleep(Duration::from_millis(1));
        }
        machine.controllers[LOCAL_IO].uni[0] = 1;
    });
    let txt = txt.start().unwrap();
    let handler = handler_for(&txt).build().unwrap();
    for begun_before in [false, true] {
        held.store(true, Ordering::Relaxed);
        handler.begin_transfer().unwrap();
        let mut checks = 0;
        let check = |_: &[FishX1Transfer]| {
            checks += 1;
            true
        };
        let error = handler.areas().wait_until(check, SHORT).unwrap_err();
        assert_eq!((error, checks), (Error::WaitTimedOut { limit: SHORT }, 0), "{begun_before}");
        // The inputs before the first response do not count as values that change.
        thread::scope(|scope| {
            scope.spawn(|| {
                thread::sleep(SHORT / 2);
                held.store(false, Ordering::Relaxed);
            });
            let error =
                handler.areas().wait_input_change(LOCAL_IO, Input::I1, 4 * SHORT).unwrap_err();
            assert_eq!(error, Error::WaitTimedOut { limit: 4 * SHORT });
        });
        handler.end_transfer().unwrap();
    }
}

#[test]
fn a_condition_that_panics_stops_the_motors() {
    let (txt, _) = counting();
    let handler = begin(&txt, DEADLINE);
    handler.areas().lock()[LOCAL_IO].output.duty[0] = 512;
    let mistake = |areas: &[FishX1Transfer]| {
        assert!(areas[LOCAL_IO].input.uni[0] < 5, "a condition with a mistake");
        false
    };
    catch_unwind(AssertUnwindSafe(|| handler.areas().wait_until(mistake, DEADLINE).map(drop)))
        .unwrap_err();
    assert_eq!(handler.end_transfer(), Err(Error::ProgramPanicked));
    assert_eq!(txt.with_machine(|machine| machine.controllers[0].outputs.duty), [0; 8]);
}

#[test]
fn a_wait_for_a_motors_distance_never_ends_early() {
    let txt = unpaced().extensions(1).start().unwrap();
    let handler = begin(&txt, DEADLINE);
    // Outputs of an extension go out after a response has included it.
    handler.areas().wait_cycle().unwrap();
    for area in [LOCAL_IO, REMOTE_IO_1] {
        // A motor without a command is ready.
        drop(handler.areas().wait_motor_ex(area, Motor::M2, DEADLINE).unwrap());
        for pulses in 1..40 {
            let slave = [(Motor::M3, Direction::Ccw)];
            handler.areas().lock()[area]
                .start_motor_ex_cmd(Motor::M2, 512, Direction::Cw, &slave, pulses)
                .unwrap();
            for motor in [Motor::M2, Motor::M3] {
                let areas = handler.areas().wait_motor_ex(area, motor, DEADLINE).unwrap();
                assert_eq!(u32::from(areas[area].get_in_cnt_count(motor.counter())), pulses);
            }
        }
    }
    // Nothing turns it, so it does not arrive.
    handler.areas().lock()[LOCAL_IO]
        .start_motor_ex_cmd(Motor::M2, 0, Direction::Halt, &[], 1)
        .unwrap();
    let error = handler.areas().wait_motor_ex(LOCAL_IO, Motor::M2, SHORT).unwrap_err();
    assert_eq!(error, Error::WaitTimedOut { limit: SHORT });
    handler.end_transfer().unwrap();
    check_client(&txt);
}

#[test]
fn a_wait_ends_with_a_counters_reset() {
    let txt = unpaced().extensions(1).start().unwrap();
    let handler = begin(&txt, DEADLINE);
    handler.areas().wait_cycle().unwrap();
    for area in [LOCAL_IO, REMOTE_IO_1] {
        for count in 1..20 {
            txt.with_machine(|machine| machine.controllers[area].counter[3] = count);
            let counted = |areas: &[FishX1Transfer]| areas[area].input.counter[3] == count;
            let mut areas = handler.areas().wait_until(counted, DEADLINE).unwrap();
            areas[area].start_counter_reset(Counter::C4);
            drop(areas);
            let areas = handler.areas().wait_counter_reset(area, Counter::C4, DEADLINE).unwrap();
            assert_eq!(areas[area].input.counter[3], 0);
        }
    }
    handler.end_transfer().unwrap();
}

#[test]
fn a_wait_ends_with_a_sound() {
    let txt = unpaced().start().unwrap();
    let handler = begin(&txt, DEADLINE);
    handler.areas().lock()[LOCAL_IO].set_sound(Sound::Bell, 2).unwrap();
    drop(handler.areas().wait_sound(LOCAL_IO, DEADLINE).unwrap());
    // Two times 0.95 s of machine time.
    assert!(txt.with_machine(|machine| machine.exchanges()) >= 190);
    handler.areas().lock()[LOCAL_IO].set_sound(Sound::Bell, 0).unwrap();
    drop(handler.areas().wait_sound(LOCAL_IO, DEADLINE).unwrap());
    // Repeat 0 plays it once.
    assert!(txt.with_machine(|machine| machine.exchanges()) >= 285);
    // Silence has nothing to end, so its id is never reported as done; nobody waits for that.
    handler.areas().lock()[LOCAL_IO].set_sound(SILENCE, 1).unwrap();
    drop(handler.areas().wait_sound(LOCAL_IO, DEADLINE).unwrap());
}

#[test]
fn a_wait_ends_with_an_inputs_next_value() {
    let txt = unpaced().extensions(1).on_exchange(|machine| {
        let exchanges = machine.exchanges() as i16;
        machine.controllers[LOCAL_IO].uni[2] = exchanges / 20;
        machine.controllers[REMOTE_IO_1].uni[7] = -(exchanges / 30);
    });
    let txt = txt.start().unwrap();
    let handler = begin(&txt, DEADLINE);
    for (area, input, sign) in [(LOCAL_IO, Input::I3, 1), (REMOTE_IO_1, Input::I8, -1)] {
        let value = |areas: &[FishX1Transfer]| areas[area].input.uni[input.index()];
        for _ in 0..10 {
            let before = value(&handler.areas().wait_cycle().unwrap());
            let after = value(&handler.areas().wait_input_change(area, input, DEADLINE).unwrap());
            // A change may have come in between the two calls.
            assert!([sign, 2 * sign].contains(&(after - before)), "{before} {after}");
        }
    }
    let error = handler.areas().wait_input_change(LOCAL_IO, Input::I1, SHORT).unwrap_err();
    assert_eq!(error, Error::WaitTimedOut { limit: SHORT });
}
