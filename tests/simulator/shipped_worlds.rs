//! The worlds that come with the library do what `docs/simulator.md` says about them.

use std::time::Duration;

use ft_transfer_area::transfer_area::{Config, InputMode, UniConfig};
use ft_transfer_area::tx::{Input, Output};
use ft_transfer_area::wire::ExchangeData;
use ft_transfer_area_simulator::world::{Remote, World};
use ft_transfer_area_simulator::{Machine, SimulatedTxt};

/// The car, with the right configuration of its inputs.
fn car() -> Machine {
    let mut machine = Machine::with_world(0, World::shipped("car").unwrap()).unwrap();
    let mut config = Config::default();
    config.uni[0] = UniConfig::digital(InputMode::Voltage);
    config.uni[1] = UniConfig::digital(InputMode::Voltage);
    config.uni[3] = UniConfig::analog(InputMode::Ultrasonic);
    machine.set_config(0, config);
    machine
}

#[test]
fn the_default_world_has_something_to_see_on_all_its_terminals() {
    let mut machine = Machine::with_world(1, World::default()).unwrap();
    let mut config = Config::default();
    config.uni[1] = UniConfig::analog(InputMode::Ultrasonic);
    for controller in 0..2 {
        machine.set_config(controller, config);
    }
    // M1 and M2 forward, the slide on M3 to its end and after 5 s back; the extension's M1.
    for (seconds, slide) in [(5, [512, 0]), (10, [0, 512])] {
        let mut pressed = [0; 3];
        let duty = [512, 0, 512, 0, slide[0], slide[1], 100, 0];
        for controller in 0..2 {
            machine.set_outputs(controller, ExchangeData { duty, ..Default::default() });
        }
        while machine.world().unwrap().time() < Duration::from_secs(seconds) {
            machine.step(Duration::from_millis(10));
            let [master, extension] = &machine.controllers[..] else { panic!() };
            assert_eq!((master.uni[1], extension.uni[1]), (40, 25));
            let now = [master.uni[0], extension.uni[0], master.uni[2]];
            pressed.iter_mut().zip(now).for_each(|(pressed, now)| *pressed += now);
        }
        let [i1, extensions_i1, i3] = pressed;
        assert!((200..=300).contains(&i1) && (200..=300).contains(&extensions_i1), "{pressed:?}");
        assert_eq!(i3, if seconds == 5 { 0 } else { 50 });
        let switches = &machine.controllers[0].uni[3..5];
        assert_eq!(switches, if seconds == 5 { [0, 1] } else { [1, 0] });
    }
    let [m1, m2, m3, _] = machine.controllers[0].counter;
    assert!(m1 > 1800 && m2 < m1 && m2 > 1000, "{m1} and {m2}: the second has a higher load");
    assert!((799..=800).contains(&m3), "{m3}");
    assert!(machine.controllers[1].counter[0] > 1800);
    assert_eq!(machine.world().unwrap().lamp(0, Output::O7).map(|lamp| lamp > 0.1), Some(true));
}

#[test]
fn in_the_default_world_the_remote_drives_and_the_acceleration_sensor_is_turned() {
    let mut machine = Machine::with_world(1, World::default()).unwrap();
    assert_eq!(machine.i2c_device(0x18)[..9], [0xFA, 0, 0, 0, 0, 0, 0, 0x40, 0x02]);
    machine.step(Duration::from_millis(2600));
    assert_eq!(machine.i2c_device(0x18)[2..8], [0, 0x40, 0, 0, 0, 0]);
    let remote = machine.controllers[0].ir[2];
    assert_eq!((remote.left_y, remote.right_y), (15, 5));
    machine.step(Duration::from_millis(2600));
    assert_eq!(machine.i2c_device(0x18)[2..8], [0, 0, 0, 0, 0, 0x40]);
}

#[test]
fn the_buttons_of_the_kits_world_are_pressed_one_after_the_other() {
    let mut machine = Machine::with_world(1, World::shipped("kit").unwrap()).unwrap();
    for controller in 0..2 {
        let mut config = Config::default();
        config.uni[1] = UniConfig::analog(InputMode::Ultrasonic);
        machine.set_config(controller, config);
    }
    let mut pressed = [Vec::new(), Vec::new()];
    for _ in 0..8 {
        machine.step(Duration::from_millis(500));
        for (pressed, controller) in pressed.iter_mut().zip(&machine.controllers) {
            pressed.push(controller.uni[0]);
        }
        assert_eq!([0, 1].map(|index| machine.controllers[index].uni[1]), [40, 25]);
    }
    // At 0.5 s the event for that time has not happened yet.
    assert_eq!(pressed, [[0, 1, 1, 0, 0, 1, 1, 0], [0, 0, 1, 1, 0, 0, 1, 1]]);
}

#[test]
fn a_world_brings_its_extensions_unless_their_number_is_asked_for() {
    for (asked_for, number) in [(None, 1), (Some(0), 0), (Some(3), 3)] {
        let builder = SimulatedTxt::builder().world(World::shipped("kit").unwrap());
        let builder = match asked_for {
            Some(extensions) => builder.extensions(extensions),
            None => builder,
        };
        let txt = builder.start().unwrap();
        assert_eq!(txt.with_machine(|machine| machine.controllers.len()), 1 + number);
    }
}

#[test]
fn the_car_drives_straight_only_when_its_wheels_are_synchronised() {
    let [alone, together] = [0, 1].map(|master| {
        let mut machine = car();
        let outputs = ExchangeData {
            duty: [400, 0, 400, 0, 0, 0, 0, 0],
            master: [0, master, 0, 0],
            distance: [1000, 1000, 0, 0],
            motor_command_id: [1, 1, 0, 0],
            ..ExchangeData::default()
        };
        machine.set_outputs(0, outputs);
        machine.step(Duration::from_secs(4));
        let [left, right, ..] = machine.controllers[0].counter;
        assert!((100..1000).contains(&left), "{left}");
        left - right
    });
    assert!(alone > 10, "{alone} pulses apart");
    assert!((-4..=4).contains(&together), "{together} pulses apart");
}

#[test]
fn the_car_sees_its_trail_and_what_is_ahead() {
    let mut machine = car();
    let mut inputs = || {
        machine.step(Duration::from_millis(10));
        let inputs = machine.controllers[0].uni;
        let world = machine.world_mut().unwrap();
        world.press(0, Input::I3, true);
        world.set_remote(Remote { left_y: 15, ..Remote::default() });
        (inputs[0], inputs[1], inputs[2], inputs[3], machine.controllers[0].ir[1].left_y)
    };
    assert_eq!(inputs(), (0, 0, 0, 80, 0));
    assert_eq!(inputs(), (0, 0, 1, 80, 15));
    assert_eq!(World::shipped("car").unwrap().remotes.len(), 1);
}
