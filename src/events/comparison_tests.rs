use super::*;
use crate::transfer_area::{InputMode, UniConfig, REMOTE_IO_1, REMOTE_IO_2};
use crate::wire::{IrRemote, UpdateConfig};

type Response = ExchangeDataResponse;

/// Two responses for the master and two extensions, all with the default configuration.
struct Pair {
    first: bool,
    before: Inputs,
    now: Inputs,
    configs_before: SentConfigs,
    configs: SentConfigs,
    sent: [Outgoing; 3],
}

impl Pair {
    fn new(before: Inputs, now: Inputs) -> Self {
        let sent = [Outgoing::default(); 3];
        let mut configs = SentConfigs::default();
        for (index, (config, area)) in configs.iter_mut().zip(&sent).enumerate() {
            let extension_id = index as i16;
            *config = Some(UpdateConfig { config_id: 1, extension_id, config: area.config });
        }
        Self { first: false, before, now, configs_before: configs, configs, sent }
    }

    fn events(&self) -> Vec<Event> {
        self.events_of(EventKind::ALL)
    }

    fn events_of(&self, kinds: &[EventKind]) -> Vec<Event> {
        let mut events = Vec::new();
        let comparison = Comparison {
            first: self.first,
            kinds: kinds.iter().copied().collect(),
            before: &self.before,
            now: &self.now,
            configs_before: &self.configs_before,
            configs: &self.configs,
            sent: &self.sent,
        };
        comparison.for_each_event(|event| events.push(event));
        events
    }

    fn configure(&mut self, area: usize, input: Input, config: UniConfig) {
        let update = self.configs[area].as_mut().unwrap();
        update.config.uni[input.index()] = config;
    }
}

/// Inputs after a response with the master and these extensions.
fn inputs(master: Response, extensions: &[(usize, Response)]) -> Inputs {
    let mut inputs = Inputs::default();
    respond(&mut inputs, master, extensions);
    inputs
}

fn respond(inputs: &mut Inputs, master: Response, extensions: &[(usize, Response)]) {
    let mut alive = 0;
    let mut all = words(&master);
    for (extension, data) in extensions {
        alive |= 1 << (extension - 1);
        all.extend(words(data));
    }
    inputs.take_compressed(alive, &all, 50);
}

fn words(data: &Response) -> Vec<u16> {
    let mut words: Vec<u16> = Vec::new();
    let values = data.uni.iter().chain(&data.counter_input).chain(&data.counter);
    words.extend(values.map(|value| *value as u16));
    words.extend(data.counter_reset_id);
    words.extend(data.motor_command_id);
    words.push(data.sound_command_id);
    for remote in data.ir {
        let axes = [remote.left_x, remote.left_y, remote.right_x, remote.right_y];
        words.extend(axes.map(|axis| i16::from(axis) as u16));
        words.push(remote.bits.into());
    }
    words
}

fn pressed(inputs: &[Input]) -> Response {
    let mut response = Response::default();
    for input in inputs {
        response.uni[input.index()] = 1;
    }
    response
}

fn changed(area: usize, input: Input, pressed: bool) -> Event {
    Event::InputChanged { area, input, pressed }
}

#[test]
fn changed_digital_inputs_are_reported_area_by_area() {
    let before = inputs(pressed(&[Input::I1]), &[(2, pressed(&[]))]);
    let now = inputs(pressed(&[Input::I8]), &[(2, pressed(&[Input::I3]))]);
    let pair = Pair::new(before, now);
    let expected = [
        changed(LOCAL_IO, Input::I1, false),
        changed(LOCAL_IO, Input::I8, true),
        changed(REMOTE_IO_2, Input::I3, true),
    ];
    assert_eq!(pair.events(), expected);
    let same = Pair { before: pair.now.clone(), ..pair };
    assert_eq!(same.events(), []);
}

#[test]
fn measured_values_are_not_digital_inputs() {
    let mut pair = Pair::new(inputs(pressed(&[]), &[]), inputs(pressed(&[Input::I1]), &[]));
    pair.configure(LOCAL_IO, Input::I1, UniConfig::analog(InputMode::Voltage));
    pair.configs_before = pair.configs;
    assert_eq!(pair.events(), []);
    pair.configs = SentConfigs::default();
    pair.configs_before = pair.configs;
    assert_eq!(pair.events(), [], "without any configuration");
}

