//! `txt plot`.

mod draw;
mod html;
mod marks;
mod thin;
mod tracks;
mod two;

use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::{bail, Context};
use ft_transfer_area_recorder::{Column, Recording};
use indicatif::{ProgressBar, ProgressStyle};

use super::clock::Clock;
use super::ensure_is_another;
use super::in_parts::ensure_is_one;
use super::part::Part;
use super::whole::say_what_is_missing;
use crate::{names, print};
use draw::Picture;
use tracks::Tracks;
pub(super) use two::second_over_first;

const AFTER: &str = "\
There is one panel for each unit. Without terminals, all inputs, counters, motors and single outputs
that change are drawn. The picture follows the light or dark setting of what shows it. Where there
was no connection, or the file is damaged, it is shaded. A tick at the bottom is a motor that has
reached its distance or is stalled, or an extension that came or went. Below the seconds since the
beginning is the time of day in this computer's time zone. A yellow line is an unusual moment with
its number in txt info; those in the picture are printed, too. A part of it is given by seconds or
by times of day, as in --from 03:12.

With --html it is a page for a browser, which needs no network: choose terminals, zoom, read values
at a cursor, and go to an unusual moment by a click in a list.

Examples:
  txt plot run.mcap I1 C1 M1 E1.I2 --from 10 --to 25.5 -o plot.svg
  txt plot run.mcap --html run.html";

/// Draw parts of a recording as a picture
#[derive(clap::Args)]
#[command(after_help = AFTER)]
pub(crate) struct Args {
    /// The recording
    recording: PathBuf,
    /// What to draw: I1 to I8, C1 to C4, M1 to M4, O1 to O8; of extension 1 E1.I1
    terminals: Vec<Column>,
    #[command(flatten)]
    names: names::File,
    /// The picture [default: the recording's name with .svg]
    #[arg(short, long, value_name = "FILE.svg")]
    output: Option<PathBuf>,
    /// Write a page for a browser instead of a picture
    #[arg(long, value_name = "FILE.html", conflicts_with = "output")]
    html: Option<PathBuf>,
    #[command(flatten)]
    part: Part,
    /// The line above the picture [default: the recording's name]
    #[arg(long)]
    title: Option<String>,
}

pub(crate) fn run(args: Args) -> anyhow::Result<()> {
    let output = args.output.unwrap_or_else(|| args.recording.with_extension("svg"));
    if let Some(html) = args.html.as_deref().filter(|path| !html::is_page(path)) {
        bail!("{}: the name of a page ends with .html", html.display());
    }
    if !is_picture(&output) {
        bail!("{}: {NAME}", output.display());
    }
    ensure_is_one(&args.recording)?;
    ensure_is_another(args.html.as_deref().unwrap_or(&output), &args.recording)?;
    let names = args.names.read()?;
    let mut recording = Recording::open(&args.recording)?;
    let part = args.part.of(&mut recording, &args.recording)?;
    let clock = Clock::of(recording.started());
    let part = part.start.as_secs_f64()..part.end.as_secs_f64();
    let mut tracks = Tracks::new(args.terminals, names, part).with_unusual();
    if args.html.is_some() {
        tracks = tracks.finer(html::BUCKETS);
    }
    read(&mut recording, &mut tracks, Duration::ZERO)?;
    say_what_is_missing(&recording, &args.recording, ": it is drawn up to there");
    let file = args.recording.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let unusual = tracks.unusual_lines(&clock);
    let output = if let Some(html) = args.html {
        html::save(tracks, &file, args.title, &clock, &html)?;
        html
    } else {
        save(&tracks.picture(&file, args.title, clock)?, &output)?;
        output
    };
    // The name of the file is for scripts.
    unusual.iter().for_each(|line| eprintln!("{}", print::clean(line)));
    print::line(output.display())
}

/// What is wrong with the name of a picture.
const NAME: &str = "the name of a picture ends with .svg";

/// Nobody wants to overwrite a recording by a picture.
fn is_picture(path: &Path) -> bool {
    path.extension().is_some_and(|end| end.eq_ignore_ascii_case("svg"))
}

/// The name of a picture.
pub(super) fn picture_name(given: &str) -> Result<PathBuf, &'static str> {
    Some(PathBuf::from(given)).filter(|path| is_picture(path)).ok_or(NAME)
}

fn save(picture: &Picture, output: &Path) -> anyhow::Result<()> {
    fs::write(output, draw::svg(picture)?)
        .with_context(|| format!("can't write {}", output.display()))
}

/// Reads the part of the recording that is drawn. Times are those since this beginning.
fn read(recording: &mut Recording, tracks: &mut Tracks, begin: Duration) -> anyhow::Result<()> {
    let style = ProgressStyle::with_template("{spinner} reading the recording: {msg}")
        .unwrap_or_else(|_| ProgressStyle::default_spinner());
    let progress = ProgressBar::new_spinner().with_style(style);
    let mut minute = None;
    for entry in recording {
        let mut entry = entry?;
        entry.at = entry.at.saturating_sub(begin);
        let now = entry.at.as_secs() / 60;
        if minute != Some(now) {
            progress.set_message(format!("minute {now}"));
            minute = Some(now);
        }
        if !tracks.take(entry) {
            break;
        }
    }
    progress.finish_and_clear();
    Ok(())
}
