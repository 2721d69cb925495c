//! Passes every byte on, in one thread that does nothing else.
//!
//! One thread sees things in the order in which they happen: a connection that a program has closed is closed at the
//! controller before the program's next one is made, and a program that has connected to the camera and then starts
//! it is seen to do so in this order. What has passed is handed to those who look as a copy.
//!
//! When a program has gone that was online, the controller is stopped before its connection ends.

use std::collections::BTreeMap;
use std::io::{self, ErrorKind};
use std::net::SocketAddr;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::Arc;
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use crossbeam_channel::{bounded, Receiver};
use mio::net::{TcpListener, TcpStream};
use mio::{Events, Interest, Poll, Token, Waker};

use super::halt::Halt;
use super::order::{Order, ORDER_LIMIT};
use super::passage::{connect, reset, Passage, Stage, Then, CHUNK};
use super::ports::behind;
use super::tap::{Piece, Tap, What};
use crate::gate::Gate;
use crate::lines::Rarely;
use crate::open_files;
use crate::seen::{Gone, Line};

const WAKER: Token = Token(3);
/// The first token of a connection; each has two.
const FIRST: usize = 4;

/// How long a program that comes to the camera before the controller has opened its port is kept waiting, and the
/// pause between two attempts.
const CAMERA_LIMIT: Duration = Duration::from_secs(5);
const CAMERA_RETRY: Duration = Duration::from_millis(20);
/// How many are accepted before the others have their turn: those who come again and again do not hold up the one that
/// drives.
const AT_ONCE: usize = 8;
/// How long to wait when no program can be accepted, as with too many open files.
const ACCEPT_RETRY: Duration = Duration::from_millis(50);

/// A relay that runs, until it is dropped.
pub(super) struct Relay {
    stop: Arc<AtomicBool>,
    gate: Arc<Gate>,
    has_come: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
    /// Why it has ended by itself.
    pub(super) failure: Receiver<io::Error>,
}

impl Relay {
    pub(super) fn start(
        listeners: [TcpListener; 3],
        controller: SocketAddr,
        tap: Tap,
        leaves_outputs: bool,
        gate: Arc<Gate>,
    ) -> anyhow::Result<Self> {
        let mut worker = Worker::new(listeners, controller, tap, leaves_outputs, gate)?;
        let (stop, gate) = (Arc::clone(&worker.stop), Arc::clone(&worker.gate));
        let has_come = Arc::clone(&worker.has_come);
        let (failed, failure) = bounded(1);
        let work = move || {
            if let Err(error) = worker.run() {
                // When nobody waits for it, the program ends already.
                let _ = failed.send(error);
            }
        };
        let thread = thread::Builder::new().name("relay".to_owned()).spawn(work)?;
        Ok(Self { stop, gate, has_come, thread: Some(thread), failure })
    }

    /// Whether a program has connected to the main port.
    pub(super) fn has_come(&self) -> bool {
        self.has_come.load(Ordering::Relaxed)
    }
}

impl Drop for Relay {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if self.gate.wake() {
            if let Some(thread) = self.thread.take() {
                // It has reported its error.
                let _ = thread.join();
            }
        }
    }
}

struct Worker {
    listeners: [TcpListener; 3],
    controller: SocketAddr,
    tap: Tap,
    /// No controller is stopped whose program has gone.
    leaves_outputs: bool,
    poll: Poll,
    /// By number.
    passages: BTreeMap<u64, Passage>,
    /// When a controller has last answered an exchange on a connection that is no more, and its name.
    exchanged: Option<(Instant, Option<String>)>,
    /// Controllers that are being stopped.
    halts: Vec<Halt>,
    /// How many connections to a port there may be. A further one ends the one that was not used for the longest time.
    most: usize,
    /// Programs that come while the controller is being stopped.
    held: Vec<(TcpStream, SocketAddr)>,
    numbers: u64,
    chunk: Vec<u8>,
    /// There is more to pass on at once.
    busy: bool,
    /// When to try again to accept programs.
    accept_at: Option<Instant>,
    /// Why no program could be accepted.
    warning: Rarely,
    /// The log has that there are many connections.
    has_warned_of_many: bool,
    order: Order,
    gate: Arc<Gate>,
    /// A program has connected to the main port.
    has_come: Arc<AtomicBool>,
    stop: Arc<AtomicBool>,
}

