//! `txt compare`: where two recordings differ first.

mod changes;
mod side;

use std::fmt::Write;
use std::path::PathBuf;
use std::time::Duration;

use anyhow::bail;
use ft_transfer_area::transfer_area::{MAX_AREAS, MAX_EXTENSIONS};
use ft_transfer_area_recorder::{value_names, Column, Cycle, UNKNOWN_UNIT};

use super::ensure_is_another;
use super::in_parts::ensure_is_one;
use super::plot::{self, second_over_first};
use super::survey::progress;
use crate::names::{self, Names};
use crate::print;
use changes::Changes;
use side::{Side, Step};

/// How many values that differ are listed.
const LISTED: usize = 20;

const AFTER_HELP: &str = "\
Compares cycle by cycle what was sent, what came in and the configurations, or only what is named.
Times are not compared, and ids of commands only by how often they have changed. With --plot, the
values of the second recording are drawn as thin lines over the wide ones of the first.

The exit status is 0 when all cycles are the same, 1 when one differs, and 2 after an error.

Example: txt compare yesterday.mcap today.mcap I1 C1 M1 --plot both.svg";

/// Find the first cycle in which two recordings differ
#[derive(clap::Args)]
#[command(after_help = AFTER_HELP)]
pub(crate) struct Args {
    /// The first recording
    first: PathBuf,
    /// The second recording
    second: PathBuf,
    /// What to compare: I1 to I8, C1 to C4, M1 to M4, O1 to O8; without any, everything
    terminals: Vec<Column>,
    #[command(flatten)]
    names: names::File,
    /// Draw both over each other
    #[arg(long, value_name = "FILE.svg", value_parser = plot::picture_name)]
    plot: Option<PathBuf>,
}

/// Returns whether they are the same.
pub(crate) fn run(args: Args) -> anyhow::Result<bool> {
    for file in [&args.first, &args.second] {
        ensure_is_one(file)?;
        args.plot.iter().try_for_each(|output| ensure_is_another(output, file))?;
    }
    let names = args.names.read()?;
    let mut sides = [Side::open(&args.first)?, Side::open(&args.second)?];
    let found = compare(&mut sides, &args.terminals, &names)?;
    for side in &sides {
        side.say_what_is_missing();
    }
    print::line(found.text(&sides).trim_end())?;
    if let Some(output) = &args.plot {
        let begins = sides.each_ref().map(Side::begin);
        let mark = found.at(&sides);
        let [first, second] = &mut sides;
        let both = [first.again()?, second.again()?];
        second_over_first(both, begins, args.terminals, &names, mark, output)?;
        print::line(output.display())?;
    }
    Ok(matches!(found.what, What::Same))
}

/// What was found, after this number of cycles that are the same.
struct Found {
    same: u64,
    /// Cycles that only one of the two has, because the other has lost them or begins later.
    left_out: u64,
    what: What,
}

enum What {
    Same,
    /// Values with their names.
    Differs {
        number: u64,
        at: [Duration; 2],
        values: Vec<(String, [String; 2])>,
    },
    /// Only this one has a cycle here.
    GoesOn {
        side: usize,
        number: u64,
        at: Duration,
    },
}

fn compare(sides: &mut [Side; 2], terminals: &[Column], names: &Names) -> anyhow::Result<Found> {
    let mut found = Found { same: 0, left_out: 0, what: What::Same };
    let mut changes = [Changes::default(), Changes::default()];
    let progress = progress("compares");
    loop {
        let [first, second] = sides;
        let which = match (first.peek()?, second.peek()?) {
            (None, None) => break,
            (Some(first), Some(second)) if first.key() == second.key() => None,
            (Some(first), Some(second)) => Some(usize::from(first.key() > second.key())),
            (first, _) => Some(usize::from(first.is_none())),
        };
        if let Some(side) = which {
            let lost = sides[1 - side].has_lost()?;
            let Some(step) = sides[side].take()? else { break };
            if !lost {
                found.what = What::GoesOn { side, number: step.cycle.number, at: step.at };
                break;
            }
            found.left_out += 1;
            // What has changed meanwhile is not known.
            changes.iter_mut().for_each(Changes::begin_again);
            continue;
        }
        let (Some(first), Some(second)) = (sides[0].take()?, sides[1].take()?) else { break };
        progress.inc(1);
        if found.same == 0 {
            // An extension may come later.
            let has = |step: &Step, column: &Column| column.area() < step.cycle.areas.len();
            let missing = terminals.iter().find(|one| !has(&first, one) && !has(&second, one));
            if let Some(terminal) = missing {
                bail!(
                    "{terminal} is in none of the two recordings: their programs have no area for it"
                );
            }
        }
        let values = differing([&first, &second], &mut changes, terminals, names);
        if !values.is_empty() {
            found.what =
                What::Differs { number: first.cycle.number, at: [first.at, second.at], values };
            break;
        }
        found.same += 1;
    }
    progress.finish_and_clear();
    if found.same == 0 && matches!(found.what, What::Same) {
        bail!("the two recordings have no cycle in common");
    }
    Ok(found)
}

