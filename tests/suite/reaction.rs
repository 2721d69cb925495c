//! Inputs of response N are answered in request N + 1.
//!
//! Windows and cycles are long here, so that the tests also hold on a busy machine.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::Duration;

use ft_transfer_area::transfer_area::LOCAL_IO;
use ft_transfer_area::{Error, TransferAreaComHandler, TransferAreaGuard, TransferAreas};
use ft_transfer_area_simulator::{Machine, SimulatedTxt, SimulatedTxtBuilder};

use crate::support::{handler_for, unpaced, wait_until, DEADLINE};

/// How many changes of an input a program answers.
const CHANGES: usize = 200;

/// A simulated TXT that changes I1 and I2 with every response, and notes how the next request
/// answers with O1 and O3.
struct Examiner {
    txt: SimulatedTxt,
    /// In the order of the requests; before the first request the inputs are 0.
    answers: Arc<Mutex<Vec<Answer>>>,
}

/// Both inputs of a response, and the two outputs of the next request.
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

    /// Checks the answers to the first changes; the first request comes before any change.
    fn check(&self) {
        let answers = self.answers.lock().unwrap();
        assert!(answers.len() > CHANGES);
        for (asked, answer) in &answers[1..=CHANGES] {
            assert_eq!(answer[0], *asked, "an input was not answered in the next request");
        }
    }
}

/// Waits for a response and answers one of its inputs by one output.
fn answer_once(area: &TransferAreas, index: usize) -> Result<i16, Error> {
    let mut areas = area.wait_cycle()?;
    let asked = areas[LOCAL_IO].input.uni[index];
    areas[LOCAL_IO].output.duty[2 * index] = asked;
    Ok(asked)
}

/// Answers all changes of the first input, and waits until the last answer is out.
fn answer_all(examiner: &Examiner, area: &TransferAreas) {
    for _ in 0..CHANGES {
        answer_once(area, 0).unwrap();
    }
    wait_until(&examiner.txt, "the last answer", |machine| machine.exchanges() > CHANGES as u64);
}

#[test]
fn a_waiting_program_answers_every_input_change_in_the_very_next_request() {
    let examiner = Examiner::start(SimulatedTxt::builder().idle_limit(2 * DEADLINE));
    let handler = handler_for(&examiner.txt).reaction_window(DEADLINE).build().unwrap();
    handler.begin_transfer().unwrap();
    answer_all(&examiner, &handler.areas().clone());
    assert_eq!(handler.areas().statistics().late_reactions, 0);
    handler.end_transfer().unwrap();
    examiner.check();
}

#[test]
fn the_request_waits_for_all_threads_that_waited_for_the_response() {
    const TOGETHER: usize = 20;
    let pace = Duration::from_millis(20);
    let examiner = Examiner::start(SimulatedTxt::builder().pace(pace));
    let handler = handler_for(&examiner.txt).reaction_window(DEADLINE).build().unwrap();
    handler.begin_transfer().unwrap();
    let stop = AtomicBool::new(false);
    // The inputs that each thread got. A thread that is too late for a response gets the next one.
    let asked: Vec<Vec<i16>> = thread::scope(|scope| {
        let threads = [0, 1].map(|index| {
            let (area, stop) = (handler.areas().clone(), &stop);
            scope.spawn(move || {
                let mut asked = Vec::new();
                while !stop.load(Ordering::Relaxed) {
                    asked.push(answer_once(&area, index).unwrap());
                }
                asked
            })
        });
        wait_until(&examiner.txt, "answers of both", |_| {
            let answers = examiner.answers.lock().unwrap();
            answers.iter().filter(|(asked, answer)| *answer == [*asked; 2]).count() > TOGETHER
        });
        stop.store(true, Ordering::Relaxed);
        threads.into_iter().map(|thread| thread.join().unwrap()).collect()
    });
    // The end may come before the last answers.
    wait_until(&examiner.txt, "the last answers", |_| {
        let answers = examiner.answers.lock().unwrap();
        asked.iter().flatten().all(|asked| answers.iter().any(|answer| answer.0 == *asked))
    });
    handler.end_transfer().unwrap();
    let answers = examiner.answers.lock().unwrap();
    for (index, asked) in asked.iter().enumerate() {
        for asked in asked {
            let (_, answer) = answers.iter().find(|answer| answer.0 == *asked).unwrap();
            assert_eq!(answer[index], *asked, "an input was not answered in the next request");
        }
    }
}

