//! A recording in several files: its options, and which files it has.

use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use anyhow::bail;

use ft_transfer_area_recorder::{parts_of, Options, Parts};

use crate::print;

/// Smaller files would be heads only.
const SMALLEST: f64 = 100e3;

#[derive(clap::Args)]
pub(crate) struct InParts {
    /// Record into run-0001.mcap, run-0002.mcap …, a new one after this size or time: 100MB, 1h
    #[arg(long, value_name = "SIZE|TIME", value_parser = parts, conflicts_with = "force")]
    parts: Option<Parts>,
    /// Delete the oldest of these files, so that all together stay below this size: 2GB
    #[arg(long, value_name = "SIZE", requires = "parts", value_parser = size)]
    keep: Option<u64>,
}

impl InParts {
    /// Whether there may be more than one file.
    pub(crate) fn is_wanted(&self) -> bool {
        self.parts.is_some()
    }

    pub(crate) fn options(&self) -> Options {
        let options = Options::default();
        match (self.parts, self.keep) {
            (Some(parts), Some(keep)) => options.parts(parts.keep(keep)),
            (Some(parts), None) => options.parts(parts),
            (None, _) => options,
        }
    }
}

/// The files of the recording that was made with this name: itself, or its parts in their order. Says on stderr that
/// there are later parts beside it.
pub(super) fn files_of(path: &Path) -> Vec<PathBuf> {
    let parts = parts_of(path).unwrap_or_default().into_iter().map(|(_, part)| part);
    let parts: Vec<_> = parts.collect();
    let (Some(first), Some(last)) = (parts.first(), parts.last()) else {
        return vec![path.to_owned()];
    };
    if !path.exists() {
        return parts;
    }
    if written(last) > written(path) {
        let [first, last, file] = [first, last, path].map(|path| path.display());
        let note =
            format!("there is a later recording in parts, {first} to {last}: this is {file}");
        eprintln!("{}", print::clean(&note));
    }
    vec![path.to_owned()]
}

/// When something was written into it last.
fn written(file: &Path) -> Option<SystemTime> {
    file.metadata().and_then(|file| file.modified()).ok()
}

/// Tells who names a recording in parts, where one file is read, what the names of its files are.
pub(super) fn ensure_is_one(path: &Path) -> anyhow::Result<()> {
    let files = files_of(path);
    match (files.first(), files.last()) {
        (Some(first), Some(last)) if first != path => {
            let [all, first, last] = [path, first, last].map(|path| path.display());
            bail!("{all} is in parts, {first} to {last}: name one of them; txt info {all} lists what is in each")
        }
        _ => Ok(()),
    }
}

/// A number with one of these units.
fn quantity(text: &str, units: &[(&str, f64)]) -> Option<f64> {
    let end = text.find(|one: char| !one.is_ascii_digit() && one != '.')?;
    let (number, unit) = text.split_at(end);
    let (_, factor) = units.iter().find(|(name, _)| unit.trim().eq_ignore_ascii_case(name))?;
    number.parse::<f64>().ok().map(|number| number * factor)
}

fn size(text: &str) -> Result<u64, &'static str> {
    let bytes = quantity(text, &[("kB", 1e3), ("MB", 1e6), ("GB", 1e9), ("TB", 1e12)]);
    let bytes = bytes.filter(|bytes| (SMALLEST..1e18).contains(bytes));
    bytes.map(|bytes| bytes as u64).ok_or("a size is expected, 100kB or more, such as 100MB or 2GB")
}

fn parts(text: &str) -> Result<Parts, &'static str> {
    let seconds = quantity(text, &[("s", 1.0), ("min", 60.0), ("h", 3600.0)]);
    match seconds.filter(|seconds| (1.0..1e9).contains(seconds)) {
        Some(seconds) => Ok(Parts::of_time(Duration::from_secs_f64(seconds))),
        None => size(text)
            .map(Parts::of_bytes)
            .map_err(|_| "a size or a time is expected, such as 100MB, 30min or 1h"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_have_a_size_or_a_time() {
        assert_eq!(parts("100MB"), Ok(Parts::of_bytes(100_000_000)));
        assert_eq!(parts("1.5 gb"), Ok(Parts::of_bytes(1_500_000_000)));
        assert_eq!(parts("30min"), Ok(Parts::of_time(Duration::from_secs(1800))));
        assert_eq!(size("2GB"), Ok(2_000_000_000));
        for wrong in ["", "1", "MB", "0.5s", "1kB", "-1h", "1e3s", "5 m", "99999999999TB"] {
            assert!(parts(wrong).is_err(), "{wrong}");
        }
        assert!(size("1h").is_err());
    }
}
