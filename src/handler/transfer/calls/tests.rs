use super::*;
use crate::handler::parts::clock::TransferClock;
use crate::handler::parts::watchdog::Watchdog;
use crate::handler::program::lease::Known;

#[test]
fn a_program_that_waits_for_a_late_response_does_not_hang() {
    let limit = Duration::from_millis(20);
    for waits in [true, false] {
        let shared =
            Shared::new(1, Watchdog::new(Some(limit)), Duration::MAX, TransferClock::new(false));
        shared.begin().unwrap();
        shared.run(0).unwrap();
        if waits {
            shared.state().window.expect();
        }
        std::thread::sleep(limit);
        let nothing = &mut Inputs::default();
        let late = Instant::now();
        shared.deliver(&Inputs::default(), 0, nothing, &mut Inputs::default());
        assert_eq!(shared.state().watchdog.deadline().unwrap() >= late + limit, waits);
    }
}

#[test]
fn a_thread_that_waits_while_another_has_the_areas_is_no_sign_of_life() {
    let limit = Duration::from_secs(60);
    let shared =
        Shared::new(1, Watchdog::new(Some(limit)), Duration::MAX, TransferClock::new(false));
    shared.begin().unwrap();
    shared.run(0).unwrap();
    let mut held = shared.lock(Known::default());
    let taken = Instant::now();
    std::thread::sleep(Duration::from_millis(2));
    // As a thread that begins to wait, and the hook that waits.
    shared.state().window.expect();
    shared.state().hook.set();
    shared.deliver(&Inputs::default(), 0, &mut Inputs::default(), &mut Inputs::default());
    assert!(shared.state().watchdog.deadline().unwrap() <= taken + limit);
    shared.release(&mut held, false);
    assert!(shared.state().watchdog.deadline().unwrap() > taken + limit);
}

#[test]
fn the_hook_is_not_called_for_a_response_after_a_gap_or_the_end() {
    let shared = Shared::new(1, Watchdog::new(None), Duration::MAX, TransferClock::new(false));
    shared.begin().unwrap();
    shared.run(0).unwrap();
    shared.state().hook.set();
    let deliver = || {
        let nothing = &mut Inputs::default();
        shared.deliver(&Inputs::default(), 0, nothing, &mut Inputs::default());
    };
    deliver();
    let error = Error::ConnectionClosed { command: "ExchangeData", received: 0 };
    shared.lose_connection(&error, &mut [FishX1Transfer::default()]);
    assert!(!shared.state().hook.is_due(), "a call after the gap");
    deliver();
    shared.ask_to_end();
    shared.finish(None);
    assert!(!shared.state().hook.is_due(), "a call after the end");
    assert_eq!(shared.statistics().missed_hook_calls, 1);
}
