//! `txt record`.

use std::fmt;
use std::path::PathBuf;
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use anyhow::{bail, Context};
use crossbeam_channel::{Receiver, RecvTimeoutError};
use ft_transfer_area::transfer_area::{InputMode, UniConfig, MAX_AREAS};
use ft_transfer_area::{CameraFrame, TransferAreaComHandler};
use ft_transfer_area_recorder::{Column, FrameSink, Recorder, Totals};
use ft_transfer_area_simulator::SimulatedTxt;
use indicatif::{ProgressBar, ProgressStyle};

use super::in_parts::InParts;
use super::output::{discard, finish, Files, Output};
use crate::progress::Progress;
use crate::{arguments, camera, interrupt, lines, print};

/// How often the progress is shown, and the recorder is checked.
const LOOK: Duration = Duration::from_millis(100);

/// For how long to try to re-establish a lost connection: practically always.
const RECONNECT: Duration = Duration::from_secs(7 * 24 * 3600);

const AFTER_HELP: &str = "\
Goes online, drives nothing, and records every cycle with all extensions into an MCAP file, which
Foxglove, PlotJuggler and txt plot open. A lost connection is re-established. A controller has one
client at a time: to record what a program does, use txt watch --record, or attach the recorder
to the program, as docs/recording.md shows.

For days, --parts begins a new file again and again, and --keep deletes the oldest ones. Each of
them can be read without the others.

Examples:
  txt record 192.168.7.2 -o run.mcap --input I2=cm --input E1.I1=ohm
  txt record 192.168.7.2 -o run.mcap --parts 100MB --keep 2GB";

/// Record a controller into a file
#[derive(clap::Args)]
#[command(after_help = AFTER_HELP)]
pub(crate) struct Args {
    /// The controller: an address or a name, with a port if it is not 65000
    #[arg(default_value = "auto")]
    host: String,
    /// The file
    #[arg(short, long, default_value = "run.mcap")]
    output: PathBuf,
    /// Replace a file that is there already, when the transfer has begun
    #[arg(long)]
    force: bool,
    #[command(flatten)]
    in_parts: InParts,
    /// End after this time instead of with Ctrl-C
    #[arg(long, value_name = "N", value_parser = arguments::seconds)]
    seconds: Option<Duration>,
    /// What an input measures: switch (the default), mV, ohm, ohm15k, cm
    #[arg(long = "input", value_name = "I1=KIND", value_parser = parse_input)]
    inputs: Vec<(Column, UniConfig)>,
    /// Record the camera's pictures, too
    #[arg(long)]
    camera: bool,
    /// Record a simulated TXT with a world: its name, or a .toml file
    #[arg(long, value_name = "WORLD", conflicts_with = "host", num_args = 0..=1, default_missing_value = "default")]
    simulate: Option<String>,
}

/// What an input can measure, by what is typed for it.
const KINDS: [(&str, UniConfig); 5] = [
    ("switch", UniConfig::digital(InputMode::Resistance)),
    ("mV", UniConfig::analog(InputMode::Voltage)),
    ("ohm", UniConfig::analog(InputMode::Resistance)),
    ("ohm15k", UniConfig::analog(InputMode::Resistance15k)),
    ("cm", UniConfig::analog(InputMode::Ultrasonic)),
];

/// A new mode needs a name here.
const _: () = assert!(KINDS.len() == 1 + InputMode::ALL.len());

fn parse_input(given: &str) -> Result<(Column, UniConfig), String> {
    let (name, kind) = given.split_once('=').ok_or("write I1=cm, for example")?;
    let column: Column = name.parse().map_err(|error| format!("{error:#}"))?;
    if column.input().is_none() {
        return Err(format!("{column} is not a universal input"));
    }
    let found = KINDS.iter().find(|(name, _)| name.eq_ignore_ascii_case(kind));
    match found {
        Some((_, kind)) => Ok((column, *kind)),
        None => {
            let names = KINDS.map(|(name, _)| name);
            Err(format!("{kind:?} is none of {}", names.join(", ")))
        }
    }
}

pub(crate) fn run(args: Args) -> anyhow::Result<()> {
    let mut output = Output::new(args.output.clone(), args.force, args.in_parts.is_wanted())?;
    let interrupted = interrupt::receiver()?;
    lines::never_wait_to_log()?;
    let reader = output.wait_for_reader(&interrupted)?;
    let simulated = args.simulate.as_deref().map(arguments::simulated).transpose()?;
    let handler = handler(&args, simulated.as_ref())?;
    let mut recorder = Recorder::start(&handler, output.first(), args.in_parts.options())?;
    drop(reader);
    let begun = handler.begin_transfer().map_err(anyhow::Error::from);
    if let Err(error) = begun.and_then(|()| output.begun(&mut recorder)) {
        discard(recorder);
        return Err(error);
    }
    let camera = start_camera(&args, &handler, recorder.frames())?;
    let recorded = watch(&args, &handler, &recorder, &interrupted);
    let ended = handler.end_transfer();
    if let Some(camera) = camera {
        // It ends with the transfer. It only hands pictures on, so it has nothing to say.
        let _ = camera.join();
    }
    let (files, totals) = finish(recorder)??;
    let kept = output.ensure_is_there(&files);
    print::line(Recorded { files, totals })?;
    recorded?;
    ended?;
    kept
}

