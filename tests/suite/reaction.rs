//! Inputs of response N are answered in request N + 1.
//!
//! Windows and paces are so wide here that a busy machine can't break the promise.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::Duration;

use ft_transfer_area::simulator::{Machine, SimulatedTxt, SimulatedTxtBuilder};
use ft_transfer_area::transfer_area::LOCAL_IO;
use ft_transfer_area::{Error, TransferArea};

use crate::support::{handler_for, unpaced, wait_until, DEADLINE};

/// How many input changes a program answers.
const CHANGES: usize = 200;

/// A simulated TXT that changes I1 and I2 with every response, and notes how the next request
/// answers with O1 and O3.
struct Examiner {
    txt: SimulatedTxt,
    /// In the order of the requests; before the first one, no response has told anything but 0.
    answers: Arc<Mutex<Vec<Answer>>>,
}

/// What a response told on both inputs, and the two outputs of the next request.
type Answer = (i16, [i16; 2]);

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
    fn check(&self) {
        let answers = self.answers.lock().unwrap();
        assert!(answers.len() > CHANGES);
        for (asked, answer) in &answers[1..=CHANGES] {
            assert_eq!(answer[0], *asked, "an input was not answered at once");
        }
    }
}

/// Waits for a response and answers one of its inputs by one output.
fn answer_once(area: &TransferArea, index: usize) -> Result<(), Error> {
    let mut areas = area.wait_cycle()?;
    areas[LOCAL_IO].output.duty[2 * index] = areas[LOCAL_IO].input.uni[index];
    Ok(())
}

/// Answers all changes of the first input, and waits until the last answer is out.
fn answer_all(examiner: &Examiner, area: &TransferArea) {
    for _ in 0..CHANGES {
        answer_once(area, 0).unwrap();
    }
    wait_until(&examiner.txt, "the last answer", |machine| machine.exchanges() > CHANGES as u64);
}

#[test]
fn a_waiting_program_answers_every_input_change_in_the_very_next_request() {
    let examiner = Examiner::start(SimulatedTxt::builder().idle_limit(2 * DEADLINE));
    let mut handler = handler_for(&examiner.txt).reaction_window(DEADLINE).build().unwrap();
    handler.begin_transfer().unwrap();
    answer_all(&examiner, &handler.transfer_area());
    assert_eq!(handler.statistics().late_reactions, 0);
    handler.end_transfer().unwrap();
    examiner.check();
}

#[test]
fn the_request_waits_for_all_threads_that_waited_for_the_response() {
    const TOGETHER: usize = 20;
    let pace = Duration::from_millis(100);
    let examiner = Examiner::start(SimulatedTxt::builder().pace(pace));
    let mut handler = handler_for(&examiner.txt).reaction_window(DEADLINE).build().unwrap();
    handler.begin_transfer().unwrap();
    let stop = AtomicBool::new(false);
    let both_since = thread::scope(|scope| {
        for index in 0..2 {
            let (area, stop) = (handler.transfer_area(), &stop);
            scope.spawn(move || {
                while !stop.load(Ordering::Relaxed) {
                    answer_once(&area, index).unwrap();
                }
            });
        }
        // The threads may come to their first response at different times.
        let is_answered = |(asked, answer): &Answer| *asked > 0 && *answer == [*asked; 2];
        let mut both_since = None;
        wait_until(&examiner.txt, "answers of both", |_| {
            let answers = examiner.answers.lock().unwrap();
            both_since = answers.iter().position(is_answered);
            both_since.is_some_and(|first| answers.len() >= first + TOGETHER)
        });
        stop.store(true, Ordering::Relaxed);
        both_since.unwrap()
    });
    handler.end_transfer().unwrap();
    for (asked, answer) in &examiner.answers.lock().unwrap()[both_since..][..TOGETHER] {
        assert_eq!(*answer, [*asked; 2], "an input was not answered by both at once");
    }
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
    examiner.check();
}

#[test]
fn a_program_that_comes_late_joins_the_window_while_it_is_open() {
    let examiner = Examiner::start(unpaced());
    let mut handler = handler_for(&examiner.txt).reaction_window(DEADLINE).build().unwrap();
    handler.begin_transfer().unwrap();
    // Nobody waits for the first response, so its window is open for long.
    wait_until(&examiner.txt, "the first response", |machine| machine.exchanges() == 1);
    answer_all(&examiner, &handler.transfer_area());
    handler.end_transfer().unwrap();
    examiner.check();
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
