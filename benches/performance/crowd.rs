//! A thread waits for cycles while other threads lock all the time. Does it get each response, and is
//! its answer in the next request?
//!
//! `cargo bench --bench crowd`

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use ft_transfer_area::simulator::SimulatedTxt;
use ft_transfer_area::transfer_area::LOCAL_IO;
use ft_transfer_area::TransferAreaComHandler;

/// Five seconds at the controller's pace.
const RESPONSES: usize = 500;

fn main() {
    println!("others  work  responses  got    answered in time  late  lock: median  99 %");
    for (lockers, work) in [(0, 0), (1, 0), (4, 0), (1, 100), (4, 100)] {
        measure(lockers, Duration::from_micros(work));
    }
}

/// The value of I1 in a response, and the value of O1 in the next request.
type Answer = (i16, i16);

/// Each of the other threads works for this time under its guard.
fn measure(lockers: usize, work: Duration) {
    let answers = Arc::new(Mutex::new(Vec::<Answer>::new()));
    let noted = Arc::clone(&answers);
    let mut asked = 0;
    let txt = SimulatedTxt::builder().on_exchange(move |machine| {
        let master = &mut machine.controllers[LOCAL_IO];
        noted.lock().expect("no panic").push((asked, master.outputs.duty[0]));
        asked = asked % 500 + 1;
        master.uni[0] = asked;
    });
    let txt = txt.start().expect("a simulated TXT");
    let handler = TransferAreaComHandler::builder("127.0.0.1").port(txt.port()).build();
    let handler = handler.expect("good settings");
    handler.begin_transfer().expect("a transfer");
    let stop = AtomicBool::new(false);
    let mut got = 0;
    let mut locked = std::thread::scope(|scope| {
        for _ in 0..lockers {
            let area = handler.transfer_area();
            let stop = &stop;
            scope.spawn(move || {
                while !stop.load(Ordering::Relaxed) {
                    let _areas = area.lock();
                    let begin = Instant::now();
                    while begin.elapsed() < work {
                        std::hint::spin_loop();
                    }
                }
            });
        }
        let area = handler.transfer_area();
        let locks = scope.spawn({
            let stop = &stop;
            move || lock_now_and_then(&area, stop)
        });
        let end = handler.statistics().cycles as usize + RESPONSES;
        while (handler.statistics().cycles as usize) < end {
            let mut areas = handler.wait_cycle().expect("a response");
            areas[LOCAL_IO].output.duty[0] = areas[LOCAL_IO].input.uni[0];
            got += 1;
        }
        stop.store(true, Ordering::Relaxed);
        locks.join().expect("no panic")
    });
    let late = handler.statistics().late_reactions;
    handler.end_transfer().expect("a good end");
    let answers = answers.lock().expect("no panic");
    let count = answers.len();
    let answered = answers.iter().filter(|(asked, answer)| asked == answer).count();
    locked.sort_unstable();
    let at = |part: usize| locked[(locked.len() - 1) * part / 100];
    println!(
        "{lockers:6}  {work:4?}  {count:9}  {:5.1} %  {:13.1} %  {late:4}  {:12.1?}  {:.1?}",
        100.0 * got as f64 / RESPONSES as f64,
        100.0 * answered as f64 / count as f64,
        at(50),
        at(99),
    );
}

/// How long another thread waits for the areas.
fn lock_now_and_then(area: &ft_transfer_area::TransferArea, stop: &AtomicBool) -> Vec<Duration> {
    let mut took = Vec::new();
    while !stop.load(Ordering::Relaxed) {
        std::thread::sleep(Duration::from_millis(3));
        let begin = Instant::now();
        drop(area.lock());
        took.push(begin.elapsed());
    }
    took
}
