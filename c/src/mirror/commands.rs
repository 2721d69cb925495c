//! The commands of a program: their ids, and what becomes of a motor's after a pause.

use std::mem;

/// How many commands are known by their ids on the wire.
const KNOWN: u16 = 8;

/// The command id of one counter, motor or sound.
///
/// A program gives its commands any ids, and may set them back to 0 while one runs; a controller remembers the last id of
/// the program before. So each command has the next id on the wire, continued from the controller's, and the program
/// sees its own.
#[derive(Clone, Copy, Default)]
pub(super) struct ContinuedId {
    /// The id on the wire of the last command that went out.
    wire: u16,
    /// The program's ids of the last commands; [`place`] says where.
    ids: [u16; KNOWN as usize],
    /// How many of them are known. The first one was given before the transfer began.
    known: u16,
    /// What came back when the transfer began, which may be another one; `None` when a newer one has come.
    before: Option<u16>,
    /// The program's id that has come back.
    received: u16,
    /// Whether it is that of the last command.
    is_back: bool,
    /// Not reported as done yet.
    pending: bool,
}

/// Where the program's id of the command with this id on the wire is.
fn place(wire: u16) -> usize {
    usize::from(wire % KNOWN)
}

impl ContinuedId {
    /// A transfer begins: the controller was given `given`, and says that `echo` is done. A command that the program
    /// gave before is still to be sent.
    pub(super) fn begin(&mut self, given: u16, echo: u16) {
        (self.received, self.pending) = (self.sent(), false);
        // The next one is neither of both.
        let is_next = echo == given.wrapping_add(1);
        self.count_from(if is_next { echo } else { given }, echo);
    }

    /// From now on the program's last id is `base` on the wire.
    fn count_from(&mut self, base: u16, echo: u16) {
        self.ids[place(base)] = self.sent();
        (self.wire, self.known, self.before) = (base, 1, Some(echo));
    }

    /// The program's id that went out last.
    fn sent(&self) -> u16 {
        self.ids[place(self.wire)]
    }

    /// Whether this id of the program's is that of a new command.
    fn is_new(&self, id: u16) -> bool {
        id != self.sent()
    }

    /// The program's ids were made 0 during a transfer. If it has given a command, 0 goes out as a new one, which it does
    /// not wait for.
    pub(super) fn renew(&mut self) {
        if self.known > 1 {
            *self = Self { wire: self.wire.wrapping_add(1), known: 2, ..Self::default() };
        }
    }

    /// The id to send for the program's; none has been given yet when it is none.
    pub(super) fn send(&mut self, id: u16) -> Option<u16> {
        if self.is_new(id) {
            self.wire = self.wire.wrapping_add(1);
            self.ids[place(self.wire)] = id;
            self.known = KNOWN.min(self.known + 1);
            (self.pending, self.is_back) = (true, false);
        }
        (self.known > 1 || self.pending).then_some(self.wire)
    }

    /// The program's view of an id that came back, and whether it is the one that it is waiting for: not
    /// when it has given a newer one since.
    pub(super) fn receive(&mut self, echo: u16, newest: u16) -> (u16, bool) {
        // Not what is one further, which stops all motors at the end of the transfer: the program has not given it.
        let age = self.wire.wrapping_sub(echo);
        if self.before != Some(echo) && age < self.known {
            self.before = None;
            self.received = self.ids[place(echo)];
            self.is_back |= age == 0;
        }
        let done = self.pending && self.is_back;
        self.pending &= !done;
        (self.received, done && self.sent() == newest)
    }
}

/// A `master` above this one makes the distance an error that is injected.
const LAST_MASTER: u8 = 4;

/// The command of one motor.
#[derive(Clone, Copy, Default)]
pub(super) struct MotorCommand {
    pub(super) id: ContinuedId,
    /// How far it goes; 0 is without end.
    distance: u16,
    /// Whether no response has come since a command without a distance.
    is_fresh: bool,
    /// Whether it stops a distance that was not done.
    is_stop: bool,
    after_pause: AfterPause,
}

/// What a motor does since all outputs were off, until its next command.
#[derive(Clone, Copy, Default, PartialEq, Eq)]
enum AfterPause {
    /// What the program says; also when they were never off.
    #[default]
    AsBefore,
    /// The rest of its distance.
    Rest,
    /// Its distance was done, so it stands still, as it would have done without the pause.
    Still,
}

impl MotorCommand {
    /// A transfer begins, as in [`ContinuedId::begin`].
    pub(super) fn begin(&mut self, given: u16, echo: u16) {
        self.id.begin(given, echo);
        (self.distance, self.after_pause) = (0, AfterPause::AsBefore);
    }

    /// As [`ContinuedId::renew`]: a command without a distance.
    pub(super) fn renew(&mut self) {
        let mut id = self.id;
        id.renew();
        *self = Self { id, ..Self::default() };
    }

    /// Takes the program's command; returns the id and the distance to send.
    pub(super) fn send(
        &mut self,
        id: u16,
        master: u8,
        distance: u16,
        is_off: bool,
    ) -> (Option<u16>, u16) {
        if self.id.is_new(id) {
            let was_under_way = self.id.pending && (self.distance != 0 || self.is_stop);
            self.distance = if master > LAST_MASTER { 0 } else { distance };
            self.is_stop = was_under_way && distance == 0 && is_off;
            self.after_pause = AfterPause::AsBefore;
            self.is_fresh = self.distance == 0;
        }
        let is_rest = self.after_pause == AfterPause::Rest;
        (self.id.send(id), if is_rest { self.distance } else { distance })
    }

    /// As [`ContinuedId::receive`], for a program on a TXT: a command without a distance is done with the second response
    /// after it, not the first. Published programs end a distance by such a command, wait for 10 ms, as long as a cycle,
    /// and command the next distance: its flag must not be set by the first command.
    pub(super) fn receive_on_txt(&mut self, echo: u16, newest: u16) -> (u16, bool) {
        match mem::take(&mut self.is_fresh) {
            true => (self.id.received, false),
            false => self.id.receive(echo, newest),
        }
    }

    /// Whether it has a target: neither without end, nor with an error that is injected.
    pub(super) fn has_distance(&self) -> bool {
        self.distance != 0
    }

    /// Whether it has stopped a distance before its end.
    pub(super) fn is_stop(&self) -> bool {
        self.is_stop
    }

    /// Whether its outputs are off whatever the program says.
    pub(super) fn is_still(&self) -> bool {
        self.after_pause == AfterPause::Still
    }

    /// All outputs were off, for which the command `stop` was sent. A controller has forgotten the command before,
    /// so what is not done of it is sent anew. `echo` is the last command that is done, and `counter` what it has
    /// counted.
    pub(super) fn go_on(&mut self, stop: u16, echo: u16, counter: i16) {
        let last = self.id.wire;
        // Otherwise the outputs went off before it was sent, and the stop has its id.
        let has_begun = last == stop.wrapping_sub(1);
        let is_done = !self.id.pending || has_begun && (echo == last || echo == stop);
        if is_done && self.distance != 0 {
            self.after_pause = AfterPause::Still;
        } else if !is_done && has_begun {
            self.after_pause = AfterPause::Rest;
            if self.distance != 0 {
                self.distance = self.distance.saturating_sub(counter as u16).max(1);
            }
        }
        let base = if is_done { stop } else { stop.wrapping_add(1) };
        self.id.count_from(base, echo);
        if is_done {
            (self.id.received, self.id.is_back) = (self.id.sent(), true);
        }
    }
}
