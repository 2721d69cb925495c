//! The command line.

use std::ffi::OsString;
use std::path::Path;
use std::time::Duration;

use ft_transfer_area::simulator::world::World;
use ft_transfer_area::simulator::{Fault, SimulatedTxt, SimulatedTxtBuilder};
use ft_transfer_area::{FirmwareVersion, PORT};
use lexopt::prelude::{Long, Short, ValueExt};

pub(crate) const HELP: &str = "\
A simulated TXT controller for clients in any language.

usage: simulated_txt [OPTIONS]

  --port N               main port (65000); 0: three free ports in a row
  --camera-port N        camera port (the main port + 1); 0: any free one
  --i2c-port N           I2C port (the main port + 2); 0: any free one
  --extensions N         number of extensions, 0 to 8 (0)
  --firmware A.B.C       firmware version that is reported (4.6.6)
  --name NAME            name that is reported, at most 16 bytes (TX2013)
  --world WORLD          what is plugged in: slide (the default), none, or a file that describes it
  --pace MS              time from one exchange response to the next (10); 0: none
  --idle-limit S         how long a connection may be silent before it is closed (5)
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

It listens on 127.0.0.1, prints each port on a line of its own, and ends on Ctrl-C. Set
RUST_LOG=info to see who connects and what they do. Lines typed while it runs press buttons and
change sensors: I3 1, E1.I2 0; a wrong line tells which there are.
";

/// A simulated TXT as the command line wants it, or `None` when it asks for help.
pub(crate) fn from_env() -> Result<Option<SimulatedTxtBuilder>, lexopt::Error> {
    let mut parser = lexopt::Parser::from_env();
    let mut txt = SimulatedTxt::builder().port(PORT);
    let mut world = Some(World::default());
    while let Some(argument) = parser.next()? {
        let name = match argument {
            Short('h') | Long("help") => return Ok(None),
            Long(name) => name.to_owned(),
            other => return Err(other.unexpected()),
        };
        if name == "world" {
            world = read_world(parser.value()?)?;
        } else {
            txt = apply(txt, &name, &mut parser).map_err(|error| in_context(&name, error))?;
        }
    }
    Ok(Some(match world {
        Some(world) => txt.world(world),
        None => txt,
    }))
}

/// The world of this name, or in this file.
fn read_world(name: OsString) -> Result<Option<World>, lexopt::Error> {
    match name.to_str() {
        Some("slide") => Ok(Some(World::default())),
        Some("none") => Ok(None),
        _ => {
            let path = Path::new(&name);
            let world =
                World::load(path).map_err(|error| format!("{}: {error}", path.display()))?;
            Ok(Some(world))
        }
    }
}

/// Sets what one option says.
fn apply(
    txt: SimulatedTxtBuilder,
    name: &str,
    parser: &mut lexopt::Parser,
) -> Result<SimulatedTxtBuilder, lexopt::Error> {
    Ok(match name {
        "port" => txt.port(parser.value()?.parse()?),
        "camera-port" => txt.camera_port(parser.value()?.parse()?),
        "i2c-port" => txt.i2c_port(parser.value()?.parse()?),
        "extensions" => txt.extensions(parser.value()?.parse()?),
        "firmware" => txt.firmware(parser.value()?.parse_with(firmware)?),
        "name" => txt.device_name(&parser.value()?.string()?),
        "pace" => txt.pace(Duration::from_millis(parser.value()?.parse()?)),
        "idle-limit" => txt.idle_limit(Duration::from_secs(parser.value()?.parse()?)),
        "camera-start-up" => txt.camera_start_up(Duration::from_millis(parser.value()?.parse()?)),
        "camera-stall" => txt.camera_stall_after(parser.value()?.parse()?),
        "no-huffman-tables" => txt.camera_tables(false),
        "fault" => txt.fault(parser.value()?.parse::<Fault>()?),
        "seed" => txt.seed(parser.value()?.parse()?),
        _ => return Err(Long(name).unexpected()),
    })
}

/// Says which option an error is about, where the error doesn't.
fn in_context(name: &str, error: lexopt::Error) -> lexopt::Error {
    match error {
        lexopt::Error::ParsingFailed { .. } => format!("--{name}: {error}").into(),
        error => error,
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
