use super::*;
use crate::handler::program::known::Known;

fn deliver(shared: &Shared) {
    let nothing = &mut Inputs::default();
    shared.deliver(&Inputs::default(), nothing, &mut Inputs::default());
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
    let shared = Shared::running(None, false);
    let hook = shared.state().tickets.set_hook();
    let known = &mut Known::default();
    deliver(&shared);
    let error = Error::ConnectionClosed { command: "ExchangeData", received: 0 };
    shared.lose_connection(&error, &mut [Outgoing::default()]);
    let call = shared.state().hook_call(hook, known);
    assert!(matches!(call, Some(Err(Error::ConnectionLost { .. }))), "{call:?}");
    let call = shared.state().hook_call(hook, known);
    assert!(call.is_none(), "a call after the gap: {call:?}");
    deliver(&shared);
    shared.ask_to_stop(Stop::Asked);
    shared.finish(None);
    let call = shared.state().hook_call(hook, known);
    assert!(call.is_none(), "a call after the end: {call:?}");
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
        shared.lose_connection(&error, &mut [Outgoing::default()]);
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
    shared.hold_window(None, Duration::ZERO, &mut [Outgoing::default()]);
    std::thread::scope(|scope| {
        let looks = scope.spawn(|| {
            let lease = shared.look(&mut Known::default(), None);
            lease.map(|lease| lease.is_some())
        });
        while shared.state().tickets.newest() < 2 {}
        let error = Error::ConnectionClosed { command: "ExchangeData", received: 0 };
        shared.lose_connection(&error, &mut [Outgoing::default()]);
        let seen = looks.join().unwrap();
        assert!(matches!(seen, Err(Error::ConnectionLost { .. })), "{seen:?}");
    });
    shared.release(&mut held, false);
}

#[test]
fn a_hook_is_called_from_the_next_response_on_and_not_for_an_old_gap() {
    let shared = Shared::running(None, false);
    deliver(&shared);
    let error = Error::ConnectionClosed { command: "ExchangeData", received: 0 };
    shared.lose_connection(&error, &mut [Outgoing::default()]);
    deliver(&shared);
    let (hook, mut known) = shared.replace_hook(true).unwrap();
    let call = shared.state().hook_call(hook, &mut known);
    assert!(call.is_none(), "{call:?}");
    deliver(&shared);
    let call = shared.state().hook_call(hook, &mut known);
    let Some(Ok(mut lease)) = call else { panic!("{call:?}") };
    assert_eq!(lease.response, 3);
    shared.release(&mut lease, false);
}

#[test]
fn a_transfer_that_gets_no_thread_ends_for_those_that_wait() {
    let shared = Shared::running(None, false);
    std::thread::scope(|scope| {
        let waits = scope.spawn(|| shared.wait_cycle(&mut Known::default(), 0, None).map(|_| ()));
        while shared.state().tickets.newest() == 0 {}
        shared.fail(Error::ProgramPanicked);
        assert_eq!(waits.join().unwrap(), Err(Error::ProgramPanicked));
    });
}

#[test]
fn a_hook_is_called_first_with_an_expired_watchdog_that_nobody_knows_of() {
    let limit = Duration::from_millis(20);
    let shared = Shared::running(Some(limit), false);
    std::thread::sleep(limit);
    deliver(&shared);
    shared.hold_window(None, Duration::ZERO, &mut [Outgoing::default()]);
    assert_eq!(shared.state().next_deadline(None), None, "it has not expired");
    let (hook, mut known) = shared.replace_hook(true).unwrap();
    let call = shared.state().hook_call(hook, &mut known);
    assert!(matches!(call, Some(Err(Error::WatchdogExpired { .. }))), "{call:?}");
    assert!(shared.state().next_deadline(None).is_some(), "no watchdog runs");
}
