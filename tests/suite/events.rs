//! Events of responses and of the transfer's end, on channels.

use std::sync::{Arc, Mutex};
use std::time::Duration;

use ft_transfer_area::transfer_area::{InputMode, UniConfig, LOCAL_IO, REMOTE_IO_1};
use ft_transfer_area::tx::{Counter, Direction, Input, IrDevice, Motor};
use ft_transfer_area::{Error, EventKind, Events, Joystick, TimedEvent, TransferAreaComHandler};
use ft_transfer_area_simulator::{Fault, FaultKind, SimulatedTxt};

use crate::support::{check_client, handler_for, unpaced, wait_until, DEADLINE};

/// Room for all events of a test.
const ROOM: usize = 10_000;

fn handler(txt: &SimulatedTxt) -> TransferAreaComHandler {
    handler_for(txt).areas(2).reaction_window(Duration::ZERO).build().unwrap()
}

/// Waits until a change of the machine has come in.
fn pass(handler: &TransferAreaComHandler) {
    // The response under way may be older than the change.
    for _ in 0..2 {
        handler.areas().wait_cycle().unwrap();
    }
}

/// The printed event: a program can't make events to compare with.
fn text(reported: &TimedEvent) -> String {
    format!("{:?}", reported.event)
}

fn next(events: &Events) -> String {
    text(&events.recv_timeout(DEADLINE).unwrap())
}

/// Ends the transfer; returns the events until then, and its end.
fn end(handler: &TransferAreaComHandler, events: &Events) -> Vec<String> {
    handler.end_transfer().unwrap();
    events.receiver().try_iter().map(|reported| text(&reported)).collect()
}

fn changed(area: usize, input: Input, pressed: bool) -> String {
    format!("InputChanged {{ area: {area}, input: {input:?}, pressed: {pressed} }}")
}

fn extension_is(extension: usize, alive: bool) -> String {
    format!("ExtensionChanged {{ extension: {extension}, alive: {alive} }}")
}

const ENDED: &str = "TransferEnded { error: None }";

#[test]
fn every_change_of_a_digital_input_is_told_once_and_in_order() {
    let txt = unpaced().extensions(1).start().unwrap();
    let press = |area: usize, index: usize, value| {
        txt.with_machine(|machine| machine.controllers[area].uni[index] = value);
    };
    press(LOCAL_IO, 0, 1);
    let handler = handler(&txt);
    let events = handler.areas().events(&[EventKind::InputChanged], ROOM).unwrap();
    handler.begin_transfer().unwrap();
    pass(&handler);
    for _ in 0..50 {
        press(LOCAL_IO, 0, 0);
        assert_eq!(next(&events), changed(LOCAL_IO, Input::I1, false));
        press(REMOTE_IO_1, 7, 1);
        assert_eq!(next(&events), changed(REMOTE_IO_1, Input::I8, true));
        press(LOCAL_IO, 0, 1);
        assert_eq!(next(&events), changed(LOCAL_IO, Input::I1, true));
        press(REMOTE_IO_1, 7, 0);
        assert_eq!(next(&events), changed(REMOTE_IO_1, Input::I8, false));
    }
    pass(&handler);
    assert_eq!(end(&handler, &events), [ENDED]);
    assert_eq!(events.lost(), 0);
}

#[test]
fn an_input_is_digital_when_the_controller_has_that_configuration() {
    let txt = unpaced().start().unwrap();
    let set = |value| txt.with_machine(|machine| machine.controllers[0].uni = [value; 8]);
    let handler = handler(&txt);
    handler.areas().lock()[LOCAL_IO].config.uni[0] = UniConfig::analog(InputMode::Voltage);
    let events = handler.areas().events(EventKind::ALL, ROOM).unwrap();
    handler.begin_transfer().unwrap();
    pass(&handler);
    // I2 is configured as analog, but the configuration is not sent yet.
    handler.areas().lock()[LOCAL_IO].config.uni[1] = UniConfig::analog(InputMode::Voltage);
    set(1);
    let others = |pressed| Input::ALL[1..].iter().map(move |&input| changed(0, input, pressed));
    for expected in others(true) {
        assert_eq!(next(&events), expected);
    }
    // The value by the new configuration comes in with the first response after it.
    handler.areas().lock()[LOCAL_IO].set_ft_uni_config(Input::I1, InputMode::Resistance, true);
    handler.areas().update_config().unwrap();
    set(0);
    assert_eq!(next(&events), changed(0, Input::I1, false));
    for expected in others(false).skip(1) {
        assert_eq!(next(&events), expected);
    }
    assert_eq!(end(&handler, &events), [ENDED]);
}

