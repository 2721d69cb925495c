//! `txt classroom`: a simulated TXT with a world for each pupil.

use std::net::{IpAddr, Ipv4Addr, SocketAddr};

use ft_transfer_area::PORT;
use ft_transfer_area_simulator::SimulatedTxt;

use crate::panel::pages::{self, Simulated};
use crate::{arguments, interrupt, open_files, print, web};

/// How many ports each simulated TXT has.
const PORTS: u16 = 3;
/// The most pupils.
const PUPILS: i64 = 60;

const AFTER: &str = "\
Each pupil has a controller with a machine: programs connect to the address that is printed,
with its port, and the link shows the machine with its buttons. The link for all shows every
controller, and only looks. A link is all that is needed to come in, so give each pupil only
their own.

With --bind 0.0.0.0 the pupils' computers reach it, and whoever reaches it can drive the
simulated controllers. Ctrl-C ends it.

Examples:
  txt classroom 12 --bind 0.0.0.0                for the computers of twelve pupils
  txt classroom 2 --world slide                  to try it out on this computer";

/// Simulate a controller with a world for each pupil
#[derive(clap::Args)]
#[command(after_help = AFTER)]
pub(crate) struct Args {
    /// How many pupils, 1 to 60
    #[arg(value_name = "N", value_parser = clap::value_parser!(u16).range(1..=PUPILS))]
    pupils: u16,
    /// What each controller has plugged in: a world by name, or a .toml file
    #[arg(long, value_name = "WORLD", default_value = "default")]
    world: String,
    /// Main port of the first controller; each next one is 3 higher; 0: any free ones
    #[arg(long, value_name = "N", default_value_t = PORT)]
    port: u16,
    /// Port of the pages; 0 is a free one
    #[arg(long, value_name = "N", default_value_t = 0)]
    page_port: u16,
    /// Where to serve it; 0.0.0.0 lets other computers in
    #[arg(long, value_name = "ADDRESS", default_value_t = IpAddr::V4(Ipv4Addr::LOCALHOST))]
    bind: IpAddr,
}

pub(crate) fn run(args: Args) -> anyhow::Result<()> {
    let interrupted = interrupt::receiver()?;
    let last = u32::from(args.port) + u32::from(args.pupils * PORTS);
    anyhow::ensure!(
        last <= 1 + u32::from(u16::MAX),
        "there are too few ports after {} for {} controllers; choose a lower one with --port",
        args.port,
        args.pupils
    );
    let world = arguments::world(&args.world)?;
    open_files::check(args.pupils.into());
    let mut txts = Vec::new();
    let mut ports = Vec::new();
    for pupil in 1..=args.pupils {
        let name = format!("TXT {pupil}");
        let port = if args.port == 0 { 0 } else { args.port + PORTS * (pupil - 1) };
        let builder = SimulatedTxt::builder().bind(args.bind).port(port).device_name(&name);
        let txt = builder.world(world.clone()).start()?;
        ports.push(txt.port());
        txts.push(Simulated::alone(txt, Some(world.clone()), name));
    }
    let links = pages::classroom(txts, SocketAddr::new(args.bind, args.page_port))?;
    let ip = web::reachable(args.bind);
    print::line(format_args!("all {}", links.all))?;
    for (index, (port, link)) in ports.iter().zip(&links.each).enumerate() {
        let address = SocketAddr::new(ip, *port);
        print::line(format_args!("pupil {}: program {address}, page {link}", index + 1))?;
    }
    // Clients and pages are served while this waits.
    Ok(interrupted.recv()?)
}
