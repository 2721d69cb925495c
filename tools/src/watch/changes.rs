//! What passes, as lines of JSON on stdout: each change of a value, and all that is not an exchange.
//!
//! A thread of its own prints them, so that a reader that pauses stops nothing. What it has no room for is left out
//! and counted.

use std::collections::HashMap;
use std::io::{self, BufWriter, ErrorKind, Write};
use std::thread;
use std::time::{Duration, Instant};

use crossbeam_channel::{bounded, Receiver, Sender};
use ft_transfer_area::tx::{Counter, Input, Motor};
use ft_transfer_area::wire::CommandId;
use ft_transfer_area::FishX1Transfer;
use serde::Serialize;
use serde_json::{json, Map, Value};

use crate::commands::Pair;
use crate::names::Names;
use crate::print;
use crate::queue::{queue, Put, Take};
use crate::seen::{Farewell, Happened, Seen, UnansweredExchanges, Unknown, MISSED};
use crate::values::{CounterValue, InputValue, RemoteValue, SoundValue};

/// How many bytes of lines may wait for their reader. A line may have hundreds of thousands.
const ROOM: usize = 16 << 20;
/// One part of so many is only for what happens to connections, which does not come again. Half of that part is also for
/// the last values of those that end.
const KEPT_OF: usize = 16;
/// The keys of lines that have a terminal.
const TERMINALS: [&str; 3] = ["input", "counter", "motor"];

/// How soon to look for room in an output that does not wait.
const LOOK: Duration = Duration::from_millis(10);
/// How long a reader may take for the last ones.
const END_LIMIT: Duration = Duration::from_millis(500);

/// Prints lines.
pub(super) struct Changes {
    lines: Put<String>,
    begin: Instant,
    names: Names,
    /// The values of each area that were printed last, for each connection; none before its first cycle.
    seen: HashMap<u64, Vec<Vec<Printed>>>,
    /// How many were left out since the last line.
    lost: u64,
    /// There was no room for a line of this cycle, and no others are tried.
    is_full: bool,
    /// Ends when all is printed.
    printed: Receiver<()>,
}

/// A value as it was printed last.
struct Printed {
    value: Value,
    /// Its first cycle. Without one the controller may never have had it.
    cycle: Option<u64>,
    /// Otherwise it has to be printed again.
    had_room: bool,
}

/// The outputs of a pair, and the command that is carried out.
#[derive(Serialize)]
struct MotorValue {
    kind: Pair,
    duty: [i16; 2],
    distance: u16,
    /// The motor that it follows, from 1; 5 to 8 with an error to correct; 0 none.
    master: u8,
    ready: bool,
}

impl Changes {
    pub(super) fn start(names: Names) -> anyhow::Result<Self> {
        let (put, lines) = queue(ROOM);
        let (printing, printed) = bounded(0);
        thread::Builder::new().name("lines".to_owned()).spawn(move || {
            let _printing: Sender<()> = printing;
            if let Err(error) = write(&lines, io::stdout().lock()) {
                // A reader that has seen enough, such as head, is not an error.
                if error.kind() != ErrorKind::BrokenPipe {
                    log::warn!(
                        "no more lines are printed: {error:#}; everything is passed on as before"
                    );
                }
            }
        })?;
        Ok(Self::new(put, names, printed))
    }

    fn new(lines: Put<String>, names: Names, printed: Receiver<()>) -> Self {
        Self {
            lines,
            begin: Instant::now(),
            names,
            seen: HashMap::new(),
            lost: 0,
            is_full: false,
            printed,
        }
    }

    /// Says where the program has to connect to.
    pub(super) fn begin(&self, main: &str, controller: &str, page: Option<&str>) {
        let line = json!({"ms": 0.0, "what": "listening", "main": main, "controller": controller, "page": page});
        // There is room: it is the first one.
        let _ = self.lines.put(print::json_line(&line), 0);
    }

    /// Waits until all is printed, but not for a reader that pauses.
    pub(super) fn finish(self) {
        let Self { lines, printed, .. } = self;
        drop(lines);
        // It ends in an error in any case: nothing is ever sent.
        let _ = printed.recv_timeout(END_LIMIT);
    }

