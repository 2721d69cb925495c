//! The command line, when the program runs for longer than in the tests.

use std::time::Duration;

use super::name::Name;

pub(crate) const USAGE: &str = "\
cargo test --release --package ft-transfer-area-system-tests --test random -- OPTIONS
  --runs N        runs N programs
  --hours H       runs programs for H hours
  --from SEED     begins with this seed instead of 1
  --until-failure ends with the first failure, and does not make it smaller
  --seed NAME     runs the program with this name 20 times, and prints it
  --shrink NAME   makes the program with this name smaller";

/// What to do.
pub(crate) enum What {
    Run { runs: u64, limit: Duration },
    Repeat(Name),
    Shrink(Name),
}

pub(crate) struct Options {
    pub(crate) what: What,
    pub(crate) from: u64,
    pub(crate) until_failure: bool,
}

impl Options {
    /// `None` without any of these options: then it is a test.
    pub(crate) fn parse(args: &[String]) -> Result<Option<Self>, String> {
        let mut what = None;
        let (mut from, mut until_failure) = (1, false);
        let mut args = args.iter();
        while let Some(arg) = args.next() {
            let mut value = || args.next().ok_or_else(|| format!("{arg} needs a value\n{USAGE}"));
            what = Some(match arg.as_str() {
                "--runs" => What::Run { runs: read(value()?)?, limit: Duration::MAX },
                "--hours" => {
                    let hours: f64 = read(value()?)?;
                    What::Run { runs: u64::MAX, limit: Duration::from_secs_f64(hours * 3600.0) }
                }
                "--seed" => What::Repeat(read(value()?)?),
                "--shrink" => What::Shrink(read(value()?)?),
                "--from" => {
                    from = read(value()?)?;
                    continue;
                }
                "--until-failure" => {
                    until_failure = true;
                    continue;
                }
                // An option of all tests.
                _ => continue,
            });
        }
        Ok(what.map(|what| Self { what, from, until_failure }))
    }
}

fn read<T: std::str::FromStr>(text: &str) -> Result<T, String> {
    text.parse().map_err(|_| format!("{text} is not a value for this option\n{USAGE}"))
}
