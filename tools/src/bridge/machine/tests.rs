use std::sync::{Arc, Mutex};

use ft_transfer_area_simulator::{Fault, FaultKind, SimulatedTxt};

use super::*;
use crate::bridge::broker::{Message, Outlet};
use crate::bridge::relay::tests::setup;
use crate::bridge::relay::COMMAND_AGE;

/// What is given up after this many exchanges.
const TOO_MANY: usize = 4_000;

/// What comes at once in a flood: more than there is room for.
const FLOOD: usize = 1500;

fn command(tail: &str, payload: &str) -> Message {
    Message {
        topic: format!("ft/press/{tail}"),
        payload: payload.as_bytes().to_vec(),
        retained: false,
        not_before: Instant::now(),
    }
}

fn turn(duty: i16) -> Message {
    command("M1/set", &format!("{{\"duty\": {duty}}}"))
}

/// A message that has arrived long ago.
fn old(message: Message) -> Message {
    let not_before = Instant::now().checked_sub(2 * COMMAND_AGE).unwrap();
    Message { not_before, ..message }
}

/// The duties of M1 in each exchange. Before each response `script` gets the number of connections so far and the
/// duty, and leaves messages. With the duty `last` the bridge ends.
fn duties(
    fault: Option<Fault>,
    last: i16,
    mut script: impl FnMut(u64, i16, &Outlet) + Send + 'static,
) -> Vec<i16> {
    let (outlet, inbox) = Outlet::new();
    let stop = Arc::new(AtomicBool::new(false));
    let duties = Arc::new(Mutex::new(Vec::new()));
    let (stopping, seen) = (Arc::clone(&stop), Arc::clone(&duties));
    let builder = SimulatedTxt::builder().on_exchange(move |machine| {
        let duty = machine.controllers[0].outputs.duty[0];
        let mut seen = seen.lock().unwrap();
        seen.push(duty);
        script(machine.connections(), duty, &outlet);
        if duty == last || seen.len() == TOO_MANY {
            stopping.store(true, Ordering::Relaxed);
        }
    });
    let builder = match fault {
        Some(fault) => builder.fault(fault),
        None => builder,
    };
    let txt = builder.start().unwrap();
    let host = txt.address().to_string();
    let handler = handler(&host, 1).unwrap();
    let relay = || Ok(Relay::without_broker(setup(host), inbox));
    let machine = Machine::with_relay(handler, None, &stop, relay).unwrap();
    machine.run(None).unwrap();
    let duties = duties.lock().unwrap();
    duties.clone()
}

/// The duties of M1 when it turns with 200 and then these messages come at once. When it stands, it is turned with 44.
fn stopped_by(messages: impl Fn() -> Vec<Message> + Send + 'static) -> Vec<i16> {
    let (mut has_turned, mut has_stopped) = (false, false);
    duties(None, 44, move |_, duty, outlet| match (has_turned, has_stopped) {
        // It is not online at once, and refuses commands before.
        (false, _) if duty == 0 => outlet.leave(turn(200)).unwrap(),
        (false, _) => {
            messages().into_iter().for_each(|message| outlet.leave(message).unwrap());
            has_turned = true;
        }
        (true, false) => has_stopped = duty == 0,
        (true, true) => outlet.leave(turn(44)).unwrap(),
    })
}

/// The command is there before the first response is. Its sender can't know that the controller is back.
#[test]
fn a_command_in_the_first_cycle_after_a_gap_moves_nothing() {
    let close = Fault::at_exchange(5, FaultKind::Close { after: 0 });
    let (mut first_connection, mut is_later) = (None, false);
    let duties = duties(Some(close), 44, move |connection, _, outlet| {
        if *first_connection.get_or_insert(connection) == connection {
            return;
        }
        // The later ones are for those cycles that follow.
        outlet.leave(turn(if is_later { 44 } else { 300 })).unwrap();
        is_later = true;
    });
    assert!(!duties.contains(&300), "{duties:?}");
    assert!(duties.contains(&44), "later commands move it");
}

#[test]
fn a_stop_for_which_there_is_no_room_stops_and_no_older_command_follows_it() {
    let duties = stopped_by(|| {
        let mut flood: Vec<_> = (0..FLOOD).map(|_| turn(500)).collect();
        flood.push(command("stop", ""));
        flood
    });
    assert!(!duties.contains(&500), "{duties:?}");
    assert!(duties.contains(&44), "later commands move it");
}

#[test]
fn an_old_command_stops_instead_of_moving() {
    let duties = stopped_by(|| vec![old(turn(500))]);
    assert!(!duties.contains(&500), "{duties:?}");
    assert!(duties.contains(&44), "later commands move it");
}