    pub(super) fn take(&mut self, seen: &Seen) {
        if matches!(seen.what, Happened::Online | Happened::Offline(_) | Happened::Closed) {
            self.tell_rest(seen);
        }
        let line = seen.line.name();
        let value = match &seen.what {
            Happened::Cycle(cycle) => return self.areas(seen, &cycle.areas, Some(cycle.number)),
            Happened::Unanswered(them) => {
                let UnansweredExchanges { exchanges, forgotten, areas } = &**them;
                let counts =
                    json!({"what": "unanswered", "exchanges": exchanges, "forgotten": forgotten});
                self.put(seen, counts);
                return self.areas(seen, areas, None);
            }
            Happened::Connected(from) => {
                json!({"what": "connected", "connection": line, "from": from.to_string()})
            }
            Happened::Refused(error) => {
                json!({"what": "refused", "connection": line, "why": format!("{error:#}")})
            }
            Happened::Closed => {
                self.seen.remove(&seen.connection);
                json!({"what": "closed", "connection": line})
            }
            Happened::Controller { name, firmware } => {
                json!({"what": "controller", "name": name, "firmware": firmware.to_string()})
            }
            Happened::Command(command) => json!({"what": "command", "command": command.name()}),
            Happened::Online => {
                self.seen.remove(&seen.connection);
                json!({"what": "online"})
            }
            Happened::Halted { gone, error } => {
                json!({"what": "outputs_off", "because": gone.name(), "done": error.is_none(), "why": error.as_ref().map(ToString::to_string)})
            }
            Happened::Offline(farewell) => {
                let by_program = *farewell == Farewell::Answered;
                json!({"what": "offline", "by_program": by_program, "stop_online": farewell.name()})
            }
            Happened::Picture(frame) => {
                json!({"what": "picture", "number": frame.sequence, "width": frame.width, "height": frame.height, "bytes": frame.data.len()})
            }
            Happened::I2c(exchange) => {
                json!({"what": "i2c", "device": exchange.device, "written": exchange.written, "read": exchange.read})
            }
            Happened::Ignored { controller } => {
                json!({"what": "ignored", "command": CommandId::UpdateConfig.name(), "controller": controller})
            }
            Happened::Unknown(Unknown { side, id, bytes }) => {
                json!({"what": "unknown", "from": side.name(), "id": format!("{id:#010x}"), "bytes": bytes})
            }
            Happened::NoAnswer { command, since } => {
                let seconds = seen.at.saturating_duration_since(*since).as_secs_f64();
                json!({"what": "no_answer", "command": command.name(), "seconds": (seconds * 10.0).round() / 10.0})
            }
            Happened::NotUnderstood { side, why } => {
                json!({"what": "not_understood", "connection": line, "from": side.name(), "why": why})
            }
            Happened::Missed => json!({"what": "missed", "connection": line, "why": MISSED}),
        };
        self.put(seen, value);
    }

    /// The changes of a cycle, or of what was sent without an answer.
    fn areas(&mut self, seen: &Seen, areas: &[FishX1Transfer], cycle: Option<u64>) {
        self.is_full = false;
        let alive = areas.first().map_or([0; 8], |master| master.state.io_slave_alive);
        let mut last = self.seen.remove(&seen.connection).unwrap_or_default();
        last.resize_with(last.len().max(areas.len()), Vec::new);
        for (index, (area, last)) in areas.iter().zip(&mut last).enumerate() {
            let is_there = index.checked_sub(1).is_none_or(|extension| alive[extension] != 0);
            let mut values = if is_there { values(index, area) } else { Vec::new() };
            if index > 0 {
                values.insert(0, json!({"controller": name(index), "alive": is_there}));
            }
            let mut before = std::mem::take(last).into_iter();
            let print = |value| match before.next() {
                Some(known) if known.says(&value, cycle.is_some()) => match known.had_room {
                    true => known,
                    // It was counted when it had no room.
                    false => self.print(seen, index, value, cycle),
                },
                _ => {
                    let printed = self.print(seen, index, value, cycle);
                    self.lost += u64::from(!printed.had_room);
                    printed
                }
            };
            *last = values.into_iter().map(print).collect();
        }
        self.seen.insert(seen.connection, last);
    }

