//! The parts of an area that are recorded: each is a channel of numbers with names.

use std::fmt;
use std::sync::LazyLock;

use ft_transfer_area::transfer_area::{InputMode, IrInput, IZ_MOTOR};
use ft_transfer_area::FishX1Transfer;
use serde::de::{DeserializeSeed, Deserializer, IgnoredAny, MapAccess, Visitor};
use serde_json::{json, Value};

/// A part of an area: its numbers by name, and where they are.
pub(crate) struct Part {
    /// The last part of the topic.
    pub(crate) name: &'static str,
    pub(crate) about: String,
    pub(crate) fields: Vec<String>,
    /// Whether it is recorded in every cycle, or only when it has changed.
    pub(crate) each_cycle: bool,
    read: fn(&FishX1Transfer, &mut Vec<i32>),
    write: fn(&mut FishX1Transfer, &mut Numbers<'_>),
}

impl Part {
    /// The numbers of an area, in place of those in `numbers`.
    pub(crate) fn read(&self, area: &FishX1Transfer, numbers: &mut Vec<i32>) {
        numbers.clear();
        (self.read)(area, numbers);
    }

    /// Writes the numbers into an area; those out of range are 0.
    pub(crate) fn write(&self, numbers: &[i32], area: &mut FishX1Transfer) {
        (self.write)(area, &mut Numbers(numbers.iter()));
    }

    /// A message with these numbers, in place of that in `out`.
    pub(crate) fn encode(&self, numbers: &[i32], out: &mut Vec<u8>) {
        out.clear();
        for (field, number) in self.fields.iter().zip(numbers) {
            let before = if out.is_empty() { '{' } else { ',' };
            out.extend(format!("{before}\"{field}\":{number}").bytes());
        }
        out.push(b'}');
    }

    /// The numbers of a message. Missing ones are 0, unknown ones are left out.
    pub(crate) fn decode(&self, message: &[u8]) -> Result<Vec<i32>, serde_json::Error> {
        let mut from = serde_json::Deserializer::from_slice(message);
        let numbers = Fields(&self.fields).deserialize(&mut from)?;
        from.end()?;
        Ok(numbers)
    }

