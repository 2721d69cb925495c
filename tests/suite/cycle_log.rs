//! The log of all cycles.

use std::sync::{Arc, Mutex};

use ft_transfer_area::channel::{RecvTimeoutError, TryRecvError};
use ft_transfer_area::transfer_area::{InputMode, UniConfig, LOCAL_IO, REMOTE_IO_1};
use ft_transfer_area::wire::ExchangeData;
use ft_transfer_area::{CycleLog, Error, Event, LogEntry, Logged, LoggedCycle};
use ft_transfer_area_simulator::{Fault, FaultKind, SimulatedTxt};

use crate::support::{handler_for, unpaced, wait_until, DEADLINE};

/// Room for all cycles of a test.
const ROOM: usize = 2_000;

/// What the log says until the handler is dropped.
fn all(log: CycleLog) -> Vec<LogEntry> {
    log.collect()
}

fn cycles(entries: &[LogEntry]) -> Vec<&LoggedCycle> {
    let cycle = |entry| match entry {
        &LogEntry { what: Logged::Cycle(ref cycle), .. } => Some(cycle),
        _ => None,
    };
    entries.iter().filter_map(cycle).collect()
}

/// The entries that are not cycles, in short.
fn others(entries: &[LogEntry]) -> Vec<String> {
    let other = |entry: &LogEntry| match &entry.what {
        Logged::Began(began) => Some(format!("{} begins", began.device_name)),
        Logged::Event(reported) => match &reported.event {
            Event::TransferEnded { error: None, .. } => Some("ends".to_owned()),
            Event::TransferEnded { .. } => Some("ends with an error".to_owned()),
            Event::ConnectionLost { .. } => Some(format!("lost after {}", reported.cycle)),
            Event::ConnectionRestored { .. } => Some(format!("restored by {}", reported.cycle)),
            other => Some(format!("{other:?}")),
        },
        Logged::Failed { error, .. } => Some(format!("failed: {error}")),
        _ => None,
    };
    entries.iter().filter_map(other).collect()
}

/// A simulated TXT that changes I1 in each exchange and keeps the outputs that came in.
fn counting(extensions: usize) -> (SimulatedTxt, Arc<Mutex<Vec<ExchangeData>>>) {
    let outputs = Arc::new(Mutex::new(Vec::new()));
    let seen = Arc::clone(&outputs);
    let mut number = 0;
    let txt = unpaced().extensions(extensions).on_exchange(move |machine| {
        number += 1;
        for (index, controller) in (0..).zip(&mut machine.controllers) {
            controller.uni[0] = number + 1000 * index;
        }
        seen.lock().unwrap().push(machine.controllers[LOCAL_IO].outputs);
    });
    (txt.start().unwrap(), outputs)
}

#[test]
fn every_cycle_has_the_outputs_of_its_request_and_the_inputs_of_its_response() {
    let (txt, outputs) = counting(1);
    let handler = handler_for(&txt).areas(2).build().unwrap();
    let log = handler.areas().cycle_log(ROOM).unwrap();
    handler.areas().lock()[LOCAL_IO].config.uni[0] = UniConfig::analog(InputMode::Voltage);
    handler.begin_transfer().unwrap();
    for _ in 0..100 {
        let mut areas = handler.areas().wait_cycle().unwrap();
        let seen = areas[LOCAL_IO].input.uni[0];
        areas[LOCAL_IO].output.duty[1] = seen;
        areas[REMOTE_IO_1].output.duty[0] = 7;
        areas[LOCAL_IO].raise_sound_cmd_id();
    }
    handler.end_transfer().unwrap();
    let total = handler.areas().statistics().cycles;
    drop(handler);
    let entries = all(log);
    assert_eq!(others(&entries), ["TX2013 begins", "ends"]);
    let cycles = cycles(&entries);
    assert_eq!(cycles.len() as u64, total);
    let outputs = outputs.lock().unwrap();
    for ((number, cycle), outputs) in (1..).zip(&cycles).zip(&*outputs) {
        let master = &cycle.areas()[LOCAL_IO];
        assert_eq!((cycle.number, cycle.first), (number, number == 1));
        assert_eq!(cycle.statistics.cycles, number);
        assert_eq!(master.input.uni[0], number as i16);
        assert_eq!(master.output.duty, outputs.duty, "cycle {number}");
        assert_eq!(master.txt_outputs.sound_cmd_id, outputs.sound_command_id);
        assert_eq!(master.config.uni[0], UniConfig::analog(InputMode::Voltage));
        assert_eq!(master.slaves_alive(), 1);
        assert_eq!(cycle.areas()[REMOTE_IO_1].input.uni[0], 1000 + number as i16);
    }
    assert!(cycles.windows(2).all(|pair| pair[0].arrived <= pair[1].arrived));
    assert!(cycles.iter().any(|cycle| cycle.areas()[LOCAL_IO].output.duty[1] > 50));
    assert_eq!(cycles.last().unwrap().areas()[LOCAL_IO].output.duty, [0; 8], "motors off");
}