    /// Prints a value with the number of its cycle, or says that it has none.
    fn print(&mut self, seen: &Seen, area: usize, value: Value, cycle: Option<u64>) -> Printed {
        let had_room = !self.is_full && self.try_put(seen, self.line(area, &value, cycle));
        self.is_full = !had_room;
        Printed { value, cycle, had_room }
    }

    /// Prints the values of a connection that had no room: no cycle tries them again.
    fn tell_rest(&mut self, seen: &Seen) {
        let Some(mut areas) = self.seen.remove(&seen.connection) else { return };
        let room = self.lines.room() / (2 * KEPT_OF) * (2 * KEPT_OF - 1);
        for (area, values) in areas.iter_mut().enumerate() {
            for known in values.iter_mut().filter(|known| !known.had_room) {
                let line = self.line(area, &known.value, known.cycle);
                known.had_room = self.put_below(seen, line, room);
            }
        }
        self.seen.insert(seen.connection, areas);
    }

    /// The line of a value.
    fn line(&self, area: usize, value: &Value, cycle: Option<u64>) -> Value {
        let mut line = value.clone();
        let terminal = TERMINALS.iter().find_map(|kind| value[kind].as_str());
        if let Some(name) = terminal.and_then(|terminal| self.names.of(area, terminal)) {
            line["name"] = json!(name);
        }
        match cycle {
            Some(number) => line["cycle"] = json!(number),
            None => line["answered"] = json!(false),
        }
        line
    }

    /// Prints a line. Without room it is lost.
    fn put(&mut self, seen: &Seen, value: Value) {
        self.lost += u64::from(!self.try_put(seen, value));
    }

    /// Prints a line, if there is room for it, with how many are lost before it.
    fn try_put(&mut self, seen: &Seen, value: Value) -> bool {
        let room = match is_of_connection(&seen.what) {
            true => self.lines.room(),
            false => self.lines.room() / KEPT_OF * (KEPT_OF - 1),
        };
        self.put_below(seen, value, room)
    }

    fn put_below(&mut self, seen: &Seen, value: Value, room: usize) -> bool {
        let ms = seen.at.saturating_duration_since(self.begin).as_micros() as f64 / 1e3;
        let mut line = Map::from_iter([("ms".to_owned(), json!(ms))]);
        line.insert("connection_number".to_owned(), json!(seen.connection));
        if self.lost > 0 {
            line.insert("lost".to_owned(), json!(self.lost));
        }
        if let Value::Object(members) = value {
            line.extend(members);
        }
        let line = print::json_line(&Value::Object(line));
        let bytes = line.capacity();
        let had_room = self.lines.put_below(line, bytes, room);
        if had_room {
            self.lost = 0;
        }
        had_room
    }
}

impl Printed {
    /// Whether there is nothing new in this value. That it was answered is new once.
    fn says(&self, value: &Value, is_answered: bool) -> bool {
        self.value == *value && (self.cycle.is_some() || !is_answered)
    }
}

/// Whether this happens to a connection, and not on it.
fn is_of_connection(what: &Happened) -> bool {
    match what {
        Happened::Connected(_)
        | Happened::Refused(_)
        | Happened::Closed
        | Happened::Controller { .. }
        | Happened::Online
        | Happened::Halted { .. }
        | Happened::Offline(_)
        | Happened::NotUnderstood { .. }
        | Happened::Missed => true,
        Happened::Command(_)
        | Happened::Cycle(_)
        | Happened::Picture(_)
        | Happened::I2c(_)
        | Happened::Ignored { .. }
        | Happened::Unknown(_)
        | Happened::NoAnswer { .. }
        | Happened::Unanswered(_) => false,
    }
}

/// `TXT`, `E1` to `E8`.
pub(super) fn name(area: usize) -> String {
    if area == 0 {
        "TXT".to_owned()
    } else {
        format!("E{area}")
    }
}

