//! The command line.

use std::ffi::OsString;
use std::path::Path;
use std::str::FromStr;
use std::time::Duration;

use ft_transfer_area::simulator::world::World;
use ft_transfer_area::simulator::{CameraConnection, Fault, SimulatedTxt, SimulatedTxtBuilder};
use ft_transfer_area::transfer_area::MAX_EXTENSIONS;
use ft_transfer_area::{FirmwareVersion, PORT};
use lexopt::prelude::{Long, Short, ValueExt};

pub(crate) const HELP: &str = "\
A simulated TXT controller for clients in any language.

usage: simulated_txt [OPTIONS]

  --port N               main port (65000), at most 65533; 0: three free ports in a row
  --camera-port N        camera port (the main port + 1); 0: any free one
  --i2c-port N           I2C port (the main port + 2); 0: any free one
  --extensions N         number of extensions, 0 to 8 (those of the world)
  --firmware A.B.C       firmware version that is reported (4.6.6)
  --name NAME            name that is reported, at most 16 bytes (TX2013)
  --world WORLD          what is plugged in: none, a world that comes with it (default), or the path
                         of a .toml file
  --pace MS              time from one exchange response to the next (10); 0: none
  --lock-step            time passes by exchanges only: no pace, no idle limit
  --idle-limit S         seconds a connection may be silent before it is closed, such as 0.5 (5)
  --camera-connection C  when the camera accepts connections: waits (always), txt (while it
                         serves), or txt40 (only clients connected when it starts) (waits)
  --camera-start-up MS   time from the camera's start to its first frame (1500)
  --camera-stall N       each camera connection becomes silent after N frames
  --no-huffman-tables    camera frames without Huffman tables, as many USB cameras send them
  --fault WHAT@WHERE     order a fault; may be given more than once
  --seed N               seed of all random values (0)
  -h, --help             this text

WHAT is delay:MS, jitter:MS, silence, dribble, id, crc, size:BYTES, mask:BITS, cut,
surplus:BYTES or close:BYTES; WHERE is response:N, exchange:N (from 0, on a connection; each
fault strikes once) or exchange:each. Examples: crc@exchange:100, close:5@response:3,
jitter:20@exchange:each.

It listens on 127.0.0.1, prints each port on its own line, and ends on Ctrl-C. It warns about
clients that do something wrong; set RUST_LOG=info to see who connects and what clients do, too.
Lines that you type while it runs press buttons and change sensors, such as I3 1 or E1.I2 0; after a
wrong line it lists all of them.
";

const PORTS: &str = "a port from 0 to 65535 is expected";
const NUMBERS: &str = "a whole number is expected, 0 or more";

/// How many bytes of a name are reported.
const NAME_LEN: usize = 16;

/// The simulated TXT of the command line, or `None` when it asks for help. An error is a sentence.
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
    format!("{error}; --help lists the options")
}

/// The world with this name, or in this file.
fn read_world(name: OsString) -> Result<Option<World>, String> {
    let path = Path::new(&name);
    let is_file = path.extension().is_some() || path.components().count() > 1;
    match name.to_str() {
        Some("none") => Ok(None),
        Some(shipped) if !is_file => World::shipped(shipped).map(Some).map_err(|error| {
            format!("{error}; or use none for no world, or the path of a .toml file")
        }),
        _ => World::load(path).map(Some).map_err(|error| format!("{}: {error}", path.display())),
    }
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
        "lock-step" => txt.lock_step(),
        "idle-limit" => txt.idle_limit(parser.value()?.parse_with(seconds)?),
        "camera-connection" => {
            txt.camera_connection(parser.value()?.parse_with(camera_connection)?)
        }
        "camera-start-up" => txt.camera_start_up(parser.value()?.parse_with(milliseconds)?),
        "camera-stall" => txt.camera_stall_after(parser.value()?.parse_with(number(NUMBERS))?),
        "no-huffman-tables" => txt.camera_tables(false),
        "fault" => txt.fault(parser.value()?.parse::<Fault>()?),
        "seed" => txt.seed(parser.value()?.parse_with(number(NUMBERS))?),
        _ => return Err(Long(name).unexpected()),
    })
}

/// Adds the option to an error that does not name it.
fn in_context(name: &str, error: lexopt::Error) -> lexopt::Error {
    match error {
        lexopt::Error::ParsingFailed { value, error } => {
            format!("--{name} {value:?}: {error}").into()
        }
        error => error,
    }
}

/// Reads a number. The error names the expected range.
fn number<T: FromStr>(expected: &'static str) -> impl Fn(&str) -> Result<T, &'static str> {
    move |text| text.parse().map_err(|_| expected)
}

fn extensions(text: &str) -> Result<usize, String> {
    let number = text.parse().ok().filter(|number| *number <= MAX_EXTENSIONS);
    number.ok_or_else(|| format!("a number from 0 to {MAX_EXTENSIONS} is expected"))
}

fn camera_connection(text: &str) -> Result<CameraConnection, &'static str> {
    match text {
        "waits" => Ok(CameraConnection::Waits),
        "txt" => Ok(CameraConnection::Txt),
        "txt40" => Ok(CameraConnection::Txt40),
        _ => Err("waits, txt or txt40 is expected"),
    }
}

fn milliseconds(text: &str) -> Result<Duration, &'static str> {
    number("whole milliseconds are expected, 0 or more")(text).map(Duration::from_millis)
}

/// A time greater than 0.
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
