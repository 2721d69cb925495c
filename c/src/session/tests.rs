use std::time::Duration;

use ft_transfer_area::wire::CommandId;
use ft_transfer_area::TransferMode;
use ft_transfer_area_simulator::{FaultKind, Machine, SimulatedTxt};

use super::*;
use crate::memory::Ta;

fn session<A: Area>(txt: &SimulatedTxt) -> ProgramSession<A> {
    let host = txt.address().to_string();
    let settings = SessionSettings { host, dev_mode: 1, areas: 1, mode: TransferMode::Compressed };
    ProgramSession::new(&settings, None).expect("valid settings")
}

fn duty<A: Area>(session: &ProgramSession<A>) -> *mut i16 {
    session.array().places(0).output.cast::<u8>().wrapping_add(12).cast()
}

fn drives_a_motor_and_stops<A: Area>() {
    let txt = SimulatedTxt::builder().start().expect("a free port");
    let session = session::<A>(&txt);
    session.start().expect("it answers");
    assert!(session.is_running());
    session.array().store(duty(&session), 300);
    let limit = Duration::from_secs(10);
    assert!(txt.wait_until(|machine| machine.controllers[0].outputs.duty[0] == 300, limit));
    session.stop().expect("it runs");
    assert!(txt.wait_until(|machine| !machine.online(), limit));
    assert_eq!(session.array().load(duty(&session)), 0);
}

#[test]
fn the_areas_of_a_tx_and_of_a_txt_drive_a_motor_and_stop() {
    drives_a_motor_and_stops::<Ta>();
    drives_a_motor_and_stops::<FishX1Transfer>();
}

#[test]
fn i2c_is_connected_when_a_transfer_begins() {
    // It refuses clients that come later than the firmware waits.
    let txt = SimulatedTxt::builder().strict(true).start().expect("a free port");
    let session = session::<FishX1Transfer>(&txt);
    session.start().expect("it answers");
    assert!(txt.wait_until(|machine| machine.i2c_connected(), Duration::from_secs(10)));
    session.stop().expect("it runs");
    assert_eq!(txt.with_machine(|machine| machine.i2c_connections()), 1);
}

#[test]
fn the_first_inputs_are_those_of_the_programs_configuration() {
    let txt = SimulatedTxt::builder().start().expect("a free port");
    let session = session::<Ta>(&txt);
    let uni = session.array().places(0).config.cast::<u8>().wrapping_add(8);
    session.array().store(uni, 3);
    session.start().expect("it answers");
    session.stop().expect("it runs");
    let configurations = |machine: &Machine| {
        let all = machine.commands();
        all.filter(|command| *command == CommandId::UpdateConfig).count()
    };
    assert_eq!(txt.with_machine(|machine| configurations(machine)), 1);
    assert_eq!(txt.with_machine(|machine| machine.controllers[0].config.uni[0].mode), 3);
}

#[test]
fn what_is_written_whole_goes_out_whole() {
    let txt = SimulatedTxt::builder().start().expect("a free port");
    let session = session::<Ta>(&txt);
    session.start().expect("it answers");
    let limit = Duration::from_secs(10);
    session.write_whole(|array| {
        array.store(duty(&session), 300);
        let now = txt.with_machine(|machine| machine.exchanges());
        assert!(txt.wait_until(|machine| machine.exchanges() > now + 5, limit));
        assert_eq!(txt.with_machine(|machine| machine.controllers[0].outputs.duty[0]), 0);
        array.store(duty(&session).wrapping_add(2), 200);
    });
    assert!(txt.wait_until(|machine| machine.controllers[0].outputs.duty[0] == 300, limit));
    assert_eq!(txt.with_machine(|machine| machine.controllers[0].outputs.duty[2]), 200);
}

#[test]
fn a_program_whose_callback_is_quick_goes_on_after_its_computer_was_too_busy() {
    let txt = SimulatedTxt::builder().start().expect("a free port");
    let session = session::<FishX1Transfer>(&txt);
    session.set_cycle_call(Some(Box::new(|| ControlFlow::Continue(()))));
    session.start().expect("it answers");
    session.array().store(duty(&session), 300);
    let limit = Duration::from_secs(10);
    let has_duty =
        |duty: i16| txt.wait_until(|machine| machine.controllers[0].outputs.duty[0] == duty, limit);
    assert!(has_duty(300));
    // Meanwhile the thread that exchanges has to wait.
    session.write_whole(|_| assert!(has_duty(0)));
    assert!(has_duty(300));
    assert!(session.is_running());
    session.stop().expect("it runs");
}

#[test]
fn a_program_goes_on_after_a_callback_that_took_too_long() {
    let txt = SimulatedTxt::builder().start().expect("a free port");
    let session = session::<Ta>(&txt);
    let blocks = Arc::new(AtomicBool::new(false));
    let asked = Arc::clone(&blocks);
    session.set_cycle_call(Some(Box::new(move || {
        if asked.load(Ordering::Acquire) {
            thread::sleep(2 * CALLBACK_LIMIT);
        }
        ControlFlow::Continue(())
    })));
    session.start().expect("it answers");
    session.array().store(duty(&session), 300);
    let limit = Duration::from_secs(10);
    let has_duty =
        |duty: i16| txt.wait_until(|machine| machine.controllers[0].outputs.duty[0] == duty, limit);
    for is_blocked in [false, true, false] {
        blocks.store(is_blocked, Ordering::Release);
        assert!(has_duty(if is_blocked { 0 } else { 300 }));
    }
    assert!(session.is_running());
    session.stop().expect("it runs");
}

#[test]
fn what_ends_by_a_callback_is_over_for_the_program_at_once() {
    let txt = Arc::new(SimulatedTxt::builder().start().expect("a free port"));
    let session = session::<FishX1Transfer>(&txt);
    session.start().expect("it answers");
    session.array().store(duty(&session), 300);
    let limit = Duration::from_secs(10);
    assert!(txt.wait_until(|machine| machine.controllers[0].outputs.duty[0] == 300, limit));
    // The end waits for an answer for some time.
    let silent = Arc::clone(&txt);
    session.set_cycle_call(Some(Box::new(move || {
        silent.with_machine(|machine| machine.disturb(FaultKind::Silence));
        ControlFlow::Break(None)
    })));
    let begun = Instant::now();
    while session.array().load(duty(&session)) != 0 {
        assert!(begun.elapsed() < limit);
        thread::sleep(Duration::from_millis(1));
    }
    assert!(txt.with_machine(|machine| machine.online()), "it has not ended yet");
    assert!(!session.is_running());
}
