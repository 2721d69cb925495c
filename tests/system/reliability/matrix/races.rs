//! What two threads do to one transfer at the same moment.

use std::sync::{Arc, Barrier, Mutex};
use std::thread;
use std::time::{Duration, Instant};

use ft_transfer_area::transfer_area::LOCAL_IO;
use ft_transfer_area::tx::{Counter, Direction, Motor, Sound};
use ft_transfer_area::{Error, FishX1Transfer, TransferAreaComHandler, TransferAreas};
use ft_transfer_area_simulator::{Machine, SimulatedTxt};

use super::controller::{is_on, txt, DUTY};
use super::row::{By, Outcome, Row, Seen, Turn, DEADLINE};

const SECTION: &str = "Two threads and one transfer";

/// How often each is tried.
const ROUNDS: u32 = 200;

/// Farther than a motor turns in a round.
const DISTANCE: u32 = 3000;

/// A value of C4 that only a reset changes.
const COUNT: i16 = 77;

/// Gives a command.
type Order = fn(&mut FishX1Transfer);

/// Waits until it is done.
type Wait = fn(&TransferAreas) -> Result<(), Error>;

/// Whether the controller has carried it out.
type Check = fn(&Machine) -> bool;

pub(crate) fn rows() -> Vec<Row> {
    let row = |place, order: Order, wait: Wait, check: Check| {
        Row::new(SECTION, "a command while another thread ends the transfer", place)
            .sees("`NotStarted`, or it was carried out", "two exchanges")
            .by(&[By::Exchange])
            .turn(Turn::First)
            .test(move || Ok(order_beside_end(order, wait, check)))
    };
    vec![
        Row::new(SECTION, "`begin_transfer` and `end_transfer`", "at the same time, 200 times")
            .sees("nothing: after `end_transfer` has returned no duty is sent", "–")
            .by(&[By::Exchange])
            .turn(Turn::First)
            .test(|| Ok(begin_beside_end())),
        row(
            "a distance, 200 times",
            |area| {
                let direction = Direction::Cw;
                area.start_motor_ex_cmd(Motor::M1, DUTY, direction, &[], DISTANCE).unwrap();
            },
            |area| area.wait_motor_ex(LOCAL_IO, Motor::M1, DEADLINE).map(drop),
            |machine| machine.controllers[0].counter[0].unsigned_abs() >= DISTANCE as u16,
        ),
        row(
            "a counter reset, 200 times",
            |area| area.start_counter_reset(Counter::C4),
            |area| area.wait_counter_reset(LOCAL_IO, Counter::C4, DEADLINE).map(drop),
            |machine| machine.controllers[0].counter[3] != COUNT,
        ),
        row(
            "a sound, 200 times",
            |area| area.set_sound(Sound::Bell, 1).unwrap(),
            |area| area.wait_sound(LOCAL_IO, DEADLINE).map(drop),
            // The script notes here that the sound was played.
            |machine| machine.controllers[0].uni[7] != 0,
        ),
    ]
}

/// A different short time for each round, so that the two threads meet at all their steps.
fn spin(round: u32, step: Duration) {
    let begin = Instant::now();
    while begin.elapsed() < step * (round % 20) {
        std::hint::spin_loop();
    }
}

/// One thread begins a transfer while another one ends it.
fn begin_beside_end() -> Outcome {
    // By connection, when a duty came in.
    let duties: Arc<Mutex<Vec<(u64, Instant)>>> = Arc::default();
    let noted = Arc::clone(&duties);
    let txt = SimulatedTxt::builder().pace(Duration::ZERO).on_exchange(move |machine| {
        if is_on(machine) {
            noted.lock().unwrap().push((machine.connections(), Instant::now()));
        }
    });
    let txt = txt.start().unwrap();
    let builder = TransferAreaComHandler::builder(txt.address());
    let handler = builder.build().unwrap();
    for round in 0..ROUNDS {
        handler.areas().lock()[LOCAL_IO].output.duty[0] = DUTY;
        let before = txt.with_machine(|machine| machine.connections());
        let ended = thread::scope(|scope| {
            let ending = scope.spawn(|| {
                let connected = |machine: &Machine| machine.connections() > before;
                assert!(txt.wait_until(connected, DEADLINE));
                spin(round, Duration::from_micros(20));
                assert_eq!(handler.end_transfer(), Ok(()));
                Instant::now()
            });
            let result = handler.begin_transfer();
            assert!(matches!(result, Ok(()) | Err(Error::NotStarted)), "{result:?}");
            ending.join().unwrap()
        });
        // The connection was made before the end was asked for, so it was the end of this transfer.
        assert!(!handler.areas().is_running(), "round {round}");
        let sent = duties.lock().unwrap().iter().filter(|(_, at)| *at > ended).count();
        assert_eq!(sent, 0, "a duty was sent after end_transfer in round {round}");
        assert!(txt.wait_until(|machine| !is_on(machine), DEADLINE));
    }
    // The next beginning works.
    assert_eq!(handler.begin_transfer(), Ok(()));
    assert_eq!(handler.end_transfer(), Ok(()));
    Outcome { seen: Seen::Nothing, soon: None, by: By::Exchange, stopped: None }
}

/// One thread gives a command while another one ends the transfer.
fn order_beside_end(order: Order, wait: Wait, check: Check) -> Outcome {
    let builder = txt().on_exchange(|machine| {
        let controller = &mut machine.controllers[0];
        if controller.outputs.sound_index != 0 {
            controller.uni[7] = 1;
        }
    });
    let txt = builder.start().unwrap();
    let (mut refused, mut took) = (0, Vec::new());
    for round in 0..ROUNDS {
        // A handler with no command before this one.
        let builder = TransferAreaComHandler::builder(txt.address());
        let handler = builder.build().unwrap();
        let area = handler.areas().clone();
        handler.begin_transfer().unwrap();
        drop(area.wait_cycle().unwrap());
        txt.with_machine(|machine| {
            let controller = &mut machine.controllers[0];
            (controller.uni[7], controller.counter[0], controller.counter[3]) = (0, 0, COUNT);
        });
        let (barrier, begin) = (Barrier::new(2), Instant::now());
        let result = thread::scope(|scope| {
            let ordering = scope.spawn(|| {
                // The guard is locked before or after the end is asked for.
                let mut guard = None;
                if round % 2 == 0 {
                    order(&mut guard.insert(area.lock())[LOCAL_IO]);
                }
                barrier.wait();
                spin(round, Duration::from_millis(1));
                if round % 2 != 0 {
                    order(&mut guard.insert(area.lock())[LOCAL_IO]);
                }
                drop(guard);
                wait(&area)
            });
            barrier.wait();
            assert_eq!(handler.end_transfer(), Ok(()));
            ordering.join().unwrap()
        });
        took.push(begin.elapsed());
        match result {
            Ok(()) => assert!(txt.with_machine(|machine| check(machine)), "round {round}"),
            Err(error) => {
                assert_eq!(error, Error::NotStarted);
                refused += 1;
            }
        }
        assert!(!txt.with_machine(|machine| is_on(machine)));
    }
    assert!(refused > 0, "no command met the end");
    took.sort_unstable();
    let seen = Seen::Error(Error::NotStarted);
    Outcome { seen, soon: took.get(took.len() / 2).copied(), by: By::Exchange, stopped: None }
}
