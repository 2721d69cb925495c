//! The state of a handler: its parts, and what each event does with all of them.
//!
//! Nothing here waits or knows another thread. What the program's threads do with it is in
//! [`program::steps`](crate::handler::program::steps), what the transfer thread does in
//! [`transfer::side`](crate::handler::transfer::side).

use std::net::SocketAddr;
use std::time::{Duration, Instant};

use crate::error::Error;
use crate::events::{Event, LoggedBeginning, TimedEvent};
use crate::exchange::{Inputs, Outgoing};
use crate::firmware::FirmwareVersion;
use crate::handler::parts::camera_work::CameraWork;
use crate::handler::parts::clock::TransferClock;
use crate::handler::parts::hand_over::HandOver;
use crate::handler::parts::interruptions::Interruptions;
use crate::handler::parts::phase::{Stop, Transfer};
use crate::handler::parts::responses::Responses;
use crate::handler::parts::tickets::{Hold, Purpose, Stage, TicketId, Tickets};
use crate::handler::parts::unfinished::Cut;
use crate::handler::parts::watchdog::Watchdog;
use crate::handler::program::known::Known;
use crate::handler::sync::{current_thread, earlier, now, thread_id, ThreadId};
use crate::statistics::Statistics;
use crate::transfer_area::FishX1Transfer;
use crate::wire::QueryStatusResponse;

/// All parts. Those that more than one side reads or changes alone are open to both.
#[derive(Debug)]
pub(crate) struct State {
    pub(crate) transfer: Transfer,
    pub(crate) camera: CameraWork,
    pub(crate) statistics: Statistics,
    pub(crate) clock: TransferClock,
    pub(crate) tickets: Tickets,
    responses: Responses,
    hand_over: HandOver,
    pub(crate) watchdog: Watchdog,
    interruptions: Interruptions,
    /// The controller of the last connection.
    pub(crate) controller: Option<Controller>,
    /// The name of one whose outputs may be on, because its connection was lost. Another one may answer at its address.
    pub(crate) left_on: Option<String>,
}

/// The controller of a connection.
#[derive(Clone, Debug)]
pub(crate) struct Controller {
    pub(crate) status: QueryStatusResponse,
    pub(crate) address: Option<SocketAddr>,
    /// For the log.
    pub(crate) peer: String,
}

/// The areas that a guard has, and what it shows of them.
#[derive(Debug)]
pub(crate) struct Lease {
    pub(crate) areas: Vec<FishX1Transfer>,
    ticket: TicketId,
    /// The newest response that is in the areas.
    pub(crate) response: u64,
    /// Whether the guard reacts to this response whatever it writes, because its thread has waited for it.
    answers: bool,
    /// Whether its handle shows this response for the first time.
    shows_first: bool,
    /// The outputs count as long as there are no more interruptions than these; `None` if they do not count at all.
    counts_until: Option<u64>,
    /// Its number in its transfer.
    pub(crate) cycle: u64,
    /// When it came in.
    pub(crate) arrived: Instant,
}

/// A response that was delivered.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Delivered {
    /// The response's number.
    pub(crate) number: u64,
    /// Its number in its transfer.
    pub(crate) cycle: u64,
    /// When it came in.
    pub(crate) arrived: Instant,
    /// Whether it is the first of its connection.
    pub(crate) first: bool,
}

impl State {
    /// Areas in the kit's default configuration, without a transfer.
    pub(crate) fn new(areas: usize, watchdog: Option<Duration>, clock: TransferClock) -> Self {
        let mut areas = vec![FishX1Transfer::default(); areas];
        for (id, area) in (0..).zip(&mut areas) {
            area.state.id = id;
        }
        Self {
            transfer: Transfer::default(),
            camera: CameraWork::default(),
            statistics: Statistics::default(),
            hand_over: HandOver::new(&areas),
            tickets: Tickets::new(areas),
            responses: Responses::new(clock.now()),
            watchdog: Watchdog::new(watchdog, now()),
            interruptions: Interruptions::default(),
            controller: None,
            left_on: None,
            clock,
        }
    }

