use super::*;
use crate::handler::program::known::Known;

fn deliver(shared: &Shared) {
    let nothing = &mut Inputs::default();
    Side(shared).deliver(&Inputs::default(), 0, nothing, &mut Inputs::default());
}

#[test]
fn a_program_that_waits_for_a_late_response_does_not_hang() {
    let limit = Duration::from_millis(20);
    for waits in [true, false] {
        let shared = Shared::running(Some(limit), false);
        if waits {
            shared.state().begin_wait(&mut Known::default(), 0).unwrap();
        }
        std::thread::sleep(limit);
        let late = Instant::now();
        deliver(&shared);
        assert_eq!(shared.state().next_deadline(None).unwrap() >= late + limit, waits);
    }
}

#[test]
fn a_thread_that_waits_while_another_has_the_areas_is_no_sign_of_life() {
    let limit = Duration::from_secs(60);
    let shared = Shared::running(Some(limit), false);
    let mut held = shared.lock(Known::default());
    let taken = Instant::now();
    std::thread::sleep(Duration::from_millis(2));
    // As a thread that begins to wait, and the hook that waits.
    shared.state().begin_wait(&mut Known::default(), 0).unwrap();
    shared.state().tickets.set_hook();
    deliver(&shared);
    assert!(shared.state().next_deadline(None).unwrap() <= taken + limit);
    shared.release(&mut held, false);
    assert!(shared.state().next_deadline(None).unwrap() > taken + limit);
}

#[test]
fn the_hook_is_not_called_for_a_response_before_a_gap_or_the_end() {
    use crate::handler::state::HookStep;

    let shared = Shared::running(None, false);
    let hook = shared.state().tickets.set_hook();
    let known = &mut Known::default();
    deliver(&shared);
    let error = Error::ConnectionClosed { command: "ExchangeData", received: 0 };
    Side(&shared).lose_connection(&error, &mut [Outgoing::default()]);
    let step = shared.state().hook_step(hook, known);
    assert!(matches!(step, HookStep::Call(Err(Error::ConnectionLost { .. }), _)), "{step:?}");
    let step = shared.state().hook_step(hook, known);
    assert!(matches!(step, HookStep::Wait), "a call after the gap: {step:?}");
    deliver(&shared);
    shared.ask_to_stop(Stop::Asked);
    Side(&shared).finish(None);
    let step = shared.state().hook_step(hook, known);
    assert!(matches!(step, HookStep::Wait), "a call after the end: {step:?}");
}

#[test]
fn an_interruption_ends_a_wait_that_has_its_response_but_not_the_areas() {
    let shared = Shared::running(None, false);
    let mut held = shared.lock(Known::default());
    deliver(&shared);
    std::thread::scope(|scope| {
        let waits = scope.spawn(|| {
            let lease = shared.wait_cycle(&mut Known::default(), 0, None);
            lease.map(|lease| lease.is_some())
        });
        while shared.state().next_may_leave() {}
        let error = Error::ConnectionClosed { command: "ExchangeData", received: 0 };
        Side(&shared).lose_connection(&error, &mut [Outgoing::default()]);
        let seen = waits.join().unwrap();
        assert!(matches!(seen, Err(Error::ConnectionLost { .. })), "{seen:?}");
    });
    shared.release(&mut held, false);
}

#[test]
fn an_interruption_ends_a_look_at_the_inputs_that_waits_for_the_areas() {
    let shared = Shared::running(None, false);
    deliver(&shared);
    let mut held = shared.lock(Known::default());
    Side(&shared).hold_window(None, Duration::ZERO, &mut [Outgoing::default()]);
    std::thread::scope(|scope| {
        let looks = scope.spawn(|| {
            let lease = shared.look(&mut Known::default(), None);
            lease.map(|lease| lease.is_some())
        });
        while shared.state().tickets.len() < 2 {}
        let error = Error::ConnectionClosed { command: "ExchangeData", received: 0 };
        Side(&shared).lose_connection(&error, &mut [Outgoing::default()]);
        let seen = looks.join().unwrap();
        assert!(matches!(seen, Err(Error::ConnectionLost { .. })), "{seen:?}");
    });
    shared.release(&mut held, false);
}

#[test]
fn a_hook_is_called_from_the_next_response_on_and_not_for_an_old_gap() {
    use crate::handler::state::HookStep;

    let shared = Shared::running(None, false);
    deliver(&shared);
    let error = Error::ConnectionClosed { command: "ExchangeData", received: 0 };
    Side(&shared).lose_connection(&error, &mut [Outgoing::default()]);
    deliver(&shared);
    let (hook, mut known) = shared.replace_hook(true).unwrap();
    let step = shared.state().hook_step(hook, &mut known);
    assert!(matches!(step, HookStep::Wait), "{step:?}");
    deliver(&shared);
    let step = shared.state().hook_step(hook, &mut known);
    let HookStep::Call(Ok(mut lease), _) = step else { panic!("{step:?}") };
    assert_eq!(lease.response, 3);
    shared.release(&mut lease, false);
}

#[test]
fn a_transfer_that_gets_no_thread_ends_for_those_that_wait() {
    let shared = Shared::running(None, false);
    std::thread::scope(|scope| {
        let waits = scope.spawn(|| shared.wait_cycle(&mut Known::default(), 0, None).map(|_| ()));
        while shared.state().tickets.len() == 0 {}
        Side(&shared).fail(Error::ProgramPanicked);
        assert_eq!(waits.join().unwrap(), Err(Error::ProgramPanicked));
    });
}

#[test]
fn a_hook_is_called_first_with_an_expired_watchdog_that_nobody_knows_of() {
    use crate::handler::state::HookStep;

    let limit = Duration::from_millis(20);
    let shared = Shared::running(Some(limit), false);
    std::thread::sleep(limit);
    deliver(&shared);
    Side(&shared).hold_window(None, Duration::ZERO, &mut [Outgoing::default()]);
    assert_eq!(shared.state().next_deadline(None), None, "it has not expired");
    let (hook, mut known) = shared.replace_hook(true).unwrap();
    let step = shared.state().hook_step(hook, &mut known);
    assert!(matches!(step, HookStep::Call(Err(Error::WatchdogExpired { .. }), _)), "{step:?}");
    assert!(shared.state().next_deadline(None).is_some(), "no watchdog runs");
}
