//! `txt replay`: a simulated TXT that answers as a recorded one did.

mod compare;
mod ids;
mod player;
mod printer;

use std::ops::Range;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use anyhow::Context;
use crossbeam_channel::{Receiver, RecvTimeoutError};
use ft_transfer_area::{FirmwareVersion, PORT};
use ft_transfer_area_recorder::Recording;
use ft_transfer_area_simulator::SimulatedTxt;

use super::answering::known;
use super::in_parts::ensure_is_one;
use super::part::Part;
use super::survey::Survey;
use super::whole::say_what_is_damaged;
use crate::{interrupt, lines, print};
use player::{Player, Program, Run};
use printer::Printer;

/// How often to check whether a program has left, or a gap is over.
const LOOK: Duration = Duration::from_millis(20);

const AFTER_HELP: &str = "\
A simulated TXT whose answer number k has the inputs that were recorded in cycle k, with the pace,
the lost connections and the wrong answers of the recording. Run the program of the recording
against it: it decides and ends in the same way. When the program leaves, txt says where its outputs
or the modes of its inputs first differed; how a client stops the motors before it leaves does not
count as a difference. After the last cycle the inputs stay as they are. With --from the first
answer is the first recorded one from then on, and the recorded program does not begin there but
goes on. A program that connects or goes online again goes on with what the recorded one did then.
After the last recorded connection the next one begins the recording again.

Example: txt replay run.mcap      then run the program with the host 127.0.0.1";

/// Play a recording back, to debug a program against it
#[derive(clap::Args)]
#[command(after_help = AFTER_HELP)]
pub(crate) struct Args {
    /// The recording
    file: PathBuf,
    #[command(flatten)]
    part: Part,
    /// The port, 0 for a free one
    #[arg(long, default_value_t = PORT)]
    port: u16,
    /// Answer immediately, instead of at the recorded pace
    #[arg(long)]
    fast: bool,
    /// End when the program has left; with status 1 if its outputs differed
    #[arg(long)]
    once: bool,
}

pub(crate) fn run(args: Args) -> anyhow::Result<()> {
    ensure_is_one(&args.file)?;
    let mut recording = Recording::open(&args.file)?;
    let survey = Survey::of(&mut recording, &args.file)?;
    recording.rewind()?;
    if let Some(damage) = &survey.damage {
        say_what_is_damaged(damage, &args.file);
    }
    anyhow::ensure!(survey.cycles > 0, "{} has no cycles to replay", args.file.display());
    let part = args.part.within(&survey)?;
    let ([name, firmware], later) = survey.controllers_from(part.start);
    let shown = known(name, firmware);
    if let Some(later) = later.iter().find(|it| it.since < part.end.as_secs_f64()) {
        log::warn!(
            "from {:.2} s on {}, answered; all is replayed as {}",
            later.since,
            later.controller().join(", firmware "),
            shown.join(", firmware ")
        );
    }
    let interrupted = interrupt::receiver()?;
    lines::never_wait_to_log()?;
    let first_picture = survey.first_picture.clone();
    let bounds = survey.bounds.clone();
    let mut player = Player::new(recording, bounds, part.clone(), first_picture, !args.fast);
    let file = args.file.display();
    anyhow::ensure!(player.begin()?, "{file} has no cycle in this time");
    let (of_part, in_all) = match args.part.is_all() {
        true => (String::new(), ""),
        false => (of_part(&survey, &part), " in all"),
    };
    let player = Arc::new(Mutex::new(player));
    let txt = start(&survey, [name, firmware], args.port, &player)?;
    let [name, firmware] = shown.map(print::clean);
    print::line(format_args!(
        "Replays {file}{of_part} ({name}, firmware {firmware}, {} cycles{in_all}) at 127.0.0.1:{}. Ctrl-C ends it.",
        survey.cycles,
        txt.port()
    ))?;
    let mut printer = Printer::start()?;
    let same = serve(&txt, &player, &interrupted, args.once, &mut printer);
    printer.finish()?;
    anyhow::ensure!(same || !args.once, "the program did not do the same");
    Ok(())
}

/// Of which part of it, in words.
fn of_part(survey: &Survey, part: &Range<Duration>) -> String {
    let end = part.end.min(survey.length);
    let [from, to] = [part.start, end]
        .map(|at| format!("{} ({:.2} s)", survey.clock.of_day(at), at.as_secs_f64()));
    format!(" from {from} to {to}")
}