impl Worker {
    fn new(
        mut listeners: [TcpListener; 3],
        controller: SocketAddr,
        tap: Tap,
        leaves_outputs: bool,
        gate: Arc<Gate>,
    ) -> io::Result<Self> {
        let poll = Poll::new()?;
        gate.wakes(Waker::new(poll.registry(), WAKER)?);
        for (index, listener) in listeners.iter_mut().enumerate() {
            poll.registry().register(listener, Token(index), Interest::READABLE)?;
        }
        Ok(Self {
            listeners,
            controller,
            tap,
            leaves_outputs,
            poll,
            passages: BTreeMap::new(),
            exchanged: None,
            halts: Vec::new(),
            most: open_files::for_programs(),
            held: Vec::new(),
            numbers: 0,
            chunk: vec![0; CHUNK],
            busy: false,
            accept_at: None,
            warning: Rarely::default(),
            has_warned_of_many: false,
            order: Order::default(),
            gate,
            has_come: Arc::default(),
            stop: Arc::default(),
        })
    }

    fn run(&mut self) -> io::Result<()> {
        let mut events = Events::with_capacity(256);
        while !self.stop.load(Ordering::Relaxed) {
            let limit = self.limit();
            match self.poll.poll(&mut events, limit) {
                Err(error) if error.kind() == ErrorKind::Interrupted => continue,
                done => done?,
            }
            let mut knocks = [false; 3];
            for event in &events {
                match event.token() {
                    Token(index @ 0..=2) => knocks[index] = true,
                    WAKER => {}
                    Token(token) => self.note(token, event.is_read_closed()),
                }
            }
            if self.accept_at.is_some_and(|at| at <= Instant::now()) {
                self.accept_at = None;
                knocks = [true; 3];
            }
            self.busy = false;
            if self.gate.is_shut() {
                self.shut_out();
            }
            // A program that connects to the camera and then starts it has connected first.
            for line in [Line::Camera, Line::I2c] {
                if knocks[line.index()] {
                    self.accept(line);
                }
            }
            self.connect();
            self.pass(|_| true);
            self.end_the_halves();
            self.halt_the_silent();
            self.go_on_to_halt();
            if knocks[Line::Main.index()] {
                self.accept(Line::Main);
            }
        }
        self.leave(&mut events)
    }

    /// Stops what programs still drive, and ends all connections.
    fn end_all(&mut self, gone: Gone) {
        let numbers: Vec<_> = self.passages.keys().copied().collect();
        let (mut driving, others): (Vec<_>, Vec<_>) =
            numbers.into_iter().partition(|number| self.passages[number].is_to_stop());
        // Those that the controller does not serve have nothing to stop, while it serves another one.
        driving.sort_by_key(|number| self.passages[number].is_served());
        driving.into_iter().for_each(|number| self.halt(number, gone));
        // StopOnline takes a second while a connection to I2C is open.
        others.into_iter().for_each(|number| self.close(number));
        self.halts.iter_mut().filter(|halt| halt.waits()).for_each(Halt::go_on_at_once);
        self.held.clear();
    }

    /// Somebody wants no program to go on: what it has left on goes off, whatever was wanted at the start.
    fn shut_out(&mut self) {
        self.passages.values_mut().for_each(|passage| passage.leaves_outputs = false);
        self.end_all(Gone::Page);
    }

    /// Stops what a program still drives, and closes everything.
    fn leave(&mut self, events: &mut Events) -> io::Result<()> {
        self.end_all(Gone::Watch);
        loop {
            self.go_on_to_halt();
            if self.halts.is_empty() {
                return Ok(());
            }
            let limit = self.limit();
            match self.poll.poll(events, limit) {
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                done => done?,
            }
        }
    }

    /// How long to wait for something to happen.
    fn limit(&self) -> Option<Duration> {
        if self.busy {
            return Some(Duration::ZERO);
        }
        let now = Instant::now();
        let times = self.passages.values().filter_map(|passage| match passage.stage {
            Stage::Again(at) => Some(at),
            Stage::Connecting(since) => [since + ORDER_LIMIT, passage.given_up_at()]
                .into_iter()
                .filter(|at| *at > now)
                .min(),
            Stage::Open => passage.silent_at().into_iter().chain(passage.ends_at()).min(),
        });
        let halts = self.halts.iter().map(Halt::next_at);
        let next = times.chain(self.accept_at).chain(halts).min()?;
        // Not a moment too early: it would be for nothing.
        Some(next.saturating_duration_since(now) + Duration::from_micros(100))
    }

