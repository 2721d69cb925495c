//! The options of `txt simulate`.

use std::ffi::OsString;
use std::str::FromStr;
use std::time::Duration;

use anyhow::bail;
use clap::builder::{OsStringValueParser, TypedValueParser};
use clap::ValueEnum;
use ft_transfer_area::transfer_area::MAX_EXTENSIONS;
use ft_transfer_area::{FirmwareVersion, PORT};
use ft_transfer_area_simulator::world::{Factory, World};
use ft_transfer_area_simulator::{
    CameraConnection, Fault, SimulatedFactory, SimulatedTxt, SimulatedTxtBuilder,
};

use crate::{arguments, open_files, print};

const AFTER: &str = "\
WHAT is delay:MS, jitter:MS, silence, dribble, id, crc, size:BYTES, mask:BITS, cut,
surplus:BYTES or close:BYTES; WHERE is response:N, exchange:N (from 0, on a connection; each
fault strikes once) or exchange:each, such as crc@exchange:100, close:5@response:3,
jitter:20@exchange:each.
The camera's port accepts clients always (waits), while it serves (txt), or always, but serves
only a client that was there before its start (txt40).

It listens on 127.0.0.1, prints each port on its own line, and ends on Ctrl-C. With
RUST_LOG=info it logs who connects and what clients do. Lines that you type while it runs press
buttons and change sensors, such as I3 1 or E1.I2 0; after a wrong line it lists all of them.
A world may have several controllers, such as factory. Each gets three ports, from the main port
on; the lines with the ports and lines that you type begin with its name.

Example: txt simulate --world slide --fault silence@exchange:300";

/// Simulate a controller, for clients in any language
#[derive(clap::Args)]
#[command(after_help = AFTER, allow_negative_numbers = true)]
pub(crate) struct Args {
    /// Main port, up to 65533; 0: any three in a row
    #[arg(long, value_name = "N", default_value_t = PORT, value_parser = port)]
    port: u16,
    /// Camera port [default: the main port + 1]; 0: any free one
    #[arg(long, value_name = "N", value_parser = port)]
    camera_port: Option<u16>,
    /// I2C port [default: the main port + 2]; 0: any free one
    #[arg(long, value_name = "N", value_parser = port)]
    i2c_port: Option<u16>,
    /// Number of extensions, 0 to 8 [default: those of the world]
    #[arg(long, value_name = "N", value_parser = extensions)]
    extensions: Option<usize>,
    /// Firmware version that is reported [default: 4.7.0]
    #[arg(long, value_name = "A.B.C", value_parser = firmware)]
    firmware: Option<FirmwareVersion>,
    /// Name that is reported, at most 16 bytes [default: TX2013]
    #[arg(long, value_parser = device_name)]
    name: Option<String>,
    /// Plugged in: none, a world by name, or a .toml file
    #[arg(long, default_value = "default", value_parser = OsStringValueParser::new().try_map(plugged))]
    world: Plugged,
    /// Time from one exchange response to the next [default: 10]; 0: none
    #[arg(long, value_name = "MS", value_parser = milliseconds)]
    pace: Option<Duration>,
    /// Time passes by exchanges only: no pace, no idle limit
    #[arg(long)]
    lock_step: bool,
    /// Seconds a connection may be silent, such as 0.5 [default: 5]
    #[arg(long, value_name = "S", value_parser = arguments::seconds)]
    idle_limit: Option<Duration>,
    /// The board clears its outputs MS after the last exchange [default: never]
    #[arg(long, value_name = "MS", value_parser = milliseconds)]
    board_watchdog: Option<Duration>,
    /// End and refuse where the maker's firmware does, instead of a warning
    #[arg(long)]
    strict: bool,
    /// When clients are accepted: waits, txt, txt40
    #[arg(long, value_name = "C", default_value = "waits", hide_possible_values = true)]
    camera_connection: CameraAccepts,
    /// Time from the camera's start to its first frame [default: 1500]
    #[arg(long, value_name = "MS", value_parser = milliseconds)]
    camera_start_up: Option<Duration>,
    /// Each camera connection becomes silent after N frames
    #[arg(long, value_name = "N", value_parser = whole::<u64>)]
    camera_stall: Option<u64>,
    /// Camera frames without Huffman tables, as many USB cameras send them
    #[arg(long)]
    no_huffman_tables: bool,
    /// Inject a fault; can be given more than once
    #[arg(long = "fault", value_name = "WHAT@WHERE")]
    faults: Vec<Fault>,
    /// Show the world on a page in the browser, and press its buttons there
    #[arg(long)]
    pub(super) show: bool,
    /// With --show: do not open the browser
    #[arg(long, requires = "show")]
    pub(super) no_browser: bool,
    /// Seed of all random values
    #[arg(long, value_name = "N", default_value = "0", value_parser = whole::<u64>)]
    seed: u64,
}

/// What is plugged in; `None` is nothing.
#[derive(Clone)]
struct Plugged(Option<Factory>);

