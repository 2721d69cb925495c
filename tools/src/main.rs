//! The program `txt`: a fischertechnik ROBOTICS TXT controller on the bench.

mod bridge;
mod camera;
mod find;
mod interrupt;
mod panel;
mod recording;
mod simulate;
mod web;

use std::process::ExitCode;

use clap::{Parser, Subcommand};
use env_logger::Env;

/// See, record, find and simulate fischertechnik ROBOTICS TXT controllers.
#[derive(Parser)]
#[command(name = "txt", version, max_term_width = 100)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    Find(find::Args),
    Panel(panel::Args),
    Record(recording::record::Args),
    Info(recording::info::Args),
    Csv(recording::csv::Args),
    Plot(recording::plot::Args),
    Replay(recording::replay::Args),
    Camera(camera::Args),
    Bridge(bridge::Args),
    Simulate(simulate::Args),
}

/// What is logged unless `RUST_LOG` says more. The errors of a transfer and of a camera are returned to the
/// commands, which tell them.
const LOG: &str = "warn,ft_transfer_area::handler=off,ft_transfer_area::camera=off";

fn main() -> ExitCode {
    env_logger::Builder::from_env(Env::default().default_filter_or(LOG)).init();
    let done = match Cli::parse().command {
        Command::Find(args) => find::run(args),
        Command::Panel(args) => panel::run(args),
        Command::Record(args) => recording::record::run(args),
        Command::Info(args) => recording::info::run(args),
        Command::Csv(args) => recording::csv::run(args),
        Command::Plot(args) => recording::plot::run(args),
        Command::Replay(args) => recording::replay::run(args),
        Command::Camera(args) => camera::run(args),
        Command::Bridge(args) => bridge::run(args),
        Command::Simulate(args) => simulate::run(args),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error:#}");
            ExitCode::FAILURE
        }
    }
}
