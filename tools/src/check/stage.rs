//! The simulated TXT of a lesson and the program that drives it: what a check does to the one and sees of the other.
//!
//! Every exchange is kept, so nothing is missed while a check is busy. Times are those of the machine.

use std::collections::BTreeSet;
use std::ffi::OsString;
use std::mem;
use std::ops::Range;
use std::time::{Duration, Instant};

use ft_transfer_area::tx::{Counter, Input};
use ft_transfer_area_simulator::world::{Sensor, World, WorldState};
use ft_transfer_area_simulator::{Machine, SimulatedTxt};

use super::heard::{Heard, GUARD};
use super::moment::Moment;
use super::report::Report;
use super::txt::Txt;
use super::words::{Check, Words, Wrong};
use crate::program::{Program, Reads};

/// How long a program has to answer an input. Much longer than it needs on a busy computer.
const SOON: Duration = Duration::from_secs(2);
/// After a time without an answer there must have been so many exchanges, too.
const SOON_EXCHANGES: usize = 20;
/// How long the program of the check before may still be connected, of which nothing is left but its last request.
const GONE: Duration = Duration::from_secs(2);
/// How long a button is pressed.
const TAP: Duration = Duration::from_millis(300);
/// How long a program may take until it is online. `cargo run` may have to compile it.
const START_LIMIT: Duration = Duration::from_secs(60);
/// How long the exchange may pause.
const SILENCE_LIMIT: Duration = Duration::from_secs(10);
/// How often to look whether the program still runs.
const LOOK: Duration = Duration::from_millis(50);

/// A longer pause between two exchanges, which come each 10 ms, is hardly the program's: the computer stood still. But a
/// program may exchange itself, without a thread for it, and sleep.
const STANDSTILL: Duration = Duration::from_millis(200);

/// Whose program drives.
enum Driver {
    /// It was started here, and ends with the check.
    Own { program: Program, heard: Heard },
    /// Somebody starts it elsewhere.
    Guest,
}

pub(super) struct Stage<'a> {
    // The program ends before its controller does.
    driver: Driver,
    txt: Txt,
    report: &'a Report,
    /// The number of exchanges before the last thing that was done to the machine.
    mark: usize,
    /// When something was waited for last while the program was online. A program that leaves goes offline at once; one
    /// that stands still does not, until the controller ends its connection.
    quiet: Option<Instant>,
    /// The buttons that are pressed now.
    pressed: BTreeSet<Input>,
    /// Whether somebody wants to end the check.
    is_over: &'a dyn Fn() -> bool,
}

impl<'a> Stage<'a> {
    /// A stage for this program, which is started now, in this world.
    pub(super) fn set(
        txt: Txt,
        world: &World,
        program: &[OsString],
        report: &'a Report,
    ) -> anyhow::Result<Self> {
        Self::clear_after(&txt, world)?;
        let address = txt.txt().address().to_string();
        let (program, stderr) = Program::start_heard(program, &address, Reads::Nothing)?;
        let driver = Driver::Own { program, heard: Heard::listen(stderr)? };
        Ok(Self::new(driver, txt, report, &|| false))
    }

    /// A stage for a program that somebody starts elsewhere.
    pub(super) fn for_guest(
        txt: Txt,
        world: &World,
        report: &'a Report,
        is_over: &'a dyn Fn() -> bool,
    ) -> anyhow::Result<Self> {
        Self::clear(&txt, world)?;
        txt.log.wait_for_guest();
        Ok(Self::new(Driver::Guest, txt, report, is_over))
    }

    fn new(driver: Driver, txt: Txt, report: &'a Report, is_over: &'a dyn Fn() -> bool) -> Self {
        let pressed = BTreeSet::new();
        Self { driver, txt, report, mark: 0, quiet: None, pressed, is_over }
    }

    /// The world as it is at its start, and no exchange yet.
    fn clear(txt: &Txt, world: &World) -> anyhow::Result<()> {
        txt.set_world(world)?;
        txt.log.begin(true);
        Ok(())
    }

    /// The same when the program of the check before may still be connected: its last exchange is none of this check.
    /// Somebody else may stay.
    fn clear_after(txt: &Txt, world: &World) -> anyhow::Result<()> {
        let _ = txt.txt().wait_until(|machine| !machine.connected(), GONE);
        Self::clear(txt, world)
    }

    fn txt(&self) -> &SimulatedTxt {
        self.txt.txt()
    }

    /// Begins the next step. The one before was right.
    pub(super) fn step(&mut self, en: &'static str, de: &'static str) {
        self.report.end_step(true);
        self.report.step(Words::fixed(en, de));
    }

