//! The worlds that are shipped as files do what `docs/simulator.md` says of them.

use std::path::Path;
use std::time::Duration;

use ft_transfer_area::simulator::world::{Remote, World};
use ft_transfer_area::simulator::{Machine, SimulatedTxt};
use ft_transfer_area::transfer_area::{Config, InputMode, UniConfig};
use ft_transfer_area::tx::Input;
use ft_transfer_area::wire::ExchangeData;

fn world(name: &str) -> World {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/worlds");
    World::load(folder.join(name).with_extension("toml")).unwrap()
}

/// The car, whose inputs are configured as they should be.
fn car() -> Machine {
    let mut machine = Machine::with_world(0, world("car")).unwrap();
    let mut config = Config::default();
    config.uni[0] = UniConfig::digital(InputMode::Voltage);
    config.uni[1] = UniConfig::digital(InputMode::Voltage);
    config.uni[3] = UniConfig::analog(InputMode::Ultrasonic);
    machine.set_config(0, config);
    machine
}

#[test]
fn the_buttons_of_the_kits_world_are_pressed_one_after_the_other() {
    let mut machine = Machine::with_world(1, world("kit")).unwrap();
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
    // At 0.5 s the event of that time is still to come.
    assert_eq!(pressed, [[0, 1, 1, 0, 0, 1, 1, 0], [0, 0, 1, 1, 0, 0, 1, 1]]);
}

#[test]
fn a_world_brings_its_extensions_unless_their_number_is_asked_for() {
    for (asked_for, number) in [(None, 1), (Some(0), 0), (Some(3), 3)] {
        let builder = SimulatedTxt::builder().world(world("kit"));
        let builder = match asked_for {
            Some(extensions) => builder.extensions(extensions),
            None => builder,
        };
        let txt = builder.start().unwrap();
        assert_eq!(txt.with_machine(|machine| machine.controllers.len()), 1 + number);
    }
}

#[test]
fn the_car_goes_straight_on_only_when_its_wheels_are_synchronised() {
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
    assert_eq!(world("car").remotes.len(), 1);
}
