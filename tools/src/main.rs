//! The program `txt`: a fischertechnik ROBOTICS TXT controller on the bench.

mod arguments;
mod bridge;
mod camera;
mod check;
mod classroom;
mod commands;
mod find;
mod gate;
mod guardian;
mod interrupt;
mod lesson;
mod lines;
mod names;
mod open_files;
mod panel;
mod plotter;
mod print;
mod program;
mod progress;
mod queue;
mod recording;
mod seen;
mod selftest;
mod shell_files;
mod simulate;
mod start;
mod stop;
mod text_file;
mod values;
mod watch;
mod web;
mod zone;

use std::process::ExitCode;

use clap::{CommandFactory, Parser, Subcommand};
use env_logger::{Env, Target};

/// See, record, find and simulate fischertechnik ROBOTICS TXT controllers.
#[derive(Parser)]
#[command(name = "txt", version, max_term_width = 100, after_help = EXAMPLE)]
struct Cli<T: Subcommand> {
    #[command(subcommand)]
    tool: T,
}

const EXAMPLE: &str = "Example: txt panel     shows a simulated TXT with its page in the browser";

#[derive(Subcommand)]
enum Tool {
    Find(find::Args),
    Panel(panel::Args),
    Record(recording::record::Args),
    Info(recording::info::Args),
    Csv(recording::csv::Args),
    Plot(recording::plot::Args),
    Compare(recording::compare::Args),
    Replay(recording::replay::Args),
    Selftest(selftest::Args),
    Camera(camera::Args),
    Bridge(bridge::Args),
    Simulate(simulate::Args),
    Stop(stop::Args),
    Watch(watch::Args),
    Classroom(classroom::Args),
    Check(check::Args),
    Lesson(lesson::Args),
    Start(start::Args),
}

/// Also what completions and manual pages leave out.
#[derive(Subcommand)]
enum Any {
    #[command(flatten)]
    Tool(Tool),
    #[command(hide = true)]
    ShellFiles(shell_files::Args),
    #[command(hide = true, name = program::KEEPER)]
    KeepProgram,
    /// A command that ends with its standard input.
    #[command(hide = true, name = WITH_INPUT)]
    WithInput {
        #[command(subcommand)]
        tool: Tool,
    },
}

/// The hidden command before a command of the start page.
pub(crate) const WITH_INPUT: &str = "with-input";

/// What is logged unless `RUST_LOG` says more. The errors of a transfer, a camera and a recording are returned to
/// the commands, which report them; that another controller answers and that a part can't be deleted are not.
const LOG: &str =
    "warn,ft_transfer_area::handler=off,ft_transfer_area::handler::transfer::handshake::another_one=warn,\
     ft_transfer_area::camera=off,ft_transfer_area_recorder=off,ft_transfer_area_recorder::parts=warn";

fn main() -> ExitCode {
    let asked = std::env::var_os(env_logger::DEFAULT_FILTER_ENV).is_some();
    let mut logger = env_logger::Builder::from_env(Env::default().default_filter_or(LOG));
    logger.target(Target::Pipe(Box::new(lines::Log::new(asked)))).init();
    interrupt::take_ends();
    interrupt::outlive_full_files();
    interrupt::wait_for_children();
    if std::env::args_os().len() == 1 {
        if start::is_double_click() {
            return ended(start::run(start::Args::default()));
        }
        // Who asks for nothing has made no mistake. Where the text can't go, there is nobody to tell.
        let _ = Cli::<Tool>::command().print_help();
        return ExitCode::SUCCESS;
    }
    let code = match Cli::<Any>::parse().tool {
        Any::Tool(tool) => run(tool),
        Any::ShellFiles(args) => ended(shell_files::run(args, Cli::<Tool>::command())),
        Any::KeepProgram => ended(program::keep()),
        Any::WithInput { tool } => {
            interrupt::end_with_input();
            run(tool)
        }
    };
    lines::flush();
    code
}

fn run(tool: Tool) -> ExitCode {
    ended(match tool {
        Tool::Find(args) => find::run(args),
        Tool::Panel(args) => panel::run(args),
        Tool::Record(args) => recording::record::run(args),
        Tool::Info(args) => recording::info::run(args),
        Tool::Csv(args) => recording::csv::run(args),
        Tool::Plot(args) => recording::plot::run(args),
        Tool::Compare(args) => return compare(args),
        Tool::Replay(args) => recording::replay::run(args),
        Tool::Selftest(args) => selftest::run(args),
        Tool::Camera(args) => camera::run(args),
        Tool::Bridge(args) => bridge::run(args),
        Tool::Simulate(args) => simulate::run(args),
        Tool::Stop(args) => stop::run(args),
        Tool::Watch(args) => return watch(args),
        Tool::Classroom(args) => classroom::run(&args),
        Tool::Check(args) => return check(&args),
        Tool::Lesson(args) => lesson::run(&args),
        Tool::Start(args) => start::run(args),
    })
}

/// Has the exit statuses of `cmp` and `diff`.
fn compare(args: recording::compare::Args) -> ExitCode {
    match recording::compare::run(args) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            ended(Err(error));
            ExitCode::from(2)
        }
    }
}

/// Has the exit status of the program that it has started, if it has.
fn watch(args: watch::Args) -> ExitCode {
    watch::run(args).unwrap_or_else(|error| ended(Err(error)))
}

/// Has the exit status 2 for words that can't be understood.
fn check(args: &check::Args) -> ExitCode {
    check::run(args).unwrap_or_else(|error| ended(Err(error)))
}

/// Tells an error.
fn ended(done: anyhow::Result<()>) -> ExitCode {
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            lines::print(&print::sentence(&error));
            ExitCode::FAILURE
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A longer line would be broken, and its last word stand alone.
    #[test]
    fn what_follows_the_options_of_a_help_has_lines_that_fit() {
        let command = Cli::<Tool>::command();
        for tool in command.get_subcommands() {
            let after = tool.get_after_help().map(ToString::to_string).unwrap_or_default();
            for line in after.lines() {
                assert!(line.chars().count() <= 100, "{}: {line:?}", tool.get_name());
            }
        }
    }
}
