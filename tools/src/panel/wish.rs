//! What a page asks for.

use serde::de::DeserializeOwned;
use serde::Deserialize;
use serde_json::Value;

use super::trouble::Trouble;

/// A message of a page.
#[derive(Debug)]
pub(crate) struct Message {
    pub(crate) host: usize,
    /// 0 the master, 1..=8 the extensions.
    pub(crate) area: usize,
    pub(crate) wish: Wish,
}

#[derive(Debug)]
pub(crate) enum Wish {
    Alive,
    Drive,
    Take,
    Release,
    Stop,
    Area(AreaWish),
    Camera(CameraWish),
    I2c(I2cWish),
    World(WorldWish),
}

/// For one controller: its configuration and its outputs.
#[derive(Debug, Deserialize)]
#[serde(tag = "do", rename_all = "snake_case")]
pub(crate) enum AreaWish {
    Uni {
        input: i32,
        mode: Mode,
        digital: bool,
    },
    CounterMode {
        counter: i32,
        mode: Counting,
    },
    ResetCounter {
        counter: i32,
    },
    MotorKind {
        motor: i32,
        outputs: bool,
    },
    Motor {
        motor: i32,
        duty: i16,
    },
    Output {
        output: i32,
        duty: i16,
    },
    Distance {
        motor: i32,
        duty: i16,
        pulses: u32,
        with: Option<i32>,
        #[serde(default)]
        opposite: bool,
    },
    Sound {
        index: i64,
        repeat: u16,
    },
}

#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Mode {
    Voltage,
    Resistance,
    Resistance15k,
    Ultrasonic,
}

#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Counting {
    Normal,
    Inverted,
}

#[derive(Debug, Deserialize)]
pub(crate) struct CameraWish {
    pub(crate) on: bool,
    pub(crate) width: Option<u16>,
    pub(crate) height: Option<u16>,
    pub(crate) fps: Option<u16>,
}

#[derive(Debug, Deserialize)]
#[serde(tag = "do")]
pub(crate) enum I2cWish {
    #[serde(rename = "i2c_scan")]
    Scan,
    #[serde(rename = "i2c_read")]
    Read { address: u8, register: u8, count: usize },
    #[serde(rename = "i2c_write")]
    Write { address: u8, register: u8, values: Vec<u8> },
}

/// For the world of a simulated TXT.
#[derive(Debug, Deserialize)]
#[serde(tag = "do", rename_all = "snake_case")]
pub(crate) enum WorldWish {
    Press { input: i32, pressed: bool },
    Sensor { input: i32, value: f64 },
    Remote(RemoteWish),
    Plug { alive: bool },
}

#[derive(Debug, Deserialize)]
pub(crate) struct RemoteWish {
    pub(crate) remote: usize,
    pub(crate) left_x: i8,
    pub(crate) left_y: i8,
    pub(crate) right_x: i8,
    pub(crate) right_y: i8,
    pub(crate) on: bool,
    pub(crate) off: bool,
}

/// The number of the message, if it has one, and the message.
pub(crate) fn read(text: &str) -> (Option<u64>, Result<Message, Trouble>) {
    match serde_json::from_str::<Value>(text) {
        Ok(value) => (value.get("seq").and_then(Value::as_u64), understand(value)),
        Err(error) => (None, Err(Trouble::bad_message(error))),
    }
}

fn understand(value: Value) -> Result<Message, Trouble> {
    let (host, area) = (place(&value, "host")?, place(&value, "area")?);
    let name = value.get("do").and_then(Value::as_str);
    let name = name.ok_or_else(|| Trouble::bad_message("it has no \"do\""))?;
    let wish = match name {
        "alive" => Wish::Alive,
        "drive" => Wish::Drive,
        "take" => Wish::Take,
        "release" => Wish::Release,
        "stop" => Wish::Stop,
        "camera" => Wish::Camera(parse(value)?),
        "i2c_scan" | "i2c_read" | "i2c_write" => Wish::I2c(parse(value)?),
        "press" | "sensor" | "remote" | "plug" => Wish::World(parse(value)?),
        _ => Wish::Area(parse(value)?),
    };
    Ok(Message { host, area, wish })
}

/// An index in a message; 0 if it is not there.
fn place(value: &Value, key: &str) -> Result<usize, Trouble> {
    let Some(given) = value.get(key).filter(|given| !given.is_null()) else { return Ok(0) };
    let index = given.as_u64().and_then(|index| usize::try_from(index).ok());
    index.ok_or_else(|| Trouble::bad_message(format!("{key:?} is no whole number from 0 on")))
}

fn parse<T: DeserializeOwned>(value: Value) -> Result<T, Trouble> {
    serde_json::from_value(value).map_err(Trouble::bad_message)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wrong_message_gives_a_sentence_and_keeps_its_number() {
        for (text, seq, reason) in [
            ("", None, "EOF"),
            ("[]", None, "no \"do\""),
            ("{\"seq\":7}", Some(7), "no \"do\""),
            ("{\"seq\":7,\"do\":\"fly\"}", Some(7), "fly"),
            ("{\"seq\":7,\"do\":\"motor\",\"motor\":0}", Some(7), "duty"),
            ("{\"do\":\"motor\",\"motor\":0,\"duty\":99999}", None, "99999"),
            ("{\"do\":\"stop\",\"host\":-1}", None, "host"),
            ("{\"do\":\"i2c_write\",\"address\":1,\"register\":1,\"values\":[256]}", None, "256"),
        ] {
            let (number, result) = read(text);
            let trouble = result.unwrap_err();
            assert_eq!((number, trouble.code), (seq, "bad_message"), "{text}");
            assert!(trouble.text.contains(reason), "{}", trouble.text);
        }
    }

    #[test]
    fn places_are_the_first_ones_by_default() {
        let (_, message) = read("{\"do\":\"motor\",\"motor\":1,\"duty\":-512,\"host\":2}");
        let message = message.unwrap();
        assert_eq!((message.host, message.area), (2, 0));
        assert!(matches!(message.wish, Wish::Area(AreaWish::Motor { motor: 1, duty: -512 })));
    }
}