#[test]
fn a_polling_program_answers_every_input_change_in_the_very_next_request() {
    let examiner = Examiner::start(unpaced());
    let handler = handler_for(&examiner.txt).reaction_window(DEADLINE).build().unwrap();
    handler.begin_transfer().unwrap();
    let window = handler.areas().clone();
    let mut asked = 0;
    for _ in 0..CHANGES {
        asked = poll_until_asked(&handler, asked);
        // The program has written its answer, so the window may end. To wait for its end two hundred
        // times would take too long.
        drop(window.wait_cycle().unwrap());
    }
    wait_until(&examiner.txt, "the last answer", |machine| machine.exchanges() > CHANGES as u64);
    handler.end_transfer().unwrap();
    examiner.check();
}

#[test]
fn a_window_ends_by_itself_when_no_thread_waits() {
    let examiner = Examiner::start(unpaced());
    let window = Duration::from_millis(500);
    let handler = handler_for(&examiner.txt).reaction_window(window).build().unwrap();
    handler.begin_transfer().unwrap();
    let mut asked = 0;
    for _ in 0..3 {
        asked = poll_until_asked(&handler, asked);
    }
    wait_until(&examiner.txt, "the last answer", |machine| machine.exchanges() > 3);
    handler.end_transfer().unwrap();
    for (asked, answer) in &examiner.answers.lock().unwrap()[1..=3] {
        assert_eq!(answer[0], *asked, "an input was not answered in the next request");
    }
}

/// Polls until another input than the last one is there, and answers it.
fn poll_until_asked(handler: &TransferAreaComHandler, last: i16) -> i16 {
    loop {
        let mut areas = handler.areas().lock();
        let asked = areas[LOCAL_IO].input.uni[0];
        areas[LOCAL_IO].output.duty[0] = asked;
        drop(areas);
        if asked != last {
            return asked;
        }
        thread::yield_now();
    }
}

#[test]
fn a_program_that_comes_late_joins_the_window_while_it_is_open() {
    let examiner = Examiner::start(unpaced());
    let handler = handler_for(&examiner.txt).reaction_window(DEADLINE).build().unwrap();
    handler.begin_transfer().unwrap();
    // No thread waits for the first response, so its window stays open for its whole time.
    wait_until(&examiner.txt, "the first response", |machine| machine.exchanges() == 1);
    answer_all(&examiner, &handler.areas().clone());
    handler.end_transfer().unwrap();
    examiner.check();
}

#[test]
fn without_a_window_requests_leave_immediately() {
    let txt = unpaced().start().unwrap();
    let handler = handler_for(&txt).reaction_window(Duration::ZERO).build().unwrap();
    handler.begin_transfer().unwrap();
    let areas = handler.areas().wait_cycle().unwrap();
    let begin = txt.with_machine(|machine| machine.exchanges());
    wait_until(&txt, "exchanges under a held guard", |machine| machine.exchanges() > begin + 5);
    drop(areas);
    handler.end_transfer().unwrap();
}

/// Holds a guard over the end of a window and checks when its outputs go out.
fn check_late<'a>(
    handler: &'a TransferAreaComHandler,
    txt: &SimulatedTxt,
    take: impl FnOnce(&'a TransferAreaComHandler) -> TransferAreaGuard<'a>,
) {
    let mut areas = take(handler);
    areas[LOCAL_IO].output.duty[0] = 300;
    let begin = txt.with_machine(|machine| machine.exchanges());
    wait_until(txt, "two more exchanges", |machine| machine.exchanges() >= begin + 2);
    assert_eq!(txt.with_machine(|machine| machine.controllers[0].outputs.duty[0]), 0);
    drop(areas);
    assert!(handler.areas().statistics().late_reactions >= 1);
    wait_until(txt, "the late duty", |machine| machine.controllers[0].outputs.duty[0] == 300);
}

#[test]
fn a_guard_held_longer_than_the_window_is_counted_and_its_outputs_follow_later() {
    let txt = unpaced().start().unwrap();
    for waiting in [false, true] {
        let window = Duration::from_millis(1);
        let handler = handler_for(&txt).reaction_window(window).build().unwrap();
        handler.begin_transfer().unwrap();
        let begin = txt.with_machine(|machine| machine.exchanges());
        wait_until(&txt, "a response", |machine| machine.exchanges() > begin + 1);
        check_late(&handler, &txt, |handler| {
            if waiting {
                handler.areas().wait_cycle().unwrap()
            } else {
                handler.areas().lock()
            }
        });
        handler.end_transfer().unwrap();
    }
}