    pub(crate) fn schema(&self) -> Value {
        let integer = || json!({ "type": "integer" });
        let fields = self.fields.iter().map(|field| (field.clone(), integer()));
        let properties: serde_json::Map<String, Value> = fields.collect();
        json!({ "type": "object", "description": self.about, "properties": properties })
    }
}

/// All parts, made once.
pub(crate) static PARTS: LazyLock<Vec<Part>> = LazyLock::new(parts);

/// The names of all values that a recording has of a controller, in the order of
/// [`Cycle::values`](crate::Cycle::values): the last part of the topic, and the name in its messages.
///
/// ```
/// assert!(ft_transfer_area_recorder::value_names().any(|name| name == ("counters", "C1")));
/// ```
pub fn value_names() -> impl Iterator<Item = (&'static str, &'static str)> {
    PARTS.iter().flat_map(|part| part.fields.iter().map(|field| (part.name, &**field)))
}

/// All values of an area.
pub(crate) fn values(area: &FishX1Transfer) -> Vec<i32> {
    let (mut all, mut numbers) = (Vec::new(), Vec::new());
    for part in &*PARTS {
        part.read(area, &mut numbers);
        all.append(&mut numbers);
    }
    all
}

/// The number of a mode, and what it measures.
fn mode(mode: &InputMode) -> String {
    format!("{} {}", u8::from(*mode), mode.unit())
}

/// All parts, in the order in which they are written.
pub(crate) fn parts() -> Vec<Part> {
    vec![
        Part {
            name: "configuration",
            about: format!(
                "What is plugged in where. mode of an input: {}, 255 not known; digital: 1 when it reports 0 or 1. \
                 M1: 1 a motor, 0 two single outputs",
                InputMode::ALL.iter().map(mode).collect::<Vec<_>>().join(", ")
            ),
            fields: configuration_fields(),
            each_cycle: false,
            read: read_configuration,
            write: write_configuration,
        },
        Part {
            name: "commands",
            about: "Ids of the last commands, and of those that are done".to_owned(),
            fields: command_fields(),
            each_cycle: false,
            read: read_commands,
            write: write_commands,
        },
        Part {
            name: "remotes",
            about: "The infrared remotes by their switches: joysticks -15 to 15, buttons 0 or 1".to_owned(),
            fields: remote_fields(),
            each_cycle: false,
            read: read_remotes,
            write: write_remotes,
        },
        Part {
            name: "inputs",
            about: "Universal inputs in the unit of their mode, and the microphone".to_owned(),
            fields: [numbered("I", 8, ""), owned(&["mic_lin", "mic_log"])].concat(),
            each_cycle: true,
            read: |area, numbers| {
                numbers.extend(area.input.uni.map(i32::from));
                numbers.extend([area.txt_inputs2.mic_lin, area.txt_inputs2.mic_log].map(i32::from));
            },
            write: |area, numbers| {
                *area.input.uni = numbers.array();
                [area.txt_inputs2.mic_lin, area.txt_inputs2.mic_log] = numbers.array();
            },
        },
        Part {
            name: "counters",
            about: "Pulses of the counters since their last reset, and their levels".to_owned(),
            fields: [numbered("C", 4, ""), numbered("C", 4, "_level")].concat(),
            each_cycle: true,
            read: |area, numbers| {
                // They are negative beyond 32767.
                numbers.extend(area.input.counter.map(|count| i32::from(count as u16)));
                numbers.extend(area.input.cnt_in.map(i32::from));
            },
            write: |area, numbers| {
                *area.input.counter = numbers.array::<u16, 4>().map(|count| count as i16);
                *area.input.cnt_in = numbers.array();
            },
        },
        Part {
            name: "outputs",
            about: "Outputs, 0 to 512, and the same as motors: M1 is O1 - O2, negative for backwards".to_owned(),
            fields: [numbered("O", 8, ""), numbered("M", 4, "")].concat(),
            each_cycle: true,
            read: |area, numbers| {
                let duty = area.output.duty.map(i32::from);
                numbers.extend(duty);
                numbers.extend((0..IZ_MOTOR).map(|motor| duty[2 * motor] - duty[2 * motor + 1]));
            },
            write: |area, numbers| *area.output.duty = numbers.array(),
        },
    ]
}

/// `I1` to `I8` and the like.
fn numbered(letter: &str, count: usize, ending: &str) -> Vec<String> {
    (1..=count).map(|number| format!("{letter}{number}{ending}")).collect()
}

fn owned(fields: &[&str]) -> Vec<String> {
    fields.iter().map(|field| (*field).to_owned()).collect()
}

fn configuration_fields() -> Vec<String> {
    [
        owned(&["config_id"]),
        numbered("I", 8, "_mode"),
        numbered("I", 8, "_digital"),
        numbered("C", 4, "_mode"),
        numbered("M", 4, ""),
    ]
    .concat()
}

fn read_configuration(area: &FishX1Transfer, numbers: &mut Vec<i32>) {
    let config = &area.config;
    numbers.push(area.state.config_id.into());
    numbers.extend(config.uni.map(|input| i32::from(input.mode)));
    numbers.extend(config.uni.map(|input| i32::from(input.digital)));
    numbers.extend(config.cnt.map(|counter| i32::from(counter.mode)));
    numbers.extend(config.motor.map(i32::from));
}

fn write_configuration(area: &mut FishX1Transfer, numbers: &mut Numbers<'_>) {
    let config = &mut area.config;
    area.state.config_id = numbers.next();
    config.uni.iter_mut().for_each(|input| input.mode = numbers.next());
    config.uni.iter_mut().for_each(|input| input.digital = numbers.next());
    config.cnt.iter_mut().for_each(|counter| counter.mode = numbers.next());
    *config.motor = numbers.array();
}

fn command_fields() -> Vec<String> {
    [
        numbered("M", 4, "_command"),
        numbered("M", 4, "_done"),
        numbered("M", 4, "_distance"),
        numbered("M", 4, "_master"),
        numbered("C", 4, "_reset"),
        numbered("C", 4, "_reset_done"),
        owned(&["sound_command", "sound_done", "sound_index", "sound_repeat"]),
    ]
    .concat()
}

fn read_commands(area: &FishX1Transfer, numbers: &mut Vec<i32>) {
    numbers.extend(area.output.motor_ex_cmd_id.map(i32::from));
    numbers.extend(area.input.motor_ex_cmd_id.map(i32::from));
    numbers.extend(area.output.distance.map(i32::from));
    numbers.extend(area.output.master.map(i32::from));
    numbers.extend(area.output.cnt_reset_cmd_id.map(i32::from));
    numbers.extend(area.input.cnt_reset_cmd_id.map(i32::from));
    let sound = &area.txt_outputs;
    let done = area.txt_inputs.sound_cmd_id;
    numbers
        .extend([sound.sound_cmd_id, done, sound.sound_index, sound.sound_repeat].map(i32::from));
}

fn write_commands(area: &mut FishX1Transfer, numbers: &mut Numbers<'_>) {
    *area.output.motor_ex_cmd_id = numbers.array();
    *area.input.motor_ex_cmd_id = numbers.array();
    *area.output.distance = numbers.array();
    *area.output.master = numbers.array();
    *area.output.cnt_reset_cmd_id = numbers.array();
    *area.input.cnt_reset_cmd_id = numbers.array();
    let sound = &mut area.txt_outputs;
    [sound.sound_cmd_id, area.txt_inputs.sound_cmd_id, sound.sound_index, sound.sound_repeat] =
        numbers.array();
}

/// The remotes in their order, by switch 1 and switch 2.
const REMOTES: [&str; 5] = ["any", "off_off", "on_off", "off_on", "on_on"];
const OF_REMOTE: [&str; 8] =
    ["left_x", "left_y", "right_x", "right_y", "on", "off", "switch_1", "switch_2"];

fn remote_fields() -> Vec<String> {
    let field = |remote: &'static str| OF_REMOTE.map(move |field| format!("{remote}_{field}"));
    REMOTES.into_iter().flat_map(field).collect()
}

fn read_remotes(area: &FishX1Transfer, numbers: &mut Vec<i32>) {
    for remote in &area.txt_inputs.ir_input {
        let IrInput { joy_left_x, joy_left_y, joy_right_x, joy_right_y, .. } = *remote;
        numbers.extend([joy_left_x, joy_left_y, joy_right_x, joy_right_y].map(i32::from));
        let IrInput { button_on, button_off, dip_switch_1, dip_switch_2, .. } = *remote;
        numbers.extend([button_on, button_off, dip_switch_1, dip_switch_2].map(i32::from));
    }
}

fn write_remotes(area: &mut FishX1Transfer, numbers: &mut Numbers<'_>) {
    for remote in &mut area.txt_inputs.ir_input {
        let mut axis = || {
            let value: i16 = numbers.next();
            let half = |value: i16| value.max(0).unsigned_abs();
            (value, half(value.saturating_neg()), half(value))
        };
        (remote.joy_left_x, remote.joy_left_x_to_left, remote.joy_left_x_to_right) = axis();
        (remote.joy_left_y, remote.joy_left_y_to_backwards, remote.joy_left_y_to_forward) = axis();
        (remote.joy_right_x, remote.joy_right_x_to_left, remote.joy_right_x_to_right) = axis();
        (remote.joy_right_y, remote.joy_right_y_to_backwards, remote.joy_right_y_to_forward) =
            axis();
        [remote.button_on, remote.button_off, remote.dip_switch_1, remote.dip_switch_2] =
            numbers.array();
    }
}

/// The numbers of a message, one after the other.
pub(crate) struct Numbers<'a>(std::slice::Iter<'a, i32>);

