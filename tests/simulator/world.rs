//! The world of the simulated TXT: over a real socket, and stepped without one.

use std::time::Duration;

use ft_transfer_area::transfer_area::{Config, InputMode, UniConfig, LOCAL_IO};
use ft_transfer_area::tx::{Input, Motor, Output};
use ft_transfer_area::wire::{CommandId, ExchangeData};
use ft_transfer_area::{FishX1Transfer, TransferAreaComHandler};
use ft_transfer_area_simulator::world::{
    AxisSwitch, Board, Contact, I2cDevice, MotorModel, Remote, Script, ScriptEvent, Sensor, Slide,
    Travel, World,
};
use ft_transfer_area_simulator::{Machine, SimulatedTxt, SimulatedTxtBuilder};

use crate::unpaced;
use crate::wire_client::{Client, LIMIT};

/// The position of the slide.
fn slide(machine: &Machine) -> f64 {
    machine.world().and_then(|world| world.slide(0, Motor::M1)).unwrap()
}

/// M1 at this duty, negative for backwards.
fn m1(duty: i16) -> ExchangeData {
    let mut outputs = ExchangeData::default();
    outputs.duty[usize::from(duty < 0)] = duty.abs();
    outputs
}

/// Exchanges until the condition holds. The number of exchanges is more than enough.
fn wait_until(
    handler: &TransferAreaComHandler,
    mut condition: impl FnMut(&FishX1Transfer) -> bool,
) {
    for _ in 0..10_000 {
        if condition(&handler.areas().wait_cycle_for(LIMIT).unwrap()[LOCAL_IO]) {
            return;
        }
    }
    panic!("the condition never held");
}

#[test]
fn a_program_runs_the_slide_to_its_end_switch_and_back_by_a_distance() {
    let txt = unpaced().world(World::shipped("slide").unwrap()).start().unwrap();
    let handler = TransferAreaComHandler::builder(txt.address())
        .reaction_window(Duration::ZERO)
        .build()
        .unwrap();
    handler.areas().lock()[LOCAL_IO].config.uni[3] = UniConfig::analog(InputMode::Ultrasonic);
    handler.begin_transfer().unwrap();
    wait_until(&handler, |area| area.input.uni[..5] == [0, 0, 0, 15, 0]);

    handler.areas().lock()[LOCAL_IO].output.duty[0] = 512;
    wait_until(&handler, |area| area.input.uni[1] == 1);
    handler.areas().lock()[LOCAL_IO].output.duty[..2].copy_from_slice(&[0, 0]);
    assert!(txt.with_machine(|machine| slide(machine)) >= 990.0);
    assert_eq!(handler.areas().lock()[LOCAL_IO].input.uni[3], 25);

    {
        let mut areas = handler.areas().lock();
        let area = &mut areas[LOCAL_IO];
        area.output.duty[1] = 512;
        area.output.distance[0] = 600;
        area.raise_motor_ex_cmd_id(Motor::M1);
    }
    wait_until(&handler, |area| area.input.motor_ex_reached[0] == 1);
    let counter = handler.areas().lock()[LOCAL_IO].input.counter[0];
    assert!((600..=603).contains(&counter), "{counter}");
    let position = txt.with_machine(|machine| slide(machine));
    assert!((380.0..=410.0).contains(&position), "{position}");
    wait_until(&handler, |area| area.input.uni[..3] == [0, 0, 0]);
    handler.end_transfer().unwrap();
    assert!(txt.with_machine(|machine| machine.oddities().next().is_none()));
}

#[test]
fn a_slide_that_is_driven_on_stops_at_its_end() {
    let mut machine = Machine::with_world(0, World::shipped("slide").unwrap()).unwrap();
    machine.set_outputs(0, m1(512));
    machine.step(Duration::from_secs(10));
    let report = machine.report(0).unwrap();
    assert_eq!((slide(&machine), &report.uni[..3]), (1000.0, &[0, 1, 0][..]));
    assert!((499..=500).contains(&report.counter[0]), "{report:?}");
    assert_eq!(machine.world().unwrap().motor_speed(0, Motor::M1), Some(0.0));
    machine.step(Duration::from_secs(10));
    assert_eq!(machine.report(0), Some(report));

    machine.set_outputs(0, m1(-512));
    machine.step(Duration::from_secs(10));
    assert_eq!((slide(&machine), &machine.controllers[0].uni[..3]), (0.0, &[1, 0, 0][..]));
    assert!((1499..=1500).contains(&machine.controllers[0].counter[0]));
}

