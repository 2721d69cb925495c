//! `txt lesson`: the page of a lesson, with its machine.

use std::net::{IpAddr, Ipv4Addr, SocketAddr};

use ft_transfer_area::PORT;
use ft_transfer_area_simulator::SimulatedTxt;

use crate::names::Names;
use crate::panel::pages::{self, PageAt};
use crate::{check, interrupt, lines, print};

const AFTER: &str = "\
The page has the task, the machine and the steps of the check side by side. Press Check on it and
start your program: the steps are ticked while it runs, and where it is wrong, the page says why.
The next lesson is a button away.

Examples:
  txt lesson                 from the first lesson on
  txt lesson 4               the end switch";

/// Show a lesson: task, machine and check side by side in the browser
#[derive(clap::Args)]
#[command(after_help = AFTER)]
pub(crate) struct Args {
    /// Number or name of the lesson, such as 4 or motor
    #[arg(default_value = "1")]
    lesson: String,
    /// Main port of the simulated controller; 0: any free one
    #[arg(long, value_name = "N", default_value_t = PORT)]
    port: u16,
    /// Port of the page; 0 is a free one
    #[arg(long, value_name = "N", default_value_t = 0)]
    page_port: u16,
    /// Where to serve it; 0.0.0.0 lets other computers in
    #[arg(long, value_name = "ADDRESS", default_value_t = IpAddr::V4(Ipv4Addr::LOCALHOST))]
    bind: IpAddr,
    /// Do not open the browser
    #[arg(long)]
    no_browser: bool,
}

pub(crate) fn run(args: &Args) -> anyhow::Result<()> {
    let interrupted = interrupt::receiver()?;
    lines::never_wait_to_log()?;
    let builder = SimulatedTxt::builder().bind(args.bind).port(args.port);
    let desk = check::desk(&args.lesson, builder, String::new())?;
    print::line(format_args!("program {}", desk.address()))?;
    let place = PageAt(SocketAddr::new(args.bind, args.page_port));
    let (url, _opening) = pages::lesson(
        vec![desk.simulated()],
        &Names::default(),
        desk.course(),
        place,
        !args.no_browser,
    )?;
    print::line(format_args!("page {url}"))?;
    // Clients and pages are served while this waits.
    Ok(interrupted.recv()?)
}
