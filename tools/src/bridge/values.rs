//! The values that a bridge tells: read from an area, compared with what was told before, sent as JSON.

use std::time::{Duration, Instant};

use ft_transfer_area::transfer_area::{CounterMode, InputMode, MAX_EXTENSIONS};
use ft_transfer_area::tx::{Input, IrDevice, JoystickAxis, JoystickSwitch, Motor};
use ft_transfer_area::FishX1Transfer;
use serde::Serialize;

use super::payload::{CounterModeName, InputModeName, PairMode};
use super::topics::{Topics, What};

/// A value as its payload.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub(crate) enum Value {
    Digital { value: i16 },
    Measured { value: i16, unit: &'static str, over_range: bool },
    InputConfig { mode: InputModeName, digital: bool },
    Counter { count: u16, level: bool },
    CounterConfig { mode: CounterModeName },
    Motor { duty: i16, distance: u16, done: bool },
    PairConfig { mode: PairMode },
    Output { duty: i16 },
    Remote { left: Stick, right: Stick, on: bool, off: bool },
    Microphone { linear: u16, logarithmic: u16 },
    Sound { sound: u16, done: bool },
    Extensions { connected: [bool; MAX_EXTENSIONS] },
}

/// Where a joystick is, −15..=15 on both axes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(crate) struct Stick {
    x: i16,
    y: i16,
}

/// Which changes of measured values are told.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Noise {
    /// The shortest time between two messages about one value.
    pub(crate) every: Duration,
    /// The smallest change that is told.
    pub(crate) deadband: u16,
}

impl Value {
    /// The value in this area; `None` for a motor that is configured as two outputs, and for outputs that
    /// are a motor.
    fn read(what: What, area: &FishX1Transfer) -> Option<Self> {
        Some(match what {
            What::Input(input) => read_input(input, area),
            What::InputConfig(input) => {
                let config = area.config.uni[input.index()];
                let mode = InputModeName::try_from(config.mode).ok()?;
                Self::InputConfig { mode, digital: config.digital != 0 }
            }
            What::Counter(counter) => {
                let (count, level) = area.get_in_counter_value(counter);
                Self::Counter { count, level }
            }
            What::CounterConfig(counter) => {
                let inverted = u8::from(CounterMode::Inverted);
                let is_inverted = area.config.cnt[counter.index()].mode == inverted;
                Self::CounterConfig { mode: CounterModeName::new(is_inverted) }
            }
            What::Motor(motor) => read_motor(motor, area)?,
            What::MotorConfig(motor) => Self::PairConfig { mode: PairMode::of(area, motor) },
            What::Output(output) => Self::Output { duty: area.get_out_pwm_values(output).ok()? },
            What::Remote(device) => read_remote(device, area),
            What::Microphone => {
                Self::Microphone { linear: area.get_mic_lin(), logarithmic: area.get_mic_log() }
            }
            What::Sound => {
                let sound = area.txt_outputs.sound_index;
                Self::Sound { sound, done: area.is_sound_ready() }
            }
            What::Extensions => {
                Self::Extensions { connected: area.state.io_slave_alive.map(|alive| alive != 0) }
            }
        })
    }

    /// The numbers that noise changes, if it has any; and what else it says.
    fn noisy(&self) -> Option<[i32; 2]> {
        match self {
            Self::Measured { value, over_range: false, .. } => Some([i32::from(*value), 0]),
            Self::Microphone { linear, logarithmic } => {
                Some([i32::from(*linear), i32::from(*logarithmic)])
            }
            _ => None,
        }
    }

    /// Whether a change to this value may wait for [`Noise::every`].
    fn may_wait(&self) -> bool {
        matches!(
            self,
            Self::Measured { .. }
                | Self::Counter { .. }
                | Self::Remote { .. }
                | Self::Microphone { .. }
        )
    }
}

fn read_input(input: Input, area: &FishX1Transfer) -> Value {
    let config = area.config.uni[input.index()];
    let reading = area.get_in_io_value(input);
    if config.digital != 0 {
        return Value::Digital { value: reading.value };
    }
    let unit = match InputMode::try_from(config.mode) {
        Ok(InputMode::Voltage) => "mV",
        Ok(InputMode::Ultrasonic) => "cm",
        _ => "Ω",
    };
    Value::Measured { value: reading.value, unit, over_range: reading.over_range }
}

fn read_motor(motor: Motor, area: &FishX1Transfer) -> Option<Value> {
    let duty = area.get_out_motor_values(motor).ok()?;
    let distance = area.output.distance[motor.index()];
    Some(Value::Motor { duty, distance, done: area.is_motor_ex_ready(motor) })
}

