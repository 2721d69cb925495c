//! `txt stop`: switches off what another program has left on.

use ft_transfer_area::transfer_area::MAX_AREAS;
use ft_transfer_area::TransferAreaComHandler;

use crate::print;

const AFTER: &str = "\
Goes online, which ends what a program has left, sends one exchange with all outputs off, also
those of extensions, and goes offline. A program that is still online keeps the controller: end
that program first. The exit status is 0 only when the controller has answered.

Example: txt stop 192.168.7.2";

/// Switch off what a program has left on
#[derive(clap::Args)]
#[command(after_help = AFTER)]
pub(crate) struct Args {
    /// The controller: an address or a name, with a port if it is not 65000
    #[arg(default_value = "auto")]
    host: String,
}

pub(crate) fn run(args: Args) -> anyhow::Result<()> {
    let handler = TransferAreaComHandler::builder(&*args.host).areas(MAX_AREAS).build()?;
    handler.begin_transfer()?;
    drop(handler.wait_cycle()?);
    handler.end_transfer()?;
    let name = handler.device_name().unwrap_or_default();
    print::line(format_args!("all outputs of {} are off", print::clean(&name)))
}
