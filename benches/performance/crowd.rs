//! A program waits for cycles while other threads lock all the time: whether it gets each response, and whether its
//! answer is in the next request.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc;
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{anyhow, Result};
use ft_transfer_area::transfer_area::LOCAL_IO;
use ft_transfer_area::{Error, TransferAreaComHandler, TransferAreas};
use ft_transfer_area_simulator::SimulatedTxt;

use crate::report::{Report, Table};
use crate::stats::Sorted;

/// Threads that lock all the time.
struct Crowd {
    name: &'static str,
    count: usize,
    /// How long each works under its guard.
    work: Duration,
}

const CROWDS: [Crowd; 5] = [
    Crowd { name: "none", count: 0, work: Duration::ZERO },
    Crowd { name: "one", count: 1, work: Duration::ZERO },
    Crowd { name: "four", count: 4, work: Duration::ZERO },
    Crowd {
        name: "one that works for 100 µs each time",
        count: 1,
        work: Duration::from_micros(100),
    },
    Crowd {
        name: "four that work for 100 µs each time",
        count: 4,
        work: Duration::from_micros(100),
    },
];

/// What was seen beside a crowd.
struct Seen {
    /// For each request: the value of I1 in the response before it, and its value of O1.
    requests: Vec<(i16, i16)>,
    /// How many responses the program got.
    got: usize,
    late: u64,
    /// How long the last thread waited for the areas each time, in µs.
    locks: Vec<f64>,
}

pub(crate) fn measure(report: &Report) -> Result<()> {
    let mut requests = report.raw("crowd", &["other threads", "request", "I1 was", "O1 is"])?;
    let mut locks = report.raw("crowd_locks", &["other threads", "lock µs"])?;
    let mut table = Table::new([
        "other threads",
        "responses that the program got",
        "answered in the next request",
        "late reactions",
        "lock time of the last thread: median",
        "99 %",
    ]);
    // At the controller's pace.
    let responses = report.times(500, 20);
    for crowd in CROWDS {
        let seen = beside(&crowd, responses)?;
        for (number, (asked, answer)) in seen.requests.iter().enumerate() {
            let numbers = [number.to_string(), asked.to_string(), answer.to_string()];
            requests
                .write_record([crowd.name].into_iter().chain(numbers.iter().map(String::as_str)))?;
        }
        for lock in &seen.locks {
            locks.write_record([crowd.name, &lock.to_string()])?;
        }
        table.row(row(&crowd, responses, seen));
    }
    requests.flush()?;
    locks.flush()?;
    report.table("crowd", &table)
}

fn row(crowd: &Crowd, responses: usize, seen: Seen) -> [String; 6] {
    let answered = seen.requests.iter().filter(|(asked, answer)| asked == answer).count();
    let percent = |part: usize, all: usize| format!("{:.1} %", 100.0 * part as f64 / all as f64);
    let locks = Sorted::of(seen.locks);
    [
        crowd.name.to_owned(),
        percent(seen.got, responses),
        percent(answered, seen.requests.len()),
        seen.late.to_string(),
        format!("{:.1} µs", locks.median()),
        format!("{:.1} µs", locks.quantile(0.99)),
    ]
}

fn beside(crowd: &Crowd, responses: usize) -> Result<Seen> {
    let (noted, requests) = mpsc::channel();
    let mut asked = 0;
    let txt = SimulatedTxt::builder().on_exchange(move |machine| {
        let master = &mut machine.controllers[LOCAL_IO];
        // Nobody asks for it any more when the measurement has failed.
        let _ = noted.send((asked, master.outputs.duty[0]));
        asked = asked % 500 + 1;
        master.uni[0] = asked;
    });
    let txt = txt.start()?;
    let handler = TransferAreaComHandler::builder(txt.address()).build()?;
    handler.begin_transfer()?;
    // Before the others begin.
    answer(&handler, handler.areas().statistics().cycles + 1)?;
    let first = handler.areas().statistics().cycles;
    let end = first + responses as u64;
    let over = AtomicBool::new(false);
    let (got, locks) = thread::scope(|scope| {
        for _ in 0..crowd.count {
            let area = handler.areas().clone();
            scope.spawn(|| lock_all_the_time(area, crowd.work, &over));
        }
        let area = handler.areas().clone();
        let locks = scope.spawn(|| lock_now_and_then(area, &over));
        let got = answer(&handler, end);
        // Also after an error: the scope waits for all threads.
        over.store(true, Ordering::Relaxed);
        let locks = locks.join().map_err(|_| anyhow!("the thread that locks has panicked"))?;
        Ok::<_, anyhow::Error>((got?, locks))
    })?;
    let late = handler.areas().statistics().late_reactions;
    handler.end_transfer()?;
    drop(txt);
    // The first request follows no response, and the one after the last response may stop the motors.
    let requests = requests.iter().skip(first as usize).take(responses).collect();
    Ok(Seen { requests, got, late, locks })
}

/// Answers responses until there were this many; returns how many it got.
fn answer(handler: &TransferAreaComHandler, end: u64) -> Result<usize, Error> {
    let mut got = 0;
    while handler.areas().statistics().cycles < end {
        let mut areas = handler.areas().wait_cycle()?;
        areas[LOCAL_IO].output.duty[0] = areas[LOCAL_IO].input.uni[0];
        got += 1;
    }
    Ok(got)
}

fn lock_all_the_time(area: TransferAreas, work: Duration, over: &AtomicBool) {
    while !over.load(Ordering::Relaxed) {
        let _areas = area.lock();
        let begin = Instant::now();
        while begin.elapsed() < work {
            std::hint::spin_loop();
        }
    }
}

/// How long another thread waits for the areas, in µs.
fn lock_now_and_then(area: TransferAreas, over: &AtomicBool) -> Vec<f64> {
    let mut took = Vec::new();
    loop {
        let begin = Instant::now();
        drop(area.lock());
        took.push(begin.elapsed().as_secs_f64() * 1e6);
        if over.load(Ordering::Relaxed) {
            return took;
        }
        thread::sleep(Duration::from_millis(3));
    }
}
