//! What a page asks for.

use ft_transfer_area::tx::InvalidCall;
use serde::de::DeserializeOwned;
use serde::Deserialize;
use serde_json::Value;

use super::problem::Problem;
use crate::commands::{names, Command, Follower, Pair};

/// A message of a page.
#[derive(Debug)]
pub(crate) struct Message {
    pub(crate) host: usize,
    /// 0 the master, 1..=8 the extensions.
    pub(crate) area: usize,
    pub(crate) request: Request,
}

#[derive(Debug)]
pub(crate) enum Request {
    Alive,
    /// Which controller is shown alone; `None` for all.
    Look(Option<usize>),
    Drive,
    Take,
    Release,
    Stop,
    /// For a controller that another program drives through this one.
    Disconnect,
    Admit,
    Record(bool),
    World(WorldRequest),
    Work(Work),
}

/// What only the page that drives may ask for.
#[derive(Debug)]
pub(crate) enum Work {
    Area(Command),
    Camera(CameraRequest),
    I2c(I2cRequest),
}

#[derive(Debug, Deserialize)]
pub(crate) struct CameraRequest {
    pub(crate) on: bool,
    pub(crate) width: Option<u16>,
    pub(crate) height: Option<u16>,
    pub(crate) fps: Option<u16>,
}

#[derive(Debug, Deserialize)]
#[serde(tag = "do")]
pub(crate) enum I2cRequest {
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
pub(crate) enum WorldRequest {
    Press {
        input: i32,
        pressed: bool,
    },
    Sensor {
        input: i32,
        value: f64,
    },
    Remote(RemoteRequest),
    Plug {
        alive: bool,
    },
    Put {
        piece: String,
        place: String,
    },
    #[serde(rename = "take_away")]
    TakeAway {
        place: String,
    },
}

/// What hands hold in a world: a page that is gone has let it go.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Held {
    Button(i32),
    Remote(usize),
}

impl Held {
    /// What a request holds or lets go, and whether it holds it.
    pub(crate) fn by(request: &WorldRequest) -> Option<(Self, bool)> {
        match request {
            WorldRequest::Press { input, pressed } => Some((Self::Button(*input), *pressed)),
            WorldRequest::Remote(remote) => {
                let at_rest = RemoteRequest { remote: remote.remote, ..RemoteRequest::default() };
                Some((Self::Remote(remote.remote), *remote != at_rest))
            }
            WorldRequest::Sensor { .. }
            | WorldRequest::Plug { .. }
            | WorldRequest::Put { .. }
            | WorldRequest::TakeAway { .. } => None,
        }
    }

    /// The request that lets it go.
    pub(crate) fn let_go(self) -> WorldRequest {
        match self {
            Self::Button(input) => WorldRequest::Press { input, pressed: false },
            Self::Remote(remote) => {
                WorldRequest::Remote(RemoteRequest { remote, ..RemoteRequest::default() })
            }
        }
    }
}

#[derive(Debug, Default, PartialEq, Eq, Deserialize)]
pub(crate) struct RemoteRequest {
    pub(crate) remote: usize,
    pub(crate) left_x: i8,
    pub(crate) left_y: i8,
    pub(crate) right_x: i8,
    pub(crate) right_y: i8,
    pub(crate) on: bool,
    pub(crate) off: bool,
}

/// The number of the message, if it has one, and the message.
pub(crate) fn read(text: &str) -> (Option<u64>, Result<Message, Problem>) {
    match serde_json::from_str::<Value>(text) {
        Ok(value) => (value.get("seq").and_then(Value::as_u64), understand(value)),
        Err(error) => (None, Err(Problem::bad_message(error))),
    }
}

fn understand(value: Value) -> Result<Message, Problem> {
    let place = |key| field::<Option<usize>>(&value, key).map(Option::unwrap_or_default);
    let (host, area) = (place("host")?, place("area")?);
    let name = value.get("do").and_then(Value::as_str);
    let name = name.ok_or_else(|| Problem::bad_message("it has no \"do\""))?;
    let request = match name {
        "alive" => Request::Alive,
        "look" => Request::Look(field(&value, "only")?),
        "drive" => Request::Drive,
        "take" => Request::Take,
        "release" => Request::Release,
        "stop" => Request::Stop,
        "disconnect" => Request::Disconnect,
        "admit" => Request::Admit,
        "record" => Request::Record(field(&value, "on")?),
        "camera" => Request::Work(Work::Camera(parse(value)?)),
        "i2c_scan" | "i2c_read" | "i2c_write" => Request::Work(Work::I2c(parse(value)?)),
        "press" | "sensor" | "remote" | "plug" | "put" | "take_away" => {
            Request::World(parse(value)?)
        }
        _ => Request::Work(Work::Area(command(name, &value)?)),
    };
    Ok(Message { host, area, request })
}

