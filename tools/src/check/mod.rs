//! `txt check`: whether a program solves a lesson, and in words what is still wrong.

mod desk;
mod examine;
mod given;
mod heard;
mod lesson;
mod lessons;
mod moment;
mod report;
mod stage;
mod task;
mod txt;
mod words;

use std::ffi::OsString;
use std::process::ExitCode;
use std::sync::Arc;
use std::time::Duration;

use anyhow::bail;
use ft_transfer_area_simulator::world::World;
use ft_transfer_area_simulator::{SimulatedTxt, SimulatedTxtBuilder};
use serde_json::{json, Value};

pub(crate) use self::desk::Shared as Desk;
use self::lesson::Lesson;
use self::report::Report;
use self::txt::{Log, Txt};
pub(crate) use self::words::Language;
use crate::names::{self, Names};
use crate::panel::pages::{self, PageAt, Simulated};
use crate::web::browser::Opening;
use crate::{lines, print};

/// How long the verdict waits for the page that shows it.
const SEEN_LIMIT: Duration = Duration::from_secs(5);
/// The exit status for words that can't be understood.
const WRONG_WORDS: u8 = 2;

const AFTER: &str = "\
It simulates the machine of the lesson, presses its buttons, and says what the program does wrong.
PROGRAM is in any language. It gets the address of the controller as its last argument, and in the
variable TXT_ADDRESS. It is ended when the check is over, with all that it has started. Options
come before LESSON. When the computer stood still for a moment, the check begins again.

The exit status is 0 when the lesson is solved, 1 when something is wrong, 2 for a wrong option.
`txt simulate --world lesson1 --show` shows the machine of lesson 1, to try a program by hand.

Examples:
  txt check 1 target/debug/lamp
  txt check --language de --show 4 python3 end_switch.py";

/// Check a program that solves a lesson
#[derive(clap::Args)]
#[command(after_help = AFTER)]
pub(crate) struct Args {
    /// Number or name of the lesson, such as 1, lamp or lampe
    lesson: String,
    /// The program and its arguments
    #[arg(required = true, trailing_var_arg = true, allow_hyphen_values = true)]
    program: Vec<OsString>,
    /// Language of its messages [default: that of the system]
    #[arg(long, value_enum, hide_possible_values = true, value_name = "en|de")]
    language: Option<Language>,
    #[command(flatten)]
    names: names::File,
    /// Show task, machine and steps on a page in the browser
    #[arg(long)]
    show: bool,
    /// With --show: do not open the browser
    #[arg(long, requires = "show")]
    no_browser: bool,
}

pub(crate) fn run(args: &Args) -> anyhow::Result<ExitCode> {
    let language = args.language.unwrap_or_else(Language::of_system);
    let lesson = match given::lesson(&args.lesson, language) {
        Ok(lesson) => lesson,
        Err(sentence) => return Ok(refuse(&sentence)),
    };
    if let Some(sentence) = given::problem(args, language) {
        return Ok(refuse(&sentence));
    }
    let names = match args.names.read() {
        Ok(names) => names,
        Err(error) => return Ok(refuse(&print::sentence(&error))),
    };
    if let Some(sentence) = given::older_than_source(args, language) {
        lines::print(&sentence);
    }
    check(args, lesson, language, names)?;
    Ok(ExitCode::SUCCESS)
}

/// Says what is wrong with the words of the command line.
fn refuse(sentence: &str) -> ExitCode {
    lines::print(sentence);
    ExitCode::from(WRONG_WORDS)
}

/// The error says what the program does wrong.
fn check(
    args: &Args,
    lesson: &'static Lesson,
    language: Language,
    names: Names,
) -> anyhow::Result<()> {
    let world = lesson.read_world()?;
    let txt = simulated_txt(SimulatedTxt::builder(), &world)?;
    let report = Arc::new(Report::new(Some(language), names.clone()));
    let _opening = show(args, &txt, (&world, &names), lesson, &report)?;
    let title = lesson.title.text(language);
    print::line(match language {
        Language::En => format!("Lesson {}: {title}", lesson.number),
        Language::De => format!("Lektion {}: {title}", lesson.number),
    })?;
    let wrong = examine::program(lesson, &txt, &args.program, &report)?;
    if args.show {
        report.wait_until_seen(SEEN_LIMIT);
    }
    if let Some(wrong) = wrong {
        bail!(wrong.text(language));
    }
    print::line(solved(lesson, language))
}

