//! `txt panel`: a page in the browser that shows and drives controllers.

mod camera;
mod common;
mod connection;
mod control_lock;
pub(crate) mod course;
mod dispatch;
mod drawing;
mod files;
mod floor;
mod histogram;
mod host;
mod i2c;
mod order;
pub(crate) mod pages;
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
use self::world::Simulated;
use crate::arguments;
use crate::guardian::Guardian;
use crate::interrupt::{self, Driving};
use crate::web::{self, qr, Site};
use crate::{lines, names};

/// The host that is not an address.
const SIMULATED: &str = "simulated";
/// How long the controllers may take to end their transfers.
const END_LIMIT: Duration = Duration::from_secs(5);
/// How long the ends of recordings may take.
const FILES_LIMIT: Duration = Duration::from_secs(3);

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
    #[command(flatten)]
    names: names::Files,
    /// Do not open the browser
    #[arg(long)]
    no_browser: bool,
}

pub(crate) fn run(mut args: Args) -> anyhow::Result<()> {
    let interrupted = interrupt::receiver_for_driving()?;
    // The same one drives and is stopped when this program is killed.
    for host in &mut args.hosts {
        *host = arguments::found(host)?;
    }
    let site = Site::listen(SocketAddr::new(args.bind, args.port))?;
    let common = Arc::new(Common::new());
    let hosts = start_hosts(&args, &common)?;
    // A paused terminal must hold up neither the page nor the end. No page has driven a controller yet.
    lines::never_wait()?;
    let (url, words) = words(&site)?;
    // A full pipe has them later.
    interrupt::in_time(move || publish(&words)).unwrap_or(Ok(()))?;
    let panel = Arc::new(Panel::new(hosts, common, Arc::clone(&site.access)));
    let guardians = guard(&panel)?;
    let driving = Driving::begin();
    let router = server::router([Arc::clone(&panel)])?;
    let _opening = site.serve(router, (!args.no_browser).then_some(url))?;
    interrupted.recv()?;
    end(&panel, guardians);
    drop(driving);
    end_recordings(&panel);
    Ok(())
}

/// Guards the controllers that outlive this program: each host with its guardian, if it needs one.
fn guard(panel: &Panel) -> anyhow::Result<Vec<Option<Guardian>>> {
    let guard =
        |host: &Host| (!host.is_simulated()).then(|| Guardian::start(&host.address)).transpose();
    panel.hosts.iter().map(guard).collect()
}

fn start_hosts(args: &Args, common: &Arc<Common>) -> anyhow::Result<Vec<Host>> {
    let only_simulated = [SIMULATED.to_owned()];
    let hosts = if args.hosts.is_empty() { &only_simulated[..] } else { &args.hosts };
    let extensions = args.extensions.map(usize::from);
    let start = |host: &String| {
        if host == SIMULATED {
            let world = read_world(args.world.as_deref())?;
            return Host::simulated(Simulated::start(world, extensions)?, common);
        }
        Host::at(host, 1 + extensions.unwrap_or(MAX_EXTENSIONS), common)
            .with_context(|| host.clone())
    };
    let names = args.names.read(hosts.len())?;
    hosts.iter().zip(names).map(|(host, names)| Ok(start(host)?.named(names))).collect()
}

/// The world with this name or in this file.
fn read_world(name: Option<&str>) -> anyhow::Result<Option<World>> {
    let Some(name) = name else {
        // The hand at the mouse presses the buttons here, not the script.
        return Ok(Some(World::default().script(Script::default())));
    };
    match name {
        "none" => Ok(None),
        _ => Ok(Some(arguments::world(name)?)),
    }
}

/// Where the page is on this computer, and what is said of it.
fn words(site: &Site) -> anyhow::Result<(String, String)> {
    let here = web::local(site.address.ip());
    let mut words = format!("{}\n", site.url(here));
    if !site.address.ip().is_loopback() {
        let unspecified = site.address.ip().is_unspecified();
        let elsewhere = if unspecified { web::own_address() } else { Some(here) };
        if let Some(url) = elsewhere.map(|ip| site.url(ip)) {
            if unspecified {
                words += &format!("from other computers: {url}\n");
            }
            words += &format!("{}\n", qr::code(&url)?);
        }
        words +=
            "Whoever in the network knows this address with its token can drive the machine.\n";
    }
    words += "Ctrl-C stops all motors and ends the panel.";
    Ok((site.url(here), words))
}

fn publish(words: &str) -> anyhow::Result<()> {
    let mut out = anstream::stdout().lock();
    writeln!(out, "{words}")?;
    Ok(out.flush()?)
}

/// Stops all motors and waits until the controllers know.
fn end(panel: &Panel, guardians: Vec<Option<Guardian>>) {
    panel.common.end();
    panel.stop();
    let deadline = Instant::now() + END_LIMIT;
    for (host, guardian) in panel.hosts.iter().zip(guardians) {
        if host.wait_for_end(deadline) {
            guardian.into_iter().for_each(Guardian::dismiss);
        } else {
            // Its guardian tries it anew.
            log::warn!("no answer from {} at the end", host.address);
        }
    }
}

/// Ends the files, as far as their disks take it in time: nothing moves any more.
fn end_recordings(panel: &Panel) {
    let ends: Vec<_> = panel.hosts.iter().filter_map(Host::end_recording).collect();
    let deadline = Instant::now() + FILES_LIMIT;
    for end in ends {
        // Nothing is ever sent.
        let _ = end.recv_deadline(deadline);
    }
}
