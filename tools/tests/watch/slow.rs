//! Those who look hold nothing up.

use std::io::{BufRead, BufReader};
use std::process::{Child, Stdio};
use std::time::Duration;

use ft_transfer_area::{TransferAreaComHandler, TransferAreaComHandlerBuilder};
use ft_transfer_area_simulator::SimulatedTxt;

use super::support::{command, listening, Watch};
use super::LIMIT;

/// Enough for far more lines than a pipe and the program hold, as all of them change eight values.
const CYCLES: u16 = 10_000;

/// A program that ends with the test.
pub(crate) struct Killed(pub(crate) Child);

impl Drop for Killed {
    fn drop(&mut self) {
        // It may have ended already.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

fn cycle(handler: TransferAreaComHandlerBuilder) {
    let handler: TransferAreaComHandler = handler.build().unwrap();
    handler.begin_transfer().unwrap();
    for number in 0..CYCLES {
        let mut areas = handler.areas().wait_cycle_for(LIMIT).unwrap();
        *areas[0].output.duty = [(number % 512) as i16; 8];
    }
    handler.end_transfer().unwrap();
}

#[test]
fn a_reader_of_the_lines_that_pauses_holds_nothing_up() {
    let txt = SimulatedTxt::builder().pace(Duration::ZERO).start().unwrap();
    let mut command = command(txt.address(), &["--json", "--no-page"]);
    let mut child = Killed(command.stdout(Stdio::piped()).spawn().unwrap());
    // It is kept and not read any more.
    let mut out = BufReader::new(child.0.stdout.take().unwrap());
    let mut line = String::new();
    out.read_line(&mut line).unwrap();
    let port = listening(&line);
    cycle(TransferAreaComHandler::builder(format!("127.0.0.1:{port}")));
}

#[test]
fn a_page_that_reads_nothing_holds_nothing_up() {
    let txt = SimulatedTxt::builder().pace(Duration::ZERO).start().unwrap();
    let watch = Watch::start(txt.address(), &[]);
    let _reads_no_more = watch.page();
    cycle(watch.handler());
}
