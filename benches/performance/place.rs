//! On which core a process runs.

use anyhow::{Context, Result};

/// Where the client and its peer run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Place {
    /// Both on the same core.
    Together,
    /// Each on a core of its own.
    Apart,
    /// Where the operating system puts them.
    Free,
}

impl Place {
    pub(crate) const ALL: [Self; 3] = [Self::Together, Self::Apart, Self::Free];

    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Together => "all on one core",
            Self::Apart => "a core each",
            Self::Free => "placed by the system",
        }
    }

    /// The arguments that put the client, or its peer, onto its core.
    pub(crate) fn arguments(self, of_peer: bool) -> Vec<String> {
        let core = match self {
            Self::Together => 0,
            Self::Apart => usize::from(of_peer),
            Self::Free => return Vec::new(),
        };
        vec!["--core".to_owned(), core.to_string()]
    }
}

/// Puts the calling thread, and all that it starts, onto a core, if one is named.
pub(crate) fn stay_on(core: Option<usize>) -> Result<()> {
    let Some(core) = core else { return Ok(()) };
    let cores = core_affinity::get_core_ids().context("the cores can't be listed")?;
    let id = cores[core % cores.len()];
    anyhow::ensure!(core_affinity::set_for_current(id), "the system refuses core {}", id.id);
    Ok(())
}
