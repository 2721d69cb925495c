//! A check from its beginning to its verdict, again when nothing was exchanged for a moment.

use std::ffi::OsString;
use std::time::Duration;

use super::lesson::Lesson;
use super::report::{Phase, Report};
use super::stage::Stage;
use super::txt::Txt;
use super::words::{german, Check, Words, Wrong};

/// How often a check begins before its verdict counts, whatever the computer does.
const TRIES: usize = 3;

/// Starts the program and checks it. Returns what is wrong.
pub(super) fn program(
    lesson: &'static Lesson,
    txt: &Txt,
    program: &[OsString],
    report: &Report,
) -> anyhow::Result<Option<Wrong>> {
    let world = lesson.read_world()?;
    let mut note = None;
    for left in (0..TRIES).rev() {
        report.begin(Phase::Waiting, note.take());
        let mut stage = Stage::set(txt.clone(), &world, program, report)?;
        let verdict = play(&mut stage, lesson);
        match (&verdict, stage.stood_still()) {
            (Err(_), Some(pause)) if left > 0 => note = Some(again(pause)),
            _ => return Ok(end(&stage, report, verdict)),
        }
    }
    Ok(None)
}

/// Waits for a program that somebody starts elsewhere, and checks it, until this check is over. Returns what is wrong.
pub(super) fn guest(mut stage: Stage, lesson: &Lesson, report: &Report) -> Option<Wrong> {
    let verdict = play(&mut stage, lesson);
    end(&stage, report, verdict)
}

fn play(stage: &mut Stage, lesson: &Lesson) -> Check {
    stage.wait_online()?;
    (lesson.check)(stage)
}

/// The verdict, with what is known of its reason.
fn end(stage: &Stage, report: &Report, verdict: Check) -> Option<Wrong> {
    let wrong = verdict.err().map(|wrong| {
        let wrong = stage.explain(wrong);
        match stage.stood_still() {
            Some(pause) => wrong.note(doubt(pause)),
            None => wrong,
        }
    });
    report.end(wrong)
}

/// Why the check begins again.
fn again(pause: Duration) -> Words {
    let seconds = pause.as_secs_f64();
    Words::new(
        format!(
            "Nothing was exchanged for {seconds:.1} s, perhaps because the computer stood still. The check begins again."
        ),
        format!(
            "{} s lang wurde nichts ausgetauscht, vielleicht stand der Computer still. Die Prüfung beginnt von vorn.",
            german(seconds, 1)
        ),
    )
}

/// Why a verdict may be no fault of the program.
fn doubt(pause: Duration) -> Words {
    let seconds = pause.as_secs_f64();
    Words::new(
        format!(
            "Nothing was exchanged for {seconds:.1} s meanwhile, which may be the reason: the computer stood still, or \
             the program itself pauses between exchanges. End other programs, and check again."
        ),
        format!(
            "Dabei wurde {} s lang nichts ausgetauscht, vielleicht liegt es daran: Der Computer stand still, oder das \
             Programm selbst macht zwischen zwei Austauschen Pause. Beende andere Programme und prüfe noch einmal.",
            german(seconds, 1)
        ),
    )
}