#[test]
fn a_distance_beyond_the_end_is_never_done() {
    let mut machine = Machine::with_world(0, World::shipped("slide").unwrap()).unwrap();
    let outputs =
        ExchangeData { distance: [501, 0, 0, 0], motor_command_id: [1, 0, 0, 0], ..m1(512) };
    machine.set_outputs(0, outputs);
    machine.step(Duration::from_secs(60));
    assert_eq!(machine.report(0).unwrap().motor_command_id[0], 0);
}

#[test]
fn an_input_reports_what_its_mode_measures() {
    let mut machine = Machine::with_world(0, World::shipped("slide").unwrap()).unwrap();
    let modes = [
        InputMode::Voltage,
        InputMode::Resistance,
        InputMode::Resistance15k,
        InputMode::Ultrasonic,
    ];
    let reported = modes.map(|mode| {
        let config = Config { uni: [UniConfig::analog(mode); 8].into(), ..Config::default() };
        machine.set_config(0, config);
        machine.step(Duration::from_millis(10));
        let uni = machine.controllers[0].uni;
        (uni[2], uni[3], uni[4])
    });
    // The button, the ultrasonic sensor, an empty input.
    let over_range = [(0, 0, 0), (5000, 5000, 5000), (15_000, 15_000, 15_000), (4096, 15, 4096)];
    assert_eq!(reported, over_range);
}

#[test]
fn an_ultrasonic_input_reports_a_distance_whatever_its_flag_says() {
    let mut machine = Machine::with_world(0, World::shipped("slide").unwrap()).unwrap();
    for config in [UniConfig::digital(InputMode::Ultrasonic), UniConfig::default()] {
        // A client that sets the mode alone leaves the flag as it was.
        let uni = UniConfig { mode: InputMode::Ultrasonic.into(), ..config };
        machine.set_config(0, Config { uni: [uni; 8].into(), ..Config::default() });
        assert_eq!(machine.controllers[0].uni[3..5], [15, 4096]);
    }
}

#[test]
fn lamps_stay_on_and_motors_turn_when_their_client_leaves_until_the_watchdog() {
    let limit = Duration::from_millis(500);
    for watchdog in [None, Some(limit)] {
        let mut txt = unpaced();
        if let Some(limit) = watchdog {
            txt = txt.board_watchdog(limit);
        }
        let is_on = watchdog.is_none();
        leave_lamp_and_motor_on(txt, is_on);
    }
}

/// Leaves a lamp and a motor on at the end of online mode, and checks whether they are then.
fn leave_lamp_and_motor_on(txt: SimulatedTxtBuilder, is_on: bool) {
    let txt = txt.world(World::shipped("slide").unwrap()).start().unwrap();
    let mut client = Client::online(&txt);
    let mut outputs = m1(256);
    outputs.duty[6] = 128;
    client.exchange(&outputs);
    let state = |machine: &Machine| {
        let world = machine.world().unwrap();
        (world.lamp(0, Output::O7), world.motor_speed(0, Motor::M1).map(|speed| speed > 0.0))
    };
    assert_eq!(txt.with_machine(|machine| state(machine)), (Some(0.25), Some(true)));
    client.command(CommandId::StopOnline);
    client.receive(4);
    let brightness = if is_on { 0.25 } else { 0.0 };
    assert_eq!(txt.with_machine(|machine| state(machine)), (Some(brightness), Some(is_on)));
    assert_eq!(txt.with_machine(|machine| machine.world().unwrap().lamp(0, Output::O1)), None);
}

#[test]
fn buttons_follow_their_script_again_and_again() {
    let event = |at, pressed| ScriptEvent::press(at, 1, Input::I8, pressed);
    let extension = Board::default().input(Input::I8, Sensor::BUTTON);
    let script = Script::default().event(event(0.02, false)).event(event(0.01, true));
    let world = World::new().extension(extension).script(script.period(0.05));
    let mut machine = Machine::with_world(1, world).unwrap();
    let mut pressed = Vec::new();
    for ms in 0..200 {
        // Steps of half milliseconds add up.
        machine.step(Duration::from_micros(500));
        machine.step(Duration::from_micros(500));
        if machine.controllers[1].uni[7] == 1 {
            pressed.push(ms);
        }
    }
    let first = pressed[0];
    assert!((10..=11).contains(&first), "{first}");
    let expected = (0..4).flat_map(|round| (0..10).map(move |ms| first + 50 * round + ms));
    assert!(pressed.iter().copied().eq(expected), "{pressed:?}");
}

