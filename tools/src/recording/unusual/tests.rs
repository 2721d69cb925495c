use std::path::Path;
use std::time::Instant;

use ft_transfer_area::{FishX1Transfer, LoggedCycle};
use ft_transfer_area_recorder::{History, Options, Parts, RecordedStatistics, Recorder, Recording};

use super::super::survey::Survey;
use super::*;

fn began() -> Transfer {
    let (device_name, firmware) = ("TX2013".to_owned(), "4.6.6".to_owned());
    Transfer::Began { device_name, firmware, address: String::new(), areas: 1 }
}

/// A cycle until which so many reactions were late.
fn cycle(number: u64, late_reactions: u64, arrived: Instant) -> LoggedCycle {
    let mut cycle = LoggedCycle::new(number, &[FishX1Transfer::default()]);
    (cycle.arrived, cycle.first) = (arrived, number == 1);
    cycle.statistics.cycles = number;
    cycle.statistics.late_reactions = late_reactions;
    cycle
}

/// How many late reactions a file has.
fn late_in(path: &Path) -> u64 {
    let counts = Survey::of_file(path).unwrap().unusual_counts;
    counts.get(&Kind::LateReaction).copied().unwrap_or(0)
}

#[test]
fn each_late_reaction_is_in_one_part_of_a_recording() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    let parts = Parts::of_time(Duration::from_millis(10));
    let options = Options::default().capacity(5_000).parts(parts);
    let (recorder, mut feed) = Recorder::fed(&path, options).unwrap();
    feed.transfer(Instant::now(), began());
    let part = |number: u64| folder.path().join(format!("run-{number:04}.mcap"));
    // By the number of the cycle; none in the later ones.
    let mut until = vec![0];
    while recorder.newest() < part(7) {
        let late = until[until.len() - 1] + u64::from(recorder.newest() < part(4));
        feed.cycle(cycle(until.len() as u64, late, Instant::now()));
        until.push(late);
        std::thread::sleep(Duration::from_millis(1));
    }
    feed.transfer(Instant::now(), Transfer::Ended);
    assert_eq!(recorder.finish().unwrap().lost, 0);
    let mut last = 0;
    for file in (1..).map(part).take_while(|file| file.exists()) {
        let before = until[last];
        for entry in Recording::open(&file).unwrap() {
            if let Recorded::Cycle(cycle) = entry.unwrap().what {
                last = cycle.number as usize;
            }
        }
        assert_eq!(late_in(&file), until[last] - before, "{file:?}");
    }
    assert_eq!(last, until.len() - 1);
    assert!(until[last] > 0);
}

#[test]
fn late_reactions_from_before_a_recording_are_not_in_it() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.mcap");
    let (now, seconds) = (Instant::now(), Duration::from_secs);
    let mut history = History::new(seconds(60), 1 << 20);
    history.transfer(now - seconds(100), began());
    history.cycle(&cycle(1, 150, now - seconds(99)));
    history.cycle(&cycle(2, 150, now - seconds(90)));
    // The first of those that are kept.
    history.cycle(&cycle(3, 152, now - seconds(40)));
    history.cycle(&cycle(4, 153, now - seconds(30)));
    let follow = history.follow();
    history.unfollow();
    Recorder::follow(&path, follow, Options::default()).unwrap().finish().unwrap();
    let survey = Survey::of_file(&path).unwrap();
    let listed: Vec<_> = survey.unusual.iter().map(|one| (one.seconds, &*one.what)).collect();
    let late = "late reactions of the program since the last second: ";
    assert_eq!(listed, [(0.0, &*format!("{late}2")), (10.0, &*format!("{late}1"))]);

    // The transfer has begun before the recorder was there, and nothing says so.
    let (recorder, mut feed) = Recorder::fed(&path, Options::default()).unwrap();
    feed.cycle(cycle(500, 150, now));
    feed.cycle(cycle(501, 153, now));
    recorder.finish().unwrap();
    assert_eq!(late_in(&path), 3);
}

/// Their files have no statistics of their beginnings.
#[test]
fn of_older_recorders_the_first_statistics_within_a_transfer_are_where_counting_begins() {
    let mut unusual = Unusual::default();
    let mut late = |seconds, late_reactions| {
        let mut statistics = RecordedStatistics::default();
        statistics.late_reactions = late_reactions;
        let at = Duration::from_secs(seconds);
        let found = unusual.look(at, &Recorded::Statistics(statistics));
        if seconds == 3 {
            unusual.look(at, &Recorded::Transfer(began()));
        }
        found.len()
    };
    assert_eq!([late(1, 150), late(2, 150), late(3, 152), late(4, 1)], [0, 0, 1, 1]);
    let mut unusual = Unusual::default();
    unusual.look(Duration::ZERO, &Recorded::Transfer(began()));
    let mut statistics = RecordedStatistics::default();
    statistics.late_reactions = 150;
    let statistics = Recorded::Statistics(statistics);
    assert!(unusual.look(Duration::from_secs(1), &statistics).is_empty());
}

#[test]
fn of_each_kind_the_first_are_listed_and_all_are_counted() {
    let event = |at: u64| {
        let mut event = RecordedEvent::default();
        event.event = "MotorStalled".to_owned();
        event.controller = "E1".to_owned();
        event.terminal = "M2".to_owned();
        event.value = at as i64;
        Recorded::Event(event)
    };
    let mut unusual = Unusual::default();
    let mut numbers = Vec::new();
    for at in 0..15 {
        let moments = unusual.look(Duration::from_secs(at), &event(at));
        numbers.extend(moments.iter().map(|moment| moment.number));
        assert_eq!(moments[0].what.en, format!("E1.M2 is blocked, at {at} pulses"));
    }
    let expired = Transfer::WatchdogExpired { limit_ms: 500 };
    let expired = unusual.look(Duration::from_secs(15), &Recorded::Transfer(expired));
    assert_eq!(numbers[9..], [Some(10), None, None, None, None, None]);
    assert_eq!(expired[0].number, Some(11));
    let counts: Vec<_> =
        unusual.into_counts().iter().map(|(kind, count)| kind.counted(*count)).collect();
    assert_eq!(counts, ["1 stop by the watchdog", "15 blocked motors"]);
}

#[test]
fn what_has_happened_is_told_in_german_too() {
    let failure = |kind| Failure { kind, error: "no answer came within 1 s".to_owned() };
    for (transfer, german) in [
        (
            Transfer::Lost(failure(FailureKind::NoAnswer)),
            "die Verbindung riss ab: der Controller hat nicht geantwortet",
        ),
        (
            Transfer::EndedBy(failure(FailureKind::Closed)),
            "die Verbindung endete: sie wurde getrennt",
        ),
        (
            Transfer::Failed(failure(FailureKind::Other)),
            "die Verbindung kam nicht zustande: no answer came within 1 s",
        ),
        (
            Transfer::WatchdogExpired { limit_ms: 500 },
            "der Watchdog hielt nach 500 ms die Motoren an",
        ),
    ] {
        let found = Unusual::default().look(Duration::ZERO, &Recorded::Transfer(transfer));
        assert_eq!(found[0].what.de, german);
    }
}