    /// What is wrong, with what the program itself has said of it.
    pub(super) fn explain(&self, wrong: Wrong) -> Wrong {
        let Driver::Own { heard, .. } = &self.driver else { return wrong };
        if wrong.is_an_error() {
            heard.wait();
            return match heard.advice(self.exchanges() > 0) {
                Some(advice) => wrong.advise(advice),
                None => wrong,
            };
        }
        if heard.warned_of_guard() {
            return wrong.advise(GUARD);
        }
        wrong
    }

    /// How long nothing was exchanged, if that was long.
    pub(super) fn stood_still(&self) -> Option<Duration> {
        let kept = self.txt.log.lock();
        let clocks: Vec<_> =
            kept.moments.iter().map(|moment| moment.clock).chain(self.quiet).collect();
        let pauses = clocks.windows(2).map(|two| two[1].saturating_duration_since(two[0]));
        pauses.max().filter(|pause| *pause > STANDSTILL)
    }

    /// Waits until the program is online and exchanges.
    pub(super) fn wait_online(&mut self) -> Check {
        self.await_exchange(0, START_LIMIT)?;
        self.report.runs();
        Ok(())
    }

    /// Presses or releases a button.
    pub(super) fn press(&mut self, input: Input, pressed: bool) {
        if pressed {
            self.pressed.insert(input);
        } else {
            self.pressed.remove(&input);
        }
        self.change(|world| {
            world.press(0, input, pressed);
        });
    }

    /// Presses a button and releases it.
    pub(super) fn tap(&mut self, input: Input) -> Check {
        self.press(input, true);
        let mark = self.mark;
        self.pass(TAP)?;
        self.press(input, false);
        // The answer to the press counts, too.
        self.mark = mark;
        Ok(())
    }

    pub(super) fn plug(&mut self, input: Input, sensor: Sensor) {
        self.change(|world| {
            world.set_sensor(0, input, Some(sensor));
        });
    }

    /// Changes the world. What comes from then on is the program's answer.
    pub(super) fn change<R>(&mut self, change: impl FnOnce(&mut WorldState) -> R) -> Option<R> {
        let log = &self.txt.log;
        let (done, mark) = self.txt().with_machine(|machine| {
            // No exchange takes place in between.
            let mark = log.len();
            (machine.world_mut().map(change), mark)
        });
        self.mark = mark;
        done
    }

    /// Lets the next answer with such a count come late, so that the program misses the counts after it.
    pub(super) fn be_late(&self, counter: Counter, counts: Range<i16>) {
        self.txt.log.be_late(counter, counts);
    }

    /// Looks at the world.
    pub(super) fn look<R>(&self, look: impl FnOnce(&WorldState) -> R) -> Option<R> {
        self.txt().with_machine(|machine| machine.world().map(look))
    }

    /// Lets this time pass.
    pub(super) fn pass(&mut self, time: Duration) -> Check {
        (self.mark, _) = self.scan(self.exchanges(), time, 0, |_| false)?;
        Ok(())
    }

    /// The first exchange from the last change on for which this holds. If there is none soon, that is wrong.
    pub(super) fn soon(
        &mut self,
        holds: impl FnMut(&Moment) -> bool,
        wrong: impl FnOnce(&Moment) -> Wrong,
    ) -> Check<Moment> {
        self.within(SOON, holds, wrong)
    }

    /// The same within this time. What comes after that exchange counts for the next call.
    pub(super) fn within(
        &mut self,
        limit: Duration,
        holds: impl FnMut(&Moment) -> bool,
        wrong: impl FnOnce(&Moment) -> Wrong,
    ) -> Check<Moment> {
        let (index, found) = self.scan(self.mark, limit, SOON_EXCHANGES, holds)?;
        let moment = self.moment(index);
        if !found {
            return Err(wrong(&moment));
        }
        self.mark = index;
        Ok(moment)
    }

    /// Whether this holds in each exchange for this time; otherwise the first one for which it does not is wrong.
    pub(super) fn stays(
        &mut self,
        time: Duration,
        mut holds: impl FnMut(&Moment) -> bool,
        wrong: impl FnOnce(&Moment) -> Wrong,
    ) -> Check {
        let (index, found) = self.scan(self.mark, time, 0, |now| !holds(now))?;
        if found {
            return Err(wrong(&self.moment(index)));
        }
        self.mark = index;
        Ok(())
    }

    /// All exchanges so far.
    pub(super) fn log(&self) -> Vec<Moment> {
        self.txt.log.lock().moments.clone()
    }