#[test]
fn a_script_moves_remotes_and_sets_the_registers_of_i2c_devices() {
    let [ahead, back] = [15, -8].map(|left_y| Remote { dip2: true, left_y, ..Remote::default() });
    let script = Script::default()
        .event(ScriptEvent::remote(0.02, ahead))
        .event(ScriptEvent::i2c(0.03, 24, 255, &[7, 8]))
        .event(ScriptEvent::i2c(0.05, 25, 0, &[9]))
        .event(ScriptEvent::remote(0.05, back));
    let [first, second] = [24, 25].map(|address| I2cDevice::new(address).registers(1, &[5]));
    let remote = Remote { dip2: true, ..Remote::default() };
    let world = World::new().script(script).remote(remote).i2c(first).i2c(second);
    let mut machine = Machine::with_world(0, world).unwrap();
    // The script does not plug it in again.
    assert!(machine.remove_i2c_device(25));
    let mut seen = || {
        machine.step(Duration::from_millis(20));
        let left_y = machine.controllers[0].ir[3].left_y;
        let [first, second, .., last] = *machine.i2c_device(24);
        (left_y, first, second, last)
    };
    assert_eq!(
        [(); 4].map(|()| seen()),
        [(0, 0, 5, 0), (15, 8, 5, 7), (-8, 8, 5, 7), (-8, 8, 5, 7)]
    );
    assert_eq!(machine.i2c_addresses().collect::<Vec<_>>(), [24]);
}

#[test]
fn a_slide_presses_switches_along_its_travel_also_on_another_controller() {
    let slide = Slide::new(Travel::Mm { length: 100.0, per_turn: 10.0 })
        .switch(AxisSwitch::new(Input::I1, 40.0).width(10.0))
        .switch(AxisSwitch::new(Input::I2, 60.0).controller(0).width(10.0));
    let switch = || Board::default().input(Input::I1, Sensor::SWITCH);
    let extension = switch().motor(Motor::M1, MotorModel::default().slide(slide));
    let master = switch().input(Input::I2, Sensor::SWITCH);
    let world = World::new().master(master).extension(extension);
    let mut machine = Machine::with_world(1, world).unwrap();
    let moved_by = |controller, input| machine.world().unwrap().moved_by(controller, input);
    assert_eq!((moved_by(0, Input::I2), moved_by(0, Input::I1)), (Some(Motor::M1), None));
    assert_eq!(moved_by(1, Input::I1), Some(Motor::M1));
    machine.set_outputs(1, m1(100));
    let mut seen = [Vec::new(), Vec::new()];
    for _ in 0..2000 {
        machine.step(Duration::from_millis(10));
        let at = machine.world().and_then(|world| world.slide(1, Motor::M1)).unwrap();
        let pressed = [machine.controllers[1].uni[0], machine.controllers[0].uni[1]];
        for (seen, pressed) in seen.iter_mut().zip(pressed) {
            seen.extend((pressed == 1).then_some(at));
        }
        assert_eq!(machine.controllers[0].uni[0], 0, "this one is not moved");
    }
    for (seen, range) in seen.iter().zip([35.0..=45.0, 55.0..=65.0]) {
        assert!(
            seen.len() > 100 && seen.iter().all(|at| range.contains(at)),
            "{range:?}: {seen:?}"
        );
    }
}