    /// The beginning of the transfer, while it is running, for a log.
    pub(crate) fn beginning(&self) -> Option<LoggedBeginning> {
        let at = self.transfer.began()?;
        let (device_name, firmware, address) = self.answering();
        Some(LoggedBeginning {
            at,
            device_name,
            firmware,
            address,
            areas: self.hand_over.outgoing().len(),
        })
    }

    /// What a line for the logger begins with: there may be several controllers.
    pub(crate) fn peer(&self) -> String {
        self.controller.as_ref().map(|it| format!("{}: ", it.peer)).unwrap_or_default()
    }

    /// What the controller has said of itself when it was connected last, and its address.
    pub(crate) fn answering(&self) -> (String, FirmwareVersion, Option<SocketAddr>) {
        let address = self.controller.as_ref().and_then(|controller| controller.address);
        let status = self.controller.as_ref().map(|controller| &controller.status);
        let firmware = status.map_or(FirmwareVersion::OLDEST_SUPPORTED, |status| status.version);
        (status.map(QueryStatusResponse::name).unwrap_or_default(), firmware, address)
    }

    /// An event that does not come with a response, with the current time.
    pub(crate) fn happens_now(&self, event: Event) -> TimedEvent {
        TimedEvent { event, cycle: self.statistics.cycles, arrived: self.clock.now() }
    }

    /// Whether the next request need not wait for the program any more.
    pub(crate) fn next_may_leave(&self) -> bool {
        if self.clock.is_lock_step() {
            return self.tickets.all_wait() || self.is_asked_for_by_command();
        }
        self.responses.opened().is_some_and(|response| self.tickets.all_have_answered(response))
    }

    /// Whether a command is sent before the next request. After a gap it is sent after the first one.
    pub(crate) fn command_comes_first(&self) -> bool {
        self.transfer.is_exchanging() && self.camera.is_asked()
    }

    /// In a gap: whether a thread waits for its command, and so for the first request, and no thread has the areas that
    /// does not wait for that, too.
    fn is_asked_for_by_command(&self) -> bool {
        let waits = |thread| self.camera.is_awaited_by(thread);
        !self.transfer.is_exchanging() && self.camera.is_asked() && self.tickets.are_at_rest(waits)
    }

    /// The thread that may take the areas now.
    pub(crate) fn first(&self) -> Option<TicketId> {
        self.tickets.first(self.responses.opened())
    }
}

/// What the program's threads do.
impl State {
    /// A thread queues to lock the areas.
    pub(crate) fn queue(&mut self) -> TicketId {
        self.tickets.add(Stage::Wants { purpose: Purpose::Lock, here: true })
    }

    /// A thread queues for the newest inputs, which it answers while their window is open. `None` when no response has
    /// come in yet on this connection.
    pub(crate) fn queue_to_look(&mut self, known: &mut Known) -> Result<Option<TicketId>, Error> {
        self.report(known)?;
        let purpose = self.responses.opened().map_or(Purpose::Look, Purpose::Answer);
        let stage = Stage::Wants { purpose, here: true };
        Ok(self.responses.last().map(|_| self.tickets.add(stage)))
    }

    /// A thread begins to wait for a response `after` this one.
    pub(crate) fn begin_wait(&mut self, known: &mut Known, after: u64) -> Result<TicketId, Error> {
        self.report(known)?;
        let stage = self.stage_of_wait(after);
        Ok(self.tickets.add(stage))
    }

    fn stage_of_wait(&self, after: u64) -> Stage {
        match self.responses.opened().filter(|response| *response > after) {
            Some(response) => Stage::Wants { purpose: Purpose::Answer(response), here: true },
            None => Stage::Waiting,
        }
    }

