//! `txt simulate`: a simulated TXT for clients in any language.

mod options;
mod typed;

use std::io;
use std::sync::{Arc, Weak};
use std::thread;

use ft_transfer_area_simulator::SimulatedTxt;

use crate::panel::{self, Simulated};
use crate::{interrupt, print};

pub(crate) use options::Args;

/// Serves clients until Ctrl-C.
pub(crate) fn run(args: Args) -> anyhow::Result<()> {
    let interrupted = interrupt::receiver()?;
    let (world, show, opens_browser) = (args.world(), args.show, !args.no_browser);
    let txt = Arc::new(args.builder().start()?);
    print::line(format_args!("main 127.0.0.1:{}", txt.port()))?;
    print::line(format_args!("camera 127.0.0.1:{}", txt.camera_port()))?;
    print::line(format_args!("i2c 127.0.0.1:{}", txt.i2c_port()))?;
    if show {
        let url = panel::show(Simulated::new(Arc::clone(&txt), world), opens_browser)?;
        print::line(format_args!("page {url}"))?;
    }

    let typed = Arc::downgrade(&txt);
    thread::Builder::new().name(String::from("typed")).spawn(move || read_lines(&typed))?;
    // Clients are served while this waits. The sender lives as long as the program.
    let _ = interrupted.recv();
    Ok(())
}

/// Carries out typed lines. Without a keyboard, or at the end of the input, the program just goes on.
fn read_lines(txt: &Weak<SimulatedTxt>) {
    for line in io::stdin().lines() {
        let (Ok(line), Some(txt)) = (line, txt.upgrade()) else { return };
        if line.trim().is_empty() {
            continue;
        }
        if let Err(sentence) = txt.with_machine(|machine| typed::carry_out(&line, machine)) {
            eprintln!("{sentence}\n{}", typed::HELP);
        }
    }
}