#[test]
fn a_configuration_is_logged_from_when_it_is_sent() {
    let txt = unpaced().start().unwrap();
    let handler = handler_for(&txt).lock_step().build().unwrap();
    let log = handler.areas().cycle_log(ROOM).unwrap();
    let mode = |mode: InputMode, raises: bool| {
        let mut areas = handler.areas().lock();
        areas[LOCAL_IO].config.uni[0] = UniConfig::analog(mode);
        if raises {
            areas[LOCAL_IO].raise_config_id();
        }
        drop(areas);
        (0..10).for_each(|_| drop(handler.areas().wait_cycle().unwrap()));
    };
    handler.begin_transfer().unwrap();
    mode(InputMode::Voltage, true);
    // The id was forgotten.
    mode(InputMode::Ultrasonic, false);
    let in_force = txt.with_machine(|machine| machine.controllers[LOCAL_IO].config.uni[0]);
    assert_eq!(in_force, UniConfig::analog(InputMode::Voltage));
    mode(InputMode::Resistance, true);
    handler.end_transfer().unwrap();
    drop(handler);
    let entries = all(log);
    let configs = cycles(&entries).into_iter().map(|cycle| {
        let area = &cycle.areas()[LOCAL_IO];
        (area.state.config_id, area.config.uni[0])
    });
    let mut configs: Vec<_> = configs.collect();
    configs.dedup();
    let [voltage, resistance] = [InputMode::Voltage, InputMode::Resistance].map(UniConfig::analog);
    assert_eq!(configs, [(2, voltage), (3, resistance)]);
}

#[test]
fn a_log_that_is_full_loses_entries_counts_them_and_delays_nothing() {
    let (txt, _) = counting(0);
    let handler = handler_for(&txt).build().unwrap();
    let log = handler.areas().cycle_log(3).unwrap();
    handler.begin_transfer().unwrap();
    while log.lost() < 50 {
        handler.areas().wait_cycle().unwrap();
    }
    handler.end_transfer().unwrap();
    drop(handler);
    let lost = log.lost();
    let entries = all(log);
    let numbers: Vec<u64> = cycles(&entries).iter().map(|cycle| cycle.number).collect();
    // The beginning takes one of the reserved places, or a cycle's.
    assert_eq!(numbers, (1..=numbers.len() as u64).collect::<Vec<_>>());
    assert!(numbers.len() <= 3);
    let last = entries.last().unwrap();
    assert_eq!(last.lost, lost, "the end reports all the loss before it");
    assert_eq!(others(&entries), ["TX2013 begins", "ends"]);
}

