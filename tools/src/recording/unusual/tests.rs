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
        assert_eq!(moments[0].what, format!("E1.M2 is blocked, at {at} pulses"));
    }
    let expired = Transfer::WatchdogExpired { limit_ms: 500 };
    let expired = unusual.look(Duration::from_secs(15), &Recorded::Transfer(expired));
    assert_eq!(numbers[9..], [Some(10), None, None, None, None, None]);
    assert_eq!(expired[0].number, Some(11));
    let counts: Vec<_> =
        unusual.into_counts().iter().map(|(kind, count)| kind.counted(*count)).collect();
    assert_eq!(counts, ["1 stop by the watchdog", "15 blocked motors"]);
}
