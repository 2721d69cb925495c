//! `txt info`.

use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use anyhow::ensure;
use serde::Serialize;

use super::in_parts;
use super::survey::{Listed, Survey};
use crate::print;

const AFTER_HELP: &str = "\
The controller, the length, the cycles and their times, and what was unusual: gaps, errors, stops by
the watchdog, blocked motors (if the program has set a limit), inputs that get over range, jumps of
counters, long cycles, late reactions, and what is not recorded. The first 10 moments of each kind
are listed; txt plot FILE --unusual NUMBER draws one. Times of day are those of this computer's time
zone. A file that is cut off is read up to there; damaged parts are left out, and a line says so.

Of a recording in parts, its name without a number means all of them, one after the other.

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
    match &in_parts::files_of(&args.file)[..] {
        [file] => show(&Survey::of_file(file)?, args.json),
        parts => show_all(parts, args.json),
    }
}

/// Shows what can be read of a recording in parts.
fn show_all(files: &[PathBuf], json: bool) -> anyhow::Result<()> {
    let mut unread = 0;
    // A long recording takes its time: each part is shown as soon as it is read, and kept no longer.
    for (number, part) in (1..).zip(files.iter().map(|file| Part::of(file))) {
        unread += usize::from(part.error.is_some());
        if json {
            let begin = if number == 1 { "[\n" } else { "" };
            let end = if number == files.len() { "\n]" } else { "," };
            print::line(format_args!("{begin}{}{end}", print::json(&part)?))?;
            continue;
        }
        let Part { file, survey, error } = part;
        let what = survey.as_ref().map(text).or(error).unwrap_or_default();
        print::line(format_args!("{:12} {file}\n{}\n", "file", what.trim_end()))?;
    }
    ensure!(unread == 0, "{unread} of {} parts can't be read", files.len());
    Ok(())
}

fn show(survey: &Survey, json: bool) -> anyhow::Result<()> {
    if json {
        print::line(print::json(survey)?)
    } else {
        print::line(text(survey).trim_end())
    }
}

/// One file of a recording in parts.
#[derive(Serialize)]
struct Part {
    file: String,
    #[serde(flatten)]
    survey: Option<Survey>,
    #[serde(skip_serializing_if = "Option::is_none")]
    error: Option<String>,
}

impl Part {
    fn of(file: &Path) -> Self {
        let (survey, error) = match Survey::of_file(file) {
            // There may be thousands of parts, and nobody sees their pictures here.
            Ok(survey) => {
                (Some(Survey { first_picture: None, bounds: Vec::new(), ..survey }), None)
            }
            Err(error) => (None, Some(format!("{error:#}"))),
        };
        Self { file: file.display().to_string(), survey, error }
    }
}

fn text(survey: &Survey) -> String {
    let mut lines = Vec::new();
    let mut line =
        |name: &str, value: String| lines.push(format!("{name:12} {}\n", print::clean(&value)));
    let [name, firmware] = survey.controller();
    line("controller", format!("{name}{}, firmware {firmware}", at(&survey.address, "")));
    let mut address = &survey.address;
    for later in &survey.later_controllers {
        let [name, firmware] = later.controller();
        let since = moment(survey, later.since);
        let at = at(&later.address, address);
        line("", format!("from {since} on {name}{at}, firmware {firmware}"));
        address = &later.address;
    }
    let more = survey.controller_changes - survey.later_controllers.len();
    if more > 0 {
        line("", format!("and {more} more changes"));
    }
    line("extensions", survey.extensions.to_string());
    line("started", started(survey));
    line("ended", survey.ended_at.clone());
    line("length", format!("{:.2} s, {} kB", survey.seconds, survey.bytes.div_ceil(1000)));
    line("transfers", format!("{}, with {}", survey.transfers, counted(survey.gaps, "gap")));
    line("cycles", format!("{}, {} entries lost", survey.cycles, survey.lost));
    let Survey { shortest_cycle_ms, mean_cycle_ms, longest_cycle_ms, .. } = survey;
    line(
        "cycle time",
        format!("{shortest_cycle_ms:.2} to {longest_cycle_ms:.2} ms, mean {mean_cycle_ms:.2} ms"),
    );
    let events = survey.events.iter().map(|(kind, count)| format!("{count} {kind}"));
    let events: Vec<String> = events.collect();
    line("events", if events.is_empty() { "none".to_owned() } else { events.join(", ") });
    line("pictures", survey.pictures.to_string());
    line("unusual", unusual(survey));
    for Listed { number, seconds, what, .. } in &survey.unusual {
        line(&format!("  {number}"), format!("{}: {what}", moment(survey, *seconds)));
    }
    if let Some(damage) = &survey.damage {
        line("note", damage.clone());
    }
    if survey.is_cut_off {
        line("note", "the file is cut off; this is what was written before".to_owned());
    }
    lines.concat()
}