#[test]
fn a_script_sets_a_sensor_of_any_kind() {
    let sensors = [
        (
            Input::I1,
            Sensor::SWITCH,
            Sensor::Switch { contact: Contact::NormallyOpen, pressed: true },
        ),
        (Input::I2, Sensor::Resistor { ohms: 100 }, Sensor::Resistor { ohms: 200 }),
        (Input::I3, Sensor::Ntc { celsius: 0.0 }, Sensor::Ntc { celsius: 50.0 }),
        (Input::I4, Sensor::Ultrasonic { cm: 10.0 }, Sensor::Ultrasonic { cm: 20.0 }),
        (Input::I5, Sensor::Colour { mv: 500 }, Sensor::Colour { mv: 900 }),
        (Input::I6, Sensor::Trail { white: true }, Sensor::Trail { white: false }),
    ];
    let mut world = World::new();
    for (input, first, second) in &sensors {
        world.master.inputs.insert(*input, first.clone());
        world.script.events.push(ScriptEvent::sensor(0.02, 0, *input, second.clone()));
    }
    let mut machine = Machine::with_world(0, world).unwrap();
    for use_second in [false, true] {
        machine.step(Duration::from_millis(20));
        for (input, first, second) in &sensors {
            let expected = if use_second { second } else { first };
            assert_eq!(machine.world().unwrap().sensor(0, *input), Some(expected));
        }
    }
}

#[test]
fn a_program_presses_buttons_and_changes_sensors_and_remotes() {
    let mut machine = Machine::with_world(1, World::shipped("slide").unwrap()).unwrap();
    let world = machine.world_mut().unwrap();
    assert!(world.press(0, Input::I3, true));
    assert!(!world.press(0, Input::I4, true), "it is not a button");
    assert!(!world.press(9, Input::I3, true));
    assert!(world.set_sensor(1, Input::I1, Some(Sensor::Resistor { ohms: 100 })));
    assert!(world.set_sensor(0, Input::I4, None));
    assert!(!world.set_sensor(2, Input::I1, None));
    world.set_remote(Remote { dip1: true, left_x: 100, ..Remote::default() });
    machine.step(Duration::from_millis(10));
    assert_eq!(machine.controllers[0].uni[..4], [0, 0, 1, 0]);
    assert_eq!(machine.controllers[1].uni[0], 1);
    for controller in &machine.controllers {
        assert_eq!(controller.ir.map(|remote| remote.left_x), [15, 0, 15, 0, 0]);
    }
}

#[test]
fn a_script_of_the_exchange_overrides_the_world() {
    let builder = unpaced().world(World::shipped("slide").unwrap());
    let txt = builder.on_exchange(|machine| machine.controllers[0].uni[0] = 77).start().unwrap();
    assert_eq!(Client::online(&txt).exchange(&m1(0)).uni[..2], [77, 0]);
}

#[test]
fn a_world_with_a_mistake_starts_nothing() {
    let mut world = World::shipped("slide").unwrap();
    world.master.lamps.insert(Output::O1);
    let error = SimulatedTxt::builder().world(world).start().unwrap_err();
    assert!(
        matches!(&error, ft_transfer_area_simulator::Error::World { line: 0, reason } if reason.contains("O1")),
        "{error}"
    );
}

#[test]
fn an_extension_that_is_cut_off_stops() {
    let mut world = World::shipped("slide").unwrap();
    world.extensions.push(world.master.clone());
    let mut machine = Machine::with_world(1, world).unwrap();
    let mut outputs = m1(512);
    outputs.duty[6] = 512;
    machine.set_outputs(1, outputs);
    machine.step(Duration::from_millis(500));
    let state = |machine: &Machine| {
        let world = machine.world().unwrap();
        (world.lamp(1, Output::O7), world.motor_speed(1, Motor::M1).unwrap() > 1e-3)
    };
    assert_eq!(state(&machine), (Some(1.0), true));
    machine.alive[0] = false;
    machine.step(Duration::from_millis(500));
    assert_eq!(state(&machine), (Some(0.0), false));
    assert_eq!(machine.report(1), None);
}

#[test]
fn a_world_that_is_plugged_in_again_is_as_at_its_start() {
    let world = World::shipped("slide").unwrap();
    let mut machine = Machine::with_world(0, world.clone()).unwrap();
    let begin = slide(&machine);
    assert!(machine.world_mut().unwrap().press(0, Input::I3, true));
    machine.set_outputs(0, m1(512));
    machine.step(Duration::from_millis(500));
    assert!(slide(&machine) > begin);
    machine.set_outputs(0, m1(0));
    machine.set_world(&world).unwrap();
    assert_eq!(slide(&machine), begin);
    let button = machine.world().unwrap().sensor(0, Input::I3).unwrap();
    assert_eq!(button.value().value, 0.0);
}
