//! `txt camera`: pictures in files, or in the browser.

mod save;
mod source;
mod watch;

use std::path::PathBuf;
use std::time::Duration;

use ft_transfer_area::CameraOptions;

use crate::{arguments, interrupt};
use save::{Plan, Target};
use source::Source;

const AFTER: &str = "\
With -o FOLDER each picture is a JPEG file, 00001.jpg and so on. With -o FILE.mjpeg all are in one
file, which ffplay and VLC show. Without --count it goes on until Ctrl-C. --watch prints an address
with a token and opens it; only browsers on this computer reach it.

The kit was tested with 160x120 at 60 pictures per second, 320x240 at 30 and 640x480 at 15. The
first picture takes a second or two. The controller goes online, which stops a program on it; no
motor moves.

Example: txt camera 192.168.7.2 -o pictures --every 60";

/// Save or show the camera's pictures
#[derive(clap::Args)]
#[command(after_help = AFTER)]
#[command(group = clap::ArgGroup::new("from").required(true).args(["host", "simulate"]))]
#[command(group = clap::ArgGroup::new("to").required(true).args(["output", "watch"]))]
pub(crate) struct Args {
    /// The controller, or auto for the only one that answers
    host: Option<String>,
    /// Show the test card of a simulated TXT
    #[arg(long)]
    simulate: bool,
    /// Save pictures in this folder, or in this file if its name ends with .mjpeg
    #[arg(short, long, value_name = "PATH")]
    output: Option<PathBuf>,
    /// Watch in the browser
    #[arg(long)]
    watch: bool,
    /// End after N pictures
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..), conflicts_with = "watch")]
    count: Option<u64>,
    /// Save a picture every S seconds instead of all
    #[arg(long, value_name = "S", value_parser = arguments::seconds, conflicts_with = "watch")]
    every: Option<Duration>,
    /// Overwrite files
    #[arg(long, conflicts_with = "watch")]
    force: bool,
    /// Size of the pictures in pixels
    #[arg(long, value_name = "WxH", default_value = "320x240", value_parser = size)]
    size: (u16, u16),
    /// Pictures per second
    #[arg(long, value_name = "N", default_value_t = 15, value_parser = clap::value_parser!(u16).range(1..=120))]
    fps: u16,
    /// Port of the page; 0: any free one
    #[arg(long, value_name = "N", default_value_t = 0, requires = "watch")]
    port: u16,
    /// Print the address of the page, but open no browser
    #[arg(long, requires = "watch")]
    no_browser: bool,
}

/// No picture is longer, in bytes: a JPEG of a camera with 1920x1080 pixels has about 1 MB at most (assumed).
pub(crate) const PICTURE_MAX: usize = 2 << 20;

/// How the camera is started here.
pub(crate) fn options() -> CameraOptions {
    CameraOptions::default().max_frame_size(PICTURE_MAX)
}

pub(crate) fn run(args: Args) -> anyhow::Result<()> {
    let interrupted = interrupt::receiver()?;
    let (width, height) = args.size;
    let options = options().size(width, height).framerate(args.fps);
    match args.output {
        Some(path) => {
            let mut target = Target::new(&path, args.force)?;
            // Two seconds in which a slow disk loses nothing, if that many fit into 64 MiB.
            let frames = (2 * usize::from(args.fps)).min((64 << 20) / PICTURE_MAX);
            let options = options.channel_frames(frames);
            let source = Source::start(args.host, options)?;
            let plan = Plan { count: args.count, every: args.every };
            save::save(&source, &mut target, plan, &interrupted)
        }
        None => {
            let page = watch::Page::listen(args.port, args.size)?;
            let source = Source::start(args.host, options.channel_frames(1))?;
            watch::watch(&source, page, !args.no_browser, &interrupted)
        }
    }
}

/// A size such as 640x480.
fn size(text: &str) -> Result<(u16, u16), &'static str> {
    let numbers = text.split_once('x').and_then(|(width, height)| {
        Some((width.parse::<u16>().ok()?, height.parse::<u16>().ok()?))
    });
    numbers
        .filter(|(width, height)| *width > 0 && *height > 0)
        .ok_or("a size such as 640x480 is expected")
}
