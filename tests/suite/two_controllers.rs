//! One loop for two controllers: each response is answered when it comes.

use std::thread;
use std::time::Duration;

use ft_transfer_area::transfer_area::{InputMode, UniConfig, LOCAL_IO};
use ft_transfer_area::{Error, TransferArea, TransferAreaComHandler};
use ft_transfer_area_simulator::{Fault, FaultKind, SimulatedTxt};

use crate::support::{handler_for, unpaced, Record, DEADLINE};

/// A simulated TXT that numbers its responses in I1 and notes the requests.
fn numbering(record: &Record) -> SimulatedTxt {
    let noted = record.clone();
    let txt = unpaced().on_exchange(move |machine| {
        noted.note(machine);
        machine.controllers[0].uni[0] = machine.exchanges() as i16 + 1;
    });
    txt.start().unwrap()
}

/// A handler whose requests wait for the answers of all threads that got the response.
fn handler(txt: &SimulatedTxt) -> TransferAreaComHandler {
    let handler = handler_for(txt).reaction_window(DEADLINE).build().unwrap();
    handler.lock()[LOCAL_IO].config.uni[0] = UniConfig::analog(InputMode::Voltage);
    handler
}

/// An output has fewer values than there are responses.
const DUTIES: i16 = 512;

/// Asserts that each request answers the response before it, up to the last one, which stops all.
fn assert_answered(record: &Record, name: &str) {
    let duties: Vec<i16> = record.outputs().iter().map(|outputs| outputs.duty[0]).collect();
    let (_, answers) = duties.split_last().unwrap();
    for (number, duty) in answers.iter().enumerate().skip(1) {
        assert_eq!(*duty, number as i16 % DUTIES, "{name} was answered late: {duties:?}");
    }
}

#[test]
fn each_response_is_answered_in_the_next_request_with_the_other_controllers_inputs_known() {
    let records = [Record::default(), Record::default()];
    let txts = records.each_ref().map(numbering);
    let handlers = txts.each_ref().map(handler);
    handlers.iter().for_each(|handler| handler.begin_transfer().unwrap());
    let areas = handlers.each_ref().map(TransferAreaComHandler::transfer_area);
    let mut counts = [0; 2];
    while counts[0] < 300 || counts[1] < 300 {
        let (which, guard) = TransferArea::wait_any(&[&areas[0], &areas[1]]);
        let mut guard = guard.unwrap();
        counts[which] += 1;
        let other = areas[1 - which].lock();
        assert!(i64::from(other[LOCAL_IO].input.uni[0]) >= counts[1 - which]);
        drop(other);
        guard[LOCAL_IO].output.duty[0] = guard[LOCAL_IO].input.uni[0] % DUTIES;
        // Which of them is ready first changes from round to round.
        if counts[which] % 7 == 0 {
            drop(guard);
            thread::yield_now();
        }
    }
    for (handler, record) in handlers.iter().zip(&records) {
        assert_eq!(handler.statistics().late_reactions, 0);
        handler.end_transfer().unwrap();
        assert_answered(record, "a response");
    }
}

#[test]
fn a_wait_for_one_controller_after_a_wait_for_two_does_not_hold_the_others_areas() {
    let records = [Record::default(), Record::default()];
    let txts = records.each_ref().map(numbering);
    // The second controller's window ends by itself, because sometimes no thread waits for it again.
    let second = handler_for(&txts[1]).reaction_window(Duration::from_millis(1)).build().unwrap();
    let handlers = [handler(&txts[0]), second];
    handlers.iter().for_each(|handler| handler.begin_transfer().unwrap());
    let areas = handlers.each_ref().map(TransferAreaComHandler::transfer_area);
    for _ in 0..100 {
        drop(TransferArea::wait_any(&[&areas[0], &areas[1]]).1.unwrap());
        // No thread waits for the second controller now, so its areas are free.
        drop(areas[1].lock());
        drop(areas[0].wait_cycle().unwrap());
    }
    let area = handlers[1].transfer_area();
    thread::spawn(move || (0..20).for_each(|_| drop(area.wait_cycle().unwrap()))).join().unwrap();
    handlers.iter().for_each(|handler| handler.end_transfer().unwrap());
}

#[test]
fn an_error_comes_with_the_index_of_its_areas_and_the_others_go_on() {
    let good = unpaced().start().unwrap();
    let fault = Fault::at_response(50, FaultKind::WrongCrc);
    let bad = unpaced().fault(fault).start().unwrap();
    let handlers = [&good, &bad].map(handler);
    handlers.iter().for_each(|handler| handler.begin_transfer().unwrap());
    let areas = handlers.each_ref().map(TransferAreaComHandler::transfer_area);
    let (which, error) = loop {
        match TransferArea::wait_any(&[&areas[0], &areas[1]]) {
            (_, Ok(_)) => {}
            (which, Err(error)) => break (which, error),
        }
    };
    assert_eq!(which, 1);
    assert!(matches!(error, Error::WrongCrc { .. }), "{error}");
    assert!(matches!(TransferArea::wait_any(&[&areas[0], &areas[1]]), (1, Err(_))), "it stays");
    for _ in 0..10 {
        drop(TransferArea::wait_any(&[&areas[0]]).1.unwrap());
    }
    assert_eq!(handlers[0].end_transfer(), Ok(()));
}

#[test]
fn a_thread_that_waits_for_several_gets_each_end() {
    let txts = [unpaced().start().unwrap(), unpaced().start().unwrap()];
    let slow = SimulatedTxt::builder().pace(Duration::from_secs(60)).start().unwrap();
    let handlers = [handler(&slow), handler(&txts[0]), handler(&txts[1])];
    handlers.iter().for_each(|handler| handler.begin_transfer().unwrap());
    let areas = handlers.each_ref().map(TransferAreaComHandler::transfer_area);
    drop(areas[0].wait_cycle());
    thread::scope(|scope| {
        let waits = scope.spawn(|| loop {
            match TransferArea::wait_any(&[&areas[0], &areas[1]]) {
                (_, Ok(_)) => {}
                (which, Err(error)) => return (which, error),
            }
        });
        drop(areas[2].wait_cycle().unwrap());
        handlers[1].end_transfer().unwrap();
        assert_eq!(waits.join().unwrap(), (1, Error::NotStarted));
    });
}

#[test]
fn without_areas_there_is_nothing_to_wait_for() {
    let (which, error) = TransferArea::wait_any(&[]);
    assert!(matches!((which, error), (0, Err(Error::OutOfRange { given: 0, .. }))));
}

#[test]
fn in_lock_step_two_controllers_take_turns_in_each_run() {
    let txts = [unpaced().start().unwrap(), unpaced().start().unwrap()];
    let handlers = txts.each_ref().map(|txt| handler_for(txt).lock_step().build().unwrap());
    handlers.iter().for_each(|handler| handler.begin_transfer().unwrap());
    let areas = handlers.each_ref().map(TransferAreaComHandler::transfer_area);
    for cycle in 1..100 {
        for index in [0, 1] {
            let (which, guard) = TransferArea::wait_any(&[&areas[0], &areas[1]]);
            assert_eq!((which, guard.unwrap().cycle()), (index, cycle));
        }
    }
    handlers.iter().for_each(|handler| handler.end_transfer().unwrap());
}
