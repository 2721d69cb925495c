//! The pages of other commands than the panel: for controllers that other programs drive.

use std::net::{Ipv4Addr, SocketAddr};
use std::sync::Arc;

use super::common::Common;
use super::dispatch::Panel;
use super::host::Host;
use super::server;
pub(crate) use super::watched::Watched;
pub(crate) use super::world::Simulated;
use crate::gate::Gate;
use crate::web::browser::Opening;
use crate::web::{self, Site};

/// A page that shows simulated TXTs which other programs drive, and its address. It is served until the program ends.
pub(crate) fn show(
    simulated: Vec<Simulated>,
    opens_browser: bool,
) -> anyhow::Result<(String, Opening)> {
    let common = Arc::new(Common::new());
    let shown = simulated.into_iter().map(|one| Host::shown(one, &common));
    show_hosts(shown.collect::<Result<_, _>>()?, common, opens_browser)
}

/// A page that shows a controller which another program drives through this one. It is served until the program ends.
pub(crate) fn watch(
    address: &str,
    gate: &Arc<Gate>,
    opens_browser: bool,
) -> anyhow::Result<(String, Watched, Opening)> {
    let common = Arc::new(Common::new());
    let (host, watched) = Host::watched(address, &common, gate);
    let (url, opening) = show_hosts(vec![host], common, opens_browser)?;
    Ok((url, watched, opening))
}

/// A page for this computer that drives nothing.
fn show_hosts(
    hosts: Vec<Host>,
    common: Arc<Common>,
    opens_browser: bool,
) -> anyhow::Result<(String, Opening)> {
    let site = Site::listen(SocketAddr::new(Ipv4Addr::LOCALHOST.into(), 0))?;
    let panel = Arc::new(Panel::new(hosts, common, Arc::clone(&site.access)));
    let url = site.url(Ipv4Addr::LOCALHOST.into());
    let opening = site.serve(server::router([panel])?, opens_browser.then(|| url.clone()))?;
    Ok((url, opening))
}

/// The addresses of the pages of a classroom.
pub(crate) struct Links {
    /// It shows all controllers, and only looks.
    pub(crate) all: String,
    /// Each shows one controller, and has the buttons of its world.
    pub(crate) each: Vec<String>,
}

/// A page for each of these simulated TXTs, and one that looks at all of them. They are served until the program ends.
pub(crate) fn classroom(txts: Vec<Simulated>, address: SocketAddr) -> anyhow::Result<Links> {
    let site = Site::listen(address)?;
    let ip = web::reachable(site.address.ip());
    let common = Arc::new(Common::new());
    let hosts = txts.into_iter().map(|txt| Host::shown(txt, &common));
    let hosts = hosts.collect::<Result<Vec<_>, _>>()?;
    let looked_at = hosts.iter().map(Host::looked_at).collect();
    let mut panels =
        vec![Arc::new(Panel::new(looked_at, Arc::clone(&common), Arc::clone(&site.access)))];
    let mut links = Links { all: site.url(ip), each: Vec::new() };
    for host in hosts {
        let access = site.another_access()?;
        links.each.push(site.url_for(ip, &access));
        let own = Arc::new(Common::new());
        panels.push(Arc::new(Panel::new(vec![host], own, access)));
    }
    let _no_browser = site.serve(server::router(panels)?, None)?;
    Ok(links)
}