    /// All exchanges from the present on, until the last of them satisfies this or the time has passed. The second
    /// value says whether it does.
    pub(super) fn watch(
        &mut self,
        limit: Duration,
        until: impl FnMut(&Moment) -> bool,
    ) -> Check<(Vec<Moment>, bool)> {
        let from = self.mark;
        let (index, found) = self.scan(from, limit, 0, until)?;
        self.mark = index;
        Ok((self.txt.log.lock().moments[from..=index].to_vec(), found))
    }

    /// Waits until the program ends. Returns whether it ends without an error, or `None` when it goes on.
    pub(super) fn wait_end(&mut self, limit: Duration) -> Check<Option<bool>> {
        let begin = Instant::now();
        while begin.elapsed() < limit {
            if let Some(well) = self.ended()? {
                return Ok(Some(well));
            }
            std::thread::sleep(LOOK);
        }
        Ok(None)
    }

    fn exchanges(&self) -> usize {
        self.txt.log.len()
    }

    /// An exchange that has taken place.
    fn moment(&self, index: usize) -> Moment {
        self.txt.log.lock().moments[index]
    }

    /// Goes from exchange to exchange until one satisfies this, or until so much time and so many exchanges have
    /// passed. Returns the last one, and whether it satisfies this.
    fn scan(
        &mut self,
        from: usize,
        limit: Duration,
        least: usize,
        mut until: impl FnMut(&Moment) -> bool,
    ) -> Check<(usize, bool)> {
        self.await_exchange(from, SILENCE_LIMIT)?;
        let begin = self.moment(from).counted;
        let mut index = from;
        loop {
            let now = self.moment(index);
            if until(&now) {
                return Ok((index, true));
            }
            if now.counted.saturating_sub(begin) >= limit && index - from >= least {
                return Ok((index, false));
            }
            index += 1;
            self.await_exchange(index, SILENCE_LIMIT)?;
        }
    }

    /// Whether the program has ended without an error; `None` while it runs.
    fn ended(&mut self) -> Check<Option<bool>> {
        let is_online = self.txt.is_online();
        if is_online {
            self.quiet = Some(Instant::now());
        }
        match &mut self.driver {
            Driver::Own { program, .. } => {
                Ok(program.ended().map_err(lost)?.map(|status| status.success()))
            }
            // Nobody knows whether it has ended well, but it is gone. Another one may have come at once.
            Driver::Guest => {
                let has_begun = self.exchanges() > 0;
                let is_gone = has_begun && (!is_online || self.is_another(self.txt.connection()));
                Ok(is_gone.then_some(true))
            }
        }
    }

    /// Whether this connection is not that of the first exchange.
    fn is_another(&self, connection: u64) -> bool {
        self.moment(0).connection != connection
    }

    /// Waits until this exchange has taken place.
    fn await_exchange(&mut self, index: usize, limit: Duration) -> Check {
        let begin = Instant::now();
        loop {
            if (self.is_over)() {
                return Err(Wrong::new("The check was ended.", "Die Prüfung wurde beendet."));
            }
            let log = &self.txt.log;
            let is_there = |_: &Machine| log.len() > index;
            if self.txt().wait_until(is_there, LOOK) {
                let is_guest = matches!(self.driver, Driver::Guest);
                return match is_guest && self.is_another(self.moment(index).connection) {
                    true => Err(ended(true, true)),
                    false => Ok(()),
                };
            }
            if let Some(well) = self.ended()? {
                return Err(ended(well, self.exchanges() > 0));
            }
            // A guest may take its time to begin.
            let may_wait = matches!(self.driver, Driver::Guest) && index == 0;
            if begin.elapsed() > limit && !may_wait {
                return Err(silent(index == 0));
            }
        }
    }
}

impl Drop for Stage<'_> {
    fn drop(&mut self) {
        // A check that something wrong has ended leaves no button pressed to who tries the machine then.
        for input in mem::take(&mut self.pressed) {
            self.press(input, false);
        }
        self.txt.log.begin(false);
    }
}

/// The program was online, and has ended with an error.
pub(super) fn ended_by_an_error() -> Wrong {
    ended(false, true)
}