impl Numbers<'_> {
    fn next<T: TryFrom<i32> + Default>(&mut self) -> T {
        self.0.next().and_then(|number| T::try_from(*number).ok()).unwrap_or_default()
    }

    fn array<T: TryFrom<i32> + Default, const N: usize>(&mut self) -> [T; N] {
        std::array::from_fn(|_| self.next())
    }
}

/// Reads an object with these fields.
struct Fields<'a>(&'a [String]);

impl<'de> DeserializeSeed<'de> for Fields<'_> {
    type Value = Vec<i32>;

    fn deserialize<D: Deserializer<'de>>(self, from: D) -> Result<Vec<i32>, D::Error> {
        from.deserialize_map(self)
    }
}

impl<'de> Visitor<'de> for Fields<'_> {
    type Value = Vec<i32>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("an object of integers")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Vec<i32>, A::Error> {
        let mut numbers = vec![0; self.0.len()];
        let mut next = 0;
        while let Some(name) = map.next_key::<&str>()? {
            // They are in order unless another program has written them.
            let in_order = self.0.get(next).is_some_and(|field| field == name);
            let place =
                if in_order { Some(next) } else { self.0.iter().position(|field| field == name) };
            match place {
                Some(place) => {
                    numbers[place] = map.next_value()?;
                    next = place + 1;
                }
                None => drop(map.next_value::<IgnoredAny>()?),
            }
        }
        Ok(numbers)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An area that has another number in each place that is recorded.
    fn area(step: i32) -> FishX1Transfer {
        let mut area = FishX1Transfer::default();
        for (index, part) in (1..).zip(parts()) {
            let numbers: Vec<i32> =
                (0..part.fields.len() as i32).map(|number| (number + index * step) % 100).collect();
            part.write(&numbers, &mut area);
        }
        area
    }

    #[test]
    fn every_field_comes_back() {
        for step in [0, 1, 7, 30] {
            let written = area(step);
            let mut read = FishX1Transfer::default();
            for part in parts() {
                let (mut numbers, mut message) = (Vec::new(), Vec::new());
                part.read(&written, &mut numbers);
                assert_eq!(numbers.len(), part.fields.len(), "{}", part.name);
                part.encode(&numbers, &mut message);
                part.write(&part.decode(&message).unwrap(), &mut read);
            }
            assert_eq!(read, written);
        }
    }

    #[test]
    fn all_values_have_a_name() {
        let mut area = area(7);
        area.input.uni[2] = 4711;
        let values = values(&area);
        assert_eq!(value_names().count(), values.len());
        let mut named = value_names().zip(values);
        assert!(named.any(|value| value == (("inputs", "I3"), 4711)));
    }

    #[test]
    fn values_have_the_names_of_their_terminals() {
        let mut area = FishX1Transfer::default();
        area.input.uni[2] = 4711;
        area.input.counter[3] = -1;
        area.output.duty[3] = 512;
        area.txt_inputs.ir_input[1].joy_left_y = -15;
        let text: String = parts()
            .iter()
            .map(|part| {
                let (mut numbers, mut message) = (Vec::new(), Vec::new());
                part.read(&area, &mut numbers);
                part.encode(&numbers, &mut message);
                String::from_utf8(message).unwrap()
            })
            .collect();
        for expected in ["\"I3\":4711", "\"C4\":65535", "\"O4\":512", "\"M2\":-512"] {
            assert!(text.contains(expected), "{expected} in {text}");
        }
        assert!(text.contains("\"off_off_left_y\":-15"), "{text}");
    }

    #[test]
    fn a_message_of_another_program_is_read_or_refused() {
        let parts = parts();
        let inputs = parts.iter().find(|part| part.name == "inputs").unwrap();
        let numbers = inputs.decode(br#"{ "new": [1], "I8": 8, "I1": 1 }"#).unwrap();
        assert_eq!(numbers, [1, 0, 0, 0, 0, 0, 0, 8, 0, 0]);
        for wrong in ["", "{", "7", "[]", r#"{"I1":"x"}"#, r#"{"I1":1.5}"#, "{}{}"] {
            assert!(inputs.decode(wrong.as_bytes()).is_err(), "{wrong}");
        }
    }
}