#[test]
fn gaps_and_failures_are_logged_with_their_errors() {
    let gap = Fault::at_exchange(20, FaultKind::Close { after: 0 });
    let txt = unpaced().fault(gap).start().unwrap();
    let handler = handler_for(&txt).reconnect(DEADLINE).build().unwrap();
    let log = handler.areas().cycle_log(ROOM).unwrap();
    handler.begin_transfer().unwrap();
    wait_until(&txt, "a second connection", |machine| machine.exchanges() > 40);
    handler.end_transfer().unwrap();
    drop(txt);
    handler.begin_transfer().unwrap_err();
    drop(handler);
    let entries = all(log);
    let firsts = cycles(&entries).into_iter().filter(|cycle| cycle.first);
    assert_eq!(firsts.map(|cycle| cycle.number).collect::<Vec<_>>(), [1, 21]);
    let others = others(&entries);
    assert_eq!(others[..4], ["TX2013 begins", "lost after 20", "restored by 21", "ends"]);
    assert!(others[4].starts_with("failed: "), "{others:?}");
    assert_eq!(others.len(), 5);
}

#[test]
fn a_log_that_comes_later_begins_with_the_transfer_that_runs() {
    let (txt, _) = counting(0);
    let handler = handler_for(&txt).build().unwrap();
    handler.begin_transfer().unwrap();
    handler.areas().wait_cycle().unwrap();
    let before = handler.areas().statistics().cycles;
    let log = handler.areas().cycle_log(ROOM).unwrap();
    let first = log.recv_timeout(DEADLINE).unwrap();
    assert!(matches!(&first.what, Logged::Began(began) if began.areas == 1), "{first:?}");
    handler.areas().wait_cycle().unwrap();
    let Logged::Cycle(cycle) = log.recv_timeout(DEADLINE).unwrap().what else {
        panic!("cycles follow")
    };
    assert!(cycle.number > before);
    // Another one that is dropped takes nothing from the first.
    drop(handler.areas().cycle_log(1).unwrap());
    handler.end_transfer().unwrap();
    drop(handler);
    assert_eq!(others(&all(log)), ["ends"]);
}

#[test]
fn a_log_that_is_made_in_a_gap_begins_with_it() {
    let txt = unpaced().start().unwrap();
    let handler = handler_for(&txt).reconnect(DEADLINE).build().unwrap();
    handler.begin_transfer().unwrap();
    drop(txt);
    let lost = loop {
        if let Err(error) = handler.areas().wait_cycle() {
            break error;
        }
    };
    assert!(matches!(lost, Error::ConnectionLost { .. }), "{lost}");
    let log = handler.areas().cycle_log(ROOM).unwrap();
    let _ = handler.end_transfer();
    drop(handler);
    let others = others(&all(log));
    let begins = others[1].starts_with("lost after ");
    assert!(others[0] == "TX2013 begins" && begins && others.len() == 3, "{others:?}");
}

#[test]
fn in_lock_step_each_cycle_is_there_when_a_wait_for_it_ends() {
    let txt = unpaced().lock_step().start().unwrap();
    let handler = handler_for(&txt).lock_step().build().unwrap();
    let log = handler.areas().cycle_log(ROOM).unwrap();
    handler.begin_transfer().unwrap();
    assert!(matches!(log.try_recv().unwrap().what, Logged::Began(_)));
    for number in 1..100 {
        handler.areas().wait_cycle().unwrap();
        let entry = log.try_recv().unwrap();
        assert!(matches!(entry.what, Logged::Cycle(cycle) if cycle.number == number));
        assert!(matches!(log.try_recv(), Err(TryRecvError::Empty)));
    }
}

#[test]
fn a_log_has_a_capacity_in_range_and_ends_with_its_handler() {
    let handler = ft_transfer_area::TransferAreaComHandler::builder("127.0.0.1").build().unwrap();
    for capacity in [0, CycleLog::MAX_CAPACITY + 1] {
        assert!(matches!(handler.areas().cycle_log(capacity), Err(Error::OutOfRange { .. })));
    }
    let area = handler.areas().clone();
    drop(handler);
    let late = area.cycle_log(1).unwrap();
    let ended = late.recv_timeout(DEADLINE);
    assert!(matches!(ended, Err(RecvTimeoutError::Disconnected)), "{ended:?}");
}
