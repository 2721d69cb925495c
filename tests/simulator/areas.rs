//! The exchange of transfer areas with a machine, without a connection.

use std::time::Duration;

use ft_transfer_area::transfer_area::{Config, InputMode, UniConfig};
use ft_transfer_area::tx::{Input, Motor};
use ft_transfer_area::FishX1Transfer;
use ft_transfer_area_simulator::world::{Contact, Sensor, World};
use ft_transfer_area_simulator::Machine;

/// What an area shows of the slide's world: its start and end switch, its button, and its distance.
fn slide_seen(area: &FishX1Transfer) -> &[i16] {
    &area.input.uni[..4]
}

#[test]
fn a_report_before_the_first_step_has_what_the_sensors_measure() {
    let mut world = World::shipped("slide").unwrap();
    world
        .master
        .inputs
        .insert(Input::I3, Sensor::Button { contact: Contact::NormallyOpen, pressed: true });
    let mut machine = Machine::with_world(0, world).unwrap();
    assert_eq!(machine.report(0).unwrap().uni[..3], [0, 0, 1]);
    let mut config = Config::default();
    config.uni[3] = UniConfig::analog(InputMode::Ultrasonic);
    machine.set_config(0, config);
    assert_eq!(machine.report(0).unwrap().uni[..4], [0, 0, 1, 15]);
    let mut area = FishX1Transfer::default();
    machine.report_into(0, &mut area);
    assert_eq!(slide_seen(&area), [0, 0, 1, 15]);
    assert_eq!(machine.time(), Duration::ZERO);
}

#[test]
fn areas_are_exchanged_without_a_mapping_by_hand() {
    let mut world = World::shipped("slide").unwrap();
    world.extensions.push(world.master.clone());
    let mut machine = Machine::with_world(1, world).unwrap();
    (machine.controllers[0].mic_lin, machine.controllers[0].mic_log) = (7, 8);
    let mut areas = [FishX1Transfer::default(); 3];
    for area in &mut areas[..2] {
        area.config.uni[3] = UniConfig::analog(InputMode::Ultrasonic);
        area.output.duty[0] = 512;
        area.output.distance[0] = 100;
        area.output.cnt_reset_cmd_id[1] = 3;
        area.raise_motor_ex_cmd_id(Motor::M1);
        area.txt_outputs.sound_cmd_id = 4;
        area.txt_outputs.sound_index = 1;
    }
    *areas[1].output.duty = [0, i16::MAX, 0, 0, 0, 0, i16::MIN, 0]; // as they are sent: 512 and 0
    machine.exchange(&mut areas, Duration::from_millis(10));
    assert_eq!(areas[0].state.io_slave_alive, [1, 0, 0, 0, 0, 0, 0, 0]);
    assert_eq!((areas[0].txt_inputs2.mic_lin, areas[0].txt_inputs2.mic_log), (7, 8));
    let is_done = |area: &FishX1Transfer| {
        area.input.motor_ex_reached[0] != 0 && area.txt_inputs.sound_cmd_id == 4
    };
    while !areas[..2].iter().all(is_done) {
        assert!(machine.time() < Duration::from_secs(10));
        machine.exchange(&mut areas, Duration::from_millis(10));
    }
    for (area, near) in areas[..2].iter().zip([17, 13]) {
        assert!((100..=103).contains(&area.input.counter[0]), "{area}");
        assert_eq!((area.input.cnt_resetted[1], area.txt_inputs.sound_cmd_id), (1, 4));
        assert_eq!(slide_seen(area), [0, 0, 0, near]);
    }
    assert_eq!(u128::from(areas[0].timer.timer_1ms), machine.time().as_millis());
    // There is no second extension.
    assert_eq!(areas[2], FishX1Transfer::default());
}

#[test]
fn a_configuration_is_taken_when_its_id_is_new_as_in_a_transfer() {
    let mut machine = Machine::with_world(0, World::shipped("slide").unwrap()).unwrap();
    let mut areas = [FishX1Transfer::default()];
    let mut seen = |areas: &mut [FishX1Transfer]| {
        machine.exchange(areas, Duration::from_millis(10));
        areas[0].input.uni[3]
    };
    let distance_at_first = seen(&mut areas);
    areas[0].config.uni[3] = UniConfig::analog(InputMode::Ultrasonic);
    assert_eq!(seen(&mut areas), distance_at_first);
    areas[0].raise_config_id();
    assert_eq!(seen(&mut areas), 15);
}

#[test]
fn an_area_of_an_extension_that_is_cut_off_does_not_change() {
    let mut machine = Machine::new(1);
    let mut areas = [FishX1Transfer::default(); 2];
    machine.controllers[1].uni[0] = 5;
    machine.exchange(&mut areas, Duration::from_millis(10));
    machine.alive[0] = false;
    machine.controllers[1].uni[0] = 6;
    areas[1].output.duty[0] = 512;
    machine.exchange(&mut areas, Duration::from_millis(10));
    assert_eq!((areas[1].input.uni[0], areas[0].state.io_slave_alive[0]), (5, 0));
    assert_eq!(machine.controllers[1].outputs.duty, [0; 8]);
}