/// All values of an area, always in the same order.
fn values(index: usize, area: &FishX1Transfer) -> Vec<Value> {
    let inputs = Input::ALL
        .map(|input| value(index, "input", json!(input.to_string()), InputValue::of(area, input)));
    let counters = Counter::ALL.map(|counter| {
        value(index, "counter", json!(counter.to_string()), CounterValue::of(area, counter))
    });
    let motors = Motor::ALL
        .map(|motor| value(index, "motor", json!(motor.to_string()), MotorValue::of(area, motor)));
    let sound = value(index, "what", json!("sound"), SoundValue::of(area));
    let remotes = area.txt_inputs.ir_input.iter().enumerate();
    let remotes = remotes
        .map(|(number, remote)| value(index, "remote", json!(number), RemoteValue::from(remote)));
    inputs.into_iter().chain(counters).chain(motors).chain([sound]).chain(remotes).collect()
}

fn value(area: usize, kind: &str, terminal: Value, value: impl Serialize) -> Value {
    let mut line = Map::new();
    line.insert("controller".to_owned(), json!(name(area)));
    line.insert(kind.to_owned(), terminal);
    if let Value::Object(members) = json!(value) {
        line.extend(members);
    }
    Value::Object(line)
}

impl MotorValue {
    fn of(area: &FishX1Transfer, motor: Motor) -> Self {
        let index = motor.index();
        Self {
            kind: Pair::of(area, motor),
            duty: motor.outputs().map(|output| area.output.duty[output.index()]),
            distance: area.output.distance[index],
            master: area.output.master[index],
            ready: area.is_motor_ex_ready(motor),
        }
    }
}

fn write(lines: &Take<String>, out: impl Write) -> io::Result<()> {
    let mut out = BufWriter::new(Waits(out));
    while let Ok(line) = lines.wait() {
        writeln!(out, "{line}")?;
        if lines.is_empty() {
            out.flush()?;
        }
    }
    Ok(())
}

/// Waits for room. A program that shares this output may have made it one that does not wait, as Node.js and ssh do.
struct Waits<W>(W);

impl<W: Write> Write for Waits<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        when_there_is_room(|| self.0.write(bytes))
    }

    fn flush(&mut self) -> io::Result<()> {
        when_there_is_room(|| self.0.flush())
    }
}