fn start(
    survey: &Survey,
    [name, firmware]: [&str; 2],
    port: u16,
    player: &Arc<Mutex<Player>>,
) -> anyhow::Result<SimulatedTxt> {
    let player = Arc::clone(player);
    let mut txt = SimulatedTxt::builder()
        .port(port)
        .pace(Duration::ZERO)
        .extensions(survey.extensions)
        .on_exchange(move |machine| lock(&player).answer(machine));
    if !name.is_empty() {
        txt = txt.device_name(name);
    }
    if !firmware.is_empty() {
        let firmware = parse_version(firmware).with_context(|| {
            format!("the recording has the firmware {firmware:?}, which is not a version")
        })?;
        txt = txt.firmware(firmware);
    }
    let txt = txt.start()?;
    // Until the first one is due. A program never sees a test card that was not recorded.
    txt.with_machine(|machine| machine.set_camera_picture(survey.first_picture.clone()));
    Ok(txt)
}

/// Serves programs until Ctrl-C, or once until all was played and the program has left; returns whether all did the same.
fn serve(
    txt: &SimulatedTxt,
    player: &Mutex<Player>,
    interrupted: &Receiver<()>,
    once: bool,
    printer: &mut Printer,
) -> bool {
    // Exchanges before the present connection. Without an exchange it was only asked who is there.
    let mut before = 0;
    let (mut has_left, mut differs) = (false, false);
    loop {
        let exchanges = lock(player).exchanges();
        let connected = txt.with_machine(|machine| machine.connected());
        let leaves = !connected && exchanges > before && lock(player).leave(exchanges);
        if leaves {
            before = exchanges;
        }
        // Without the lock, for which the next program waits.
        let left = lock(player).take_left();
        left.iter().for_each(|(program, run)| printer.leave(words(program, run)));
        has_left = leaves || has_left && !connected;
        let run = lock(player).run().clone();
        // The next one may have begun again before this was looked at.
        let has_played_all = left.iter().any(|(_, run)| run.at_end);
        differs |= left.iter().any(|(_, run)| run.differs);
        let is_over = has_left && run.at_end && run.back_at.is_none_or(|at| at <= Instant::now());
        if once && (has_played_all || is_over) {
            return !differs && (has_played_all || !run.differs);
        }
        if run.back_at.is_some_and(|back_at| back_at <= Instant::now()) {
            txt.with_machine(|machine| machine.set_absent(false));
            lock(player).is_back();
        }
        match interrupted.recv_timeout(LOOK) {
            Err(RecvTimeoutError::Timeout) if !printer.is_over() => {}
            _ => return !differs && !run.differs,
        }
    }
}

/// How a program did when it has left.
fn words(program: &Program, run: &Run) -> String {
    let to_come = if run.at_end { "" } else { "; the recording goes on" };
    let did = match (&program.first_difference, &program.other_stop) {
        (None, None) if program.cycles == 0 => "There was nothing to compare".to_owned(),
        (None, None) => "It did the same".to_owned(),
        (None, Some(stop)) => format!(
            "It did the same, but stopped the motors otherwise: in cycle {} {}",
            stop.cycle, stop.what
        ),
        (Some(first), _) => format!(
            "It first differed in cycle {}, {:.2} s after the beginning: {}",
            first.cycle,
            first.at.as_secs_f64(),
            first.what
        ),
    };
    let error = run.error.as_ref();
    let error =
        error.map(|error| format!("\nThe recording could not be read to its end: {error:#}"));
    format!(
        "The program has left after {} recorded cycles. {did}{to_come}.{}",
        program.cycles,
        error.unwrap_or_default()
    )
}

fn parse_version(text: &str) -> Option<FirmwareVersion> {
    let mut numbers = text.split('.').map(|number| number.parse().ok());
    // A fourth number, which some have, says nothing about the protocol.
    Some(FirmwareVersion::new(numbers.next()??, numbers.next()??, numbers.next()??))
}

fn lock(player: &Mutex<Player>) -> MutexGuard<'_, Player> {
    player.lock().unwrap_or_else(PoisonError::into_inner)
}
