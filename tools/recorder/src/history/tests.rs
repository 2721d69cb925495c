use super::*;
use crate::format::LONGEST_TEXT;
use crate::{Options, Recorded, Recorder, Recording};

const MINUTE: Duration = Duration::from_secs(60);
const ROOM: usize = 1 << 20;

/// A cycle in which these areas have its number at I1, so long before now.
fn cycle(number: u64, counted: &[usize], ago: Duration) -> LoggedCycle {
    let mut areas = vec![FishX1Transfer::default(); MAX_AREAS];
    areas[0].state.io_slave_alive = [1; MAX_EXTENSIONS];
    for area in counted {
        areas[*area].input.uni[0] = number as i16;
    }
    let mut cycle = LoggedCycle::new(number, &areas);
    (cycle.arrived, cycle.first) = (Instant::now() - ago, number == 1);
    cycle
}

fn began() -> Transfer {
    let (device_name, firmware) = ("TX2013".to_owned(), "4.6.6".to_owned());
    Transfer::Began { device_name, firmware, address: String::new(), areas: MAX_AREAS }
}

/// The number, I1 of each area and what was lost before, of all cycles.
fn cycles(entries: &[Recorded]) -> Vec<(u64, Vec<i16>, u64)> {
    let of_cycle = |entry: &Recorded| match entry {
        Recorded::Cycle(cycle) => {
            let values = cycle.areas.iter().map(|area| area.input.uni[0]).collect();
            Some((cycle.number, values, cycle.lost))
        }
        _ => None,
    };
    entries.iter().filter_map(of_cycle).collect()
}

fn recorded(follow: Follow) -> Vec<Recorded> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    Recorder::follow(&path, follow, Options::default()).unwrap().finish().unwrap();
    Recording::open(&path).unwrap().map(|entry| entry.unwrap().what).collect()
}

#[test]
fn a_recording_begins_with_what_is_not_older_than_it_should_be_and_goes_on() {
    let mut history = History::new(MINUTE, ROOM);
    let seconds = Duration::from_secs;
    history.transfer(Instant::now() - seconds(100), began());
    history.cycle(&cycle(1, &[0, 3], seconds(90)));
    history.cycle(&cycle(2, &[0, 3], seconds(50)));
    let mut third = cycle(3, &[0], seconds(40));
    third.first = true;
    history.cycle(&third);
    let follow = history.follow();
    assert!(follow.since().elapsed() >= seconds(50) && follow.since().elapsed() < seconds(90));
    history.cycle(&cycle(4, &[3, 8], Duration::ZERO));
    history.unfollow();
    history.cycle(&cycle(5, &[0], Duration::ZERO));

    let entries = recorded(follow);
    // As in a part of a recording.
    assert!(matches!(&entries[0], Recorded::Transfer(what) if *what == began()), "{entries:?}");
    let values = |ones: [i16; 3]| vec![ones[0], 0, 0, ones[1], 0, 0, 0, 0, ones[2]];
    let expected =
        [(2, values([2, 2, 0]), 0), (3, values([3, 0, 0]), 0), (4, values([0, 4, 4]), 0)];
    assert_eq!(cycles(&entries), expected);
}

#[test]
fn a_recording_of_what_has_ended_long_ago_is_empty() {
    let mut history = History::new(MINUTE, ROOM);
    history.transfer(Instant::now() - MINUTE * 3, began());
    history.cycle(&cycle(1, &[0], MINUTE * 2));
    history.transfer(Instant::now() - MINUTE * 2, Transfer::Ended);
    let follow = history.follow();
    history.unfollow();
    assert!(recorded(follow).is_empty());
    assert_eq!((history.bytes, history.kept.len()), (0, 0));
}