#[test]
fn a_guard_that_is_held_over_many_windows_is_late_once() {
    let txt = unpaced().start().unwrap();
    let handler = handler_for(&txt).reaction_window(Duration::ZERO).build().unwrap();
    handler.begin_transfer().unwrap();
    let areas = handler.areas().wait_cycle().unwrap();
    let begin = txt.with_machine(|machine| machine.exchanges());
    wait_until(&txt, "more exchanges", |machine| machine.exchanges() > begin + 5);
    drop(areas);
    assert_eq!(handler.areas().statistics().late_reactions, 1);
    handler.end_transfer().unwrap();
}

#[test]
fn a_waiting_program_answers_in_the_next_request_while_other_threads_lock_all_the_time() {
    for lockers in [1, 4] {
        let examiner = Examiner::start(unpaced());
        let handler = handler_for(&examiner.txt).reaction_window(DEADLINE).build().unwrap();
        handler.begin_transfer().unwrap();
        let stop = AtomicBool::new(false);
        thread::scope(|scope| {
            for _ in 0..lockers {
                let (area, stop) = (handler.areas().clone(), &stop);
                scope.spawn(move || {
                    while !stop.load(Ordering::Relaxed) {
                        drop(area.lock());
                    }
                });
            }
            answer_all(&examiner, &handler.areas().clone());
            stop.store(true, Ordering::Relaxed);
        });
        assert_eq!(handler.areas().statistics().late_reactions, 0);
        handler.end_transfer().unwrap();
        examiner.check();
    }
}

#[test]
fn late_answers_can_be_counted_from_outside() {
    // Each answer differs from the last, so a late answer is missing in its request.
    let examiner = Examiner::start(unpaced());
    let handler = handler_for(&examiner.txt).reaction_window(Duration::ZERO).build().unwrap();
    handler.begin_transfer().unwrap();
    let area = handler.areas().clone();
    // The first answer is late for certain: its request has left before.
    let mut areas = area.wait_cycle().unwrap();
    let mut asked = vec![areas[LOCAL_IO].input.uni[0]];
    wait_until(&examiner.txt, "the request", |_| {
        examiner.answers.lock().unwrap().iter().any(|request| request.0 == asked[0])
    });
    areas[LOCAL_IO].output.duty[0] = asked[0];
    drop(areas);
    for _ in 1..CHANGES {
        asked.push(answer_once(&area, 0).unwrap());
    }
    let late = handler.areas().statistics().late_reactions;
    // Two more responses, so that the last answer has left.
    let seen = examiner.txt.with_machine(|machine| machine.exchanges());
    wait_until(&examiner.txt, "the last answer", |machine| machine.exchanges() > seen + 2);
    handler.end_transfer().unwrap();
    let answers = examiner.answers.lock().unwrap();
    let mut missing = 0;
    let mut requests = answers.iter();
    for asked in &asked {
        // The request after the response that was answered.
        let (_, answer) = requests.find(|request| request.0 == *asked).unwrap();
        missing += u64::from(answer[0] != *asked);
    }
    assert!(missing > 0, "the first answer is late");
    assert_eq!(late, missing);
}

#[test]
fn a_watchdog_that_is_fed_does_not_end_the_window() {
    let (window, limit) = (Duration::from_secs(60), Duration::from_millis(600));
    // On a busy machine the watchdog may expire, but not each time.
    for _ in 0..10 {
        let txt = unpaced().start().unwrap();
        let handler = handler_for(&txt).reaction_window(window).watchdog(limit).build().unwrap();
        handler.begin_transfer().unwrap();
        // Nobody waits for the first response, so its window is open for its whole time.
        wait_until(&txt, "the first response", |machine| machine.exchanges() == 1);
        let fed = (0..4).all(|_| {
            thread::sleep(limit / 3);
            handler.areas().feed_watchdog().is_ok()
        });
        let exchanges = txt.with_machine(|machine| machine.exchanges());
        handler.end_transfer().unwrap();
        if fed {
            assert_eq!(exchanges, 1, "the window has ended early");
            return;
        }
    }
    panic!("the watchdog expires each time");
}
