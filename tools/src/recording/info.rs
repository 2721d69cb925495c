//! `txt info`.

use std::path::PathBuf;
use std::time::{Duration, SystemTime};

use super::survey::Survey;
use crate::print;

/// How many errors are listed.
const LISTED: usize = 10;

const AFTER_HELP: &str = "\
The controller, the length, the cycles and their times, what was lost, gaps and errors. A file that
is cut off is read up to there; damaged parts are left out, and a line says so.

Example: txt info run.mcap";

/// Show what is in a recording
#[derive(clap::Args)]
#[command(after_help = AFTER_HELP)]
pub(crate) struct Args {
    /// The recording
    file: PathBuf,
    /// As JSON, for scripts
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(args: Args) -> anyhow::Result<()> {
    let survey = Survey::of(&args.file)?;
    if args.json {
        print::line(print::json(&survey)?)
    } else {
        print::line(text(&survey).trim_end())
    }
}

fn text(survey: &Survey) -> String {
    let mut lines = Vec::new();
    let mut line =
        |name: &str, value: String| lines.push(format!("{name:12} {}\n", print::clean(&value)));
    let at = match &*survey.address {
        "" => String::new(),
        address => format!(" at {address}"),
    };
    let [name, firmware] = survey.controller();
    line("controller", format!("{name}{at}, firmware {firmware}"));
    line("extensions", survey.extensions.to_string());
    line("started", started(survey.started));
    line("length", format!("{:.2} s, {} kB", survey.seconds, survey.bytes.div_ceil(1000)));
    line("transfers", format!("{}, with {} gaps", survey.transfers, survey.gaps));
    line("cycles", format!("{}, {} entries lost by a slow disk", survey.cycles, survey.lost));
    let Survey { shortest_cycle_ms, mean_cycle_ms, longest_cycle_ms, .. } = survey;
    line(
        "cycle time",
        format!("{shortest_cycle_ms:.2} to {longest_cycle_ms:.2} ms, mean {mean_cycle_ms:.2} ms"),
    );
    let events = survey.events.iter().map(|(kind, count)| format!("{count} {kind}"));
    let events: Vec<String> = events.collect();
    line("events", if events.is_empty() { "none".to_owned() } else { events.join(", ") });
    line("pictures", survey.pictures.to_string());
    for (at, error) in survey.errors.iter().take(LISTED) {
        line("error", format!("{at:.2} s: {error:#}"));
    }
    if survey.errors.len() > LISTED {
        line("", format!("and {} more errors", survey.errors.len() - LISTED));
    }
    if let Some(damage) = &survey.damage {
        line("note", damage.clone());
    }
    if survey.is_cut_off {
        line("note", "the file is cut off; this is what was written before".to_owned());
    }
    lines.concat()
}

/// The time in UTC.
fn started(seconds: f64) -> String {
    let since_1970 = Duration::try_from_secs_f64(seconds).unwrap_or_default();
    let ago = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH + since_1970);
    let (year, month, day) = date((since_1970.as_secs() / 86_400) as i64);
    let of_day = since_1970.as_secs() % 86_400;
    let (hour, minute, second) = (of_day / 3600, of_day / 60 % 60, of_day % 60);
    let time = format!("{year}-{month:02}-{day:02} {hour:02}:{minute:02}:{second:02} UTC");
    match ago {
        Ok(ago) if ago.as_secs() < 86_400 => format!("{time}, {} minutes ago", ago.as_secs() / 60),
        _ => time,
    }
}

/// The date of a day since 1970, in the calendar of 400 years with 146097 days.
fn date(days: i64) -> (i64, i64, i64) {
    // Years begin in March, so that the leap day is the last of its year.
    let days = days + 719_468;
    let (era, of_era) = (days.div_euclid(146_097), days.rem_euclid(146_097));
    let year_of_era = (of_era - of_era / 1_460 + of_era / 36_524 - of_era / 146_096) / 365;
    let of_year = of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let month = (5 * of_year + 2) / 153;
    let day = of_year - (153 * month + 2) / 5 + 1;
    let month = if month < 10 { month + 3 } else { month - 9 };
    (400 * era + year_of_era + i64::from(month <= 2), month, day)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates_have_leap_years() {
        for (days, expected) in [
            (0, (1970, 1, 1)),
            (59, (1970, 3, 1)),
            (11_016, (2000, 2, 29)),
            (11_017, (2000, 3, 1)),
            (19_782, (2024, 2, 29)),
            (20_453, (2025, 12, 31)),
            (47_540, (2100, 2, 28)),
            (47_541, (2100, 3, 1)),
        ] {
            assert_eq!(date(days), expected, "{days}");
        }
    }
}