#[test]
fn it_takes_no_more_bytes_than_it_has_room_for() {
    let mut history = History::new(MINUTE, 20_000);
    for number in 1..=1000 {
        history.cycle(&cycle(number, &[0], Duration::ZERO));
        assert!(history.bytes <= 20_000);
    }
    let follow = history.follow();
    history.unfollow();
    let entries = recorded(follow);
    let cycles = cycles(&entries);
    assert!((30..100).contains(&cycles.len()), "{}", cycles.len());
    let numbers = 1001 - cycles.len() as u64..=1000;
    assert!(cycles.iter().map(|(number, ..)| *number).eq(numbers));
    assert!(cycles.iter().all(|(number, values, _)| values[0] == *number as i16));
}

#[test]
fn what_a_slow_disk_has_no_room_for_is_counted_and_what_follows_is_right() {
    let mut history = History::new(MINUTE, 20_000);
    let mut follow = history.follow();
    // The last value of the second area came in a cycle that is lost.
    for number in 1..=200 {
        history.cycle(&cycle(number, if number < 150 { &[0] } else { &[0, 1] }, Duration::ZERO));
    }
    let lost = follow.lost();
    let first = 200 - lost;
    assert!((100..170).contains(&lost), "{lost}");
    for number in 1..=first {
        assert!(matches!(follow.next().unwrap().what, Fed::Cycle(cycle) if cycle.number == number));
    }
    let mut areas = cycle(201, &[0], Duration::ZERO).areas();
    areas[1].input.uni[0] = 200;
    history.transfer(Instant::now(), Transfer::WatchdogExpired { limit_ms: 5 });
    history.cycle(&LoggedCycle::new(201, &areas));
    history.unfollow();
    let entries = recorded(follow);
    let cycles = cycles(&entries);
    assert_eq!((cycles.len(), cycles[0].0, &cycles[0].1[..2]), (1, 201, &[201, 200][..]));
    let Recorded::Transfer(Transfer::NotRecorded { entries: told }) = entries[0] else {
        panic!("{:?}", entries[0]);
    };
    assert_eq!(told, lost);
    assert!(matches!(entries[1], Recorded::Transfer(Transfer::WatchdogExpired { .. })));
}

#[test]
fn what_follows_a_transfer_that_had_no_room_is_of_the_newest_one() {
    let mut history = History::new(MINUTE, 20_000);
    history.transfer(Instant::now(), began());
    let mut follow = history.follow();
    (1..=200).for_each(|number| history.cycle(&cycle(number, &[0], Duration::ZERO)));
    let other = |error: &str| {
        Transfer::Lost(crate::Failure { kind: crate::FailureKind::Other, error: error.to_owned() })
    };
    history.transfer(Instant::now(), other("it has room of its own"));
    let newest = &"x".repeat(LONGEST_TEXT);
    for error in vec!["one of many"; OF_TRANSFERS / LONGEST_TEXT].into_iter().chain([&**newest]) {
        history.transfer(Instant::now(), other(error));
    }
    history.cycle(&cycle(201, &[0], Duration::ZERO));
    let mut waiting = || -> Vec<Fed> {
        std::iter::from_fn(|| follow.next().ok()).map(|entry| entry.what).collect()
    };
    let told = |entries: &[Fed]| -> Vec<Transfer> {
        let transfers = entries.iter().filter_map(|entry| match entry {
            Fed::Transfer { what, .. } => Some(what.clone()),
            _ => None,
        });
        transfers.collect()
    };
    let first = told(&waiting());
    assert_eq!(first[..3], [began(), other("it has room of its own"), other("one of many")]);
    assert!(!first.contains(&other(newest)));
    history.cycle(&cycle(202, &[0], Duration::ZERO));
    let entries = waiting();
    assert_eq!(told(&entries), [other(newest)]);
    assert!(matches!(entries.last(), Some(Fed::Cycle(cycle)) if cycle.number == 202));
}

#[test]
fn a_recorder_follows_it_until_it_has_ended() {
    let mut history = History::new(MINUTE, ROOM);
    let follow = history.follow();
    history.unfollow();
    assert!(history.is_followed());
    drop(follow);
    assert!(!history.is_followed());
    history.cycle(&cycle(1, &[0], Duration::ZERO));
    let second = history.follow();
    assert_eq!(second.waiting(), 1);
}