#[test]
fn an_input_with_a_new_configuration_has_no_event_and_others_do() {
    let both = pressed(&[Input::I1, Input::I2]);
    let mut pair = Pair::new(inputs(pressed(&[]), &[]), inputs(both, &[]));
    for config in [UniConfig::digital(InputMode::Voltage), UniConfig::analog(InputMode::Voltage)] {
        pair.configure(LOCAL_IO, Input::I1, config);
        assert_eq!(pair.events(), [changed(LOCAL_IO, Input::I2, true)]);
        std::mem::swap(&mut pair.configs, &mut pair.configs_before);
        assert_eq!(pair.events(), [changed(LOCAL_IO, Input::I2, true)], "and back");
        std::mem::swap(&mut pair.configs, &mut pair.configs_before);
    }
    pair.configs_before = pair.configs;
    pair.sent[0].config.uni[1] = UniConfig::analog(InputMode::Voltage);
    let events = pair.events();
    assert_eq!(events, [changed(LOCAL_IO, Input::I2, true)], "what was not sent has no effect");
}

#[test]
fn counters_are_reported_without_a_sign() {
    let response = |counter| Response { counter, ..Response::default() };
    let pair = Pair::new(
        inputs(response([5, 0, 32_767, 9]), &[]),
        inputs(response([0, 0, -32_768, -1]), &[]),
    );
    let expected_event = |counter, count| Event::CounterChanged { area: LOCAL_IO, counter, count };
    assert_eq!(
        pair.events(),
        [
            expected_event(Counter::C1, 0),
            expected_event(Counter::C3, 32_768),
            expected_event(Counter::C4, 65_535)
        ]
    );
}

#[test]
fn a_reset_is_an_event_when_the_id_that_was_sent_is_reported_as_done() {
    let response = |id| Response { counter_reset_id: [0, id, 0, 0], ..Response::default() };
    let mut pair = Pair::new(inputs(response(3), &[]), inputs(response(4), &[]));
    assert_eq!(pair.events(), [], "another command was sent");
    pair.sent[0].output.cnt_reset_cmd_id[1] = 4;
    let expected_event =
        Event::CounterReset { area: LOCAL_IO, counter: Counter::C2, command_id: 4 };
    assert_eq!(pair.events(), [expected_event]);
    pair.before = pair.now.clone();
    assert_eq!(pair.events(), [], "it is reported once");
}

#[test]
fn a_motor_has_reached_its_position_when_its_own_command_with_a_distance_is_done() {
    let response = |id, count| Response {
        motor_command_id: [0, 0, 0, id],
        counter: [0, 0, 0, count],
        ..Response::default()
    };
    let mut pair = Pair::new(inputs(response(7, 100), &[]), inputs(response(8, 101), &[]));
    let only = [EventKind::MotorReached];
    pair.sent[0].output.motor_ex_cmd_id[3] = 8;
    assert_eq!(pair.events_of(&only), [], "leaving the mode is not an arrival");
    pair.sent[0].output.distance[3] = 101;
    let (area, motor) = (LOCAL_IO, Motor::M4);
    let expected_event = Event::MotorReached { area, motor, position: 101, command_id: 8 };
    for (master, expected) in [(0, 1), (1, 1), (4, 1), (5, 0), (8, 0)] {
        pair.sent[0].output.master[3] = master;
        let expected = vec![expected_event.clone(); expected];
        assert_eq!(pair.events_of(&only), expected, "master {master}");
    }
    pair.sent[0].output.master[3] = 0;
    pair.sent[0].output.motor_ex_cmd_id[3] = 9;
    assert_eq!(pair.events_of(&only), [], "a newer command is not finished");
}

#[test]
fn joysticks_are_reported_by_remote_and_side() {
    let mut response = Response::default();
    response.ir[1] = IrRemote { left_x: -15, bits: 1, ..IrRemote::default() };
    response.ir[4] = IrRemote { right_x: 3, right_y: 15, ..IrRemote::default() };
    let mut pair = Pair::new(inputs(Response::default(), &[]), inputs(response, &[]));
    let expected_event = |device, joystick, x, y| {
        let area = LOCAL_IO;
        Event::JoystickMoved { area, device, joystick, x, y }
    };
    assert_eq!(
        pair.events(),
        [
            expected_event(IrDevice::OffOff, Joystick::Left, -15, 0),
            expected_event(IrDevice::OnOn, Joystick::Right, 3, 15),
        ]
    );
    pair.before = pair.now.clone();
    response.ir[1].bits = 0;
    pair.now = inputs(response, &[]);
    assert_eq!(pair.events(), [], "a button is not a joystick");
}