/// A pupil's place in a lesson, with this number or name: a simulated TXT, and what checks programs for it.
pub(crate) fn desk(
    lesson: &str,
    builder: SimulatedTxtBuilder,
    label: String,
) -> anyhow::Result<desk::Shared> {
    let lesson = given::lesson(lesson, Language::of_system()).map_err(anyhow::Error::msg)?;
    let world = lesson.read_world()?;
    let txt = simulated_txt(builder, &world)?;
    Ok(desk::Shared(Arc::new(desk::Desk::new(lesson, world, txt, label))))
}

/// Number and title of each lesson, for pages.
pub(crate) fn lessons() -> Vec<Value> {
    let lessons = lesson::LESSONS.iter();
    lessons.map(|one| json!({ "number": one.number, "title": one.title.json() })).collect()
}

/// The number of the lesson whose world has this name.
pub(crate) fn number_of_world(name: &str) -> Option<u8> {
    Lesson::of_world(name).map(|lesson| lesson.number)
}

/// A simulated TXT for checks.
fn simulated_txt(builder: SimulatedTxtBuilder, world: &World) -> anyhow::Result<Txt> {
    let log = Log::default();
    let keeper = log.clone();
    let builder = builder.world(world.clone());
    let txt = builder.on_exchange(move |machine| keeper.keep(machine)).start()?;
    Ok(Txt { txts: Arc::new(vec![(String::new(), txt)]), log })
}

/// Shows the machine, the steps and the verdict on a page, if that is wanted.
fn show(
    args: &Args,
    txt: &Txt,
    (world, names): (&World, &Names),
    lesson: &'static Lesson,
    report: &Arc<Report>,
) -> anyhow::Result<Opening> {
    if !args.show {
        return Ok(Opening::default());
    }
    let shown = Simulated::all(&txt.txts, vec![Some(world.clone())]);
    let course = Arc::new(desk::Shown { lesson, report: Arc::clone(report) });
    let (url, opening) = pages::lesson(shown, names, course, PageAt::default(), !args.no_browser)?;
    print::line(format_args!("page {url}"))?;
    Ok(opening)
}

fn solved(lesson: &Lesson, language: Language) -> String {
    let next = lesson.next();
    let next = next.map(|next| (next.number, next.title.text(language)));
    match (language, next) {
        (Language::En, Some((number, title))) => {
            format!("Solved. Next is lesson {number}: {title}.")
        }
        (Language::En, None) => String::from("Solved. That was the last lesson."),
        (Language::De, Some((number, title))) => {
            format!("Geschafft! Weiter geht es mit Lektion {number}: {title}.")
        }
        (Language::De, None) => String::from("Geschafft! Das war die letzte Lektion."),
    }
}

/// The world of a lesson, if it has this name.
pub(crate) fn world(name: &str) -> Option<anyhow::Result<World>> {
    Lesson::of_world(name).map(Lesson::read_world)
}

#[cfg(test)]
mod tests {
    use super::lesson::LESSONS;
    use super::*;

    #[test]
    fn each_lesson_has_a_world_and_is_found_by_number_and_name() {
        for (lesson, number) in LESSONS.iter().zip(1..) {
            assert_eq!(lesson.number, number);
            for text in [lesson.name.to_owned(), number.to_string()] {
                assert_eq!(Lesson::find(&text).unwrap().number, number, "{text}");
            }
            world(&lesson.world_name()).unwrap().unwrap();
        }
        assert_eq!(LESSONS.len(), 10);
        assert_eq!(Lesson::find("Zähler").unwrap().number, 5);
        for (language, names) in
            [(Language::En, "1 lamp, 2 blink"), (Language::De, "1 lampe, 2 blinken")]
        {
            let sentence = given::lesson("11", language).err().unwrap();
            assert!(sentence.contains(names), "{sentence}");
        }
        assert!(world("lesson11").is_none());
    }
}
