//! The lines that are typed while `txt simulate` runs.

use std::time::Duration;

use ft_transfer_area::tx::{Input, Motor};
use ft_transfer_area::wire::IrRemote;
use ft_transfer_area_simulator::world::{Factory, Piece, Remote, Sensor, World};
use ft_transfer_area_simulator::Machine;

use typed::carry_out;

#[path = "../../tools/src/simulate/typed.rs"]
mod typed;

/// The world `everything`, on a master with an extension.
fn everything() -> Machine {
    Machine::with_world(1, World::shipped("everything").unwrap()).unwrap()
}

/// What the eight universal inputs of a controller report one step after these lines.
fn reported(machine: &mut Machine, lines: &[&str], controller: usize) -> [i16; 8] {
    lines.iter().for_each(|line| carry_out(line, machine).unwrap());
    machine.step(Duration::from_millis(10));
    machine.controllers[controller].uni
}

#[test]
fn lines_press_buttons_and_set_sensors() {
    let mut machine = everything();
    assert_eq!(reported(&mut machine, &["I3 1"], 0)[2], 1);
    assert_eq!(reported(&mut machine, &["i3 0"], 0)[2], 0);
    assert_eq!(reported(&mut machine, &["e1.i2 7600"], 1)[1], 0, "over range");
    carry_out("I5 -10.5", &mut machine).unwrap();
    carry_out("E1.C2 1", &mut machine).unwrap();
    let world = machine.world().unwrap();
    assert_eq!(format!("{:?}", world.sensor(0, Input::I5)), "Some(Ntc { celsius: -10.5 })");
    // The light barrier of a place is on C3.
    assert_eq!(machine.controllers[1].counter_input, [0, 1, 1, 0]);
}

#[test]
fn lines_set_the_inputs_themselves_without_a_world() {
    let mut machine = Machine::new(1);
    let uni = reported(&mut machine, &["I1 4711", "I8 -1", "E1.I1 5"], 0);
    assert_eq!(uni, [4711, 0, 0, 0, 0, 0, 0, -1]);
    assert_eq!(machine.controllers[1].uni[0], 5);
}

#[test]
fn a_counter_counts_the_lines_that_raise_its_level() {
    for mut machine in [Machine::new(1), everything()] {
        for (line, level, count) in
            [("C4 1", 1, 1), ("C4 1", 1, 1), ("C4 0", 0, 1), ("C4 1", 1, 2), ("C4 0", 0, 2)]
        {
            carry_out(line, &mut machine).unwrap();
            machine.step(Duration::from_millis(10));
            let report = machine.report(0).unwrap();
            assert_eq!((report.counter_input[3], report.counter[3]), (level, count), "{line}");
        }
    }
}

#[test]
fn what_a_slide_moves_can_not_be_set() {
    let mut machine = everything();
    for (line, sentence) in [
        ("I1 1", "I1 is pressed by the slide of M1"),
        ("I2 0", "I2 is pressed by the slide of M1"),
        ("I4 12.5", "I4 measures the distance to the slide of M1"),
    ] {
        assert_eq!(carry_out(line, &mut machine), Err(String::from(sentence)));
        let [now, at_first] = [&machine, &everything()].map(|machine| {
            let world = machine.world().unwrap();
            Input::ALL.map(|input| world.sensor(0, input).cloned())
        });
        assert_eq!(now, at_first);
    }
    carry_out("I3 1", &mut machine).unwrap();
    carry_out("E1.I1 1", &mut machine).unwrap();
}

#[test]
fn a_slide_moves_only_what_is_plugged_in_for_it() {
    let mut machine = everything();
    let world = machine.world_mut().unwrap();
    let moved = Input::ALL.map(|input| world.moved_by(0, input));
    let by_slide = Some(Motor::M1);
    assert_eq!(moved, [by_slide, by_slide, None, by_slide, None, None, None, None]);
    assert_eq!((world.moved_by(1, Input::I1), world.moved_by(9, Input::I1)), (None, None));
    for input in [Input::I1, Input::I4] {
        world.set_sensor(0, input, Some(Sensor::Voltage { mv: 1 }));
        assert_eq!(world.moved_by(0, input), None);
    }
    world.set_sensor(0, Input::I2, None);
    assert_eq!(world.moved_by(0, Input::I2), None);
}

#[test]
fn the_number_of_a_remote_chooses_its_dip_switches() {
    for (number, dip1, dip2) in
        [(1, false, false), (2, true, false), (3, false, true), (4, true, true)]
    {
        let mut machine = Machine::with_world(1, World::new()).unwrap();
        let line = format!("IR{number} 1 -2 15 -15 1");
        carry_out(&line, &mut machine).unwrap();
        let remote = Remote {
            dip1,
            dip2,
            left_x: 1,
            left_y: -2,
            right_x: 15,
            right_y: -15,
            on: true,
            off: false,
        };
        assert_eq!(machine.world().unwrap().remotes(), [remote]);
        machine.step(Duration::from_millis(10));
        let bits = 1 | u8::from(dip1) << 2 | u8::from(dip2) << 3;
        let sent = IrRemote { left_x: 1, left_y: -2, right_x: 15, right_y: -15, bits };
        let mut seen = [IrRemote::default(); 5];
        (seen[0], seen[number]) = (sent, sent);
        assert_eq!(machine.controllers[1].ir, seen);
        // With the right DIP switches it is the same remote.
        carry_out(&format!("IR{number} 0 0 0 0 {}", bits ^ 3), &mut machine).unwrap();
        let remotes = machine.world().unwrap().remotes();
        assert_eq!(remotes, [Remote { dip1, dip2, off: true, ..Remote::default() }]);
    }
}