#[test]
fn a_value_by_a_new_configuration_is_no_change() {
    // The input is analog at first. It measures a voltage that is 0 for a digital input.
    let txt = unpaced().on_exchange(|machine| {
        let controller = &mut machine.controllers[0];
        controller.uni[2] = if controller.config.uni[2].digital == 0 { 300 } else { 0 };
    });
    let txt = txt.start().unwrap();
    let handler = handler(&txt);
    let events = handler.areas().events(EventKind::ALL, ROOM).unwrap();
    handler.begin_transfer().unwrap();
    for round in 0..20 {
        let digital = round % 2 != 0;
        handler.areas().lock()[LOCAL_IO].set_ft_uni_config(Input::I3, InputMode::Voltage, digital);
        handler.areas().update_config().unwrap();
    }
    assert_eq!(end(&handler, &events), [ENDED]);
}

#[test]
fn a_command_is_told_to_be_done_once() {
    let txt = unpaced().extensions(1).start().unwrap();
    let handler = handler(&txt);
    let kinds = [EventKind::MotorReached, EventKind::CounterReset];
    let events = handler.areas().events(&kinds, ROOM).unwrap();
    // These go out with the first exchange.
    handler.areas().lock()[LOCAL_IO].start_counter_reset(Counter::C4);
    handler.begin_transfer().unwrap();
    let reset = |area: usize, counter: Counter, id: u16| {
        format!("CounterReset {{ area: {area}, counter: {counter:?}, command_id: {id} }}")
    };
    assert_eq!(next(&events), reset(LOCAL_IO, Counter::C4, 1));
    pass(&handler);
    let (cw, ccw) = (Direction::Cw, Direction::Ccw);
    for area in [LOCAL_IO, REMOTE_IO_1] {
        for round in 1..=30 {
            let mut areas = handler.areas().lock();
            let slaves = [(Motor::M4, ccw)];
            areas[area].start_motor_ex_cmd(Motor::M1, 512, cw, &slaves, 2 + round).unwrap();
            let ids = areas[area].output.motor_ex_cmd_id;
            drop(areas);
            let position = 2 + round as u16;
            for (motor, command_id) in [(Motor::M1, ids[0]), (Motor::M4, ids[3])] {
                let expected = format!(
                    "MotorReached {{ area: {area}, motor: {motor:?}, position: {position}, \
                     command_id: {command_id} }}"
                );
                assert_eq!(next(&events), expected);
            }
            // To leave the mode is a command too, but no motor arrives.
            handler.areas().lock()[area].stop_all_motor_ex_cmd();
            handler.areas().wait_motor_ex(area, Motor::M1, DEADLINE).unwrap();
            handler.areas().lock()[area].start_counter_reset(Counter::C2);
            assert_eq!(next(&events), reset(area, Counter::C2, round as u16));
        }
    }
    assert_eq!(end(&handler, &events), [ENDED]);
    check_client(&txt);
}

#[test]
fn counters_are_told_by_each_response_in_which_they_differ() {
    let txt = unpaced().start().unwrap();
    let set = |counter| txt.with_machine(|machine| machine.controllers[0].counter = counter);
    set([4, 0, 0, 0]);
    let handler = handler(&txt);
    let events = handler.areas().events(&[EventKind::CounterChanged], ROOM).unwrap();
    handler.begin_transfer().unwrap();
    pass(&handler);
    let reported = |counter: Counter, count: u16| {
        format!("CounterChanged {{ area: {LOCAL_IO}, counter: {counter:?}, count: {count} }}")
    };
    set([5, 0, 0, -32_768]);
    assert_eq!(next(&events), reported(Counter::C1, 5));
    assert_eq!(next(&events), reported(Counter::C4, 32_768));
    handler.areas().lock()[LOCAL_IO].start_counter_reset(Counter::C1);
    assert_eq!(next(&events), reported(Counter::C1, 0));
    assert_eq!(end(&handler, &events), [ENDED]);
}

#[test]
fn a_joystick_is_told_when_it_moves() {
    let txt = unpaced().extensions(1).start().unwrap();
    let handler = handler(&txt);
    let events = handler.areas().events(&[EventKind::JoystickMoved], ROOM).unwrap();
    handler.begin_transfer().unwrap();
    pass(&handler);
    txt.with_machine(|machine| {
        for index in [IrDevice::Any.index(), IrDevice::OnOff.index()] {
            machine.controllers[1].ir[index].right_y = -15;
            machine.controllers[1].ir[index].bits = 4;
        }
    });
    for device in [IrDevice::Any, IrDevice::OnOff] {
        let joystick = Joystick::Right;
        let expected = format!(
            "JoystickMoved {{ area: {REMOTE_IO_1}, device: {device:?}, joystick: {joystick:?}, \
             x: 0, y: -15 }}"
        );
        assert_eq!(next(&events), expected);
    }
    assert_eq!(end(&handler, &events), [ENDED]);
}

