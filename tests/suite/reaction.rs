//! Inputs of response N are answered in request N + 1.
//!
//! Windows and paces are so wide here that a busy machine can't break the promise.

use std::sync::{Arc, Mutex};
use std::thread;
use std::time::Duration;

use ft_transfer_area::simulator::{Machine, SimulatedTxt, SimulatedTxtBuilder};
use ft_transfer_area::transfer_area::LOCAL_IO;
use ft_transfer_area::{Error, TransferArea};

use crate::support::{handler_for, unpaced, wait_until, DEADLINE};

/// How many input changes a program answers.
const CHANGES: usize = 200;

/// A simulated TXT that changes I1 and I2 with every response, and notes for how many of them the
/// next request did not answer with the same duty on O1 and O3.
struct Examiner {
    txt: SimulatedTxt,
    /// What the response told, and what the next request answered.
    answers: Arc<Mutex<Vec<(i16, [i16; 2])>>>,
}

impl Examiner {
    fn start(builder: SimulatedTxtBuilder) -> Self {
        let answers = Arc::new(Mutex::new(Vec::new()));
        let noted = Arc::clone(&answers);
        let mut asked = 0;
        let txt = builder.on_exchange(move |machine: &mut Machine| {
            let controller = &mut machine.controllers[LOCAL_IO];
            let duty = controller.outputs.duty;
            noted.lock().unwrap().push((asked, [duty[0], duty[2]]));
            asked = asked % 500 + 1;
            controller.uni[..2].fill(asked);
        });
        Self { txt: txt.start().unwrap(), answers }
    }

    /// Checks the answers to the first changes; the first request comes before any.
    fn check(&self, outputs: &[usize]) {
        let answers = self.answers.lock().unwrap();
        assert!(answers.len() > CHANGES);
        for (asked, answer) in &answers[1..=CHANGES] {
            for &output in outputs {
                assert_eq!(answer[output], *asked, "an input was not answered at once");
            }
        }
    }
}

/// Answers one input by one output in so many cycles.
fn answer_waiting(area: &TransferArea, index: usize) -> Result<(), Error> {
    for _ in 0..CHANGES {
        let mut areas = area.wait_cycle()?;
        areas[LOCAL_IO].output.duty[2 * index] = areas[LOCAL_IO].input.uni[index];
    }
    Ok(())
}

#[test]
fn a_waiting_program_answers_every_input_change_in_the_very_next_request() {
    let examiner = Examiner::start(SimulatedTxt::builder().idle_limit(2 * DEADLINE));
    let mut handler = handler_for(&examiner.txt).reaction_window(DEADLINE).build().unwrap();
    handler.begin_transfer().unwrap();
    answer_waiting(&handler.transfer_area(), 0).unwrap();
    wait_until(&examiner.txt, "the last answer", |machine| machine.exchanges() > CHANGES as u64);
    assert_eq!(handler.statistics().late_reactions, 0);
    handler.end_transfer().unwrap();
    examiner.check(&[0]);
}

#[test]
fn the_request_waits_for_all_threads_that_waited_for_the_response() {
    let examiner = Examiner::start(unpaced());
    let mut handler = handler_for(&examiner.txt).reaction_window(DEADLINE).build().unwrap();
    // Both must be waiting before the first response, so the first thread begins the transfer
    // when the second one is ready to wait.
    let second = handler.transfer_area();
    thread::scope(|scope| {
        handler.begin_transfer().unwrap();
        let second = scope.spawn(move || answer_waiting(&second, 1));
        answer_waiting(&handler.transfer_area(), 0).unwrap();
        second.join().unwrap().unwrap();
    });
    handler.end_transfer().unwrap();
}

#[test]
fn a_polling_program_answers_every_input_change_in_the_very_next_request() {
    let examiner = Examiner::start(unpaced());
    let window = Duration::from_millis(100);
    let mut handler = handler_for(&examiner.txt).reaction_window(window).build().unwrap();
    handler.begin_transfer().unwrap();
    while examiner.txt.with_machine(|machine| machine.exchanges()) <= CHANGES as u64 {
        let mut areas = handler.lock();
        areas[LOCAL_IO].output.duty[0] = areas[LOCAL_IO].input.uni[0];
        drop(areas);
        thread::sleep(Duration::from_millis(1));
    }
    handler.end_transfer().unwrap();
    examiner.check(&[0]);
}

#[test]
fn a_program_that_comes_late_joins_the_window_while_it_is_open() {
    let examiner = Examiner::start(unpaced());
    let mut handler = handler_for(&examiner.txt).reaction_window(DEADLINE).build().unwrap();
    handler.begin_transfer().unwrap();
    // Nobody waits for the first response, so its window is open for long.
    wait_until(&examiner.txt, "the first response", |machine| machine.exchanges() == 1);
    answer_waiting(&handler.transfer_area(), 0).unwrap();
    handler.end_transfer().unwrap();
    examiner.check(&[0]);
}

#[test]
fn without_a_window_requests_leave_at_once() {
    let txt = unpaced().start().unwrap();
    let mut handler = handler_for(&txt).reaction_window(Duration::ZERO).build().unwrap();
    handler.begin_transfer().unwrap();
    let areas = handler.wait_cycle().unwrap();
    let begin = txt.with_machine(|machine| machine.exchanges());
    wait_until(&txt, "exchanges under a held guard", |machine| machine.exchanges() > begin + 5);
    drop(areas);
    handler.end_transfer().unwrap();
}

#[test]
fn a_guard_held_longer_than_the_window_is_counted_and_its_outputs_follow_later() {
    let txt = unpaced().start().unwrap();
    let window = Duration::from_millis(1);
    let mut handler = handler_for(&txt).reaction_window(window).build().unwrap();
    handler.begin_transfer().unwrap();
    let mut areas = handler.wait_cycle().unwrap();
    areas[LOCAL_IO].output.duty[0] = 300;
    let begin = txt.with_machine(|machine| machine.exchanges());
    wait_until(&txt, "two more exchanges", |machine| machine.exchanges() >= begin + 2);
    assert_eq!(txt.with_machine(|machine| machine.controllers[0].outputs.duty[0]), 0);
    assert!(handler.statistics().late_reactions >= 1);
    drop(areas);
    wait_until(&txt, "the late duty", |machine| machine.controllers[0].outputs.duty[0] == 300);
    handler.end_transfer().unwrap();
}
