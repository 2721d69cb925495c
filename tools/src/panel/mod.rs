//! `txt panel`: a page in the browser that shows and drives controllers.

mod bundle;
mod camera;
mod common;
mod connection;
mod control_lock;
mod dispatch;
mod files;
mod floor;
mod histogram;
mod host;
mod i2c;
mod order;
mod problem;
mod reply;
mod request;
mod server;
mod shown;
mod state;
mod watched;
mod worker;
mod world;

use std::io::Write;
use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::sync::Arc;
use std::time::{Duration, Instant};

use anyhow::Context;
use ft_transfer_area::transfer_area::MAX_EXTENSIONS;
use ft_transfer_area_simulator::world::{Script, World};

use self::common::Common;
use self::dispatch::Panel;
use self::host::Host;
pub(crate) use self::watched::Watched;
pub(crate) use self::world::Simulated;
use crate::web::browser::Opening;
use crate::web::{self, qr, Site};
use crate::{arguments, interrupt};

/// The host that is no address.
const SIMULATED: &str = "simulated";
/// How long the controllers may take to end their transfers.
const END_LIMIT: Duration = Duration::from_secs(5);

/// Show and drive controllers on a page in the browser
#[derive(clap::Args)]
#[command(after_help = "\
The page shows inputs, counters, motors, lamps, sounds, remotes, the camera and I2C devices. All
motors stop when it closes, when it is silent for a second, and at Ctrl-C. The space bar stops
them, too.

Examples:
  txt panel                               a simulated TXT, to try it out
  txt panel 192.168.7.2 192.168.8.2       two controllers, by USB and by Wi-Fi
  txt panel --world car --extensions 2    another simulated machine")]
pub(crate) struct Args {
    /// Controllers: 192.168.7.2, txt:65000, auto, or simulated [default: simulated]
    #[arg(value_name = "HOST")]
    hosts: Vec<String>,
    /// Port of the page; 0 is a free one
    #[arg(long, default_value_t = 0)]
    port: u16,
    /// Where to serve the page; 0.0.0.0 lets others in
    #[arg(long, value_name = "ADDRESS", default_value_t = IpAddr::V4(Ipv4Addr::LOCALHOST))]
    bind: IpAddr,
    /// World of a simulated TXT: its name, a .toml file, or none
    #[arg(long, value_name = "WORLD")]
    world: Option<String>,
    /// Number of extensions, 0 to 8 [default: all there are]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(0..=MAX_EXTENSIONS as i64))]
    extensions: Option<u8>,
    /// Do not open the browser
    #[arg(long)]
    no_browser: bool,
}

pub(crate) fn run(args: Args) -> anyhow::Result<()> {
    let interrupted = interrupt::receiver()?;
    let site = Site::listen(SocketAddr::new(args.bind, args.port))?;
    let common = Arc::new(Common::new());
    let hosts = start_hosts(&args, &common)?;
    let panel = Arc::new(Panel::new(hosts, common, Arc::clone(&site.access)));
    let router = server::router([Arc::clone(&panel)])?;
    let url = tell(&site)?;
    let _opening = site.serve(router, (!args.no_browser).then_some(url))?;
    interrupted.recv()?;
    end(&panel)
}

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
    opens_browser: bool,
) -> anyhow::Result<(String, Watched, Opening)> {
    let common = Arc::new(Common::new());
    let (host, watched) = Host::watched(address, &common);
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

fn start_hosts(args: &Args, common: &Arc<Common>) -> anyhow::Result<Vec<Host>> {
    let only_simulated = [SIMULATED.to_owned()];
    let hosts = if args.hosts.is_empty() { &only_simulated[..] } else { &args.hosts };
    let extensions = args.extensions.map(usize::from);
    let start = |host: &String| {
        if host == SIMULATED {
            let world = read_world(args.world.as_deref())?;
            return Ok(Host::simulated(Simulated::start(world, extensions)?, common)?);
        }
        Host::at(host, 1 + extensions.unwrap_or(MAX_EXTENSIONS), common)
            .with_context(|| host.clone())
    };
    hosts.iter().map(start).collect()
}

/// The world with this name or in this file.
fn read_world(name: Option<&str>) -> anyhow::Result<Option<World>> {
    let Some(name) = name else {
        // The hand at the mouse presses the buttons here, not the script.
        return Ok(Some(World::default().with_script(Script::default())));
    };
    match name {
        "none" => Ok(None),
        _ => Ok(Some(arguments::world(name)?)),
    }
}

/// Says where the page is.
fn tell(site: &Site) -> anyhow::Result<String> {
    let here = web::local(site.address.ip());
    let mut out = anstream::stdout().lock();
    writeln!(out, "{}", site.url(here))?;
    if !site.address.ip().is_loopback() {
        let unspecified = site.address.ip().is_unspecified();
        let elsewhere = if unspecified { web::own_address() } else { Some(here) };
        if let Some(url) = elsewhere.map(|ip| site.url(ip)) {
            if unspecified {
                writeln!(out, "from other computers: {url}")?;
            }
            writeln!(out, "{}", qr::code(&url)?)?;
        }
        writeln!(
            out,
            "Whoever in the network knows this address with its token can drive the machine."
        )?;
    }
    writeln!(out, "Ctrl-C stops all motors and ends the panel.")?;
    out.flush()?;
    Ok(site.url(here))
}

/// Stops all motors and waits until the controllers know.
fn end(panel: &Panel) -> anyhow::Result<()> {
    panel.common.end();
    panel.stop();
    let deadline = Instant::now() + END_LIMIT;
    let late: Vec<_> = panel
        .hosts
        .iter()
        .filter(|host| !host.wait_for_end(deadline))
        .map(|host| host.address.as_str())
        .collect();
    if !late.is_empty() {
        // Its connection is closed now, which stops its motors.
        log::warn!("no answer from {} at the end", late.join(", "));
    }
    Ok(())
}