fn read_remote(device: IrDevice, area: &FishX1Transfer) -> Value {
    let axis = |axis| area.get_joystick_full(device, axis);
    Value::Remote {
        left: Stick { x: axis(JoystickAxis::LeftX), y: axis(JoystickAxis::LeftY) },
        right: Stick { x: axis(JoystickAxis::RightX), y: axis(JoystickAxis::RightY) },
        on: area.get_joystick_but_swi(device, JoystickSwitch::On),
        off: area.get_joystick_but_swi(device, JoystickSwitch::Off),
    }
}

/// All values of a controller, with what was told about each.
pub(crate) struct Values {
    values: Vec<Told>,
    noise: Noise,
}

/// One value, and what was told about it last.
struct Told {
    area: usize,
    what: What,
    topic: String,
    /// `None` before the first message of a connection to the broker.
    last: Option<(Option<Value>, Instant)>,
    /// The newest response that an event about it came from.
    newest: u64,
}

/// A message with a value. An empty payload removes the value that a broker keeps.
pub(crate) struct Message<'a> {
    pub(crate) topic: &'a str,
    pub(crate) payload: String,
}

impl Values {
    pub(crate) fn new(topics: &Topics, areas: usize, noise: Noise) -> Self {
        let told = |area: usize, what: What| Told {
            area,
            what,
            topic: topics.of(&what.tail(area)),
            last: None,
            newest: 0,
        };
        let values = (0..areas)
            .flat_map(|area| What::all(area).into_iter().map(move |what| told(area, what)))
            .collect();
        Self { values, noise }
    }

    /// A transfer begins, and counts its responses from the beginning.
    pub(crate) fn begin(&mut self) {
        for told in &mut self.values {
            told.newest = 0;
        }
    }

    /// Everything is to be told again.
    pub(crate) fn forget(&mut self) {
        for told in &mut self.values {
            told.last = None;
        }
    }

