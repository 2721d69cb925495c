//! The threads of the handler, tested by `shuttle` in many orders of their steps.
//!
//! `RUSTFLAGS="--cfg shuttle" cargo test --lib model`
//!
//! The locks, threads and time are those of [`sync`](super::sync) for the models, and the connection is that of a
//! [`controller`] in the model. All else is the code of the library. A thread that waits forever fails a model, as
//! does one that never stops working.

mod commands;
mod controller;
mod gaps;
mod hook;
mod hook_ends;
mod state;
mod transfers;
mod waits;
mod watchdog;

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::Arc;
use std::time::Duration;

use shuttle::scheduler::{PctScheduler, RandomScheduler};
use shuttle::thread::{self, JoinHandle};
use shuttle::{Config, MaxSteps, Runner};

pub(super) use self::controller::TxtClient;
use self::controller::{Controller, Request};
use crate::error::Error;
use crate::exchange::TransferMode;
use crate::handler::com_handler::TransferAreaComHandler;
use crate::handler::program::area::TransferAreas;
use crate::handler::program::guard::TransferAreaGuard;
use crate::handler::settings::Settings;

/// How many points in each order give another thread priority.
const DEPTH: usize = 4;

/// So many steps are enough for each model.
const STEPS: usize = 50_000;
/// The bytes of each thread's stack.
const STACK: usize = 0x4_0000;

/// In each cycle, whether a window ends by itself or by the program's threads is random.
const WINDOW: Duration = Duration::from_millis(5);
/// A window that only the program's threads end.
const NO_END: Duration = Duration::MAX;

/// Runs a model in so many random orders, and in as many with few changes of priority.
fn check(orders: usize, model: impl Fn() + Send + Sync + Copy + 'static) {
    // Warnings of guards that are kept go to a logger, and there is none.
    log::set_max_level(log::LevelFilter::Error);
    let mut config = Config::new();
    config.stack_size = STACK;
    config.max_steps = MaxSteps::FailAfter(STEPS);
    let order = Order::default();
    let counted = || {
        let order = Arc::clone(&order.0);
        move || {
            order.fetch_add(1, Ordering::Relaxed);
            model();
        }
    };
    Runner::new(RandomScheduler::new(orders), config.clone()).run(counted());
    Runner::new(PctScheduler::new(DEPTH, orders), config).run(counted());
}

/// Counts the orders, and prints in which one a model failed.
#[derive(Default)]
struct Order(Arc<AtomicUsize>);

impl Drop for Order {
    fn drop(&mut self) {
        if std::thread::panicking() {
            eprintln!("failed in order {}", self.0.load(Ordering::Relaxed));
        }
    }
}

/// A handler with these settings, and the controller that it will connect to.
fn handler(set: impl FnOnce(&mut Settings)) -> (Arc<TransferAreaComHandler>, Arc<Controller>) {
    let mut settings = Settings::new("a model".to_owned());
    settings.mode = TransferMode::Simple;
    settings.reaction_window = WINDOW;
    set(&mut settings);
    (Arc::new(TransferAreaComHandler::new(settings)), Controller::new())
}

/// A thread of the program with a handle of its own.
fn program<T: Send + 'static>(
    handler: &TransferAreaComHandler,
    work: impl FnOnce(TransferAreas) -> T + Send + 'static,
) -> JoinHandle<T> {
    let area = handler.areas().clone();
    thread::spawn(move || work(area))
}

/// Waits for responses until the transfer ends; returns the errors before that.
fn wait_to_the_end(
    area: &TransferAreas,
    mut answer: impl FnMut(&mut TransferAreaGuard<'_>),
) -> Vec<Error> {
    let mut reported = Vec::new();
    loop {
        // Otherwise an order by priorities may run the transfer and this thread forever.
        thread::yield_now();
        match area.wait_cycle() {
            Ok(mut areas) => answer(&mut areas),
            Err(error @ (Error::ConnectionLost { .. } | Error::WatchdogExpired { .. })) => {
                reported.push(error);
            }
            Err(_) => return reported,
        }
    }
}

/// The duty of O1 in each request.
fn duties(requests: &[Request]) -> Vec<i16> {
    requests.iter().map(|request| request.outputs.duty[0]).collect()
}
