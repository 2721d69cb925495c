//! What several commands read from their command line.

use std::ffi::OsStr;
use std::path::Path;
use std::time::Duration;

use anyhow::{anyhow, Context};
use ft_transfer_area::controller_address;
use ft_transfer_area_simulator::world::{Factory, World};
use ft_transfer_area_simulator::SimulatedTxt;

use crate::check;

/// How long to look for the only controller.
const SEARCH: Duration = Duration::from_millis(1500);

/// Whether the only controller is meant that answers, whichever that is.
pub(crate) fn is_auto(host: &str) -> bool {
    host.split(':').next().is_some_and(|name| name.eq_ignore_ascii_case("auto"))
}

/// A host as it is written, or in place of `auto` the address of the only controller that answers now: later it may be
/// another one, which nobody means.
pub(crate) fn found(host: &str) -> anyhow::Result<String> {
    if is_auto(host) {
        return Ok(controller_address(host, SEARCH)?.to_string());
    }
    Ok(host.to_owned())
}

/// The world with this name, or in this file if it is a path or has an extension.
pub(crate) fn world(given: impl AsRef<OsStr>) -> anyhow::Result<World> {
    match name_or_file(given.as_ref()) {
        Ok(name) => check::world(name).unwrap_or_else(|| shipped(World::shipped(name))),
        Err(path) => World::load(path).with_context(|| path.display().to_string()),
    }
}

/// The same with one or several controllers.
pub(crate) fn factory(given: impl AsRef<OsStr>) -> anyhow::Result<Factory> {
    match name_or_file(given.as_ref()) {
        Ok(name) => match check::world(name) {
            Some(world) => world.map(Factory::from),
            None => shipped(Factory::shipped(name)),
        },
        Err(path) => Factory::load(path).with_context(|| path.display().to_string()),
    }
}

fn name_or_file(given: &OsStr) -> Result<&str, &Path> {
    let path = Path::new(given);
    let is_file = path.extension().is_some() || path.components().count() > 1;
    path.to_str().filter(|_| !is_file).ok_or(path)
}

fn shipped<T>(world: Result<T, ft_transfer_area_simulator::Error>) -> anyhow::Result<T> {
    world.map_err(|error| anyhow!("{error:#}; those of the lessons are lesson1 to lesson10; or write the path of a .toml file"))
}

/// A simulated TXT with this world.
pub(crate) fn simulated(given: &str) -> anyhow::Result<SimulatedTxt> {
    Ok(SimulatedTxt::builder().world(world(given)?).start()?)
}

/// A time greater than 0.
pub(crate) fn seconds(text: &str) -> Result<Duration, &'static str> {
    let seconds = text.parse().ok().and_then(|seconds| Duration::try_from_secs_f64(seconds).ok());
    let more_than_none = seconds.filter(|seconds| !seconds.is_zero());
    more_than_none.ok_or("seconds are expected, more than 0, such as 5 or 0.5")
}