/// A handler that drives nothing.
fn handler(
    args: &Args,
    simulated: Option<&SimulatedTxt>,
) -> anyhow::Result<TransferAreaComHandler> {
    let builder = match simulated {
        Some(txt) => TransferAreaComHandler::builder(txt.address()).camera_port(txt.camera_port()),
        None => TransferAreaComHandler::builder(&*args.host),
    };
    let handler = builder.areas(MAX_AREAS).reconnect(RECONNECT).build()?;
    let mut areas = handler.areas().lock();
    for (column, config) in &args.inputs {
        if let Some(input) = column.input() {
            let area = &mut areas[column.area()];
            area.config.uni[input.index()] = *config;
            area.raise_config_id();
        }
    }
    drop(areas);
    Ok(handler)
}

/// Hands the camera's pictures to the recorder.
fn start_camera(
    args: &Args,
    handler: &TransferAreaComHandler,
    sink: FrameSink,
) -> anyhow::Result<Option<JoinHandle<()>>> {
    if !args.camera {
        return Ok(None);
    }
    let frames: Receiver<CameraFrame> = handler.start_camera(camera::options())?;
    let hand_on = move || frames.iter().for_each(|frame| sink.record(&frame));
    let thread = thread::Builder::new().name("camera".to_owned()).spawn(hand_on);
    thread.map(Some).context("a thread for the camera could not be started")
}

/// Shows the progress until it is to end.
fn watch(
    args: &Args,
    handler: &TransferAreaComHandler,
    recorder: &Recorder,
    interrupted: &Receiver<()>,
) -> anyhow::Result<()> {
    let bar = ProgressBar::no_length();
    if let Ok(style) = ProgressStyle::with_template("{spinner} {prefix} from {msg} ({elapsed})") {
        bar.set_style(style);
    }
    let progress = Progress::start(bar, |bar, (so_far, name): (String, String)| {
        bar.set_prefix(so_far);
        bar.set_message(name);
    });
    let begin = Instant::now();
    loop {
        let so_far = Recorded { files: Files::of(recorder), totals: recorder.recorded() };
        let name = handler.device_name().unwrap_or_default();
        progress.show((so_far.to_string(), print::clean(&name).into_owned()));
        if let Some(error) = recorder.error() {
            return Err(error.into());
        }
        if !handler.areas().is_running() {
            // Its error is that of the transfer's end.
            return Ok(());
        }
        let rest =
            args.seconds.map_or(LOOK, |limit| LOOK.min(limit.saturating_sub(begin.elapsed())));
        if rest.is_zero() {
            return Ok(());
        }
        match interrupted.recv_timeout(rest) {
            Err(RecvTimeoutError::Timeout) => {}
            Ok(()) => return Ok(()),
            Err(RecvTimeoutError::Disconnected) => bail!("Ctrl-C is not watched any more"),
        }
    }
}

/// What is recorded, as a sentence.
struct Recorded {
    files: Files,
    totals: Totals,
}

impl fmt::Display for Recorded {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Totals { cycles, lost, frames, lost_frames, .. } = self.totals;
        write!(f, "{}: {cycles} cycles, {lost} lost", self.files)?;
        if frames + lost_frames > 0 {
            write!(f, ", {frames} pictures, {lost_frames} lost")?;
        }
        let Some(only) = self.files.only() else { return Ok(()) };
        let kilobytes = std::fs::metadata(only).map_or(0, |file| file.len()).div_ceil(1000);
        write!(f, ", {kilobytes} kB")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_input_is_given_by_its_name_and_what_it_measures() {
        let (column, kind) = parse_input("e1.i2=CM").unwrap();
        assert_eq!((column.area(), column.to_string()), (1, "E1.I2".to_owned()));
        assert_eq!(kind, UniConfig::analog(InputMode::Ultrasonic));
        assert!(parse_input("I1=switch").unwrap().1.is_digital());
        for (wrong, sentence) in [
            ("I1", "write I1=cm, for example"),
            ("I1=bar", "\"bar\" is none of switch, mV, ohm, ohm15k, cm"),
            ("M1=cm", "M1 is not a universal input"),
        ] {
            assert_eq!(parse_input(wrong).unwrap_err(), sentence);
        }
        assert!(parse_input("I9=cm").unwrap_err().starts_with("there is no \"I9\""));
    }
}