/// Where a controller is, if that is known and was not said before.
fn at(address: &str, before: &str) -> String {
    if address.is_empty() || address == before {
        return String::new();
    }
    format!(" at {address}")
}

/// When it began, and how long ago it was if that is less than a day.
fn started(survey: &Survey) -> String {
    let since_1970 = Duration::try_from_secs_f64(survey.started).unwrap_or_default();
    let time = &survey.started_at;
    match SystemTime::now().duration_since(SystemTime::UNIX_EPOCH + since_1970) {
        Ok(ago) if ago.as_secs() < 86_400 => {
            let minutes = ago.as_secs() / 60;
            let ago = match minutes {
                0..120 => counted(minutes, "minute"),
                _ => counted(minutes / 60, "hour"),
            };
            format!("{time}, {ago} ago")
        }
        _ => time.clone(),
    }
}

/// How many unusual moments of each kind there are.
fn unusual(survey: &Survey) -> String {
    let counts = survey.unusual_counts.iter().map(|(kind, count)| kind.counted(*count));
    let counts: Vec<String> = counts.collect();
    match &counts[..] {
        [] => "nothing".to_owned(),
        counts => counts.join(", "),
    }
}

/// A time of day, with the seconds since the beginning.
fn moment(survey: &Survey, seconds: f64) -> String {
    let at = Duration::try_from_secs_f64(seconds).unwrap_or_default();
    format!("{} ({seconds:.2} s)", survey.clock.of_day(at))
}

/// So many of something, such as "1 gap" and "2 gaps".
fn counted(count: u64, what: &str) -> String {
    format!("{count} {what}{}", if count == 1 { "" } else { "s" })
}

#[cfg(test)]
mod tests {
    use ft_transfer_area_recorder::Transfer;

    use super::*;

    #[test]
    fn each_controller_has_its_own_address() {
        let mut survey = Survey::default();
        for (second, name, address) in
            [(0, "A", "10.0.0.1"), (5, "A", "10.0.0.1"), (6, "B", "10.0.0.2"), (7, "C", "10.0.0.2")]
        {
            let (device_name, firmware) = (name.to_owned(), "4.7.0".to_owned());
            let began =
                Transfer::Began { device_name, firmware, address: address.to_owned(), areas: 1 };
            survey.note(&began, Duration::from_secs(second));
        }
        let text = text(&survey);
        let begins: Vec<_> = text.lines().take(3).collect();
        assert_eq!(begins[0], "controller   A at 10.0.0.1, firmware 4.7.0");
        assert!(begins[1].ends_with("(6.00 s) on B at 10.0.0.2, firmware 4.7.0"), "{text}");
        assert!(begins[2].ends_with("(7.00 s) on C, firmware 4.7.0"), "{text}");
    }

    #[test]
    fn a_beginning_that_is_long_ago_is_told_in_hours() {
        let now = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap();
        let told = [30.0, 3600.0, 5.5 * 3600.0, 25.0 * 3600.0]
            .map(|ago| started(&Survey { started: now.as_secs_f64() - ago, ..Survey::default() }));
        assert_eq!(told, [", 0 minutes ago", ", 60 minutes ago", ", 5 hours ago", ""]);
    }

    #[test]
    fn one_of_something_is_not_several() {
        assert_eq!([0, 1, 2].map(|count| counted(count, "gap")), ["0 gaps", "1 gap", "2 gaps"]);
    }
}
