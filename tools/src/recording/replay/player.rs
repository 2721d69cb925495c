//! Answers exchange by exchange as a recording says.

use std::collections::VecDeque;
use std::ops::Range;
use std::time::{Duration, Instant};

use ft_transfer_area_recorder::{
    Cycle, Entry, Error, Failure, FailureKind, Place, Recorded, Recording, Transfer,
};
use ft_transfer_area_simulator::{FaultKind, Machine};

use super::compare::{Difference, Terminals};

/// The time from one response to the next where nothing was recorded.
const PACE: Duration = Duration::from_millis(10);

/// How long a controller that did not come back stays away after the last attempt that was recorded.
const AFTER_ALL_ATTEMPTS: Duration = Duration::from_secs(1);

/// Plays a recording, session after session.
pub(super) struct Player {
    recording: Recording,
    /// Where its cycles begin anew or end, in order.
    bounds: Vec<Place>,
    /// What is played of it, and where that begins.
    part: Range<Duration>,
    begin: Place,
    /// The last picture before that; when all begins again, the first one at least.
    picture_before: Option<Vec<u8>>,
    first_picture: Option<Vec<u8>>,
    /// Entries that were looked at before their turn.
    ahead: VecDeque<Entry>,
    /// Whether times are as recorded.
    paced: bool,
    /// The numbers of the machine's connection and session that are served.
    session: (u64, u64),
    /// How many exchanges there were.
    exchanges: u64,
    terminals: Vec<Terminals>,
    /// The number of the next cycle; `None` when the rest of the session is not recorded.
    next: Option<u64>,
    /// When the last response is sent, and when it was recorded.
    answered: Option<(Instant, Duration)>,
    /// A difference that is none if the program and the recorded one stop there: only some clients also end distances
    /// and sounds in the exchange that stops the motors.
    at_stop: Option<Difference>,
    /// What the program does that is connected.
    program: Program,
    /// Whether it has left.
    has_left: bool,
    /// What programs have done that have left, until it is said.
    left: Vec<(Program, Run)>,
    run: Run,
}

/// What one program has done.
#[derive(Clone, Debug, Default)]
pub(super) struct Program {
    /// Cycles that were answered as recorded.
    pub(super) cycles: u64,
    pub(super) first_difference: Option<Difference>,
    /// How it stopped its motors otherwise, which does not count as a difference.
    pub(super) other_stop: Option<Difference>,
}

/// One run through the recording.
#[derive(Clone, Debug, Default)]
pub(super) struct Run {
    /// Whether a program has done something else than the recorded one.
    pub(super) differs: bool,
    /// Whether all of the recording was played.
    pub(super) at_end: bool,
    /// When the controller is back after a gap; `None` when it is not away.
    pub(super) back_at: Option<Instant>,
    /// What went wrong with the file.
    pub(super) error: Option<String>,
}

impl Player {
    /// Plays this part of a recording that is at its beginning.
    pub(super) fn new(
        recording: Recording,
        bounds: Vec<Place>,
        part: Range<Duration>,
        first_picture: Option<Vec<u8>>,
        paced: bool,
    ) -> Self {
        Self {
            begin: recording.place(),
            recording,
            bounds,
            part,
            picture_before: None,
            first_picture,
            ahead: VecDeque::new(),
            paced,
            session: (0, 0),
            exchanges: 0,
            terminals: Vec::new(),
            next: None,
            answered: None,
            at_stop: None,
            program: Program::default(),
            has_left: true,
            left: Vec::new(),
            run: Run::default(),
        }
    }

    /// How many exchanges there were.
    pub(super) fn exchanges(&self) -> u64 {
        self.exchanges
    }

    pub(super) fn run(&self) -> &Run {
        &self.run
    }

    /// Goes to the beginning of what is played; returns whether there is anything to play.
    pub(super) fn begin(&mut self) -> Result<bool, Error> {
        let first = self.read()?;
        self.begin = self.recording.place();
        self.first_picture = self.picture_before.clone().or(self.first_picture.take());
        self.ahead.extend(first);
        self.find_cycle(|_| {})
    }

