//! `txt simulate`: a simulated TXT for clients in any language.

mod options;
mod typed;

use std::sync::{Arc, Weak};
use std::thread;
use std::time::{Duration, Instant};
use std::{io, mem};

use ft_transfer_area_simulator::SimulatedTxt;

use crate::panel::pages::{self, Simulated};
use crate::web::browser::Opening;
use crate::{interrupt, lines, print};

pub(crate) use options::Args;

/// Serves clients until Ctrl-C.
pub(crate) fn run(args: Args) -> anyhow::Result<()> {
    let interrupted = interrupt::receiver()?;
    lines::never_wait_to_log()?;
    let (worlds, show, opens_browser) = (args.worlds(), args.show, !args.no_browser);
    let txts = Arc::new(args.start()?);
    for (name, txt) in txts.iter() {
        let name = if name.is_empty() { String::new() } else { format!("{name} ") };
        print::line(format_args!("{name}main 127.0.0.1:{}", txt.port()))?;
        print::line(format_args!("{name}camera 127.0.0.1:{}", txt.camera_port()))?;
        print::line(format_args!("{name}i2c 127.0.0.1:{}", txt.i2c_port()))?;
    }
    let mut _opening = Opening::default();
    if show {
        let (url, opening) = pages::show(Simulated::all(&txts, worlds), opens_browser)?;
        print::line(format_args!("page {url}"))?;
        _opening = opening;
    }

    let typed = Arc::downgrade(&txts);
    thread::Builder::new().name(String::from("typed")).spawn(move || read_lines(&typed))?;
    // Clients are served while this waits. The sender lives as long as the program.
    let _ = interrupted.recv();
    // The system closes all connections when the program ends, without a wait for thousands of threads one by one.
    mem::forget(txts);
    Ok(())
}

/// The least time between two answers to wrong lines: those of another program may have no end.
const BETWEEN_ANSWERS: Duration = Duration::from_millis(500);

/// Carries out typed lines. Without a keyboard, or at the end of the input, the program just goes on.
fn read_lines(txts: &Weak<Vec<(String, SimulatedTxt)>>) {
    let mut input = io::stdin().lock();
    let mut answered: Option<Instant> = None;
    while let Some(line) = typed::next_line(&mut input) {
        let Some(txts) = txts.upgrade() else { return };
        let done = line.and_then(|line| {
            let (txt, line) = typed::addressed(&line, &txts)?;
            txt.with_machine(|machine| typed::carry_out(line, machine))
        });
        drop(txts);
        if let Err(sentence) = done {
            if let Some(before) = answered {
                thread::sleep(BETWEEN_ANSWERS.saturating_sub(before.elapsed()));
            }
            answered = Some(Instant::now());
            eprintln!("{sentence}\n{}", typed::HELP);
        }
    }
}
