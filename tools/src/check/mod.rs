//! `txt check`: whether a program solves a lesson, and in words what is still wrong.

mod lesson;
mod lessons;
mod moment;
mod stage;
mod words;

use std::ffi::OsString;

use anyhow::bail;
use ft_transfer_area_simulator::world::World;

use self::lesson::{Lesson, LESSONS};
use self::stage::Stage;
use self::words::Language;
use crate::print;

const AFTER: &str = "\
It simulates the machine of the lesson, presses its buttons, and says what the program does wrong.
PROGRAM is in any language. It gets the address of the controller as its last argument, and in the
variable TXT_ADDRESS. It is ended when the check is over, with all that it has started. Options
come before LESSON.

The exit status is 0 when the lesson is solved, 1 when something is wrong, 2 for a wrong option.
`txt simulate --world lesson1 --show` shows the machine of lesson 1, to try a program by hand.

Examples:
  txt check 1 target/debug/lamp
  txt check --language de --show 4 python3 end_switch.py";

/// Check a program that solves a lesson
#[derive(clap::Args)]
#[command(after_help = AFTER)]
pub(crate) struct Args {
    /// Number or name of the lesson, such as 1 or lamp
    #[arg(value_parser = lesson)]
    lesson: &'static Lesson,
    /// The program and its arguments
    #[arg(required = true, trailing_var_arg = true, allow_hyphen_values = true)]
    program: Vec<OsString>,
    /// Language of its messages [default: that of the system]
    #[arg(long, value_enum, hide_possible_values = true, value_name = "en|de")]
    language: Option<Language>,
    /// Show the machine on a page in the browser
    #[arg(long)]
    show: bool,
    /// With --show: do not open the browser
    #[arg(long, requires = "show")]
    no_browser: bool,
}

pub(crate) fn run(args: Args) -> anyhow::Result<()> {
    let language = args.language.unwrap_or_else(Language::of_system);
    let lesson = args.lesson;
    let title = lesson.title.text(language);
    let mut stage = Stage::set(lesson.read_world()?, &args, language)?;
    print::line(match language {
        Language::En => format!("Lesson {}: {title}", lesson.number),
        Language::De => format!("Lektion {}: {title}", lesson.number),
    })?;
    let checked = stage.wait_online().and_then(|()| (lesson.check)(&mut stage));
    stage.end_step(checked.is_ok());
    if let Err(wrong) = checked {
        bail!(wrong.text(language));
    }
    let next = lesson.next();
    let next = next.map(|next| (next.number, next.title.text(language)));
    print::line(match (language, next) {
        (Language::En, Some((number, title))) => {
            format!("Solved. Next is lesson {number}: {title}.")
        }
        (Language::En, None) => String::from("Solved. That was the last lesson."),
        (Language::De, Some((number, title))) => {
            format!("Geschafft! Weiter geht es mit Lektion {number}: {title}.")
        }
        (Language::De, None) => String::from("Geschafft! Das war die letzte Lektion."),
    })
}

/// The world of a lesson, if it has this name.
pub(crate) fn world(name: &str) -> Option<anyhow::Result<World>> {
    Lesson::of_world(name).map(Lesson::read_world)
}

fn lesson(text: &str) -> Result<&'static Lesson, String> {
    Lesson::find(text).ok_or_else(|| {
        let lessons = LESSONS.iter().map(|lesson| format!("{} {}", lesson.number, lesson.name));
        let lessons = lessons.collect::<Vec<_>>().join(", ");
        format!("there is no lesson {text:?}; there are {lessons}")
    })
}

#[cfg(test)]
mod tests {
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
        assert!(lesson("11").err().unwrap().contains("1 lamp, 2 blink"));
        assert!(world("lesson11").is_none());
    }
}
