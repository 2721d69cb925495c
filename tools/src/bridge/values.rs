//! Which values are published: those that differ from what was published before.

use std::time::{Duration, Instant};

use ft_transfer_area::transfer_area::MAX_AREAS;
use ft_transfer_area::tx::Input;
use ft_transfer_area::FishX1Transfer;

use super::topics::Topics;
use super::value::{values_of, Read, Value};
use crate::commands::{is_connected, Reconfigured};

/// Which changes of measured values are published.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Noise {
    /// The shortest time between two messages about one value.
    pub(crate) every: Duration,
    /// The smallest change that is published.
    pub(crate) deadband: u16,
}

/// How many values that there are not are removed at once: a bridge that sends a lot can't know how long the commands have
/// waited that come in meanwhile.
const REMOVALS: usize = 10;

/// All values that a controller can have, with what was published about each. Those of extensions that are not
/// connected are removed: they are not those of now, and a bridge of this name may have left them at the broker.
pub(crate) struct Values {
    values: Vec<Tracked>,
    noise: Noise,
}

/// One value, and what was published about it last.
struct Tracked {
    area: usize,
    /// The input that it is of.
    input: Option<Input>,
    topic: String,
    read: Read,
    /// `None` before the first message of a connection to the broker.
    last: Option<(Option<Value>, Instant)>,
    /// The newest response that an event about it came from.
    newest: u64,
    /// Whether it was looked at since the controller answers. What was published before may be another one's.
    is_new: bool,
}

impl Values {
    pub(crate) fn new(topics: &Topics, noise: Noise) -> Self {
        let reported = |area: usize, tail: &str, read: Read| Tracked {
            area,
            input: Input::ALL.into_iter().find(|input| is_of(tail, *input)),
            topic: topics.of(tail),
            read,
            last: None,
            newest: 0,
            is_new: true,
        };
        let values = (0..MAX_AREAS)
            .flat_map(|area| {
                values_of(area).into_iter().map(move |(tail, read)| reported(area, &tail, read))
            })
            .collect();
        Self { values, noise }
    }

    /// A controller answers, perhaps another one than before, and its responses are counted from the beginning.
    pub(crate) fn begin(&mut self) {
        for reported in &mut self.values {
            (reported.newest, reported.is_new) = (0, true);
        }
    }

    /// Everything is to be published again.
    pub(crate) fn forget(&mut self) {
        for reported in &mut self.values {
            (reported.last, reported.is_new) = (None, true);
        }
    }

    /// Sends all values that have changed, by topic and payload. An empty payload removes the value that a broker
    /// keeps. What `send` does not take is tried again the next time.
    ///
    /// `cycle` is the number of the response that the areas show. The events that came before this call are
    /// to be published before: they know the changes between two calls, and may be newer than the areas. An input that
    /// was configured anew has to be measured first.
    ///
    /// Returns whether all that is published now is of these areas.
    pub(crate) fn publish(
        &mut self,
        areas: &[FishX1Transfer],
        reconfigured: &Reconfigured,
        cycle: u64,
        now: Instant,
        mut send: impl FnMut(&str, String) -> bool,
    ) -> bool {
        let (mut removals, mut is_all) = (0, true);
        for reported in &mut self.values {
            let is_held =
                reported.input.is_some_and(|input| reconfigured.has(reported.area, input));
            if cycle < reported.newest || is_held {
                is_all &= !reported.is_new;
                continue;
            }
            let area = areas.get(reported.area).filter(|_| is_connected(areas, reported.area));
            let value = area.and_then(&reported.read);
            if value.is_none() && !matches!(reported.last, Some((None, _))) {
                removals += 1;
                if removals > REMOVALS {
                    is_all = false;
                    continue;
                }
            }
            if reported.is_news(value, now, self.noise) && !reported.publish(value, now, &mut send)
            {
                return false;
            }
            reported.is_new = false;
        }
        is_all
    }

    /// Sends a change of a digital input that this response has shown, unless the last message said this.
    pub(crate) fn publish_change(
        &mut self,
        (area, input): (usize, Input),
        pressed: bool,
        cycle: u64,
        mut send: impl FnMut(&str, String) -> bool,
    ) -> bool {
        let tail = format!("/{input}");
        let mut of_area = self.values.iter_mut().filter(|reported| reported.area == area);
        let Some(reported) = of_area.find(|reported| reported.topic.ends_with(&tail)) else {
            return true;
        };
        reported.newest = cycle;
        let value = Some(Value::Digital { value: i16::from(pressed) });
        match reported.last {
            // It is published with all others.
            None => true,
            Some((last, _)) => last == value || reported.publish(value, Instant::now(), &mut send),
        }
    }
}