    /// Notes that a program has gone before it was connected.
    fn note(&mut self, token: usize, closed: bool) {
        let (number, is_program) = (((token - FIRST) / 2) as u64, (token - FIRST) % 2 == 0);
        if let Some(passage) = self.passages.get_mut(&number).filter(|_| is_program && closed) {
            passage.program_ended |= passage.stage != Stage::Open;
        }
    }

    /// Accepts programs that wait.
    fn accept(&mut self, line: Line) {
        for _ in 0..AT_ONCE {
            let accepted = self.listeners[line.index()].accept();
            let (program, from) = match accepted {
                Ok(accepted) => accepted,
                Err(error) if error.kind() == ErrorKind::WouldBlock => return,
                Err(error) if error.kind() == ErrorKind::Interrupted => continue,
                Err(error) => {
                    if self.warning.is_due() {
                        log::warn!("a program can't be accepted: {error}");
                    }
                    self.accept_at = Some(Instant::now() + ACCEPT_RETRY);
                    return;
                }
            };
            if line == Line::Main {
                self.has_come.store(true, Ordering::Relaxed);
            }
            if self.gate.is_shut() {
                reset(&program);
                continue;
            }
            // What was closed before is closed at the controller first.
            self.pass(|other| line == Line::Main || other == line);
            if line == Line::Main && !self.halts.iter().all(Halt::waits) {
                if self.held.len() == self.most {
                    self.held.remove(0);
                }
                self.held.push((program, from));
            } else {
                self.admit(line, program, from);
            }
        }
        // More may wait.
        self.accept_at = Some(Instant::now());
    }

    /// Begins to connect to the controller for a program.
    fn admit(&mut self, line: Line, program: TcpStream, from: SocketAddr) {
        if line == Line::Main {
            // It may have come back, also if the controller refuses it now.
            self.halts.iter_mut().filter(|halt| halt.waits()).for_each(Halt::put_off);
        }
        if !self.has_room(line) {
            return reset(&program);
        }
        self.numbers += 1;
        let number = self.numbers;
        self.report(line, number, What::Opened(from));
        let (address, tokens) = (behind(self.controller, line), tokens(number));
        let registry = self.poll.registry();
        match Passage::begin((line, number), program, address, registry, tokens) {
            Ok(mut passage) => {
                passage.leaves_outputs = self.leaves_outputs;
                self.passages.insert(number, passage);
            }
            Err(error) => {
                self.report(line, number, What::Refused(error));
                self.report(line, number, What::Closed);
            }
        }
    }

    /// Makes room for a connection to this port; returns whether there is room. One that drives is not ended for it,
    /// and what its program uses beside it is the last to be.
    fn has_room(&mut self, line: Line) -> bool {
        let all = || self.passages.values().filter(|one| one.line == line);
        if all().count() < self.most {
            return true;
        }
        if !std::mem::replace(&mut self.has_warned_of_many, true) {
            log::warn!(
                "{} {} connections are open: each further one ends an unused one",
                self.most,
                line.name()
            );
        }
        let drives = |one: &&Passage| one.drives() && one.is_served();
        let main = self.passages.values().find(drives);
        let serves = |one: &Passage| main.map(|main| one.serves(main));
        let others = all().filter(|one| !drives(one));
        let unused = others.min_by_key(|one| (!one.is_half(), serves(one), one.used()));
        let unused = unused.map(|one| one.number);
        unused.into_iter().for_each(|number| self.close(number));
        unused.is_some()
    }

    /// Ends connections of which one side has ended, and where nothing passes any more.
    fn end_the_halves(&mut self) {
        let now = Instant::now();
        let is_over = |one: &&Passage| one.ends_at().is_some_and(|at| at <= now);
        let over: Vec<_> = self.passages.values().filter(is_over).map(|one| one.number).collect();
        over.into_iter().for_each(|number| self.close(number));
    }

    /// Stops the controller of a program that has gone, unless it has served another one all the time.
    fn halt(&mut self, number: u64, gone: Gone) {
        let Some(passage) = self.remove(number) else { return };
        let serves = |other: &Passage| other.is_served() && other.drives();
        if !passage.is_served() && self.passages.values().any(serves) {
            drop(passage);
            return self.report(Line::Main, number, What::Closed);
        }
        self.halts.extend(passage.halt(gone, &self.tap));
    }

