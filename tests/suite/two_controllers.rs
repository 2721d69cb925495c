//! Two controllers, each with a handler of its own.

use std::thread;

use ft_transfer_area::transfer_area::{InputMode, UniConfig, LOCAL_IO};
use ft_transfer_area::{TransferAreaComHandler, TransferAreas};
use ft_transfer_area_simulator::SimulatedTxt;

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
    handler.areas().lock()[LOCAL_IO].config.uni[0] = UniConfig::analog(InputMode::Voltage);
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
    thread::scope(|scope| {
        for (this, other) in [(0, 1), (1, 0)] {
            let (own, other) = (handlers[this].areas().clone(), handlers[other].areas().clone());
            scope.spawn(move || {
                let mut newest = 0;
                for _ in 0..300 {
                    let seen = other.lock()[LOCAL_IO].input.uni[0];
                    assert!(seen >= newest, "inputs of the other go back");
                    newest = seen;
                    let mut areas = own.wait_cycle().unwrap();
                    areas[LOCAL_IO].output.duty[0] = areas[LOCAL_IO].input.uni[0] % DUTIES;
                }
            });
        }
    });
    for (handler, record) in handlers.iter().zip(&records) {
        assert_eq!(handler.areas().statistics().late_reactions, 0);
        handler.end_transfer().unwrap();
        assert_answered(record, "a response");
    }
}

#[test]
fn in_lock_step_two_controllers_take_turns_in_each_run() {
    let txts = [unpaced().start().unwrap(), unpaced().start().unwrap()];
    let handlers = txts.each_ref().map(|txt| handler_for(txt).lock_step().build().unwrap());
    handlers.iter().for_each(|handler| handler.begin_transfer().unwrap());
    for cycle in 1..100 {
        for handler in &handlers {
            assert_eq!(handler.areas().wait_cycle().unwrap().cycle(), cycle);
        }
    }
    handlers.iter().for_each(|handler| handler.end_transfer().unwrap());
}

/// As in the guide on reliability.
struct EndsAll(Vec<TransferAreas>);

impl Drop for EndsAll {
    fn drop(&mut self) {
        self.0.iter().for_each(TransferAreas::ask_to_end);
    }
}

/// Notes whether the first controller has ended when only its own handler is left.
struct Between<'a>(&'a SimulatedTxt, &'a mut bool);

impl Drop for Between<'_> {
    fn drop(&mut self) {
        *self.1 = self.0.wait_until(|machine| !machine.online(), DEADLINE);
    }
}

#[test]
fn no_transfer_waits_for_the_handler_of_another_one_when_all_are_asked_before() {
    let first = unpaced().start().unwrap();
    let second = unpaced().start().unwrap();
    let mut had_ended = false;
    {
        let one = handler_for(&first).build().unwrap();
        let _between = Between(&first, &mut had_ended);
        let other = handler_for(&second).build().unwrap();
        let _ends = EndsAll(vec![one.areas().clone(), other.areas().clone()]);
        one.begin_transfer().unwrap();
        other.begin_transfer().unwrap();
        one.areas().wait_cycle().unwrap()[LOCAL_IO].output.duty[0] = 512;
    }
    assert!(had_ended);
}