    /// The gap is over.
    pub(super) fn is_back(&mut self) {
        self.run.back_at = None;
    }

    /// What programs have done that have left since the last call, and how far the recording was then.
    pub(super) fn take_left(&mut self) -> Vec<(Program, Run)> {
        std::mem::take(&mut self.left)
    }

    /// The program with the last of so many exchanges has left, perhaps before the end of the recorded connection. `false`
    /// when there was another exchange meanwhile, perhaps of the next one.
    pub(super) fn leave(&mut self, exchanges: u64) -> bool {
        if self.exchanges != exchanges {
            return false;
        }
        if let Err(error) = self.skip_session() {
            self.fail(&error);
        }
        self.see_off();
        true
    }

    /// Keeps what the program has done, to be said. After a recorded gap it is expected back.
    fn see_off(&mut self) {
        if !std::mem::replace(&mut self.has_left, true) && self.run.back_at.is_none() {
            self.left.push((std::mem::take(&mut self.program), self.run.clone()));
        }
    }

    /// Lets the machine answer an exchange.
    pub(super) fn answer(&mut self, machine: &mut Machine) {
        if let Err(error) = self.try_answer(machine) {
            self.fail(&error);
        }
    }

    /// Nothing more can be read. The inputs stay as they are.
    fn fail(&mut self, error: &Error) {
        self.run.error = Some(format!("{error:#}"));
        self.run.at_end = true;
        self.next = None;
    }

    fn try_answer(&mut self, machine: &mut Machine) -> Result<(), Error> {
        self.exchanges += 1;
        let session = (machine.connections(), machine.sessions());
        let before = std::mem::replace(&mut self.session, session);
        if session != before {
            self.begin_session(session.0 == before.0)?;
            if let Some(jpeg) = self.picture_before.take() {
                machine.set_camera_picture(Some(jpeg));
            }
        }
        // It goes on, so it did not stop there.
        let at_stop = self.at_stop.take();
        self.note(at_stop);
        let recorded = match self.next {
            Some(number) => self.take_cycle(number, machine)?,
            None => None,
        };
        match recorded {
            Some((at, cycle)) => self.play(at, &cycle, machine),
            None => self.keep_pace(None, machine),
        }
        Ok(())
    }

    /// Goes on to the first cycle of the next session; after the last one, a new connection begins with the first.
    fn begin_session(&mut self, is_online_again: bool) -> Result<(), Error> {
        let next = self.next;
        self.skip_session()?;
        if !is_online_again {
            self.see_off();
            self.has_left = false;
        }
        if self.run.at_end && is_online_again {
            self.note_online_again(next);
            return Ok(());
        }
        if self.run.at_end {
            self.recording.rewind()?;
            self.recording.skip_to(Some(self.begin));
            self.picture_before.clone_from(&self.first_picture);
            self.ahead.clear();
            self.run = Run::default();
        }
        self.answered = None;
        self.terminals.clear();
        while let Some(entry) = self.peek()? {
            if let Recorded::Cycle(cycle) = &entry.what {
                self.next = Some(cycle.number);
                return Ok(());
            }
            self.ahead.pop_front();
        }
        Ok(())
    }

    /// The program goes online again after all that was recorded. A recording without an end says nothing of what came
    /// then.
    fn note_online_again(&mut self, next: Option<u64>) {
        let Some(entry) = self.ahead.front() else { return };
        if let Recorded::Transfer(Transfer::Ended | Transfer::EndedBy(_)) = entry.what {
            let (at, what) =
                (entry.at, "it goes online again, and the recorded one left".to_owned());
            self.note(next.map(|cycle| Difference { cycle, at, what }));
        }
    }