#[test]
fn disconnected_extensions_keep_their_values_and_are_compared_with_these_when_they_come_back() {
    let master = Response::default();
    let mut now = inputs(master, &[(1, pressed(&[Input::I1])), (8, master)]);
    let mut pair = Pair::new(now.clone(), now.clone());
    let expected_event = |extension, alive| Event::ExtensionChanged { extension, alive };
    respond(&mut now, master, &[(2, pressed(&[Input::I2]))]);
    pair.now = now.clone();
    // The second extension's first inputs are not a change.
    assert_eq!(
        pair.events(),
        [expected_event(1, false), expected_event(2, true), expected_event(8, false)]
    );
    pair.before = now.clone();
    respond(&mut now, master, &[(1, pressed(&[])), (2, pressed(&[Input::I2]))]);
    pair.now = now;
    assert_eq!(pair.events(), [expected_event(1, true), changed(REMOTE_IO_1, Input::I1, false)]);
}

#[test]
fn extensions_without_an_area_are_reported_and_bits_without_an_extension_are_not() {
    let mut now = Inputs::default();
    now.take_compressed(0xFF80, &[1; 10 * 50], 50);
    let mut pair = Pair::new(inputs(Response::default(), &[]), now);
    pair.first = false;
    let expected_event = Event::ExtensionChanged { extension: 8, alive: true };
    assert_eq!(pair.events_of(&[EventKind::ExtensionChanged]), [expected_event]);
}

#[test]
fn a_transfers_first_response_reports_only_commands_that_are_done() {
    let mut response = pressed(&[Input::I1]);
    response.counter = [7; 4];
    response.ir[0].left_x = 1;
    response.counter_reset_id = [1, 0, 0, 0];
    response.motor_command_id = [1, 0, 0, 0];
    // Before it there was no transfer, or one with lower ids.
    for before in [Inputs::default(), inputs(Response::default(), &[])] {
        let mut pair = Pair::new(before, inputs(response, &[(1, response)]));
        pair.first = true;
        for sent in &mut pair.sent[..2] {
            sent.output.cnt_reset_cmd_id[0] = 1;
            sent.output.motor_ex_cmd_id[0] = 1;
            sent.output.distance[0] = 7;
        }
        let (area, command_id) = (LOCAL_IO, 1);
        assert_eq!(
            pair.events(),
            [
                Event::CounterReset { area, counter: Counter::C1, command_id },
                Event::MotorReached { area, motor: Motor::M1, position: 7, command_id },
            ]
        );
        pair.before = inputs(response, &[]);
        assert_eq!(pair.events(), [], "they were done in the transfer before");
    }
}

#[test]
fn only_kinds_that_are_asked_for_are_reported() {
    let mut response = pressed(&[Input::I1]);
    response.counter = [7; 4];
    response.ir[0].left_x = 1;
    response.counter_reset_id = [1, 0, 0, 0];
    response.motor_command_id = [1, 0, 0, 0];
    let now = inputs(response, &[(1, response)]);
    let mut pair = Pair::new(inputs(Response::default(), &[]), now);
    pair.sent[0].output.cnt_reset_cmd_id[0] = 1;
    pair.sent[0].output.motor_ex_cmd_id[0] = 1;
    pair.sent[0].output.distance[0] = 7;
    for &kind in EventKind::ALL {
        let events = pair.events_of(&[kind]);
        let expected = match kind {
            EventKind::CounterChanged => 4,
            EventKind::MotorStalled
            | EventKind::TransferEnded
            | EventKind::ConnectionLost
            | EventKind::ConnectionRestored
            | EventKind::WatchdogExpired => 0,
            _ => 1,
        };
        assert_eq!(events.len(), expected, "{kind:?}");
        assert!(events.iter().all(|event| event.kind() == kind), "{events:?}");
    }
}
