use super::*;

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