    /// Begins to stop the controller for programs that say nothing more. The controller would close their connections
    /// a moment later, and then it would be too late.
    fn halt_the_silent(&mut self) {
        let now = Instant::now();
        let is_silent = |one: &&Passage| one.silent_at().is_some_and(|at| at <= now);
        let silent = self.passages.values().filter(is_silent);
        let silent: Vec<_> = silent.map(|one| (one.number, self.successor(one))).collect();
        for (number, successor) in silent {
            let Some(name) = successor else {
                self.halt(number, Gone::Silent);
                continue;
            };
            // Its end is not the end of the other program.
            let halt = self.remove(number).and_then(Passage::halt_later);
            self.report(Line::Main, number, What::Closed);
            if let Some(halt) = halt {
                halt.tell_of_another(name.as_deref(), &self.tap);
            }
        }
    }

    /// The name of the controller that has answered exchanges on another connection since this one was ended: the outputs
    /// are those of that program. `None` if none has.
    fn successor(&self, one: &Passage) -> Option<Option<String>> {
        let others = self.passages.values().filter(|other| other.number != one.number);
        let (at, name) =
            others.filter_map(Passage::exchange).chain(self.exchanged.clone()).max()?;
        let is_later = at > one.exchanged().unwrap_or(one.begun);
        (one.is_left() && is_later).then_some(name)
    }

    fn remove(&mut self, number: u64) -> Option<Passage> {
        let passage = self.passages.remove(&number)?;
        self.exchanged = self.exchanged.take().max(passage.exchange());
        Some(passage)
    }

    /// Goes on to stop controllers whose program has gone. Afterwards others are let in.
    fn go_on_to_halt(&mut self) {
        if self.halts.is_empty() {
            return;
        }
        self.wait_for_return();
        for mut halt in std::mem::take(&mut self.halts) {
            let [of_i2c, of_main] = tokens(halt.connection);
            let connect = |line| {
                let token = if line == Line::Main { of_main } else { of_i2c };
                connect(behind(self.controller, line), self.poll.registry(), token)
            };
            if !halt.go_on(connect, &mut self.chunk, &self.tap) {
                self.halts.push(halt);
            }
        }
        if self.halts.iter().all(Halt::waits) {
            for (program, from) in std::mem::take(&mut self.held) {
                self.admit(Line::Main, program, from);
            }
        }
    }

    /// A program that has come back stops what was left by its first exchange: going online clears the outputs, and that
    /// sends them. One that has not exchanged may still do so.
    fn wait_for_return(&mut self) {
        if !self.held.is_empty() {
            self.halts.iter_mut().filter(|halt| halt.pauses()).for_each(Halt::put_off);
        }
        let mut mains = self.passages.values().filter(|one| one.line == Line::Main).peekable();
        if mains.peek().is_none() {
            return;
        }
        if let Some((exchanged, name)) = mains.filter_map(Passage::exchange).max() {
            let tap = &self.tap;
            self.halts.retain(|halt| !halt.is_over_since(exchanged, name.as_deref(), tap));
        }
        if self.halts.iter().any(Halt::is_overdue) {
            // The controller serves one at a time.
            let looks = |one: &&Passage| one.line == Line::Main;
            let numbers: Vec<_> =
                self.passages.values().filter(looks).map(|one| one.number).collect();
            for number in numbers {
                // What it has left is stopped with the rest.
                drop(self.remove(number));
                self.report(Line::Main, number, What::Closed);
            }
            self.halts.iter_mut().filter(|halt| halt.waits()).for_each(Halt::go_on_at_once);
            return;
        }
        self.halts.iter_mut().filter(|halt| halt.waits()).for_each(Halt::put_off);
    }

    /// Goes on with connections that are being made.
    fn connect(&mut self) {
        let now = Instant::now();
        let open = |passage: &Passage| passage.stage == Stage::Open;
        let numbers: Vec<_> =
            self.passages.values().filter(|one| !open(one)).map(|one| one.number).collect();
        for number in numbers {
            let Some(passage) = self.passages.get_mut(&number) else { continue };
            let (line, begun) = (passage.line, passage.begun);
            let done = match passage.stage {
                Stage::Again(at) if at > now => continue,
                Stage::Again(_) if !passage.program_waits() => {
                    self.close(number);
                    continue;
                }
                Stage::Again(_) => {
                    let address = behind(self.controller, line);
                    passage.try_again(address, self.poll.registry(), tokens(number)[1])
                }
                Stage::Connecting(_) | Stage::Open => passage.is_connected().map(drop),
            };
            let Err(error) = done else {
                if passage.is_given_up() {
                    passage.reset();
                    self.close(number);
                }
                continue;
            };
            let is_early = line == Line::Camera
                && error.kind() == ErrorKind::ConnectionRefused
                && now < begun + CAMERA_LIMIT;
            if is_early {
                passage.stage = Stage::Again(now + CAMERA_RETRY);
            } else {
                passage.reset();
                self.report(line, number, What::Refused(error));
                self.close(number);
            }
        }
    }