#[test]
fn events_tell_when_extensions_come_and_go_and_their_inputs_stay() {
    let txt = unpaced().extensions(2).start().unwrap();
    txt.with_machine(|machine| machine.controllers[1].uni[0] = 1);
    let handler = handler(&txt);
    let events = handler.areas().events(EventKind::ALL, ROOM).unwrap();
    handler.begin_transfer().unwrap();
    pass(&handler);
    for _ in 0..20 {
        for alive in [false, true] {
            for extension in [1, 2] {
                txt.with_machine(|machine| machine.alive[extension - 1] = alive);
                assert_eq!(next(&events), extension_is(extension, alive));
            }
        }
    }
    // Changes in between are reported when the extension is back.
    txt.with_machine(|machine| machine.alive[0] = false);
    assert_eq!(next(&events), extension_is(1, false));
    txt.with_machine(|machine| machine.controllers[1].uni[0] = 0);
    pass(&handler);
    txt.with_machine(|machine| machine.alive[0] = true);
    assert_eq!(next(&events), extension_is(1, true));
    assert_eq!(next(&events), changed(REMOTE_IO_1, Input::I1, false));
    assert_eq!(end(&handler, &events), [ENDED]);
}

#[test]
fn a_transfers_first_response_is_compared_with_none() {
    let txt = unpaced().extensions(1).start().unwrap();
    let handler = handler(&txt);
    let events = handler.areas().events(EventKind::ALL, ROOM).unwrap();
    for round in 0..10 {
        txt.with_machine(|machine| {
            machine.alive[0] = round % 2 != 0;
            for controller in &mut machine.controllers {
                controller.uni = [round % 2; 8];
                controller.counter = [round; 4];
                controller.ir[3].left_x = round as i8;
            }
        });
        handler.begin_transfer().unwrap();
        pass(&handler);
        assert_eq!(end(&handler, &events), [ENDED]);
    }
}

#[test]
fn a_listener_in_the_middle_of_a_transfer_gets_the_changes_from_then_on() {
    let txt = unpaced().start().unwrap();
    let press = |value| txt.with_machine(|machine| machine.controllers[0].uni[4] = value);
    let handler = handler(&txt);
    handler.begin_transfer().unwrap();
    for value in [1, 0, 1, 0, 1] {
        press(value);
        pass(&handler);
        let area = handler.areas().clone();
        let events = area.events(&[EventKind::InputChanged], ROOM).unwrap();
        press(1 - value);
        assert_eq!(next(&events), changed(LOCAL_IO, Input::I5, value == 0));
        pass(&handler);
        assert_eq!(events.receiver().len(), 0);
    }
    handler.end_transfer().unwrap();
}

#[test]
fn a_listener_finds_the_inputs_in_the_areas_and_its_answer_goes_out_in_the_very_next_request() {
    const CHANGES: usize = 200;
    let answers = Arc::new(Mutex::new(Vec::new()));
    let noted = Arc::clone(&answers);
    let mut number = 0;
    let txt = unpaced().on_exchange(move |machine| {
        let controller = &mut machine.controllers[0];
        noted.lock().unwrap().push((number, controller.outputs.duty[0]));
        number += 1;
        controller.uni[0] = number % 2;
        controller.uni[1] = number;
    });
    let txt = txt.start().unwrap();
    let handler = handler_for(&txt).reaction_window(DEADLINE).build().unwrap();
    handler.areas().lock()[LOCAL_IO].config.uni[1] = UniConfig::analog(InputMode::Voltage);
    let events = handler.areas().events(&[EventKind::InputChanged], ROOM).unwrap();
    handler.begin_transfer().unwrap();
    let area = handler.areas().clone();
    drop(area.wait_cycle().unwrap());
    for number in 2..CHANGES as i16 {
        assert_eq!(next(&events), changed(LOCAL_IO, Input::I1, number % 2 != 0));
        let mut areas = handler.areas().lock();
        assert_eq!(areas[LOCAL_IO].input.uni[1], number);
        areas[LOCAL_IO].output.duty[0] = number;
        drop(areas);
        // The program has written its answer, so the window may end.
        drop(area.wait_cycle().unwrap());
    }
    wait_until(&txt, "the last answer", |machine| machine.exchanges() as usize >= CHANGES);
    handler.end_transfer().unwrap();
    for (number, answer) in &answers.lock().unwrap()[2..CHANGES] {
        assert_eq!(answer, number, "an event was not answered in the next request");
    }
}