fn when_there_is_room<T>(mut write: impl FnMut() -> io::Result<T>) -> io::Result<T> {
    loop {
        match write() {
            Err(error) if error.kind() == ErrorKind::WouldBlock => thread::sleep(LOOK),
            done => return done,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::seen::{Cycle, I2cExchange, Line};

    /// An output that has room for 5 bytes, then for none, and so on.
    struct Tight(Vec<u8>, bool);

    impl Write for Tight {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            self.1 = !self.1;
            if self.1 {
                return Err(ErrorKind::WouldBlock.into());
            }
            let room = bytes.len().min(5);
            self.0.extend_from_slice(&bytes[..room]);
            Ok(room)
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn an_output_that_does_not_wait_gets_all_lines() {
        let (put, take) = queue(10_000);
        for line in ["the first line", "the second"] {
            assert!(put.put(line.to_owned(), 0));
        }
        drop(put);
        let mut out = Tight(Vec::new(), false);
        write(&take, &mut out).unwrap();
        assert_eq!(out.0, b"the first line\nthe second\n");
    }

    #[test]
    fn lines_that_wait_take_no_more_bytes_than_there_is_room_for() {
        let (put, take) = queue(10_000);
        let mut changes = Changes::new(put, Names::default(), bounded(0).1);
        let seen = |bytes| {
            let exchange = I2cExchange { device: 8, written: vec![7; bytes], read: None };
            let (at, line) = (Instant::now(), Line::I2c);
            Seen { at, line, connection: 3, what: Happened::I2c(exchange) }
        };
        (0..20).for_each(|_| changes.take(&seen(2000)));
        let lines: Vec<String> = std::iter::from_fn(|| take.next()).collect();
        assert!(lines.iter().map(String::len).sum::<usize>() < 10_000, "{}", lines.len());
        changes.take(&seen(1));
        let next: Value = serde_json::from_str(&take.next().unwrap()).unwrap();
        assert_eq!(
            (&next["lost"], &next["connection_number"]),
            (&json!(20 - lines.len()), &json!(3))
        );
    }

    #[test]
    fn a_value_without_room_is_told_when_there_is_room() {
        let (put, take) = queue(60_000);
        let mut changes = Changes::new(put, Names::default(), bounded(0).1);
        let cycle = |number, duty| {
            let mut area = FishX1Transfer::default();
            area.output.duty = [duty; 8].into();
            let (since_last, answer, config_updates, areas) = (None, None, 0, vec![area]);
            let cycle = Cycle { number, since_last, answer, config_updates, areas };
            let (at, line, what) = (Instant::now(), Line::Main, Happened::Cycle(Box::new(cycle)));
            Seen { at, line, connection: 1, what }
        };
        // Until there is no room, and then often enough that each value was tried again.
        (1..200).for_each(|number| changes.take(&cycle(number, number as i16)));
        (200..210).for_each(|number| changes.take(&cycle(number, 512)));
        let (at, line, what) =
            (Instant::now(), Line::Main, Happened::Connected(([127; 4], 7).into()));
        changes.take(&Seen { at, line, connection: 2, what });
        let lines = || std::iter::from_fn(|| take.next()).map(|line| serde_json::from_str(&line));
        let before: Vec<Value> = lines().collect::<Result<_, _>>().unwrap();
        assert!(before.iter().all(|line| line["duty"] != json!([512, 512])));
        let last = before.last().unwrap();
        assert_eq!((&last["what"], &last["connection_number"]), (&json!("connected"), &json!(2)));
        changes.take(&cycle(210, 512));
        let after: Vec<Value> = lines().collect::<Result<_, _>>().unwrap();
        let motors: Vec<_> =
            after.iter().map(|line| json!([line["motor"], line["duty"]])).collect();
        assert_eq!(motors, [1, 2, 3, 4].map(|number| json!([format!("M{number}"), [512, 512]])));
        // Each of four motors had a line in 200 cycles, and is lost once for each that is missing.
        let told = before.iter().filter(|line| line["motor"].is_string()).count();
        assert_eq!(last["lost"], json!(4 * 200 - told));
        // Nor is one forgotten when the program ends before there is room.
        (211..420).for_each(|number| changes.take(&cycle(number, number as i16)));
        let what = Happened::Offline(Farewell::Answered);
        changes.take(&Seen { at, line: Line::Main, connection: 1, what });
        let mut rest: Vec<Value> = lines().collect::<Result<_, _>>().unwrap();
        assert_eq!(rest.pop().unwrap()["what"], "offline");
        let of_motors = rest.split_off(rest.len() - 4);
        let said: Vec<_> =
            of_motors.iter().map(|line| json!([line["duty"][0], line["cycle"]])).collect();
        assert_eq!(said, [(); 4].map(|()| json!([419, 419])));
    }

    #[test]
    fn a_value_that_had_no_answer_is_told_again_with_the_cycle_that_answers_it() {
        let (put, take) = queue(ROOM);
        let mut changes = Changes::new(put, Names::default(), bounded(0).1);
        let areas = |duty| {
            let mut area = FishX1Transfer::default();
            area.output.duty[0] = duty;
            vec![area]
        };
        let cycle = |number, duty| {
            let (since_last, answer, config_updates) = (None, None, 0);
            let areas = areas(duty);
            Happened::Cycle(Box::new(Cycle { number, since_last, answer, config_updates, areas }))
        };
        let unanswered = |exchanges, duty| {
            let (forgotten, areas) = (0, areas(duty));
            Happened::Unanswered(Box::new(UnansweredExchanges { exchanges, forgotten, areas }))
        };
        let happened = [
            cycle(1, 0),
            unanswered(1, 512),
            unanswered(2, 512),
            cycle(2, 512),
            cycle(3, 512),
            unanswered(1, 512),
            cycle(4, 512),
            cycle(5, 0),
        ];
        for what in happened {
            changes.take(&Seen { at: Instant::now(), line: Line::Main, connection: 1, what });
        }
        let lines = std::iter::from_fn(|| take.next());
        let lines = lines.map(|line| serde_json::from_str::<Value>(&line).unwrap());
        let lines = lines.filter(|line| line["motor"] == "M1");
        let told = lines.map(|line| json!([line["cycle"], line["answered"], line["duty"][0]]));
        let expected = [
            json!([1, null, 0]),
            json!([null, false, 512]),
            json!([2, null, 512]),
            json!([5, null, 0]),
        ];
        assert_eq!(told.collect::<Vec<_>>(), expected);
    }
}