    /// Whether commands wait for a connection to the camera or to I2C that is being made.
    fn is_one_coming(&mut self) -> bool {
        let is_first = |one: &&Passage| one.stage == Stage::Connecting(one.begun);
        let coming = self.passages.values().filter(|one| one.line != Line::Main).filter(is_first);
        self.order.waits(coming.map(|one| one.begun), Instant::now())
    }

    /// Passes on what is there, on these connections.
    fn pass(&mut self, which: impl Fn(Line) -> bool) {
        let may_command = !self.is_one_coming();
        let (mut closed, mut gone) = (Vec::new(), None);
        for passage in self.passages.values_mut() {
            if passage.stage != Stage::Open || !which(passage.line) {
                continue;
            }
            let may_send = may_command || passage.line != Line::Main;
            match passage.pass(may_send, &mut self.chunk, &self.tap) {
                Then::Waits => {}
                Then::More => self.busy = true,
                Then::Closed => closed.push(passage.number),
                Then::Gone(why) => {
                    gone = Some((passage.number, why));
                    // Nothing is done before the controller is stopped.
                    self.busy = true;
                    break;
                }
            }
        }
        if let Some((number, why)) = gone {
            self.halt(number, why);
        }
        closed.into_iter().for_each(|number| self.close(number));
    }

    fn close(&mut self, number: u64) {
        if let Some(passage) = self.remove(number) {
            let line = passage.line;
            // Its sockets are closed before that is reported.
            let halt = passage.halt_later();
            halt.into_iter().for_each(|halt| self.halt_later(halt));
            self.report(line, number, What::Closed);
        }
    }

    /// Waits to stop a controller. All that wait do the same, so a few are enough for programs that come again and
    /// again to a controller that ends their connections.
    fn halt_later(&mut self, halt: Halt) {
        if self.halts.len() >= self.most {
            let waiting = self.halts.iter().position(Halt::waits);
            waiting.map(|place| self.halts.remove(place));
        }
        self.halts.push(halt);
    }

    fn report(&self, line: Line, connection: u64, what: What) {
        self.tap.report(Piece { line, connection, at: Instant::now(), what });
    }
}

/// The tokens of a connection: its program, its controller.
fn tokens(number: u64) -> [Token; 2] {
    let first = FIRST + 2 * number as usize;
    [Token(first), Token(first + 1)]
}

#[cfg(test)]
mod tests {
    use super::super::driven::Driven;
    use super::super::ports::listen;
    use super::super::tap::tap;
    use super::*;

    #[test]
    fn no_more_stops_wait_than_there_are_connections() {
        let (tap, _pieces) = tap();
        let nobody = SocketAddr::new([127, 0, 0, 1].into(), 1);
        let mut worker =
            Worker::new(listen(0).unwrap(), nobody, tap, false, Arc::default()).unwrap();
        for number in 0..100 {
            worker.halt_later(Halt::later(Gone::Lost, number, Driven::new()));
        }
        let numbers: Vec<_> = worker.halts.iter().map(|halt| halt.connection).collect();
        assert_eq!(numbers, (100 - worker.most as u64..100).collect::<Vec<_>>());
    }

    #[test]
    fn a_few_programs_are_accepted_at_once_and_all_in_the_end() {
        let controller = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
        let main = SocketAddr::new([127, 0, 0, 1].into(), controller.local_addr().unwrap().port());
        let (tap, _pieces) = tap();
        let listeners = listen(0).unwrap();
        let camera = listeners[1].local_addr().unwrap();
        let mut worker = Worker::new(listeners, main, tap, false, Arc::default()).unwrap();
        let come = |_| std::net::TcpStream::connect(camera).unwrap();
        let _programs: Vec<_> = (0..2 * AT_ONCE + 1).map(come).collect();
        for accepted in [AT_ONCE, 2 * AT_ONCE, 2 * AT_ONCE + 1] {
            worker.accept_at = None;
            worker.accept(Line::Camera);
            assert_eq!(worker.numbers, accepted as u64);
            assert_eq!(worker.accept_at.is_some(), accepted % AT_ONCE == 0, "more may wait");
        }
    }
}