/// The values that differ in two cycles, with their names.
fn differing(
    steps: [&Step; 2],
    changes: &mut [Changes; 2],
    terminals: &[Column],
    names: &Names,
) -> Vec<(String, [String; 2])> {
    let cycles = steps.map(|step| &step.cycle);
    if !terminals.is_empty() {
        let values = |column: &Column| cycles.map(|cycle| with_unit(column, cycle));
        let texts = terminals.iter().map(|one| (names.beside(one), values(one)));
        return texts.filter(|(_, [first, second])| first != second).collect();
    }
    let mut found = Vec::new();
    let mut note = |name: String, values: [String; 2]| {
        if values[0] != values[1] {
            found.push((name, values));
        }
    };
    note("connection".to_owned(), cycles.map(connection));
    for extension in 0..MAX_EXTENSIONS {
        let alive = |cycle: &Cycle| cycle.areas[0].state.io_slave_alive[extension] != 0;
        if cycles.map(alive) != [false; 2] {
            let there = |there| if there { "there" } else { "not there" }.to_owned();
            note(format!("E{}", extension + 1), cycles.map(alive).map(there));
        }
    }
    for area in 0..MAX_AREAS {
        let [first, second] = changes;
        let [first, second] = [(first, cycles[0]), (second, cycles[1])]
            .map(|(changes, cycle)| changes.values(area, cycle));
        if first == second {
            continue;
        }
        let controller = if area == 0 { "TXT".to_owned() } else { format!("E{area}") };
        for (place, (part, name)) in value_names().enumerate() {
            let values = [&first, &second].map(|values| values.as_ref().map(|all| all[place]));
            let texts = values.map(|value| match value {
                Some(changes) if changes::is_id(name) => changed(changes),
                value => text(value),
            });
            let called = names.of(area, name).map(|called| format!(" ({called})"));
            note(format!("/{controller}/{part} {name}{}", called.unwrap_or_default()), texts);
        }
    }
    found
}

fn connection(cycle: &Cycle) -> String {
    if cycle.first { "begins" } else { "goes on" }.to_owned()
}

/// How often an id has changed.
fn changed(times: i32) -> String {
    match times {
        0 => "unchanged".to_owned(),
        1 => "changed once".to_owned(),
        _ => format!("changed {times} times"),
    }
}

/// A number of an input says nothing without what it measures.
fn with_unit(column: &Column, cycle: &Cycle) -> String {
    let value = column.value(&cycle.areas);
    let unit = column.unit(&cycle.areas);
    match column.input() {
        Some(_) if value.is_some() && !["", UNKNOWN_UNIT].contains(&unit) => {
            format!("{} {unit}", text(value))
        }
        _ => text(value),
    }
}

fn text(value: Option<i32>) -> String {
    value.map_or_else(|| "no area".to_owned(), |value| value.to_string())
}

impl Found {
    /// When the first difference is, in seconds of the recording that has it.
    fn at(&self, sides: &[Side; 2]) -> Option<f64> {
        let (at, side) = match &self.what {
            What::Same => return None,
            What::Differs { at, .. } => (at[0], 0),
            What::GoesOn { side, at, .. } => (*at, *side),
        };
        Some(at.saturating_sub(sides[side].begin()).as_secs_f64())
    }

    fn text(&self, sides: &[Side; 2]) -> String {
        let names = sides.each_ref().map(|side| side.path.display().to_string());
        let since =
            |side: usize, at: Duration| at.saturating_sub(sides[side].begin()).as_secs_f64();
        let mut text = match &self.what {
            What::Same => format!("All {} cycles are the same.\n", self.same),
            What::GoesOn { side, number, at } => format!(
                "{} cycles are the same. Then only {} has a cycle {number}, {:.2} s after its first one.\n",
                self.same,
                names[*side],
                since(*side, *at)
            ),
            What::Differs { number, at, values } => {
                let mut text = format!(
                    "{} cycles are the same. Cycle {number} differs, {:.2} s after the first one in {} and {:.2} s \
                     in {}:\n",
                    self.same,
                    since(0, at[0]),
                    names[0],
                    since(1, at[1]),
                    names[1]
                );
                text += &table(values, &names);
                text
            }
        };
        if self.left_out > 0 {
            // Writing to a text does not fail.
            let _ = writeln!(
                text,
                "{} cycles are left out: they are not in one of the two.",
                self.left_out
            );
        }
        text
    }
}

/// The values as lines with aligned columns.
fn table(values: &[(String, [String; 2])], names: &[String; 2]) -> String {
    let listed = &values[..values.len().min(LISTED)];
    let widest = |texts: &mut dyn Iterator<Item = &String>| {
        texts.map(|text| text.chars().count()).max().unwrap_or(0)
    };
    let name = widest(&mut listed.iter().map(|(name, _)| name));
    let first = widest(&mut listed.iter().map(|(_, [first, _])| first).chain([&names[0]]));
    let mut text = format!("  {:name$}  {:first$}  {}\n", "", names[0], names[1]);
    for (value, [one, other]) in listed {
        text += &format!("  {value:name$}  {one:first$}  {other}\n");
    }
    if values.len() > LISTED {
        text += &format!("  and {} more values\n", values.len() - LISTED);
    }
    text
}
