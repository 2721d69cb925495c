//! The controller that the program gets: one that is named, or a simulated TXT in this process.

use std::ffi::OsStr;
use std::path::Path;
use std::time::Duration;

use ft_transfer_area::controller_address;
use ft_transfer_area_simulator::world::{Factory, Supply, World};
use ft_transfer_area_simulator::SimulatedTxt;

use crate::options::Options;
use crate::show::Shown;
use crate::Sentence;

/// How long to look for the only controller.
const SEARCH: Duration = Duration::from_millis(1500);

/// Where the program runs.
pub(crate) enum Target {
    Host(String),
    Simulated {
        txt: SimulatedTxt,
        world: String,
        supply: Supply,
    },
    /// The same in another process, with a page.
    Shown {
        txt: Shown,
        world: String,
        supply: Supply,
    },
}

impl Target {
    pub(crate) fn new(options: &Options) -> Result<Self, Sentence> {
        if let Some(host) = &options.host {
            return Ok(Self::Host(found(host)?));
        }
        let name = options.world.as_deref().unwrap_or(OsStr::new("default"));
        let shown = options.show.then(|| Shown::start(name)).transpose()?;
        let read = read_world(name)?;
        let supply = read.as_ref().map(|world| world.supply).unwrap_or_default();
        let world = name.to_string_lossy().into_owned();
        if let Some(txt) = shown {
            return Ok(Self::Shown { txt, world, supply });
        }
        let builder = SimulatedTxt::builder();
        let builder = match read {
            Some(world) => builder.world(world),
            None => builder,
        };
        Ok(Self::Simulated { txt: builder.start()?, world, supply })
    }

    /// What a program on the TXT itself reads of its supply, as environment variables.
    pub(crate) fn supply(&self) -> Vec<(&'static str, String)> {
        let supply = match self {
            Self::Host(_) => return Vec::new(),
            Self::Simulated { supply, .. } | Self::Shown { supply, .. } => supply,
        };
        let values = [
            ("FT_TXT_POWER", supply.power),
            ("FT_TXT_TEMPERATURE", supply.temperature),
            ("FT_TXT_REFERENCE", supply.reference),
        ];
        values.into_iter().map(|(name, value)| (name, value.to_string())).collect()
    }

    /// As `FT_TXT_HOST` names it.
    pub(crate) fn host(&self) -> String {
        match self {
            Self::Host(host) => host.clone(),
            Self::Simulated { txt, .. } => txt.address().to_string(),
            Self::Shown { txt, .. } => txt.address.clone(),
        }
    }

    /// For people.
    pub(crate) fn describe(&self) -> String {
        match self {
            Self::Host(host) => format!("the TXT at {host}"),
            Self::Simulated { txt, world, .. } => {
                format!("a simulated TXT at {} with the world {world}", txt.address())
            }
            Self::Shown { txt, world, .. } => {
                format!("a simulated TXT at {} with the world {world}", txt.address)
            }
        }
    }
}

/// A host as it is written, or in place of `auto` the address of the only controller that answers now. When the program is
/// killed, another one may answer, or several.
fn found(host: &str) -> Result<String, Sentence> {
    let name = host.split(':').next().unwrap_or_default();
    if !name.eq_ignore_ascii_case("auto") {
        return Ok(host.to_owned());
    }
    Ok(controller_address(host, SEARCH)?.to_string())
}

/// What to do with a world for several programs.
pub(crate) fn several(world: &str) -> Sentence {
    format!(
        "the world {world} has several controllers, and a program drives one: start it with txt simulate --world \
         {world}, and give each program the address of its controller with --host"
    )
    .into()
}

/// The world with this name, or in this file.
fn read_world(name: &OsStr) -> Result<Option<World>, Sentence> {
    let path = Path::new(name);
    let has_several = |factory: Factory| factory.controllers.len() > 1;
    let is_file = path.extension().is_some() || path.components().count() > 1;
    match name.to_str() {
        Some("none") => Ok(None),
        Some(shipped) if !is_file && Factory::SHIPPED.contains(&shipped) => Err(several(shipped)),
        Some(shipped) if !is_file => World::shipped(shipped).map(Some).map_err(|error| {
            format!("{error:#}; or use none for no world, or the path of a .toml file").into()
        }),
        _ if Factory::load(path).is_ok_and(has_several) => Err(several(&name.to_string_lossy())),
        _ => World::load(path)
            .map(Some)
            .map_err(|error| format!("{}: {error:#}", path.display()).into()),
    }
}
