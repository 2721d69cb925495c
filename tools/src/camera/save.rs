//! Pictures in files.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use anyhow::{bail, ensure, Context};
use crossbeam_channel::Receiver;
use ft_transfer_area_recorder::file::{is_at, open_alone};
use indicatif::{ProgressBar, ProgressStyle};

use super::source::{Next, Source};
use crate::print;
use crate::progress::Progress;

/// How many pictures are saved, and when.
pub(super) struct Plan {
    /// `None` until Ctrl-C.
    pub(super) count: Option<u64>,
    /// `None` for all.
    pub(super) every: Option<Duration>,
}

/// Saves pictures until the plan is fulfilled, or until Ctrl-C if it has no end.
pub(super) fn save(
    source: &Source,
    target: &mut Target,
    plan: Plan,
    interrupted: &Receiver<()>,
) -> anyhow::Result<()> {
    let progress = Progress::start(bar(plan.count), |bar, saved| bar.set_position(saved));
    let mut last: Option<Instant> = None;
    let (mut saved, mut damaged) = (0, 0);
    while plan.count.is_none_or(|count| saved < count) {
        match source.next(interrupted).with_context(|| reported(saved, target))? {
            Next::Picture(jpeg) => {
                let too_early =
                    plan.every.zip(last).is_some_and(|(every, last)| last.elapsed() < every);
                if !too_early {
                    last = Some(Instant::now());
                    target.add(&jpeg).with_context(|| reported(saved, target))?;
                    saved += 1;
                    progress.show(saved);
                }
            }
            Next::Damaged => damaged += 1,
            Next::Interrupted => break,
        }
    }
    drop(progress);
    let kept = target.ensure_is_there();
    print::line(reported(saved, target))?;
    // Between pictures that are not wanted, nothing is lost.
    let lost = if plan.every.is_none() { source.dropped() } else { 0 };
    if lost + damaged > 0 {
        print::line(format_args!("{lost} more came too fast to be saved, {damaged} were damaged"))?;
    }
    source.end()?;
    match plan.count {
        Some(count) if saved < count => bail!("stopped before all {count} pictures had come"),
        _ => kept,
    }
}

fn reported(saved: u64, target: &Target) -> String {
    format!("{saved} picture(s) saved in {}", target.path().display())
}

fn bar(count: Option<u64>) -> ProgressBar {
    match count {
        Some(count) => ProgressBar::new(count).with_style(
            ProgressStyle::with_template("{wide_bar} {pos}/{len} pictures")
                .unwrap_or_else(|_| ProgressStyle::default_bar()),
        ),
        None => ProgressBar::new_spinner().with_style(
            ProgressStyle::with_template("{spinner} {pos} pictures, Ctrl-C ends")
                .unwrap_or_else(|_| ProgressStyle::default_spinner()),
        ),
    }
}

/// Where pictures are saved.
pub(super) enum Target {
    /// Files with numbers.
    Folder { folder: PathBuf, number: u64, force: bool },
    /// All in one file. What was in it is overwritten with the first picture: until then, there is nothing better.
    Film { path: PathBuf, file: File, size: u64, is_new: bool },
}

impl Target {
    /// A film if the name ends with `.mjpeg`, or a folder, which is made.
    pub(super) fn new(path: &Path, force: bool) -> anyhow::Result<Self> {
        let ends_with =
            |ends: &[&str]| path.extension().is_some_and(|end| ends.iter().any(|one| end == *one));
        if ends_with(&["mjpeg", "mjpg"]) {
            let is_new = !path.exists();
            let file = open_alone(&options(force), path);
            let file = file.map_err(|error| refused(error, path))?;
            return Ok(Self::Film { path: path.to_owned(), file, size: 0, is_new });
        }
        let is_file = path.exists() || ends_with(&["jpg", "jpeg", "png", "avi", "mp4"]);
        if is_file && !path.is_dir() {
            bail!(
                "{} is the name of a file; pictures need a folder, or one file that ends with .mjpeg",
                path.display()
            );
        }
        fs::create_dir_all(path).with_context(|| path.display().to_string())?;
        Ok(Self::Folder { folder: path.to_owned(), number: 0, force })
    }

    fn path(&self) -> &Path {
        match self {
            Self::Folder { folder: path, .. } | Self::Film { path, .. } => path,
        }
    }

    /// The error says that somebody has removed the film, or given it another name, or replaced it.
    fn ensure_is_there(&self) -> anyhow::Result<()> {
        let Self::Film { path, file, .. } = self else { return Ok(()) };
        ensure!(!is_file(file) || path.exists(), "{} is not there any more", path.display());
        ensure!(
            !is_file(file) || is_at(file, path),
            "{} is another file now, so these pictures are not there any more",
            path.display()
        );
        Ok(())
    }

    /// Saves a picture. If that fails, no part of it is left.
    fn add(&mut self, jpeg: &[u8]) -> anyhow::Result<()> {
        match self {
            Self::Folder { folder, number, force } => {
                *number += 1;
                let path = folder.join(format!("{number:05}.jpg"));
                let file = options(*force).truncate(*force).open(&path);
                let written = file.map_err(|error| refused(error, &path))?.write_all(jpeg);
                if written.is_err() {
                    let _ = fs::remove_file(&path);
                }
                written.with_context(|| path.display().to_string())
            }
            Self::Film { path, file, size, .. } => {
                // Not so a pipe or a device.
                if *size == 0 && is_file(file) {
                    file.set_len(0).with_context(|| path.display().to_string())?;
                }
                if let Err(error) = file.write_all(jpeg) {
                    let _ = file.set_len(*size);
                    return Err(error).with_context(|| path.display().to_string());
                }
                *size += jpeg.len() as u64;
                Ok(())
            }
        }
    }
}

impl Drop for Target {
    /// A film to which no picture came would only stand in the way of the next try.
    fn drop(&mut self) {
        if let Self::Film { path, file, size: 0, is_new: true } = self {
            if is_file(file) && is_at(file, path) {
                let _ = fs::remove_file(path);
            }
        }
    }
}

fn is_file(file: &File) -> bool {
    file.metadata().is_ok_and(|file| file.is_file())
}

/// For a new file, or one that is there if that is wanted.
fn options(force: bool) -> OpenOptions {
    let mut options = OpenOptions::new();
    options.write(true).create(force).create_new(!force);
    options
}

fn refused(error: io::Error, path: &Path) -> anyhow::Error {
    match error.kind() {
        io::ErrorKind::AlreadyExists => {
            anyhow::anyhow!("{} is there already; --force overwrites it", path.display())
        }
        _ => anyhow::Error::new(error).context(path.display().to_string()),
    }
}
