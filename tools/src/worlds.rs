//! The world of a simulated TXT, as it is named on the command line.

use std::ffi::OsStr;
use std::path::Path;

use anyhow::{anyhow, Context};
use ft_transfer_area_simulator::world::World;

/// The world with this name, or in this file if it is a path or has an extension.
pub(crate) fn named(given: impl AsRef<OsStr>) -> anyhow::Result<World> {
    let path = Path::new(given.as_ref());
    let is_file = path.extension().is_some() || path.components().count() > 1;
    match path.to_str().filter(|_| !is_file) {
        Some(name) => World::shipped(name)
            .map_err(|error| anyhow!("{error}; or write the path of a .toml file")),
        None => World::load(path).with_context(|| path.display().to_string()),
    }
}