    /// Leaves out what is left of the session.
    fn skip_session(&mut self) -> Result<(), Error> {
        let at_stop = self.at_stop.take();
        let Some(next) = self.next.take() else {
            self.note(at_stop);
            return self.look_for_end();
        };
        // When the first of them was, and whether it is the only one and stops the motors.
        let mut left_out = None;
        let mut stopped = true;
        loop {
            let tells_no_more = matches!(left_out, Some((_, false)));
            if tells_no_more && self.ahead.is_empty() {
                self.skip_to_bound();
            }
            let Some(entry) = self.peek()? else { break };
            match &entry.what {
                Recorded::Cycle(cycle) if begins_anew(cycle, next) => break,
                Recorded::Cycle(cycle) => {
                    let only = left_out.is_none() && is_stop(cycle);
                    left_out = Some((left_out.map_or(entry.at, |(at, _)| at), only));
                    self.ahead.pop_front();
                }
                Recorded::Transfer(Transfer::Lost(_)) => {
                    stopped = false;
                    break;
                }
                Recorded::Transfer(Transfer::Ended | Transfer::EndedBy(_)) => break,
                _ => drop(self.ahead.pop_front()),
            }
        }
        match left_out {
            None if stopped => {
                self.program.other_stop = self.program.other_stop.take().or(at_stop);
            }
            None => self.note(at_stop),
            Some((at, true)) if stopped && at_stop.is_none() => {
                let what = "it left without stopping the motors first".to_owned();
                self.program.other_stop.get_or_insert(Difference { cycle: next, at, what });
            }
            Some((at, _)) => {
                self.note(at_stop);
                let what = "it left, and the recorded one went on".to_owned();
                self.note(Some(Difference { cycle: next, at, what }));
            }
        }
        self.look_for_end()
    }

    /// Leaves out what is left of a session that may be hours long, as far as that is before its last half second: the
    /// next program waits.
    fn skip_to_bound(&mut self) {
        let here = self.recording.place();
        let next = self.bounds.partition_point(|bound| *bound < here);
        self.recording.skip_to(self.bounds.get(next).copied());
    }

    fn look_for_end(&mut self) -> Result<(), Error> {
        self.run.at_end = self.session.0 > 0 && !self.find_cycle(|_| {})?;
        Ok(())
    }

    /// The cycle with this number; `None` if it is not recorded. What has happened before is done to the machine.
    fn take_cycle(
        &mut self,
        number: u64,
        machine: &mut Machine,
    ) -> Result<Option<(Duration, Cycle)>, Error> {
        let goes_on = self.answered.is_some();
        while let Some(entry) = self.peek()? {
            match &entry.what {
                // The end of this session is in a damaged part.
                Recorded::Cycle(cycle) if goes_on && begins_anew(cycle, number) => {
                    self.next = None;
                    return Ok(None);
                }
                // It was lost when it was recorded, or is in a damaged part.
                Recorded::Cycle(cycle) if cycle.number > number => {
                    self.next = Some(number + 1);
                    return Ok(None);
                }
                Recorded::Cycle(_) => {
                    self.next = Some(number + 1);
                    let entry = self.ahead.pop_front();
                    return Ok(entry.and_then(cycle_of));
                }
                Recorded::Transfer(Transfer::Lost(failure)) => {
                    disturb(failure, machine);
                    self.ahead.pop_front();
                    return self.be_absent(machine).map(|()| None);
                }
                Recorded::Transfer(end @ (Transfer::Ended | Transfer::EndedBy(_))) => {
                    let breaks =
                        matches!(end, Transfer::EndedBy(failure) if disturb(failure, machine));
                    let what = "it goes on, and the recorded one left".to_owned();
                    let difference = Difference { cycle: number, at: entry.at, what };
                    self.note((!breaks).then_some(difference));
                    return self.end_session().map(|()| None);
                }
                Recorded::Transfer(Transfer::NotRecorded { entries }) => {
                    // Most of them are cycles. They may be those before the end of the session.
                    let left = entries.saturating_sub(1);
                    let fewer = Recorded::Transfer(Transfer::NotRecorded { entries: left });
                    if let Some(entry) = self.ahead.front_mut().filter(|_| left > 0) {
                        entry.what = fewer;
                    } else {
                        self.ahead.pop_front();
                    }
                    self.next = Some(number + 1);
                    return Ok(None);
                }
                Recorded::Picture(jpeg) => {
                    machine.set_camera_picture(Some(jpeg.clone()));
                    self.ahead.pop_front();
                }
                _ => drop(self.ahead.pop_front()),
            }
        }
        self.run.at_end = true;
        self.next = None;
        Ok(None)
    }