/// The program has ended too early.
fn ended(well: bool, was_online: bool) -> Wrong {
    match (well, was_online) {
        (true, false) => Wrong::new(
            "The program ended without going online.",
            "Das Programm endete, ohne sich mit dem Controller zu verbinden.",
        )
        .hint(
            "call begin_transfer, and connect to the address that the program gets as its argument.",
            "Rufe begin_transfer auf, mit der Adresse, die das Programm als Argument bekommt.",
        ),
        (true, true) => Wrong::new(
            "The program ended, but it should go on.",
            "Das Programm ist zu Ende, sollte aber weiterlaufen.",
        )
        .hint(
            "put what it does into a loop: loop { … }. The end of a program switches everything off.",
            "Pack das, was es tut, in eine Schleife: loop { … }. Am Ende eines Programms geht alles aus.",
        ),
        (false, false) => Wrong::new(
            "The program ended with an error before it was online. Its message is above.",
            "Das Programm endete mit einem Fehler, bevor es verbunden war. Die Meldung steht weiter oben.",
        )
        .of_an_error()
        .hint(
            "the address comes as an argument: std::env::args().nth(1).",
            "Die Adresse kommt als Argument: std::env::args().nth(1).",
        ),
        (false, true) => Wrong::new(
            "The program ended with an error. Its message is above.",
            "Das Programm endete mit einem Fehler. Die Meldung steht weiter oben.",
        )
        .of_an_error(),
    }
}

/// The program runs, but no exchange takes place.
fn silent(at_start: bool) -> Wrong {
    if at_start {
        return Wrong::new(
            "The program runs, but it does not connect to the simulated controller.",
            "Das Programm läuft, verbindet sich aber nicht mit dem simulierten Controller.",
        )
        .hint(
            "the address comes as an argument: std::env::args().nth(1). Then call begin_transfer.",
            "Die Adresse kommt als Argument: std::env::args().nth(1). Danach kommt begin_transfer.",
        );
    }
    Wrong::new(
        "The program runs, but it is no longer connected to the controller.",
        "Das Programm läuft, ist aber nicht mehr mit dem Controller verbunden.",
    )
    .hint(
        "an error has ended the transfer: let main return it, with ? after each call.",
        "Ein Fehler hat die Verbindung beendet. Gib ihn aus main zurück, mit ? nach jedem Aufruf.",
    )
}

/// The operating system does not say how the program is.
fn lost(error: std::io::Error) -> Wrong {
    Wrong::new(
        format!("The program can't be watched: {error:#}"),
        format!("Das Programm lässt sich nicht beobachten: {error:#}"),
    )
}

#[cfg(test)]
mod tests {
    use std::thread;

    use ft_transfer_area::{TimeLimits, TransferAreaComHandler};
    use ft_transfer_area_simulator::world::Board;

    use super::*;
    use crate::check;
    use crate::names::Names;

    #[test]
    fn no_exchange_of_the_program_before_is_one_of_this_check() {
        let world = World::default();
        let txt = check::simulated_txt(SimulatedTxt::builder(), &world).unwrap();
        let handler = TransferAreaComHandler::builder(txt.txt().address()).build().unwrap();
        handler.begin_transfer().unwrap();
        let before = thread::spawn(move || {
            thread::sleep(Duration::from_millis(300));
            drop(handler);
        });
        Stage::clear_after(&txt, &world).unwrap();
        before.join().unwrap();
        assert_eq!(txt.log.len(), 0);
    }

    #[test]
    fn a_stop_of_what_a_program_has_left_is_no_program_to_be_checked() {
        let world = World::default();
        let txt = check::simulated_txt(SimulatedTxt::builder(), &world).unwrap();
        let report = Report::new(None, Names::default());
        let _stage = Stage::for_guest(txt.clone(), &world, &report, &|| false).unwrap();
        let address = txt.txt().address();
        ft_transfer_area::stop_controller(address, TimeLimits::default()).unwrap();
        assert_eq!(txt.log.len(), 0);
        let handler = TransferAreaComHandler::builder(address).build().unwrap();
        handler.begin_transfer().unwrap();
        let has_begun = |_: &Machine| txt.log.len() > 0;
        assert!(txt.txt().wait_until(has_begun, START_LIMIT));
    }

    #[test]
    fn a_check_leaves_no_button_pressed() {
        let world = World::new().master(Board::default().input(Input::I1, Sensor::BUTTON));
        let txt = check::simulated_txt(SimulatedTxt::builder(), &world).unwrap();
        let value = |txt: &Txt| {
            let look = |world: &WorldState| world.sensor(0, Input::I1).unwrap().value().value;
            txt.txt().with_machine(|machine| machine.world().map(look)).unwrap()
        };
        let report = Report::new(None, Names::default());
        let mut stage = Stage::for_guest(txt.clone(), &world, &report, &|| true).unwrap();
        assert!(stage.tap(Input::I1).is_err(), "somebody has ended it");
        assert_eq!(value(&txt), 1.0);
        drop(stage);
        assert_eq!(value(&txt), 0.0);
    }
}
