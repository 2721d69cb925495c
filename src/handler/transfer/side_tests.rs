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
    assert!(matches!(step, HookStep::Call(Err(Error::ConnectionLost { .. }))), "{step:?}");
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