    /// The rest of this session is not recorded.
    fn end_session(&mut self) -> Result<(), Error> {
        self.ahead.pop_front();
        self.next = None;
        self.run.at_end = !self.find_cycle(|_| {})?;
        Ok(())
    }

    /// The connection was lost: the controller is away until it was connected again.
    fn be_absent(&mut self, machine: &mut Machine) -> Result<(), Error> {
        self.next = None;
        let mut gave_up = false;
        let mut until = Duration::ZERO;
        let is_back = self.find_cycle(|entry| {
            until = entry.at;
            gave_up |= matches!(entry.what, Recorded::Transfer(Transfer::EndedBy(_)));
        })?;
        if !is_back {
            // It did not come back while the program tried.
            until += AFTER_ALL_ATTEMPTS;
            self.run.at_end = true;
            gave_up = true;
        }
        if self.paced || gave_up {
            // Since the last response, because a program may have waited long for the next one.
            let last = self.answered.map_or(until, |(_, last)| last);
            machine.set_absent(true);
            self.run.back_at = Some(Instant::now() + until.saturating_sub(last));
        }
        Ok(())
    }

    /// Reads ahead to the next cycle, and shows each entry; returns whether there is a cycle.
    fn find_cycle(&mut self, mut see: impl FnMut(&Entry)) -> Result<bool, Error> {
        self.ahead.iter().for_each(&mut see);
        let is_cycle = |entry: &Entry| matches!(entry.what, Recorded::Cycle(_));
        let mut found = self.ahead.iter().any(is_cycle);
        while !found {
            let Some(entry) = self.read()? else { break };
            see(&entry);
            found = is_cycle(&entry);
            keep(&mut self.ahead, entry);
        }
        Ok(found)
    }

    fn play(&mut self, at: Duration, cycle: &Cycle, machine: &mut Machine) {
        self.program.cycles += 1;
        self.terminals.resize_with(cycle.areas.len(), Terminals::default);
        let alive = cycle.areas[0].state.io_slave_alive;
        let (mut what, mut stops) = (None, is_stop(cycle));
        for (index, (area, terminals)) in cycle.areas.iter().zip(&mut self.terminals).enumerate() {
            // Outputs are sent only to extensions that took part in the response before.
            let before = index.checked_sub(1).map(|extension| machine.alive[extension]);
            let Some(controller) = machine.controllers.get_mut(index) else { break };
            if before.is_none_or(|alive| alive && !cycle.first) {
                let differs = terminals.compare(area, controller);
                let name = if index == 0 { String::new() } else { format!("E{index}: ") };
                what = what.or_else(|| differs.map(|differs| format!("{name}{differs}")));
                stops &= controller.outputs.duty.iter().all(|duty| *duty == 0);
            }
            controller.report_as(Some(terminals.report(area)));
            controller.mic_lin = area.txt_inputs2.mic_lin;
            controller.mic_log = area.txt_inputs2.mic_log;
        }
        machine.alive = alive.map(|alive| alive != 0);
        let difference = what.map(|what| Difference { cycle: cycle.number, at, what });
        if stops {
            self.at_stop = difference;
        } else {
            self.note(difference);
        }
        self.keep_pace(Some(at), machine);
    }

    /// Notes a difference, if it is the first.
    fn note(&mut self, difference: Option<Difference>) {
        self.run.differs |= difference.is_some();
        self.program.first_difference = self.program.first_difference.take().or(difference);
    }

