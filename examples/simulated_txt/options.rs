//! The command line.

use std::ffi::{OsStr, OsString};
use std::path::Path;
use std::str::FromStr;
use std::time::Duration;

use ft_transfer_area::simulator::world::World;
use ft_transfer_area::simulator::{Fault, SimulatedTxt, SimulatedTxtBuilder};
use ft_transfer_area::transfer_area::MAX_EXTENSIONS;
use ft_transfer_area::{Error, FirmwareVersion, PORT};
use lexopt::prelude::{Long, Short, ValueExt};

pub(crate) const HELP: &str = "\
A simulated TXT controller for clients in any language.

usage: simulated_txt [OPTIONS]

  --port N               main port (65000), at most 65533; 0: three free ports in a row
  --camera-port N        camera port (the main port + 1); 0: any free one
  --i2c-port N           I2C port (the main port + 2); 0: any free one
  --extensions N         number of extensions, 0 to 8 (as many as the world has)
  --firmware A.B.C       firmware version that is reported (4.6.6)
  --name NAME            name that is reported, at most 16 bytes (TX2013)
  --world WORLD          what is plugged in: slide (the default), kit, car, none, or a file that
                         describes it
  --pace MS              time from one exchange response to the next (10); 0: none
  --idle-limit S         seconds a connection may be silent before it is closed, such as 0.5 (5)
  --camera-start-up MS   time from the camera's start to its first frame (1500)
  --camera-stall N       each camera connection falls silent after N frames
  --no-huffman-tables    camera frames without Huffman tables, as many USB cameras send them
  --fault WHAT@WHERE     order a fault; may be given more than once
  --seed N               what all that is random follows from (0)
  -h, --help             this text

WHAT is delay:MS, jitter:MS, silence, dribble, id, crc, size:BYTES, mask:BITS, cut,
surplus:BYTES or close:BYTES; WHERE is response:N, exchange:N (from 0, on a connection; each
fault strikes once) or exchange:each. Examples: crc@exchange:100, close:5@response:3,
jitter:20@exchange:each.

It listens on 127.0.0.1, prints each port on a line of its own, and ends on Ctrl-C. It warns of
clients that do something wrong; set RUST_LOG=info to see who connects and what they do, too. Lines
typed while it runs press buttons and change sensors: I3 1, E1.I2 0; a wrong line tells which there
are.
";

const PORTS: &str = "a port from 0 to 65535 is expected";
const NUMBERS: &str = "a whole number is expected, 0 or more";

/// How many bytes of a name are reported.
const NAME_LEN: usize = 16;

/// A simulated TXT as the command line wants it, or `None` when it asks for help. Otherwise a
/// sentence.
pub(crate) fn from_env() -> Result<Option<SimulatedTxtBuilder>, String> {
    let mut parser = lexopt::Parser::from_env();
    let mut txt = SimulatedTxt::builder().port(PORT);
    let mut world = Some(World::default());
    while let Some(argument) = parser.next().map_err(with_hint)? {
        let name = match argument {
            Short('h') | Long("help") => return Ok(None),
            Long(name) => name.to_owned(),
            other => return Err(with_hint(other.unexpected())),
        };
        if name == "world" {
            world = read_world(parser.value().map_err(with_hint)?)?;
        } else {
            txt = apply(txt, &name, &mut parser)
                .map_err(|error| with_hint(in_context(&name, error)))?;
        }
    }
    Ok(Some(match world {
        Some(world) => txt.world(world),
        None => txt,
    }))
}

/// The sentence for a mistake in the command line.
fn with_hint(error: lexopt::Error) -> String {
    format!("{error}; --help tells what there is")
}

/// The world of this name, or in this file.
fn read_world(name: OsString) -> Result<Option<World>, String> {
    match name.to_str() {
        Some("slide") => Ok(Some(World::default())),
        Some("kit") => in_file(&name, World::from_toml(include_str!("../worlds/kit.toml"))),
        Some("car") => in_file(&name, World::from_toml(include_str!("../worlds/car.toml"))),
        Some("none") => Ok(None),
        _ => in_file(&name, World::load(&name)),
    }
}