/// A command for one area: its configuration and its outputs. Terminals are counted from 0.
fn command(name: &str, message: &Value) -> Result<Command, Problem> {
    let motor = || terminal(message, "motor");
    let duty = || field::<i16>(message, "duty").map(i64::from);
    Ok(match name {
        "uni" => Command::InputMode {
            input: terminal(message, "input")?,
            mode: names::input_mode(&message["mode"]).map_err(Problem::bad_message)?,
            digital: field(message, "digital")?,
        },
        "counter_mode" => Command::CounterMode {
            counter: terminal(message, "counter")?,
            mode: names::counter_mode(&message["mode"]).map_err(Problem::bad_message)?,
        },
        "reset_counter" => Command::ResetCounter(terminal(message, "counter")?),
        "motor_kind" => {
            let kind = if field(message, "outputs")? { Pair::Outputs } else { Pair::Motor };
            Command::Pair { motor: motor()?, kind }
        }
        "motor" => Command::Motor { motor: motor()?, duty: duty()?, stops_followers: true },
        "output" => Command::Output { output: terminal(message, "output")?, duty: duty()? },
        "distance" => {
            let opposite = field::<Option<bool>>(message, "opposite")?.unwrap_or_default();
            let with = match &message["with"] {
                Value::Null => Vec::new(),
                _ => vec![Follower { motor: terminal(message, "with")?, opposite }],
            };
            // Two motors may turn together without end.
            let pulses = Some(field(message, "pulses")?);
            let pulses = pulses.filter(|pulses| *pulses != 0 || with.is_empty());
            Command::Move { motor: motor()?, duty: duty()?, pulses, with }
        }
        "sound" => {
            Command::Sound { index: field(message, "index")?, repeat: field(message, "repeat")? }
        }
        other => return Err(Problem::bad_message(format!("there is no {other:?}"))),
    })
}

/// The terminal with the index that a message has under this key.
fn terminal<T: TryFrom<i32, Error = InvalidCall>>(
    message: &Value,
    key: &str,
) -> Result<T, Problem> {
    Ok(T::try_from(field(message, key)?)?)
}

fn field<T: DeserializeOwned>(message: &Value, key: &str) -> Result<T, Problem> {
    T::deserialize(&message[key]).map_err(|error| Problem::bad_message(format!("{key}: {error}")))
}

fn parse<T: DeserializeOwned>(value: Value) -> Result<T, Problem> {
    serde_json::from_value(value).map_err(Problem::bad_message)
}

#[cfg(test)]
mod tests {
    use ft_transfer_area::tx::Motor;

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
            let problem = result.unwrap_err();
            assert_eq!((number, problem.code), (seq, "bad_message"), "{text}");
            assert!(problem.text.contains(reason), "{}", problem.text);
        }
    }

    #[test]
    fn places_are_the_first_ones_by_default() {
        let (_, message) = read("{\"do\":\"motor\",\"motor\":1,\"duty\":-512,\"host\":2}");
        let message = message.unwrap();
        assert_eq!((message.host, message.area), (2, 0));
        let command = Command::Motor { motor: Motor::M2, duty: -512, stops_followers: true };
        assert!(matches!(message.request, Request::Work(Work::Area(given)) if given == command));
    }

    #[test]
    fn a_terminal_that_there_is_not_is_out_of_range() {
        for text in [
            "{\"do\":\"motor\",\"motor\":4,\"duty\":0}",
            "{\"do\":\"uni\",\"input\":-1,\"mode\":\"voltage\",\"digital\":false}",
            "{\"do\":\"output\",\"output\":8,\"duty\":1}",
        ] {
            assert_eq!(read(text).1.unwrap_err().code, "out_of_range", "{text}");
        }
    }

    #[test]
    fn without_pulses_two_motors_turn_together_and_one_has_no_distance() {
        let pulses = |with: &str| {
            let go = "\"do\":\"distance\",\"motor\":1,\"duty\":9,\"pulses\":0";
            match read(&format!("{{{go}{with}}}")).1.unwrap().request {
                Request::Work(Work::Area(Command::Move { pulses, .. })) => pulses,
                other => panic!("{other:?}"),
            }
        };
        assert_eq!((pulses(",\"with\":3"), pulses("")), (None, Some(0)));
    }
}