    /// Delays the response to when it came in the recording.
    fn keep_pace(&mut self, at: Option<Duration>, machine: &mut Machine) {
        let now = Instant::now();
        let due = match self.answered {
            Some((answered, last)) if self.paced => {
                let pace = at.map_or(PACE, |at| at.saturating_sub(last));
                now.max(answered + pace)
            }
            _ => now,
        };
        if due > now {
            machine.disturb(FaultKind::Delay(due - now));
        }
        let last = self.answered.map_or(Duration::ZERO, |(_, last)| last + PACE);
        self.answered = Some((due, at.unwrap_or(last)));
    }

    /// The next entry.
    fn peek(&mut self) -> Result<Option<&Entry>, Error> {
        if self.ahead.is_empty() {
            let next = self.read()?;
            self.ahead.extend(next);
        }
        Ok(self.ahead.front())
    }

    /// The next entry of what is played.
    fn read(&mut self) -> Result<Option<Entry>, Error> {
        while let Some(entry) = self.recording.next().transpose()? {
            match entry.what {
                // An event may be in the file before its cycle, so only a cycle is the end.
                Recorded::Cycle(_) if entry.at > self.part.end => return Ok(None),
                _ if self.part.contains(&entry.at) => return Ok(Some(entry)),
                Recorded::Picture(jpeg) if entry.at < self.part.start => {
                    self.picture_before = Some(jpeg);
                }
                _ => {}
            }
        }
        Ok(None)
    }
}

/// Keeps an entry until its turn. A camera that goes on without a program has no cycles between its pictures: only the
/// newest is shown with the next one. Programs may come and go without a cycle, of which the first say all.
fn keep(ahead: &mut VecDeque<Entry>, entry: Entry) {
    const MOST: usize = 100;
    let is_picture = |entry: &Entry| matches!(entry.what, Recorded::Picture(_));
    match entry.what {
        Recorded::Event(_) | Recorded::Statistics(_) | Recorded::Missing => return,
        Recorded::Transfer(_) if ahead.len() >= MOST => return,
        // There is one at most. Looked for from behind, only what came since then is passed over.
        Recorded::Picture(_) => {
            if let Some(before) = ahead.iter().rposition(is_picture) {
                ahead.remove(before);
            }
        }
        _ => {}
    }
    ahead.push_back(entry);
}

/// Whether a cycle is of another session than the one that should have this number next: numbers rise within one.
fn begins_anew(cycle: &Cycle, next: u64) -> bool {
    cycle.first || cycle.number < next
}

/// Whether a request leaves all motors off.
fn is_stop(cycle: &Cycle) -> bool {
    cycle.areas.iter().all(|area| area.output.duty.iter().all(|duty| *duty == 0))
}

fn cycle_of(entry: Entry) -> Option<(Duration, Cycle)> {
    match entry.what {
        Recorded::Cycle(cycle) => Some((entry.at, cycle)),
        _ => None,
    }
}