    /// Sends all values that have changed. What `send` does not take is tried again the next time.
    ///
    /// `cycle` is the number of the response that the areas show. The events that came before this call are
    /// to be told before: they know the changes between two calls, and may be newer than the areas.
    pub(crate) fn tell(
        &mut self,
        areas: &[FishX1Transfer],
        cycle: u64,
        now: Instant,
        mut send: impl FnMut(Message<'_>) -> bool,
    ) {
        for told in &mut self.values {
            let Some(area) = areas.get(told.area) else { continue };
            if cycle < told.newest {
                continue;
            }
            let value = Value::read(told.what, area);
            if told.is_news(value, now, self.noise) && !told.tell(value, now, &mut send) {
                return;
            }
        }
    }

    /// Sends a change of a digital input that this response has shown, unless the last message said this.
    pub(crate) fn tell_change(
        &mut self,
        (area, input): (usize, Input),
        pressed: bool,
        cycle: u64,
        mut send: impl FnMut(Message<'_>) -> bool,
    ) -> bool {
        let what = What::Input(input);
        let Some(told) = self.values.iter_mut().find(|told| told.area == area && told.what == what)
        else {
            return true;
        };
        told.newest = cycle;
        let value = Some(Value::Digital { value: i16::from(pressed) });
        match told.last {
            // It is told with all others.
            None => true,
            Some((last, _)) => last == value || told.tell(value, Instant::now(), &mut send),
        }
    }
}

impl Told {
    fn is_news(&self, value: Option<Value>, now: Instant, noise: Noise) -> bool {
        let Some((last, at)) = self.last else { return value.is_some() };
        if value == last {
            return false;
        }
        let (Some(value), Some(last)) = (value, last) else { return true };
        if value.may_wait() && now.saturating_duration_since(at) < noise.every {
            return false;
        }
        match (value.noisy(), last.noisy()) {
            (Some(new), Some(old)) => {
                let change = new.iter().zip(old).map(|(new, old)| new.abs_diff(old)).max();
                // Another unit is another value, however near the number.
                change.unwrap_or_default() >= u32::from(noise.deadband)
                    || unit_of(&value) != unit_of(&last)
            }
            _ => true,
        }
    }

    fn tell(
        &mut self,
        value: Option<Value>,
        now: Instant,
        send: &mut impl FnMut(Message<'_>) -> bool,
    ) -> bool {
        let payload = match value.map(|value| serde_json::to_string(&value)) {
            Some(Ok(payload)) => payload,
            Some(Err(_)) | None => String::new(),
        };
        let taken = send(Message { topic: &self.topic, payload });
        if taken {
            self.last = Some((value, now));
        }
        taken
    }
}

fn unit_of(value: &Value) -> Option<&'static str> {
    match value {
        Value::Measured { unit, .. } => Some(unit),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NOISE: Noise = Noise { every: Duration::from_millis(100), deadband: 5 };

    fn values() -> Values {
        Values::new(&Topics::new("ft", "press"), 1, NOISE)
    }

    /// What is told about this area at this time, in ms.
    fn told(values: &mut Values, area: FishX1Transfer, begin: Instant, ms: u64) -> Vec<String> {
        let mut told = Vec::new();
        values.tell(&[area], 1, begin + Duration::from_millis(ms), |message| {
            told.push(format!("{} {}", message.topic, message.payload));
            true
        });
        told
    }

    #[test]
    fn everything_is_told_once_and_then_changes_only() {
        let (mut values, begin) = (values(), Instant::now());
        let mut area = FishX1Transfer::default();
        let first = told(&mut values, area, begin, 0);
        assert!(first.contains(&r#"ft/press/I1 {"value":0}"#.to_owned()), "{first:?}");
        assert!(!first.iter().any(|line| line.starts_with("ft/press/O")), "all are motors");
        assert_eq!(told(&mut values, area, begin, 1), [""; 0]);
        area.input.uni[1] = 1;
        assert_eq!(told(&mut values, area, begin, 2), [r#"ft/press/I2 {"value":1}"#]);
        values.forget();
        assert_eq!(told(&mut values, area, begin, 3).len(), first.len());
    }

    #[test]
    fn measured_values_wait_and_small_changes_are_noise() {
        let (mut values, begin) = (values(), Instant::now());
        let mut area = FishX1Transfer::default();
        area.set_ft_uni_config(Input::I1, InputMode::Voltage, false);
        told(&mut values, area, begin, 0);
        area.input.uni[0] = 4;
        assert_eq!(told(&mut values, area, begin, 200), [""; 0], "noise");
        area.input.uni[0] = 5;
        let line = r#"ft/press/I1 {"value":5,"unit":"mV","over_range":false}"#;
        assert_eq!(told(&mut values, area, begin, 201), [line]);
        area.input.uni[0] = 500;
        assert_eq!(told(&mut values, area, begin, 300), [""; 0], "too soon");
        let line = r#"ft/press/I1 {"value":500,"unit":"mV","over_range":false}"#;
        assert_eq!(told(&mut values, area, begin, 301), [line]);
        area.input.uni[0] = 10_000;
        let line = r#"ft/press/I1 {"value":10000,"unit":"mV","over_range":true}"#;
        assert_eq!(told(&mut values, area, begin, 500), [line]);
    }

    #[test]
    fn what_was_not_taken_is_told_the_next_time() {
        let (mut values, begin) = (values(), Instant::now());
        let area = FishX1Transfer::default();
        let mut room = 3;
        values.tell(&[area], 1, begin, |_| {
            room -= 1;
            room >= 0
        });
        let rest = told(&mut values, area, begin, 1);
        assert_eq!(rest.len() + 3, told_at_first(area, begin));
    }

    fn told_at_first(area: FishX1Transfer, begin: Instant) -> usize {
        told(&mut values(), area, begin, 0).len()
    }

    /// What is told when the areas of response `cycle` come after these events.
    fn told_with_events(
        values: &mut Values,
        events: &[(u64, bool)],
        cycle: u64,
        now: i16,
    ) -> Vec<String> {
        let mut told = Vec::new();
        let mut send = |message: Message<'_>| {
            told.push(message.payload);
            true
        };
        for &(of, pressed) in events {
            values.tell_change((0, Input::I1), pressed, of, &mut send);
        }
        let mut area = FishX1Transfer::default();
        area.input.uni[0] = now;
        values.tell(&[area], cycle, Instant::now(), send);
        told
    }

    #[test]
    fn every_change_of_a_digital_input_is_told_once_and_in_order() {
        let mut values = values();
        told(&mut values, FishX1Transfer::default(), Instant::now(), 0);
        let values = &mut values;
        let line = |value| format!("{{\"value\":{value}}}");
        // Three responses came at once.
        let events = [(2, true), (3, false), (4, true)];
        assert_eq!(told_with_events(values, &events, 4, 1), [line(1), line(0), line(1)]);
        // The areas are before the event, which then tells nothing new.
        assert_eq!(told_with_events(values, &[], 5, 0), [line(0)]);
        assert_eq!(told_with_events(values, &[(5, false)], 6, 0), [""; 0]);
        // The event is before its areas.
        assert_eq!(told_with_events(values, &[(7, true), (8, false)], 7, 1), [line(1), line(0)]);
        assert_eq!(told_with_events(values, &[], 8, 0), [""; 0]);
    }

    #[test]
    fn a_value_that_is_no_more_is_removed_from_the_broker() {
        let (mut values, begin) = (values(), Instant::now());
        let mut area = FishX1Transfer::default();
        told(&mut values, area, begin, 0);
        area.set_ft_motor_config(Motor::M1, false);
        let told = told(&mut values, area, begin, 1);
        for line in [
            "ft/press/M1 ",
            r#"ft/press/M1/config {"mode":"outputs"}"#,
            r#"ft/press/O1 {"duty":0}"#,
            r#"ft/press/O2 {"duty":0}"#,
        ] {
            assert!(told.contains(&line.to_owned()), "{line}: {told:?}");
        }
        assert_eq!(told.len(), 4);
    }
}