/// Whether a value is an input's, by what follows the controller's name in its topic.
fn is_of(tail: &str, input: Input) -> bool {
    let name = input.to_string();
    tail.split('/').any(|part| part == name)
}

impl Tracked {
    fn is_news(&self, value: Option<Value>, now: Instant, noise: Noise) -> bool {
        // The broker may keep what another bridge has left, and has to hear also that there is no value.
        let Some((last, at)) = self.last else { return true };
        if value == last {
            return false;
        }
        let (Some(value), Some(last)) = (value, last) else { return true };
        if self.is_new {
            return true;
        }
        let waits = value.may_wait() && value.is_like(&last);
        if waits && now.saturating_duration_since(at) < noise.every {
            return false;
        }
        value.distance(&last).is_none_or(|distance| distance >= u32::from(noise.deadband))
    }

    fn publish(
        &mut self,
        value: Option<Value>,
        now: Instant,
        send: &mut impl FnMut(&str, String) -> bool,
    ) -> bool {
        let payload = match value.map(|value| serde_json::to_string(&value)) {
            Some(Ok(payload)) => payload,
            Some(Err(_)) | None => String::new(),
        };
        let taken = send(&self.topic, payload);
        if taken {
            self.last = Some((value, now));
        }
        taken
    }
}

#[cfg(test)]
mod tests {
    use ft_transfer_area::transfer_area::{InputMode, UniConfig};
    use ft_transfer_area::tx::Motor;

    use super::*;

    const NOISE: Noise = Noise { every: Duration::from_millis(100), deadband: 5 };

    fn values() -> Values {
        Values::new(&Topics::new("ft", "press"), NOISE)
    }

    /// What is published about this area at this time, in ms.
    fn reported(values: &mut Values, area: FishX1Transfer, begin: Instant, ms: u64) -> Vec<String> {
        let mut reported = Vec::new();
        let now = begin + Duration::from_millis(ms);
        values.publish(&[area], &Reconfigured::default(), 1, now, |topic, payload| {
            reported.push(format!("{topic} {payload}"));
            true
        });
        reported
    }

    /// The same until nothing is left to remove.
    fn all_reported(values: &mut Values, area: FishX1Transfer, begin: Instant) -> Vec<String> {
        let mut all = reported(values, area, begin, 0);
        loop {
            let more = reported(values, area, begin, 0);
            assert!(more.len() <= REMOVALS, "{more:?}");
            if more.is_empty() {
                return all;
            }
            all.extend(more);
        }
    }