    /// A listener begins to wait for a response or an interruption after those that it has seen; `None` if there is one.
    /// It does not answer it.
    pub(crate) fn begin_step(&mut self, seen: Known) -> Option<TicketId> {
        let now = self.known_now();
        let is_new = now.shown > seen.shown || now.interruptions > seen.interruptions;
        (!is_new).then(|| self.tickets.add(Stage::Waiting))
    }

    /// Whether the newest response has moved the time beyond a deadline, in lock-step.
    pub(crate) fn is_too_late(&self, deadline: Option<Instant>) -> bool {
        self.clock.is_lock_step() && deadline.is_some_and(|deadline| deadline < self.clock.now())
    }

    /// Returns as an error what the handle does not know yet: the next interruption, or why no transfer is running.
    pub(crate) fn report(&mut self, known: &mut Known) -> Result<(), Error> {
        self.report_interruption(known)?;
        self.check_running(known)
    }

    fn report_interruption(&mut self, known: &mut Known) -> Result<(), Error> {
        let next = self.interruptions.next_after(known.interruptions);
        let Some((number, error)) = next else { return Ok(()) };
        known.interruptions = number;
        self.watchdog.acknowledge(number, now());
        Err(error)
    }

    /// Returns an error with the reason if no transfer is running; the handle then knows it.
    pub(crate) fn check_running(&self, known: &mut Known) -> Result<(), Error> {
        self.transfer.check_running().inspect_err(|_| {
            if !self.transfer.is_beginning() {
                self.learn_all(known);
            }
        })
    }

    /// The handle knows of all that has stopped the outputs.
    pub(crate) fn learn_all(&self, known: &mut Known) {
        known.interruptions = self.interruptions.count();
    }

    /// What is known of all that has happened so far.
    pub(crate) fn known_now(&self) -> Known {
        let newest = self.responses.newest();
        let interruptions = self.interruptions.count();
        Known { returned: newest, shown: newest, interruptions }
    }

    /// What a hook knows that is set now. It is called with the error of an expired watchdog that no handle has got: until
    /// one has, the outputs stay off and no watchdog runs.
    pub(crate) fn known_to_new_hook(&self) -> Known {
        let now = self.known_now();
        let interruptions =
            self.watchdog.expired().map_or(now.interruptions, |expired| expired - 1);
        Known { interruptions, ..now }
    }

    /// The program is alive.
    pub(crate) fn feed_watchdog(&mut self) {
        if self.watchdog.is_on() {
            self.watchdog.feed(now());
        }
    }

    /// The thread has come for the areas: gets them, brought up to date, when it is its turn.
    pub(crate) fn take(&mut self, ticket: TicketId, known: Known) -> Option<Lease> {
        let purpose = self.tickets.come(ticket)?;
        if self.first() != Some(ticket) {
            return None;
        }
        let hold = Hold { purpose, thread: current_thread(), since: now(), warned: false };
        let mut areas = self.tickets.take(ticket, hold)?;
        self.hand_over.bring_up_to_date(&mut areas, self.transfer.elapsed(self.clock.now()));
        let response = self.responses.newest();
        Some(Lease {
            areas,
            ticket,
            response,
            answers: matches!(purpose, Purpose::Answer(_)),
            shows_first: response > known.shown && self.responses.last().is_some(),
            counts_until: self.outputs_count(known).then(|| self.interruptions.count()),
            cycle: self.statistics.cycles,
            arrived: self.responses.arrived(),
        })
    }

    /// Whether the outputs count of a guard that this handle locks now: not while they are stopped and the handle does
    /// not know of that, even if the guard is dropped later.
    fn outputs_count(&self, known: Known) -> bool {
        let goes_on = self.transfer.is_exchanging() && !self.watchdog.has_expired();
        goes_on || known.interruptions >= self.interruptions.count()
    }

