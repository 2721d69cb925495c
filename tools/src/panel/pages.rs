//! The pages of other commands than the panel: for controllers that other programs drive.

use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::sync::Arc;

use super::common::Common;
use super::course::Course;
use super::dispatch::Panel;
use super::host::Host;
use super::server;
pub(crate) use super::watched::Watched;
pub(crate) use super::world::Simulated;
use crate::gate::Gate;
use crate::names::Names;
use crate::recording::on_demand::Button;
use crate::web::access::Token;
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

/// Where a page of a lesson is served.
#[derive(Clone, Copy)]
pub(crate) struct PageAt(pub(crate) SocketAddr);

impl Default for PageAt {
    fn default() -> Self {
        Self(SocketAddr::new(Ipv4Addr::LOCALHOST.into(), 0))
    }
}

/// The page of a lesson, with a simulated TXT which another program drives, and its address. It is served until the
/// program ends.
pub(crate) fn lesson(
    simulated: Vec<Simulated>,
    names: &Names,
    course: Arc<dyn Course>,
    PageAt(address): PageAt,
    opens_browser: bool,
) -> anyhow::Result<(String, Opening)> {
    let common = Arc::new(Common::new());
    let shown = |one| Ok(Host::shown(one, &common)?.named(names.clone()));
    let hosts = simulated.into_iter().map(shown).collect::<anyhow::Result<_>>()?;
    let site = Site::listen(address)?;
    let panel = Panel::new(hosts, common, Arc::clone(&site.access)).with_course(Some(course));
    let url = site.lesson_url(web::reachable(site.address.ip()), &site.access);
    let router = server::router([Arc::new(panel)])?;
    let opening = site.serve(router, opens_browser.then(|| url.clone()))?;
    Ok((url, opening))
}

/// A page that shows a controller which another program drives through this one. It is served until the program ends.
pub(crate) fn watch(
    address: &str,
    names: Names,
    gate: &Arc<Gate>,
    button: Option<Button>,
    opens_browser: bool,
) -> anyhow::Result<(String, Watched, Opening)> {
    let common = Arc::new(Common::new());
    let (host, watched) = Host::watched(address, &common, gate, button);
    let (url, opening) = show_hosts(vec![host.named(names)], common, opens_browser)?;
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

/// Where the pages of a classroom are.
pub(crate) struct Pages {
    site: Site,
    ip: IpAddr,
}

impl Pages {
    /// Listens for the pages of a classroom, whose page of all has this token.
    pub(crate) fn listen(address: SocketAddr) -> anyhow::Result<Self> {
        let site = Site::listen(address)?;
        let ip = web::reachable(site.address.ip());
        Ok(Self { site, ip })
    }

    pub(crate) fn port(&self) -> u16 {
        self.site.address.port()
    }

    /// The link with this token.
    pub(crate) fn link(&self, token: &Token) -> String {
        self.site.url_for(self.ip, &self.site.access(token))
    }

    /// The same to the page of a lesson.
    pub(crate) fn lesson_link(&self, token: &Token) -> String {
        self.site.lesson_url(self.ip, &self.site.access(token))
    }

    /// Serves a page for each of these simulated TXTs, for those who have its token, and one that looks at all of them.
    /// They are served until the program ends.
    pub(crate) fn serve(self, all: &Token, txts: Vec<(Simulated, Token)>) -> anyhow::Result<()> {
        let common = Arc::new(Common::new());
        let mut hosts = Vec::new();
        for (txt, token) in txts {
            hosts.push((Host::shown(txt, &common)?, self.site.access(&token)));
        }
        let looked_at = hosts.iter().map(|(host, _)| host.looked_at()).collect();
        let mut panels =
            vec![Arc::new(Panel::new(looked_at, Arc::clone(&common), self.site.access(all)))];
        for (host, access) in hosts {
            let own = Arc::new(Common::new());
            let course = host.course();
            let panel = Panel::new(vec![host], own, access).beside_others();
            panels.push(Arc::new(panel.with_course(course)));
        }
        let _no_browser = self.site.serve(server::router(panels)?, None)?;
        Ok(())
    }
}