/// Says which file a mistake is in.
fn in_file(name: &OsStr, world: Result<World, Error>) -> Result<Option<World>, String> {
    world.map(Some).map_err(|error| format!("{}: {error}", Path::new(name).display()))
}

/// Sets what one option says.
fn apply(
    txt: SimulatedTxtBuilder,
    name: &str,
    parser: &mut lexopt::Parser,
) -> Result<SimulatedTxtBuilder, lexopt::Error> {
    Ok(match name {
        "port" => txt.port(parser.value()?.parse_with(number(PORTS))?),
        "camera-port" => txt.camera_port(parser.value()?.parse_with(number(PORTS))?),
        "i2c-port" => txt.i2c_port(parser.value()?.parse_with(number(PORTS))?),
        "extensions" => txt.extensions(parser.value()?.parse_with(extensions)?),
        "firmware" => txt.firmware(parser.value()?.parse_with(firmware)?),
        "name" => txt.device_name(&parser.value()?.parse_with(device_name)?),
        "pace" => txt.pace(parser.value()?.parse_with(milliseconds)?),
        "idle-limit" => txt.idle_limit(parser.value()?.parse_with(seconds)?),
        "camera-start-up" => txt.camera_start_up(parser.value()?.parse_with(milliseconds)?),
        "camera-stall" => txt.camera_stall_after(parser.value()?.parse_with(number(NUMBERS))?),
        "no-huffman-tables" => txt.camera_tables(false),
        "fault" => txt.fault(parser.value()?.parse::<Fault>()?),
        "seed" => txt.seed(parser.value()?.parse_with(number(NUMBERS))?),
        _ => return Err(Long(name).unexpected()),
    })
}

/// Says which option an error is about, where the error doesn't.
fn in_context(name: &str, error: lexopt::Error) -> lexopt::Error {
    match error {
        lexopt::Error::ParsingFailed { value, error } => {
            format!("--{name} {value:?}: {error}").into()
        }
        error => error,
    }
}

/// A number, whose range is told when it is another.
fn number<T: FromStr>(expected: &'static str) -> impl Fn(&str) -> Result<T, &'static str> {
    move |text| text.parse().map_err(|_| expected)
}

fn extensions(text: &str) -> Result<usize, String> {
    let number = text.parse().ok().filter(|number| *number <= MAX_EXTENSIONS);
    number.ok_or_else(|| format!("a number from 0 to {MAX_EXTENSIONS} is expected"))
}

fn milliseconds(text: &str) -> Result<Duration, &'static str> {
    number("whole milliseconds are expected, 0 or more")(text).map(Duration::from_millis)
}

/// More than no time at all.
fn seconds(text: &str) -> Result<Duration, &'static str> {
    let seconds = text.parse().ok().and_then(|seconds| Duration::try_from_secs_f64(seconds).ok());
    let more_than_none = seconds.filter(|seconds| !seconds.is_zero());
    more_than_none.ok_or("seconds are expected, more than 0, such as 5 or 0.5")
}

/// A name that is reported as it is.
fn device_name(text: &str) -> Result<String, String> {
    match text.len() {
        0..=NAME_LEN => Ok(text.to_owned()),
        length => Err(format!("at most {NAME_LEN} bytes are expected, and this has {length}")),
    }
}

/// A version such as 4.6.6.
fn firmware(text: &str) -> Result<FirmwareVersion, &'static str> {
    let expected = "a version such as 4.6.6 is expected";
    let mut parts = text.split('.').map(|part| part.parse::<u8>().map_err(|_| expected));
    match (parts.next(), parts.next(), parts.next(), parts.next()) {
        (Some(major), Some(minor), Some(patch), None) => {
            Ok(FirmwareVersion::new(major?, minor?, patch?))
        }
        _ => Err(expected),
    }
}
