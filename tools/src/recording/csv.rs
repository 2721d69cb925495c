//! `txt csv`.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::Context;
use ft_transfer_area::FishX1Transfer;
use ft_transfer_area_recorder::{Column, Recorded, Recording, UNKNOWN_UNIT};

use super::answering::Change;
use super::clock::Clock;
use super::ensure_is_another;
use super::in_parts::ensure_is_one;
use super::part::Part;
use super::survey::{progress, Survey};
use super::whole::say_what_is_missing;
use crate::names::{self, Names};
use crate::print;

const AFTER_HELP: &str = "\
One line for each cycle: the time in seconds since the beginning, the number of the cycle, and the
inputs, counters and motors, E1.I1 for extension 1. Motors are -512 to 512, negative for backwards.
Where M1 is configured as two outputs, there are O1 and O2, too, and M1 is O1 less O2. While an
extension is not connected, it has no values. The last column is date and time of day in this
computer's time zone, with its offset from UTC. With --names, the first line has I1 (gate) in place
of I1. A part of it is given by seconds or by times of day, as in --from 03:12 --to 03:14:30.

Example: txt csv run.mcap I1 M1 E1.C1 -o run.csv";

/// Write a recording as CSV
#[derive(clap::Args)]
#[command(after_help = AFTER_HELP)]
pub(crate) struct Args {
    /// The recording
    file: PathBuf,
    /// The columns: I1 to I8, C1 to C4, M1 to M4, O1 to O8; without any, all, but
    /// of O1 to O8 only those that are configured
    columns: Vec<Column>,
    #[command(flatten)]
    names: names::File,
    #[command(flatten)]
    part: Part,
    /// The file; without it, the terminal
    #[arg(short, long)]
    output: Option<PathBuf>,
}

pub(crate) fn run(args: Args) -> anyhow::Result<()> {
    ensure_is_one(&args.file)?;
    args.output.iter().try_for_each(|output| ensure_is_another(output, &args.file))?;
    let names = args.names.read()?;
    let mut recording = Recording::open(&args.file)?;
    let mut columns = args.columns;
    if columns.is_empty() {
        columns = Survey::of(&mut recording, &args.file)?.columns();
        recording.rewind()?;
    }
    let part = args.part.of(&mut recording, &args.file)?;
    let table = Table { columns, names, part, file: args.file.clone() };
    let done = match &args.output {
        Some(path) => {
            let file = File::create(path).map_err(Failure::Write);
            file.and_then(|file| table.write(recording, BufWriter::new(file)))
        }
        None => table.write(recording, io::stdout().lock()),
    };
    match (done, &args.output) {
        (Ok(recording), _) => {
            say_what_is_missing(&recording, &args.file, "; this is what was written before");
            Ok(())
        }
        // The next program in a pipe has seen enough.
        (Err(Failure::Write(error)), None) if error.kind() == io::ErrorKind::BrokenPipe => Ok(()),
        (Err(Failure::Write(error)), None) => Err(error).context("can't write the output"),
        (Err(Failure::Write(error)), Some(path)) => {
            Err(error).with_context(|| format!("can't write {}", path.display()))
        }
        (Err(Failure::Read(error)), _) => Err(error.into()),
    }
}

/// On which side the table has failed.
enum Failure {
    Read(ft_transfer_area_recorder::Error),
    Write(io::Error),
}

impl From<csv::Error> for Failure {
    fn from(error: csv::Error) -> Self {
        Self::Write(match error.into_kind() {
            csv::ErrorKind::Io(error) => error,
            other => io::Error::other(format!("{other:?}")),
        })
    }
}

/// Notes that an input does not measure the same in all lines.
#[derive(Default)]
struct Units {
    /// Of each column, in the last line that has a value.
    now: Vec<Option<&'static str>>,
    /// The first change.
    first: Option<String>,
}

impl Units {
    fn take(&mut self, columns: &[Column], areas: &[FishX1Transfer], at: Duration) {
        self.now.resize(columns.len(), None);
        for (column, now) in columns.iter().zip(&mut self.now) {
            if column.input().is_none() || column.value(areas).is_none() {
                continue;
            }
            let unit = match column.unit(areas) {
                UNKNOWN_UNIT => continue,
                "" => "0 or 1",
                unit => unit,
            };
            let before = now.replace(unit).filter(|before| *before != unit);
            if let Some(before) = before {
                let at = at.as_secs_f64();
                let change =
                    || format!("from {at:.2} s on {column} has {unit} in place of {before}");
                self.first.get_or_insert_with(change);
            }
        }
    }

    /// Says it on stderr.
    fn say(&self, file: &Path) {
        if let Some(first) = &self.first {
            eprintln!("{}", print::clean(&format!("{}: {first}", file.display())));
        }
    }
}

/// What is written.
struct Table {
    columns: Vec<Column>,
    names: Names,
    part: Range<Duration>,
    /// For sentences.
    file: PathBuf,
}

impl Table {
    /// Writes the table; returns the recording, which was read to the end of what is written.
    fn write(&self, mut recording: Recording, out: impl Write) -> Result<Recording, Failure> {
        let mut table = csv::Writer::from_writer(out);
        let heads = self.columns.iter().map(|column| self.names.beside(column));
        let heads = ["time", "cycle"].map(str::to_owned).into_iter().chain(heads);
        table.write_record(heads.chain(["local_time".to_owned()]))?;
        let clock = Clock::of(recording.started());
        let progress = progress("writes");
        let (mut change, mut units) = (Change::from(self.part.start), Units::default());
        for entry in recording.by_ref() {
            let entry = entry.map_err(Failure::Read)?;
            let cycle = match entry.what {
                Recorded::Cycle(cycle) => cycle,
                Recorded::Transfer(transfer) if entry.at <= self.part.end => {
                    change.take(&transfer, entry.at);
                    continue;
                }
                _ => continue,
            };
            if entry.at > self.part.end {
                break;
            }
            if entry.at < self.part.start {
                continue;
            }
            progress.inc(1);
            units.take(&self.columns, &cycle.areas, entry.at);
            let head = [format!("{:.6}", entry.at.as_secs_f64()), cycle.number.to_string()];
            // An area that the handler did not have, or of an extension that was not there, is empty.
            let text = |value: Option<i32>| value.map_or(String::new(), |value| value.to_string());
            let values = self.columns.iter().map(|column| text(column.value(&cycle.areas)));
            let local_time = clock.precise(entry.at);
            table.write_record(head.into_iter().chain(values).chain([local_time]))?;
        }
        progress.finish_and_clear();
        change.say(&self.file);
        units.say(&self.file);
        table.flush().map_err(Failure::Write)?;
        Ok(recording)
    }
}