    #[test]
    fn everything_is_told_once_and_then_changes_only() {
        let (mut values, begin) = (values(), Instant::now());
        let mut area = FishX1Transfer::default();
        let first = all_reported(&mut values, area, begin);
        assert!(first.contains(&r#"ft/press/I1 {"value":0}"#.to_owned()), "{first:?}");
        let of_outputs = first.iter().filter(|line| line.starts_with("ft/press/O"));
        assert!(of_outputs.clone().all(|line| line.ends_with(' ')), "all are motors: {first:?}");
        assert_eq!(of_outputs.count(), 8, "what an earlier bridge has left is removed");
        assert!(first.contains(&"ft/press/ext8/I1 ".to_owned()), "{first:?}");
        area.input.uni[1] = 1;
        assert_eq!(reported(&mut values, area, begin, 2), [r#"ft/press/I2 {"value":1}"#]);
        values.forget();
        assert_eq!(all_reported(&mut values, area, begin).len(), first.len());
    }

    #[test]
    fn measured_values_wait_and_small_changes_are_noise() {
        let (mut values, begin) = (values(), Instant::now());
        let mut area = FishX1Transfer::default();
        area.set_ft_uni_config(Input::I1, InputMode::Voltage, false);
        all_reported(&mut values, area, begin);
        area.input.uni[0] = 4;
        assert_eq!(reported(&mut values, area, begin, 200), [""; 0], "noise");
        area.input.uni[0] = 5;
        let line = r#"ft/press/I1 {"value":5,"unit":"mV","over_range":false}"#;
        assert_eq!(reported(&mut values, area, begin, 201), [line]);
        area.input.uni[0] = 500;
        assert_eq!(reported(&mut values, area, begin, 300), [""; 0], "too soon");
        let line = r#"ft/press/I1 {"value":500,"unit":"mV","over_range":false}"#;
        assert_eq!(reported(&mut values, area, begin, 301), [line]);
        area.input.uni[0] = 10_000;
        let line = r#"ft/press/I1 {"value":10000,"unit":"mV","over_range":true}"#;
        assert_eq!(reported(&mut values, area, begin, 500), [line]);
    }

    #[test]
    fn what_was_not_taken_is_told_the_next_time() {
        let (mut values, begin) = (values(), Instant::now());
        let area = FishX1Transfer::default();
        let mut room = 3;
        values.publish(&[area], &Reconfigured::default(), 1, begin, |_, _| {
            room -= 1;
            room >= 0
        });
        let rest = all_reported(&mut values, area, begin);
        assert_eq!(rest.len() + 3, all_reported(&mut self::values(), area, begin).len());
    }

    /// What is published when the areas of response `cycle` come after these events.
    fn published_with_events(
        values: &mut Values,
        events: &[(u64, bool)],
        cycle: u64,
        now: i16,
    ) -> Vec<String> {
        let mut reported = Vec::new();
        let mut send = |_: &str, payload| {
            reported.push(payload);
            true
        };
        for &(of, pressed) in events {
            values.publish_change((0, Input::I1), pressed, of, &mut send);
        }
        let mut area = FishX1Transfer::default();
        area.input.uni[0] = now;
        values.publish(&[area], &Reconfigured::default(), cycle, Instant::now(), send);
        reported
    }

    #[test]
    fn every_change_of_a_digital_input_is_told_once_and_in_order() {
        let mut values = values();
        all_reported(&mut values, FishX1Transfer::default(), Instant::now());
        let values = &mut values;
        let line = |value| format!("{{\"value\":{value}}}");
        // Three responses came at once.
        let events = [(2, true), (3, false), (4, true)];
        assert_eq!(published_with_events(values, &events, 4, 1), [line(1), line(0), line(1)]);
        // The areas are before the event, which then says nothing new.
        assert_eq!(published_with_events(values, &[], 5, 0), [line(0)]);
        assert_eq!(published_with_events(values, &[(5, false)], 6, 0), [""; 0]);
        // The event is before its areas.
        assert_eq!(
            published_with_events(values, &[(7, true), (8, false)], 7, 1),
            [line(1), line(0)]
        );
        assert_eq!(published_with_events(values, &[], 8, 0), [""; 0]);
    }

    #[test]
    fn an_input_that_is_configured_anew_is_measured_first() {
        let (mut values, mut reconfigured) = (values(), Reconfigured::default());
        let (begin, mut areas) = (Instant::now(), [FishX1Transfer::default()]);
        areas[0].input.uni[2] = 1;
        all_reported(&mut values, areas[0], begin);
        reconfigured.change(&mut areas, 1, |areas| {
            areas[0].set_ft_uni_config(Input::I3, InputMode::Ultrasonic, false);
        });
        let mut reported = |areas: &_, cycle: u64, reconfigured: &_| {
            let mut reported = Vec::new();
            let now = begin + Duration::from_secs(cycle);
            values.publish(areas, reconfigured, cycle, now, |topic, payload| {
                reported.push(format!("{topic} {payload}"));
                true
            });
            reported
        };
        assert_eq!(reported(&areas, 1, &reconfigured), [""; 0], "the area has a 0");
        for (cycle, value) in [(2, 5000), (3, 40)] {
            areas[0].input.uni[2] = value;
            reconfigured.change(&mut areas, cycle, |_| {});
            let expected: &[&str] = match cycle {
                2 => &[],
                _ => &[
                    r#"ft/press/I3 {"value":40,"unit":"cm","over_range":false}"#,
                    r#"ft/press/I3/config {"mode":"ultrasonic","digital":false}"#,
                ],
            };
            assert_eq!(reported(&areas, cycle, &reconfigured), expected);
        }
        // The old number in its unit does not stay for the time of `--every`.
        let mut reported = |mode, ms| {
            areas[0].config.uni[2] = UniConfig::analog(mode);
            let now = begin + Duration::from_secs(3) + Duration::from_millis(ms);
            let mut reported = Vec::new();
            values.publish(&areas, &reconfigured, 4, now, |topic, payload| {
                reported.push(format!("{topic} {payload}"));
                true
            });
            reported
        };
        let line = r#"ft/press/I3 {"value":40,"unit":"mV","over_range":false}"#;
        assert_eq!(reported(InputMode::Voltage, 1)[0], line);
    }

    #[test]
    fn a_value_that_is_no_more_is_removed_from_the_broker() {
        let (mut values, begin) = (values(), Instant::now());
        let mut area = FishX1Transfer::default();
        all_reported(&mut values, area, begin);
        area.set_ft_motor_config(Motor::M1, false);
        let reported = reported(&mut values, area, begin, 1);
        for line in [
            "ft/press/M1 ",
            r#"ft/press/M1/config {"mode":"outputs"}"#,
            r#"ft/press/O1 {"duty":0}"#,
            r#"ft/press/O2 {"duty":0}"#,
        ] {
            assert!(reported.contains(&line.to_owned()), "{line}: {reported:?}");
        }
        assert_eq!(reported.len(), 4);
    }
}
