//! What a page asks for.

use std::mem;

use ft_transfer_area::tx::InvalidCall;
use serde::de::DeserializeOwned;
use serde::Deserialize;
use serde_json::{Map, Value};

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
#[serde(deny_unknown_fields)]
pub(crate) struct CameraRequest {
    pub(crate) on: bool,
    pub(crate) width: Option<u16>,
    pub(crate) height: Option<u16>,
    pub(crate) fps: Option<u16>,
}

#[derive(Debug, Deserialize)]
#[serde(tag = "do", deny_unknown_fields)]
pub(crate) enum I2cRequest {
    #[serde(rename = "i2c_scan")]
    Scan {},
    #[serde(rename = "i2c_read")]
    Read { address: u8, register: u8, count: usize },
    #[serde(rename = "i2c_write")]
    Write { address: u8, register: u8, values: Vec<u8> },
}

/// For the world of a simulated TXT.
#[derive(Debug, Deserialize)]
#[serde(tag = "do", rename_all = "snake_case", deny_unknown_fields)]
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
#[serde(deny_unknown_fields)]
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
    let mut members = Members::of(value);
    let _seq: Value = members.take("seq")?;
    let (host, area) = (members.place("host")?, members.place("area")?);
    let name: Option<String> = members.take("do")?;
    let name = name.ok_or_else(|| Problem::bad_message("it has no \"do\""))?;
    let request = match &*name {
        "alive" => Request::Alive,
        "look" => Request::Look(members.take("only")?),
        "drive" => Request::Drive,
        "take" => Request::Take,
        "release" => Request::Release,
        "stop" => Request::Stop,
        "disconnect" => Request::Disconnect,
        "admit" => Request::Admit,
        "record" => Request::Record(members.take("on")?),
        "camera" => Request::Work(Work::Camera(members.all()?)),
        "i2c_scan" | "i2c_read" | "i2c_write" => Request::Work(Work::I2c(members.all_of(name)?)),
        "press" | "sensor" | "remote" | "plug" | "put" | "take_away" => {
            Request::World(members.all_of(name)?)
        }
        _ => Request::Work(Work::Area(command(&name, &mut members)?)),
    };
    members.end()?;
    Ok(Message { host, area, request })
}

/// A command for one area: its configuration and its outputs. Terminals are counted from 0.
fn command(name: &str, members: &mut Members) -> Result<Command, Problem> {
    Ok(match name {
        "uni" => Command::InputMode {
            input: members.terminal("input")?,
            mode: names::input_mode(&members.take::<Value>("mode")?)
                .map_err(Problem::bad_message)?,
            digital: members.take("digital")?,
        },
        "counter_mode" => Command::CounterMode {
            counter: members.terminal("counter")?,
            mode: names::counter_mode(&members.take::<Value>("mode")?)
                .map_err(Problem::bad_message)?,
        },
        "reset_counter" => Command::ResetCounter(members.terminal("counter")?),
        "motor_kind" => {
            let kind = if members.take("outputs")? { Pair::Outputs } else { Pair::Motor };
            Command::Pair { motor: members.terminal("motor")?, kind }
        }
        "motor" => Command::Motor {
            motor: members.terminal("motor")?,
            duty: members.duty()?,
            stops_followers: true,
        },
        "output" => Command::Output { output: members.terminal("output")?, duty: members.duty()? },
        "distance" => {
            let opposite: Option<bool> = members.take("opposite")?;
            let opposite = opposite.unwrap_or_default();
            let with = match members.take("with")? {
                Value::Null => Vec::new(),
                motor => vec![Follower { motor: terminal("with", motor)?, opposite }],
            };
            // Two motors may turn together without end.
            let pulses = Some(members.take("pulses")?);
            let pulses = pulses.filter(|pulses| *pulses != 0 || with.is_empty());
            let (motor, duty) = (members.terminal("motor")?, members.duty()?);
            Command::Move { motor, duty, pulses, with }
        }
        "sound" => {
            Command::Sound { index: members.take("index")?, repeat: members.take("repeat")? }
        }
        other => return Err(Problem::bad_message(format!("there is no {other:?}"))),
    })
}

/// The members of a message that are not yet understood. What is left at the end may be a place that was misspelt, and
/// another machine would move.
struct Members(Map<String, Value>);

impl Members {
    fn of(message: Value) -> Self {
        match message {
            Value::Object(members) => Self(members),
            _ => Self(Map::new()),
        }
    }

    /// One that is not there is null.
    fn take<T: DeserializeOwned>(&mut self, key: &str) -> Result<T, Problem> {
        read_member(key, self.0.remove(key).unwrap_or_default())
    }

    /// A host or an area; without it the first.
    fn place(&mut self, key: &str) -> Result<usize, Problem> {
        self.0.remove(key).map_or(Ok(0), |place| read_member(key, place))
    }

    fn terminal<T: TryFrom<i32, Error = InvalidCall>>(&mut self, key: &str) -> Result<T, Problem> {
        terminal(key, self.0.remove(key).unwrap_or_default())
    }

    fn duty(&mut self) -> Result<i64, Problem> {
        self.take::<i16>("duty").map(i64::from)
    }

    /// All that are left.
    fn all<T: DeserializeOwned>(&mut self) -> Result<T, Problem> {
        let members = mem::take(&mut self.0);
        serde_json::from_value(Value::Object(members)).map_err(Problem::bad_message)
    }

    /// The same for what begins with its name.
    fn all_of<T: DeserializeOwned>(&mut self, name: String) -> Result<T, Problem> {
        self.0.insert("do".to_owned(), Value::String(name));
        self.all()
    }

    fn end(self) -> Result<(), Problem> {
        match self.0.keys().next() {
            None => Ok(()),
            Some(key) => Err(Problem::bad_message(format!("there is no member {key:?} in it"))),
        }
    }
}

/// A terminal by its index.
fn terminal<T: TryFrom<i32, Error = InvalidCall>>(key: &str, index: Value) -> Result<T, Problem> {
    Ok(T::try_from(read_member(key, index)?)?)
}

fn read_member<T: DeserializeOwned>(key: &str, value: Value) -> Result<T, Problem> {
    T::deserialize(value).map_err(|error| Problem::bad_message(format!("{key}: {error}")))
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
            ("{\"do\":\"stop\",\"host\":null}", None, "host"),
            ("{\"do\":\"motor\",\"hosts\":1,\"motor\":0,\"duty\":300}", None, "\"hosts\""),
            ("{\"do\":\"press\",\"Host\":1,\"input\":0,\"pressed\":true}", None, "Host"),
            ("{\"do\":\"i2c_scan\",\"extension\":1}", None, "extension"),
            ("{\"do\":\"camera\",\"on\":true,\"width\":320,\"high\":240}", None, "high"),
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