#[test]
fn a_slow_listener_keeps_the_oldest_events_and_a_count_of_the_others() {
    let txt = unpaced().on_exchange(|machine| {
        machine.controllers[0].uni[0] = (machine.exchanges().min(150) % 2) as i16;
    });
    let txt = txt.start().unwrap();
    let handler = handler(&txt);
    let slow = handler.areas().events(EventKind::ALL, 3).unwrap();
    let quick = handler.areas().events(EventKind::ALL, ROOM).unwrap();
    handler.begin_transfer().unwrap();
    // The exchange does not wait for the listener.
    wait_until(&txt, "exchanges", |machine| machine.exchanges() > 200);
    let all = end(&handler, &quick);
    let kept: Vec<String> = slow.receiver().try_iter().map(|reported| text(&reported)).collect();
    assert_eq!(kept[..3], all[..3]);
    assert_eq!(kept[3..], [ENDED]);
    assert_eq!(slow.lost() as usize, all.len() - kept.len());
    assert_eq!(quick.lost(), 0);
    assert_eq!(all.len(), 150 + 1, "the changes and the end");
}

#[test]
fn a_loop_over_events_ends_with_the_transfer_and_the_next_one_has_another() {
    let txt =
        unpaced().fault(Fault::at_response(20, FaultKind::Close { after: 0 })).start().unwrap();
    let handler = handler(&txt);
    let events = handler.areas().events(&[EventKind::JoystickMoved], 10).unwrap();
    handler.begin_transfer().unwrap();
    let reported: Vec<String> = (&events).map(|reported| text(&reported)).collect();
    assert_eq!(reported, [format!("TransferEnded {{ error: {:?} }}", handler.areas().error())]);
    handler.begin_transfer().unwrap();
    handler.end_transfer().unwrap();
    let reported: Vec<String> = (&events).map(|reported| text(&reported)).collect();
    assert_eq!(reported, [ENDED]);
}

#[test]
fn the_end_of_each_transfer_is_told_with_its_error() {
    let fault = Fault::at_response(20, FaultKind::WrongCrc);
    let txt = unpaced().fault(fault).start().unwrap();
    let handler = handler(&txt);
    let events = handler.areas().events(&[EventKind::TransferEnded], 10).unwrap();
    handler.begin_transfer().unwrap();
    while handler.areas().wait_cycle().is_ok() {}
    let error = handler.areas().error();
    assert!(matches!(error, Some(Error::WrongCrc { .. })));
    assert_eq!(next(&events), format!("TransferEnded {{ error: {error:?} }}"));
    handler.begin_transfer().unwrap();
    handler.end_transfer().unwrap();
    assert_eq!(next(&events), ENDED);
    drop(txt);
    handler.begin_transfer().unwrap_err();
    handler.end_transfer().unwrap_err();
    assert_eq!(events.receiver().len(), 0, "what has not begun does not end");
}

#[test]
fn the_channel_ends_with_the_handler_while_other_handles_exist() {
    let txt = unpaced().start().unwrap();
    let handler = handler(&txt);
    let area = handler.areas().clone();
    let events = area.events(EventKind::ALL, 10).unwrap();
    let looped = area.events(EventKind::ALL, 10).unwrap();
    handler.begin_transfer().unwrap();
    drop(handler);
    assert_eq!(next(&events), ENDED);
    assert!(events.recv_timeout(DEADLINE).is_err_and(|error| error.is_disconnected()));
    assert_eq!(looped.map(|reported| text(&reported)).collect::<Vec<_>>(), [ENDED]);
    let late = area.events(EventKind::ALL, 10).unwrap();
    assert!(late.recv_timeout(DEADLINE).is_err_and(|error| error.is_disconnected()));
}

#[test]
fn a_listener_that_has_stopped_gets_nothing_and_delays_nothing() {
    let txt = unpaced().start().unwrap();
    let handler = handler(&txt);
    let events = handler.areas().events(EventKind::ALL, 1).unwrap();
    let receiver = events.receiver().clone();
    handler.begin_transfer().unwrap();
    drop(events);
    for value in [1, 0, 1] {
        txt.with_machine(|machine| machine.controllers[0].uni[0] = value);
        pass(&handler);
    }
    handler.end_transfer().unwrap();
    assert!(receiver.recv_timeout(DEADLINE).is_err_and(|error| error.is_disconnected()));
}

#[test]
fn an_impossible_capacity_is_out_of_range() {
    let handler = TransferAreaComHandler::builder("127.0.0.1").build().unwrap();
    let most = Events::MAX_CAPACITY;
    let highest = i64::try_from(usize::MAX).unwrap_or(i64::MAX);
    for (capacity, given) in [(0, 0), (most + 1, most as i64 + 1), (usize::MAX, highest)] {
        let error = handler.areas().events(EventKind::ALL, capacity).unwrap_err();
        let (what, least, most) = ("capacity for events", 1, most as i64);
        assert_eq!(error, Error::OutOfRange { what, given, least, most });
    }
    handler.areas().events(&[], 1).unwrap();
    handler.areas().events(EventKind::ALL, most).unwrap();
}
