//! `txt selftest`: whether a controller does what is known of the maker's firmware.
//!
//! It speaks the protocol itself, because the library is careful to avoid most of what is tried here. `line.rs` is a
//! connection, `session.rs` online mode, `i2c.rs` its I2C connection; `bench.rs` has the controller and leaves it
//! stopped; `checks/` is the table; `outcome.rs` the words and the JSON.

mod bench;
mod checks;
mod i2c;
mod line;
mod outcome;
mod session;

use std::env;
use std::fs::File;
use std::io::{self, IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{anyhow, bail, ensure, Context};
use jiff::Zoned;
use serde_json::{json, Value};

use self::bench::Bench;
use self::checks::{Check, Needs};
use self::outcome::{summary, Outcome, Row, Trouble};
use crate::guardian::Guardian;
use crate::interrupt::{self, Driving};
use crate::print;
use crate::program::ADDRESS;
use crate::watch::ports;
use crate::zone;

const AFTER: &str = "\
Each line is a statement about the controller: \"as the firmware does\", \"differs\", or \"not tried\".
The firmware is the maker's 4.7.0, as measured under emulation. It takes about a minute, plays some
short sounds, and switches no output on. A program that runs on the controller is stopped.

With --motors M1 turns for half a minute. Plug in M1, with its encoder at C1, so that it turns
freely. A button at I1 stops it, so it is good to have one. --crash also starts the camera twice.

The results are also in a file, to attach to an issue. Ctrl-C ends it with the motors off. When it
is killed while M1 may turn, another process switches the outputs off. The exit status is 1 when it
could not run to its end; what differs is no error.

Example: txt selftest 192.168.7.2";

/// What must be plugged in.
const QUESTION: &str = "\
M1 is going to turn at full speed, for about half a minute, with pauses.
Plug in: M1, with its encoder at C1; nothing else, except a button at I1, which stops it.
Go on? [y/N] ";

/// Compare a real controller with what is known of the maker's firmware
#[derive(clap::Args)]
#[command(after_help = AFTER)]
pub(crate) struct Args {
    /// The controller: an address or a name, with a port if it is not 65000, or auto
    host: String,
    /// Also let M1 turn: it needs its encoder at C1, and nothing else plugged in
    #[arg(long)]
    motors: bool,
    /// With --motors: do not ask whether all is plugged in
    #[arg(long, requires = "motors")]
    yes: bool,
    /// Also end the firmware's program, which comes back after 2 seconds
    #[arg(long)]
    crash: bool,
    /// Print JSON, for scripts
    #[arg(long)]
    json: bool,
    /// File of the results [default: selftest-DATE-TIME.json]
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Replace a file that is there already
    #[arg(long, requires = "output")]
    force: bool,
}

pub(crate) fn run(args: Args) -> anyhow::Result<()> {
    // The address that `txt watch` gives to a program.
    let is_watched = env::var(ADDRESS).is_ok_and(|address| address == args.host);
    ensure!(!is_watched, "behind txt watch, whose address this is by {ADDRESS}, it would measure what txt watch does");
    let address = ports::controller(&args.host)?;
    if args.motors && !args.yes {
        ask()?;
    }
    let begun = zone::now();
    let path = args.output.clone().unwrap_or_else(|| {
        PathBuf::from(format!("selftest-{}.json", begun.strftime("%Y%m%d-%H%M%S")))
    });
    // Before a minute is spent.
    let file = create(&path, args.force).with_context(|| path.display().to_string())?;
    let interrupted = interrupt::receiver_for_driving()?;
    let driving = Driving::begin();
    let bench = Bench::new(address, interrupted).map_err(|trouble| {
        // It has nothing yet.
        let _ = std::fs::remove_file(&path);
        not_there(trouble, &args.host)
    })?;
    // Only a motor goes on when this program is killed.
    let guardian = args.motors.then(|| Guardian::start(&address.to_string())).transpose()?;
    let mut run = Run { rows: Vec::new(), bench, args, begin: Instant::now(), given_up: None };
    let ended = run.head().and_then(|()| run.all());
    let is_stopped = run.bench.leave();
    if let Some(guardian) = guardian.filter(|_| is_stopped) {
        guardian.dismiss();
    }
    drop(driving);
    let result = run.json(&begun, ended.as_ref().err());
    write(file, &result).with_context(|| path.display().to_string())?;
    run.foot(&path, &result)?;
    ended?;
    ensure!(is_stopped, "the controller did not answer in the end, so it may still be online");
    Ok(())
}

/// Prints a line between two checks, where no motor turns. A pipe that nobody reads ends the test, and the controller
/// does not stay online for it.
fn show(line: String) -> anyhow::Result<()> {
    interrupt::in_time(move || print::line(line)).context("nobody reads the output")?
}

fn ask() -> anyhow::Result<()> {
    ensure!(io::stdin().is_terminal(), "--motors asks a question; --yes answers it in a script");
    eprint!("{QUESTION}");
    let mut answer = String::new();
    io::stdin().read_line(&mut answer).context("can't read the answer")?;
    ensure!(matches!(answer.trim(), "y" | "Y" | "yes"), "nothing was done");
    Ok(())
}

fn create(path: &Path, force: bool) -> io::Result<File> {
    if force {
        return File::create(path);
    }
    File::create_new(path).map_err(|error| match error.kind() {
        io::ErrorKind::AlreadyExists => {
            io::Error::other("it is there already; --force replaces it")
        }
        _ => error,
    })
}

fn write(mut file: File, result: &Value) -> anyhow::Result<()> {
    file.write_all(print::json(result)?.as_bytes())?;
    file.write_all(b"\n")?;
    Ok(())
}

/// Why it did not begin.
fn not_there(trouble: Trouble, host: &str) -> anyhow::Error {
    match trouble {
        Trouble::Lost(what) => anyhow!(
            "{host}: {what}; is it on, at this address, and is no other program online on it?"
        ),
        Trouble::Another(other) => anyhow!(another(&other)),
        Trouble::Interrupted | Trouble::Button | Trouble::NotTried(_) => anyhow!(INTERRUPTED),
    }
}

fn another(controller: &str) -> String {
    format!("another controller has this address now: {}", print::clean(controller))
}

const INTERRUPTED: &str = "interrupted";

struct Run {
    rows: Vec<Row>,
    bench: Bench,
    args: Args,
    begin: Instant,
    /// Why nothing more is tried, or no motors.
    given_up: Option<&'static str>,
}

impl Run {
    fn head(&self) -> anyhow::Result<()> {
        if self.args.json {
            return Ok(());
        }
        let Bench { name, firmware, .. } = &self.bench;
        show(format!("{}, firmware {firmware}\n", print::clean(name)))
    }

    /// Runs each check. The error is what has ended it early.
    fn all(&mut self) -> anyhow::Result<()> {
        for check in checks::all() {
            if let Some(option) = self.option_without(check) {
                self.rows.push(Row::new(check, Outcome::not_tried(format!("it needs {option}"))));
                continue;
            }
            let row = Row::new(check, self.run_one(check)?);
            if !self.args.json {
                show(row.line())?;
            }
            self.rows.push(row);
        }
        ensure!(self.given_up != Some(GONE), GONE);
        Ok(())
    }

    fn run_one(&mut self, check: &Check) -> anyhow::Result<Outcome> {
        if let Some(why) = self.given_up {
            if why == GONE || check.needs == Needs::Motors {
                return Ok(Outcome::not_tried(why));
            }
        }
        Ok(match (check.run)(&mut self.bench) {
            Ok(outcome) => outcome,
            Err(Trouble::Interrupted) => bail!(INTERRUPTED),
            Err(Trouble::Another(other)) => bail!(another(&other)),
            Err(Trouble::NotTried(why)) => Outcome::not_tried(why),
            Err(Trouble::Button) => {
                self.given_up = Some(BUTTON);
                // What it could not stop is stopped before the next session.
                let _ = self.bench.end();
                Outcome::not_tried(BUTTON)
            }
            Err(Trouble::Lost(what)) => {
                self.come_back()?;
                match self.given_up {
                    Some(GONE) => Outcome::not_tried(format!("{what}; {GONE}")),
                    _ => Outcome::differs(what),
                }
            }
        })
    }

    /// The option without which a check does not run.
    fn option_without(&self, check: &Check) -> Option<&'static str> {
        match check.needs {
            Needs::Motors if !self.args.motors => Some("--motors"),
            Needs::Crash if !self.args.crash => Some("--crash"),
            _ => None,
        }
    }

    /// After a lost connection: gives up when the controller does not answer any more.
    fn come_back(&mut self) -> anyhow::Result<()> {
        match self.bench.comes_back() {
            Ok(Some(_)) => {}
            Err(Trouble::Interrupted) => bail!(INTERRUPTED),
            Err(Trouble::Another(other)) => bail!(another(&other)),
            _ => self.given_up = Some(GONE),
        }
        Ok(())
    }

    fn json(&self, begun: &Zoned, error: Option<&anyhow::Error>) -> Value {
        json!({
            "name": self.bench.name,
            "firmware": self.bench.firmware.to_string(),
            "compared_with": "the maker's firmware 4.7.0 under emulation",
            "begun": begun.strftime("%Y-%m-%d %H:%M:%S%:z").to_string(),
            "seconds": (self.begin.elapsed().as_secs_f64() * 10.0).round() / 10.0,
            "motors": self.args.motors,
            "ended_early": error.map(ToString::to_string),
            "txt": env!("CARGO_PKG_VERSION"),
            "system": std::env::consts::OS,
            "checks": self.rows.iter().map(Row::json).collect::<Vec<_>>(),
        })
    }

    fn foot(&self, path: &Path, result: &Value) -> anyhow::Result<()> {
        if self.args.json {
            return show(print::json(result)?);
        }
        let more: String = ["--motors", "--crash"]
            .into_iter()
            .filter_map(|option| {
                let without = |check: &&Check| self.option_without(check) == Some(option);
                let count = checks::all().filter(without).count();
                (count > 0).then(|| format!("{option} would try {count} more\n"))
            })
            .collect();
        show(format!(
            "\n{}, in {:.0} s\n{more}{} has it all, to attach to an issue",
            summary(&self.rows),
            self.begin.elapsed().as_secs_f64(),
            path.display()
        ))
    }
}

const GONE: &str = "the controller does not answer any more, or another program is online on it";
const BUTTON: &str = "the button at I1 is pressed";
