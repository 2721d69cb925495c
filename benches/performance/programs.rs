//! Programs that answer each response: O1 gets the value of I1.

use std::ops::ControlFlow;
use std::thread;
use std::time::Duration;

use anyhow::{ensure, Result};
use clap::{Args, ValueEnum};
use ft_transfer_area::transfer_area::LOCAL_IO;
use ft_transfer_area::{EventKind, FishX1Transfer, TransferAreaComHandler};

use crate::clients::{Direct, Load};
use crate::place::stay_on;
use crate::process::{Cost, Usage};

/// How a program notices a response.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum Way {
    Direct,
    Waiting,
    Hooked,
    Events,
    Polling,
}

impl Way {
    pub(crate) const ALL: [Self; 5] =
        [Self::Direct, Self::Waiting, Self::Hooked, Self::Events, Self::Polling];

    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Direct => "calls `TxtClient::do_transfer`",
            Self::Waiting => "waits with `wait_cycle`",
            Self::Hooked => "has a cycle hook",
            Self::Events => "receives events",
            Self::Polling => "looks each millisecond",
        }
    }
}

/// Runs for a number of cycles, and prints what they cost.
#[derive(Args, Clone)]
pub(crate) struct Program {
    #[arg(long)]
    way: Way,
    #[arg(long)]
    port: u16,
    #[arg(long)]
    cycles: u64,
    #[arg(long)]
    core: Option<usize>,
}

impl Program {
    pub(crate) fn run(&self) -> Result<()> {
        stay_on(self.core)?;
        let cost = if matches!(self.way, Way::Direct) { self.direct()? } else { self.handler()? };
        println!("{} {}", cost.processor, cost.switches);
        Ok(())
    }

    /// Without a thread or a transfer area that threads share.
    fn direct(&self) -> Result<Cost> {
        let mut client = Direct::connect(self.port, Load::IDLE)?;
        client.cycle(copy_input)?;
        let begin = Usage::now()?;
        for _ in 0..self.cycles {
            client.cycle(copy_input)?;
        }
        begin.per_cycle(self.cycles)
    }

    fn handler(&self) -> Result<Cost> {
        let handler =
            TransferAreaComHandler::builder(format!("127.0.0.1:{}", self.port)).build()?;
        handler.begin_transfer()?;
        drop(handler.areas().wait_cycle()?);
        let (begin, first) = (Usage::now()?, handler.areas().statistics().cycles);
        self.answer(&handler)?;
        let cost = begin.per_cycle(handler.areas().statistics().cycles - first)?;
        handler.end_transfer()?;
        Ok(cost)
    }

    fn answer(&self, handler: &TransferAreaComHandler) -> Result<()> {
        let goes_on = || handler.areas().statistics().cycles < self.cycles;
        match self.way {
            Way::Direct | Way::Waiting => {
                while goes_on() {
                    copy_input(&mut handler.areas().wait_cycle()?);
                }
            }
            Way::Hooked => {
                handler
                    .set_cycle_hook(|areas| {
                        let areas = areas.unwrap();
                        copy_input(areas);
                        ControlFlow::Continue(())
                    })
                    .unwrap();
                while goes_on() {
                    thread::sleep(Duration::from_millis(100));
                }
                handler.clear_cycle_hook();
            }
            Way::Events => {
                let events = handler.areas().events(&[EventKind::InputChanged], 1000)?;
                while goes_on() {
                    events.recv()?;
                    copy_input(&mut handler.areas().lock());
                }
                ensure!(events.lost() == 0, "events were lost");
            }
            Way::Polling => {
                while goes_on() {
                    copy_input(&mut handler.areas().lock());
                    thread::sleep(Duration::from_millis(1));
                }
            }
        }
        Ok(())
    }
}

fn copy_input(areas: &mut [FishX1Transfer]) {
    areas[LOCAL_IO].output.duty[0] = areas[LOCAL_IO].input.uni[0];
}

/// Keeps a core busy until it is ended.
pub(crate) fn be_busy() -> Result<()> {
    println!("busy");
    loop {
        std::hint::spin_loop();
    }
}