/// Lets the connection break as it did; returns whether it did.
fn disturb(failure: &Failure, machine: &mut Machine) -> bool {
    let fault = match failure.kind {
        FailureKind::NoAnswer => FaultKind::Silence,
        FailureKind::WrongData => FaultKind::WrongCrc,
        FailureKind::Closed => FaultKind::Close { after: 0 },
        // The program itself, such as a panic of it.
        _ => return false,
    };
    machine.disturb(fault);
    true
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::path::Path;
    use std::thread;

    use ft_transfer_area::{CameraFrame, TransferAreaComHandler};
    use ft_transfer_area_recorder::{Options, Recorder};
    use ft_transfer_area_simulator::SimulatedTxt;

    use super::*;
    use crate::recording::survey::tests::record_ends;
    use crate::recording::survey::Survey;

    /// Kinds of records.
    const CHUNK: u8 = 6;
    const DATA_END: u8 = 15;

    /// The file with a damaged piece in the middle: whoever looks at it finds that.
    fn damage(path: &Path) {
        let mut file = fs::read(path).unwrap();
        let (mut chunks, mut at) = (Vec::new(), 8);
        while file[at] != DATA_END {
            if file[at] == CHUNK {
                chunks.push(at);
            }
            at += 9 + u64::from_le_bytes(file[at + 1..at + 9].try_into().unwrap()) as usize;
        }
        assert!(chunks.len() > 4, "{chunks:?}");
        let middle = chunks.len() / 2;
        file[(chunks[middle] + chunks[middle + 1]) / 2] ^= 0x55;
        fs::write(path, file).unwrap();
    }

    #[test]
    fn of_a_session_that_a_program_leaves_early_the_rest_is_not_looked_at() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.mcap");
        let txt = SimulatedTxt::builder().lock_step().start().unwrap();
        let handler = TransferAreaComHandler::builder(txt.address()).lock_step().build().unwrap();
        let recorder = Recorder::start(&handler, &path, Options::default()).unwrap();
        for cycles in [6, 1] {
            handler.begin_transfer().unwrap();
            for _ in 0..cycles {
                handler.areas().lock()[0].output.duty[0] = 512;
                drop(handler.areas().wait_cycle().unwrap());
                // Longer than the time of a piece.
                thread::sleep(Duration::from_millis(600));
            }
            handler.end_transfer().unwrap();
        }
        recorder.finish().unwrap();
        let mut recording = Recording::open(&path).unwrap();
        let survey = Survey::of(&mut recording, &path).unwrap();
        damage(&path);
        recording.rewind().unwrap();
        let part = Duration::ZERO..Duration::MAX;
        let mut player = Player::new(recording, survey.bounds, part, None, false);
        assert!(player.begin().unwrap());
        player.session = (1, 1);
        player.begin_session(false).unwrap();
        player.ahead.pop_front();
        player.next = Some(2);
        player.skip_session().unwrap();
        let first = player.program.first_difference.as_ref().unwrap();
        assert_eq!((first.cycle, &*first.what), (2, "it left, and the recorded one went on"));
        assert!(matches!(player.peek().unwrap().unwrap().what, Recorded::Transfer(_)));
        assert!(player.find_cycle(|_| {}).unwrap() && !player.run.at_end);
        assert!(player.recording.damage().is_none());
    }

    #[test]
    fn of_a_camera_that_goes_on_after_the_last_cycle_one_picture_is_kept() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.mcap");
        let txt = SimulatedTxt::builder().lock_step().start().unwrap();
        let builder = TransferAreaComHandler::builder(txt.address());
        let handler = builder.lock_step().build().unwrap();
        let recorder = Recorder::start(&handler, &path, Options::default()).unwrap();
        handler.begin_transfer().unwrap();
        drop(handler.areas().wait_cycle().unwrap());
        handler.end_transfer().unwrap();
        let picture = include_bytes!("../../../../tests/camera/clean_48x32_420.jpg");
        for _ in 0..10 {
            recorder.frames().record(&CameraFrame::new(picture.to_vec()));
        }
        assert_eq!(recorder.finish().unwrap().frames, 10);
        let recording = Recording::open(&path).unwrap();
        let mut player =
            Player::new(recording, Vec::new(), Duration::ZERO..Duration::MAX, None, false);
        while player.find_cycle(|_| {}).unwrap() {
            player.ahead.clear();
        }
        let is_picture = |entry: &&Entry| matches!(entry.what, Recorded::Picture(_));
        assert_eq!(player.ahead.iter().filter(is_picture).count(), 1);
    }

    #[test]
    fn of_transfers_without_a_cycle_the_first_are_kept() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.mcap");
        record_ends(&path);
        let recording = Recording::open(&path).unwrap();
        let mut player =
            Player::new(recording, Vec::new(), Duration::ZERO..Duration::MAX, None, false);
        let mut seen = 0;
        assert!(!player.find_cycle(|_| seen += 1).unwrap());
        assert!(seen >= 300, "{seen}");
        assert_eq!(player.ahead.len(), 100);
    }
}