    /// Takes the areas back from a guard; after a panic as they were before it.
    pub(crate) fn put_back(&mut self, lease: &mut Lease, panicked: bool) {
        if panicked {
            self.hand_over.restore(&mut lease.areas);
            self.transfer.ask_to_stop(Stop::ProgramPanicked);
        } else {
            self.take_answer(lease);
        }
        let newer = self.responses.opened().filter(|response| *response > lease.response);
        self.tickets.put_back(lease.ticket, std::mem::take(&mut lease.areas), newer);
    }

    /// Takes what a guard leaves in the areas.
    fn take_answer(&mut self, lease: &Lease) {
        let reacts = lease.answers || lease.shows_first && self.hand_over.differs(&lease.areas);
        if !self.responses.answer(lease.response) && reacts && self.transfer.stop().is_none() {
            self.statistics.late_reactions += 1;
        }
        let counts = lease.counts_until == Some(self.interruptions.count());
        self.hand_over.put_back(&lease.areas, counts);
        self.feed_watchdog();
    }

    /// Since when this thread has the areas.
    pub(crate) fn held_by(&self, thread: ThreadId) -> Option<Instant> {
        self.tickets.holder().filter(|hold| hold.thread.id() == thread).map(|hold| hold.since)
    }

    /// What the cycle hook is to be called with now, if it is to be called.
    pub(crate) fn hook_call(
        &mut self,
        hook: TicketId,
        known: &mut Known,
    ) -> Option<Result<Lease, Error>> {
        if self.tickets.has_hook_before(hook, thread_id()) {
            // Only one runs at a time.
            return None;
        }
        if let Err(error) = self.report_interruption(known) {
            self.tickets.change(hook, Stage::Interrupted);
            return Some(Err(error));
        }
        if !matches!(self.tickets.stage(hook), Some(Stage::Wants { .. })) {
            let stage = self.stage_of_wait(known.returned);
            self.tickets.change(hook, stage);
        }
        let lease = self.transfer.stop().is_none().then(|| self.take(hook, *known)).flatten();
        lease.map(Ok)
    }
}

/// What the transfer thread does.
impl State {
    /// The connection is made. Returns an error when the transfer was stopped meanwhile.
    pub(crate) fn run(&mut self, config_updates: u64) -> Result<(), Stop> {
        let time = self.clock.now();
        self.transfer.run(time)?;
        self.responses.begin(time);
        self.camera.reset();
        self.watchdog.start(now());
        self.statistics = Statistics { config_updates, ..Statistics::default() };
        Ok(())
    }

    /// A response has come in. Its window is still closed.
    pub(crate) fn deliver(&mut self, inputs: &Inputs) -> Delivered {
        // What a thread writes that sees this response counts.
        self.transfer.resume();
        self.hand_over.deliver(inputs);
        self.clock.step();
        let arrived = self.clock.now();
        let before = self.responses.arrive(arrived);
        self.statistics.count_response(before, arrived);
        if before.is_none() {
            // It has what this transfer sets.
            self.left_on = None;
        }
        let (number, cycle) = (self.responses.newest(), self.statistics.cycles);
        Delivered { number, cycle, arrived, first: before.is_none() }
    }

    /// The inputs as the program sees them.
    pub(crate) fn incoming(&self) -> &Inputs {
        self.hand_over.incoming()
    }

    /// Opens the window of the newest response: all waiting threads are woken for it.
    pub(crate) fn open_window(&mut self, wake: impl Fn(TicketId)) {
        self.responses.open();
        let calls_hook = self.transfer.stop().is_none();
        let any = self.tickets.respond(self.responses.newest(), calls_hook, wake);
        if any && self.watchdog.is_on() {
            // A program that has waited for a late response does not hang. But while a thread has the areas, nobody
            // can do anything: then only the time before that was a sign of life.
            let held_since = self.tickets.holder().map(|hold| hold.since);
            self.watchdog.feed(held_since.unwrap_or_else(now));
        }
    }

