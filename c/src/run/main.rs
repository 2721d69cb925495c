//! Compiles and runs C and C++ programs that were written for the ROBO TX or the TXT.
//!
//! ```text
//! tx_run StopGo.c                             # on a simulated TXT
//! tx_run StopGo.c bt.c --world slide          # with another world
//! tx_run StopGo.c --host 192.168.7.2          # on a TXT
//! tx_run main.cpp --host auto -- an argument  # a program with a main, and its arguments
//! tx_run lib main.cpp -I inc -l jsoncpp       # all sources of a folder, own headers, a library
//! ```

mod cache;
mod child;
mod compiler;
mod copies;
mod endings;
mod folder;
#[cfg(target_os = "linux")]
mod forks;
mod headers;
mod inputs;
mod key;
mod kind;
mod language;
mod libraries;
mod link;
mod missing;
mod online;
mod options;
#[cfg(target_os = "linux")]
mod own_names;
mod packages;
#[path = "../port_entries.rs"]
mod port_entries;
mod program;
mod read;
mod search;
mod show;
mod signals;
mod sources;
mod stop;
mod symbols;
mod target;
#[cfg(unix)]
mod terminal;
mod work;

use std::env;
use std::error::Error;
use std::io::{self, Write};
use std::process::{self, ExitCode};
use std::thread::JoinHandle;
use std::time::Duration;

use env_logger::Env;
use ft_transfer_area::notices;

use child::Ended;
use folder::BuildFolder;
use options::{Options, HELP};

/// What is logged unless `RUST_LOG` says more: what a program does that a TXT accepts, but no correct program does. That
/// no I2C device answers is said to the program, or by it.
const LOG: &str = "warn,ft_transfer_area_simulator::i2c=error";

/// How long the end waits for the last lines that are logged, if nobody reads them.
const LAST_LINES: Duration = Duration::from_millis(500);

/// An error that is a sentence.
type Sentence = Box<dyn Error>;

/// Says a sentence on the error output. Not while a program runs, which nobody would look at if nobody reads it.
fn say(sentence: &str) {
    signals::while_writing(|| write_sentence(sentence));
}

fn write_sentence(sentence: &str) {
    // Nobody reads it when the terminal is gone.
    let _ = io::stderr().lock().write_all(format!("tx_run: {sentence}\n").as_bytes());
}

/// Writes to the error output, without what another thread writes between it.
fn pass_on(words: &[u8]) {
    // Nobody reads it when the terminal is gone.
    let _ = signals::while_writing(|| io::stderr().lock().write_all(words));
}

fn main() -> ExitCode {
    env_logger::init_from_env(Env::default().default_filter_or(LOG));
    match Options::parse(env::args_os()) {
        Ok(None) => {
            // Nobody misses what can't be written.
            let _ = io::stdout().write_all(HELP.as_bytes());
            ExitCode::SUCCESS
        }
        Ok(Some(options)) => match run(&options) {
            // Programs on Windows have longer ones than an `ExitCode` can be.
            Ok(status) => {
                notices::flush(LAST_LINES);
                process::exit(status)
            }
            Err(error) => {
                notices::flush(LAST_LINES);
                say(&format!("{error:#}"));
                ExitCode::FAILURE
            }
        },
        Err(error) => {
            say(&format!("{error}; --help shows the usage"));
            ExitCode::from(2)
        }
    }
}

fn run(options: &Options) -> Result<i32, Sentence> {
    signals::take_up()?;
    let build = BuildFolder::new()?;
    let ended = run_in(&build, options).map_err(|error| build.with_its_fault(error))?;
    // Nothing is left to do when nobody reads the last words.
    drop(build);
    signals::while_writing(|| ended.saying.map(JoinHandle::join));
    ended.words.iter().for_each(|word| say(word));
    Ok(ended.status)
}

/// Compiles the program in this folder, and runs it.
fn run_in(build: &BuildFolder, options: &Options) -> Result<Ended, Sentence> {
    let program = program::build(options, build.path())?;
    let target = target::Target::new(options)?;
    let name = program.path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let ports = child::named_ports(options);
    let named = ports.lines().collect::<Vec<_>>().join(", ");
    let also = if named.is_empty() {
        named
    } else {
        format!("; for COM ports FT_TXT_PORTS names {named}")
    };
    say(&format!("{name}, {}, runs on {}{also}", program.kind, target.describe()));
    #[cfg(unix)]
    terminal::remember();
    let ended = child::run(&program, &target, &ports, &options.arguments, build.path());
    #[cfg(unix)]
    terminal::put_back();
    ended
}