#[test]
fn without_a_world_the_number_of_a_remote_is_its_place() {
    for number in 0..5 {
        let mut machine = Machine::new(0);
        carry_out(&format!("ir{number} 0 0 0 7 9"), &mut machine).unwrap();
        let mut ir = [IrRemote::default(); 5];
        ir[number] = IrRemote { right_y: 7, bits: 9, ..IrRemote::default() };
        assert_eq!(machine.controllers[0].ir, ir);
    }
}

#[test]
fn wrong_lines_are_answered_and_change_nothing() {
    for (line, answer) in [
        ("IR0 0 0 0 0 1", "IR0 is any remote; in a world use IR1 to IR4"),
        ("IR5 0 0 0 0 1", "there is no IR5 in a world, only IR1 to IR4"),
        ("IR2 0 0 0 0 8", "IR2 already sets the DIP switches, so its last number is 0 to 3"),
        ("IR1 0 0 0 0 12", "IR1 already sets the DIP switches, so its last number is 0 to 3"),
        ("IR1 0 0 0 0 16", "the last number of IR1 is 0 to 15"),
        ("IR1 0 0 0 0 -1", "the last number of IR1 is 0 to 15"),
        ("IR1 0 0 16 0 0", "a joystick of IR1 goes from -15 to 15, not to 16"),
        ("IR1 -128 0 0 0 0", "a joystick of IR1 goes from -15 to 15, not to -128"),
        ("IR1 0 0 0 0", "IR1 wants 5 number(s), not \"0 0 0 0\""),
        ("IR 0 0 0 0 0", "there is no \"IR\" to set"),
        ("C1 2", "the level of C1 is 0 or 1, not 2"),
        ("C5 1", "there is no \"C5\" to set"),
        ("I9 1", "there is no \"I9\" to set"),
        ("E1.I8 1", "nothing is plugged into E1.I8 in this world"),
        ("E2.I1 1", "there is no extension \"E2\"; --extensions sets how many there are"),
        ("I3 nan", "NaN is not a value for I3"),
        ("I3", "I3 wants 1 number(s), not \"\""),
        ("E1.I4 0", "E1.I4 looks at the place exit; PUT puts a workpiece there"),
        ("PUT blue", "PUT wants a workpiece and a place, not \"blue\""),
        (
            "PUT green seat",
            "there is no workpiece \"green\"; there are white, red, blue, container",
        ),
        ("PUT red exit", "there is no room for it at exit"),
        ("PUT red bin", "there is no place \"bin\"; there are exit, seat, table, storage"),
        ("TAKE red exit", "TAKE wants a place, not \"red exit\""),
        ("TAKE seat", "there is nothing at seat"),
        ("TAKE bin", "there is no place \"bin\"; there are exit, seat, table, storage"),
    ] {
        let mut machine = everything();
        assert_eq!(carry_out(line, &mut machine), Err(String::from(answer)), "{line}");
        assert_eq!(machine.world().unwrap().remotes(), everything().world().unwrap().remotes());
    }
    let mut machine = Machine::new(0);
    for (line, answer) in [
        ("IR5 0 0 0 0 1", "there is no IR5, only IR0 to IR4"),
        ("IR1 0 0 0 -16 1", "a joystick of IR1 goes from -15 to 15, not to -16"),
    ] {
        assert_eq!(carry_out(line, &mut machine), Err(String::from(answer)), "{line}");
    }
}

#[test]
fn places_of_a_controller_of_several_are_found_without_its_name() {
    let machines = Factory::shipped("factory").unwrap().machines().unwrap();
    let (_, mut sorting) = machines.into_iter().find(|(name, _)| name == "sorting").unwrap();
    for place in ["red_storage", "sorting.blue_storage"] {
        let (put, take) = (format!("PUT red {place}"), format!("TAKE {place}"));
        carry_out(&put, &mut sorting).unwrap();
        assert_eq!(
            carry_out(&put, &mut sorting),
            Err(format!("there is no room for it at {place}"))
        );
        carry_out(&take, &mut sorting).unwrap();
        assert_eq!(carry_out(&take, &mut sorting), Err(format!("there is nothing at {place}")));
    }
}

#[test]
fn lines_for_several_controllers_begin_with_a_name() {
    let several = [(String::from("robot"), 1), (String::from("sorting"), 2)];
    assert_eq!(typed::addressed("sorting I1 1", &several), Ok((&2, "I1 1")));
    assert_eq!(typed::addressed(" robot\tE1.I2 0", &several), Ok((&1, "E1.I2 0")));
    let sentence = "there is no controller \"I1\"; a line begins with robot, sorting";
    assert_eq!(typed::addressed("I1 1", &several), Err(String::from(sentence)));
    let single = [(String::new(), 3)];
    assert_eq!(typed::addressed("I1 1", &single), Ok((&3, "I1 1")));
}

#[test]
fn the_help_lists_lines_that_work() {
    let mut machine = everything();
    let lines = ["E1.I2 0", "E1.C1 1", "E1 0", "E1 1", "C1 1", "IR1 0 0 0 0 1", "I2C 24 63 7"];
    for line in lines.into_iter().chain(["PUT blue seat"]) {
        assert!(typed::HELP.contains(line), "{line}");
        carry_out(line, &mut machine).unwrap();
    }
    assert_eq!(machine.i2c_device(24)[63], 7);
    let seat = machine.world().unwrap().places().swap_remove(1);
    assert_eq!(seat, (String::from("seat"), Some(Piece::Blue)));
    assert!(typed::HELP.contains("TAKE seat"));
    carry_out("TAKE seat", &mut machine).unwrap();
    assert_eq!(machine.world().unwrap().places().swap_remove(1), (String::from("seat"), None));
    assert!(typed::HELP.lines().all(|line| line.len() <= 100));
}