#[derive(Clone, Copy, ValueEnum)]
enum CameraAccepts {
    Waits,
    Txt,
    Txt40,
}

impl Args {
    /// What is plugged in, for each controller.
    pub(super) fn worlds(&self) -> Vec<Option<World>> {
        match &self.world.0 {
            Some(factory) => {
                factory.controllers.iter().map(|(_, world)| Some(world.clone())).collect()
            }
            None => vec![None],
        }
    }

    /// Starts a simulated TXT for each controller of the world, with their names.
    pub(super) fn start(mut self) -> anyhow::Result<Vec<(String, SimulatedTxt)>> {
        let port = self.port;
        let Some(factory) = self.world.0.take() else {
            let txt = self.set_up(SimulatedTxt::builder().port(port)).start()?;
            return Ok(vec![(String::new(), txt)]);
        };
        if factory.controllers.len() > 1 {
            let options = [
                ("--camera-port", self.camera_port.is_some()),
                ("--i2c-port", self.i2c_port.is_some()),
                ("--extensions", self.extensions.is_some()),
                ("--name", self.name.is_some()),
            ];
            if let Some((option, _)) = options.into_iter().find(|(_, given)| *given) {
                let count = factory.controllers.len();
                bail!("{option} is for one controller, and this world has {count}");
            }
        }
        open_files::check(factory.controllers.len(), self.show);
        let factory = SimulatedFactory::start(factory, port, |_, builder| self.set_up(builder))?;
        Ok(factory.into_txts())
    }

    /// Sets what these options describe, without the main port and the world.
    fn set_up(&self, builder: SimulatedTxtBuilder) -> SimulatedTxtBuilder {
        let builder = builder
            .camera_connection(match self.camera_connection {
                CameraAccepts::Waits => CameraConnection::Waits,
                CameraAccepts::Txt => CameraConnection::Txt,
                CameraAccepts::Txt40 => CameraConnection::Txt40,
            })
            .camera_tables(!self.no_huffman_tables)
            .strict(self.strict)
            .seed(self.seed);
        let builder = if self.lock_step { builder.lock_step() } else { builder };
        let builder = with(builder, self.camera_port, SimulatedTxtBuilder::camera_port);
        let builder = with(builder, self.i2c_port, SimulatedTxtBuilder::i2c_port);
        let builder = with(builder, self.extensions, SimulatedTxtBuilder::extensions);
        let builder = with(builder, self.firmware, SimulatedTxtBuilder::firmware);
        let builder = with(builder, self.name.as_deref(), SimulatedTxtBuilder::device_name);
        let builder = with(builder, self.pace, SimulatedTxtBuilder::pace);
        let builder = with(builder, self.idle_limit, SimulatedTxtBuilder::idle_limit);
        let builder = with(builder, self.board_watchdog, SimulatedTxtBuilder::board_watchdog);
        let builder = with(builder, self.camera_start_up, SimulatedTxtBuilder::camera_start_up);
        let builder = with(builder, self.camera_stall, SimulatedTxtBuilder::camera_stall_after);
        self.faults.iter().cloned().fold(builder, SimulatedTxtBuilder::fault)
    }
}

/// Sets what was given; the library has the default of the rest.
fn with<T>(
    builder: SimulatedTxtBuilder,
    value: Option<T>,
    set: impl FnOnce(SimulatedTxtBuilder, T) -> SimulatedTxtBuilder,
) -> SimulatedTxtBuilder {
    match value {
        Some(value) => set(builder, value),
        None => builder,
    }
}

/// The world with this name, or in this file.
fn plugged(name: OsString) -> Result<Plugged, String> {
    if name == "none" {
        return Ok(Plugged(None));
    }
    let factory = arguments::factory(&name).map_err(|error| print::sentence(&error))?;
    Ok(Plugged(Some(factory)))
}

fn port(text: &str) -> Result<u16, &'static str> {
    text.parse().map_err(|_| "a port from 0 to 65535 is expected")
}

fn whole<T: FromStr>(text: &str) -> Result<T, &'static str> {
    text.parse().map_err(|_| "a whole number is expected, 0 or more")
}

fn extensions(text: &str) -> Result<usize, String> {
    let number = text.parse().ok().filter(|number| *number <= MAX_EXTENSIONS);
    number.ok_or_else(|| format!("a number from 0 to {MAX_EXTENSIONS} is expected"))
}

fn milliseconds(text: &str) -> Result<Duration, &'static str> {
    let number = text.parse().map_err(|_| "whole milliseconds are expected, 0 or more")?;
    Ok(Duration::from_millis(number))
}

/// A name that is reported as it is.
fn device_name(text: &str) -> Result<String, String> {
    /// How many bytes of a name are reported.
    const LEN: usize = 16;
    match text.len() {
        0..=LEN => Ok(text.to_owned()),
        length => Err(format!("at most {LEN} bytes are expected, and this has {length}")),
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