    /// When a window of this length ends; in lock-step the clock does not end it.
    pub(crate) fn window_end(&self, length: Duration) -> Option<Instant> {
        let last = self.responses.last().filter(|_| !self.clock.is_lock_step());
        last.and_then(|response| response.checked_add(length))
    }

    /// When the window ends or the watchdog expires, whichever is first.
    pub(crate) fn next_deadline(&self, window_end: Option<Instant>) -> Option<Instant> {
        earlier(window_end, self.watchdog.deadline(self.hook_since()))
    }

    /// When the cycle hook got the areas, or now when it may get them at any time.
    fn hook_since(&self) -> Option<Instant> {
        if self.clock.is_lock_step() {
            return None;
        }
        self.tickets.has_hook().then(|| self.tickets.hook_since().unwrap_or_else(now))
    }

    /// If the watchdog expires, stops the motors and ends all waits; returns its limit.
    pub(crate) fn check_watchdog(&mut self, wake: impl Fn(TicketId)) -> Option<Duration> {
        let number = self.interruptions.count() + 1;
        let hook_since = self.hook_since();
        let limit = self.watchdog.check(self.clock.now(), hook_since, number)?;
        self.interruptions.note(Error::WatchdogExpired { limit });
        self.tickets.interrupt(true, wake);
        self.hand_over.stop(Cut::Motors);
        Some(limit)
    }

    /// Closes the window and counts whether the program has missed the response.
    pub(crate) fn close_window(&mut self) {
        if self.responses.close() && self.transfer.stop().is_none() {
            self.statistics.missed_responses += 1;
        }
    }

    /// What the last guard left to be sent.
    pub(crate) fn outgoing(&self) -> &[Outgoing] {
        self.hand_over.outgoing()
    }

    /// The guard that the program is to be warned of now: once for each one that takes `long`, or half of the
    /// watchdog's limit when that has just `expired`.
    pub(crate) fn guard_to_warn_of(&mut self, long: Duration, expired: bool) -> Option<Hold> {
        let limit = if expired { long.min(self.watchdog.limit() / 2) } else { long };
        let hold = self.tickets.holder_mut()?;
        if hold.warned || now() - hold.since < limit {
            return None;
        }
        hold.warned = true;
        Some(hold.clone())
    }

    /// The connection is lost, and another one is to be made: stops the outputs and ends all waits.
    pub(crate) fn lose_connection(&mut self, error: &Error, wake: impl Fn(TicketId)) {
        let cause = Box::new(error.clone());
        self.interruptions.note(Error::ConnectionLost { cause });
        self.hand_over.stop(Cut::Connection);
        self.transfer.reconnect();
        self.leave_on();
        self.statistics.gaps += 1;
        self.responses.lose_connection();
        self.responses.close();
        self.tickets.interrupt(true, wake);
    }

    /// The connection was lost, or is given up, with outputs that may be on.
    pub(crate) fn leave_on(&mut self) {
        let name = || self.controller.as_ref().map(|it| it.status.name());
        self.left_on = self.left_on.take().or_else(name);
    }

    /// This controller answers. Returns the name of another one whose outputs may be on, once.
    pub(crate) fn meet(&mut self, controller: Controller) -> Option<String> {
        let name = controller.status.name();
        self.controller = Some(controller);
        self.left_on.take_if(|before| *before != name)
    }

    /// The transfer is about to end: stops the outputs.
    pub(crate) fn leave(&mut self) {
        self.interruptions.note_end();
        self.hand_over.stop(Cut::Connection);
        self.transfer.leave();
    }

    /// The transfer has ended.
    pub(crate) fn finish(&mut self, error: Option<Error>, wake: impl Fn(TicketId)) {
        self.responses.close();
        self.camera.reset();
        self.transfer.end(self.clock.now(), error);
        self.tickets.interrupt(false, wake);
    }
}
