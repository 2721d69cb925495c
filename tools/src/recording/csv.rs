//! `txt csv`.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use anyhow::Context;
use ft_transfer_area_recorder::{Column, Recorded, Recording};

use super::survey::{progress, Survey};

const AFTER_HELP: &str = "\
One line for each cycle: the time in seconds since the beginning, the number of the cycle, and the
inputs, counters and motors, E1.I1 for extension 1. Motors are -512 to 512, negative for backwards.

Example: txt csv run.mcap I1 M1 E1.C1 -o run.csv";

/// Write a recording as CSV
#[derive(clap::Args)]
#[command(after_help = AFTER_HELP)]
pub(crate) struct Args {
    /// The recording
    file: PathBuf,
    /// The columns: I1 to I8, C1 to C4, M1 to M4, O1 to O8; without any, all but O1 to O8
    columns: Vec<Column>,
    /// The file; without it, the terminal
    #[arg(short, long)]
    output: Option<PathBuf>,
}

pub(crate) fn run(args: Args) -> anyhow::Result<()> {
    let columns = if args.columns.is_empty() {
        Column::of_areas(1 + Survey::of(&args.file)?.extensions)
    } else {
        args.columns
    };
    let recording = Recording::open(&args.file)?;
    match &args.output {
        Some(path) => {
            let failed = || format!("can't write {}", path.display());
            let file = File::create(path).with_context(failed)?;
            write(recording, &args.file, &columns, BufWriter::new(file)).with_context(failed)
        }
        None => match write(recording, &args.file, &columns, io::stdout().lock()) {
            // The next program in a pipe has seen enough.
            Err(error) if is_broken_pipe(&error) => Ok(()),
            done => done,
        },
    }
}

fn is_broken_pipe(error: &anyhow::Error) -> bool {
    error
        .chain()
        .filter_map(|cause| cause.downcast_ref::<io::Error>())
        .any(|error| error.kind() == io::ErrorKind::BrokenPipe)
}

fn write(
    mut recording: Recording,
    path: &Path,
    columns: &[Column],
    out: impl Write,
) -> anyhow::Result<()> {
    let mut table = csv::Writer::from_writer(out);
    let names = columns.iter().map(ToString::to_string);
    table.write_record(["time", "cycle"].map(str::to_owned).into_iter().chain(names))?;
    let progress = progress("writes");
    for entry in recording.by_ref() {
        let entry = entry?;
        let Recorded::Cycle(cycle) = entry.what else { continue };
        progress.inc(1);
        let head = [format!("{:.6}", entry.at.as_secs_f64()), cycle.number.to_string()];
        // An area that the handler did not have is empty.
        let text = |value: Option<i32>| value.map_or(String::new(), |value| value.to_string());
        let values = columns.iter().map(|column| text(column.value(&cycle.areas)));
        table.write_record(head.into_iter().chain(values))?;
    }
    progress.finish_and_clear();
    table.flush()?;
    if recording.is_cut_off() {
        eprintln!("{} is cut off; this is what was written before", path.display());
    }
    Ok(())
}
