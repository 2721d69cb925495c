//! The TX library's calls against a simulated world, over a real socket.

use std::collections::BTreeMap;

use ft_transfer_area::transfer_area::{
    CounterMode, FishX1Transfer, InputMode, LOCAL_IO, NO_ULTRASONIC, R2_OVR, R_OVR, U_OVR,
};
use ft_transfer_area::tx::{
    Counter, Direction, Input, InvalidCall, IoValue, IrDevice, JoystickAxis, JoystickPart,
    JoystickSwitch, Motor, Output, Sound, SILENCE,
};
use ft_transfer_area::TransferAreaComHandler;
use ft_transfer_area_simulator::world::{Board, MotorModel, Remote, Sensor, World};
use ft_transfer_area_simulator::{Machine, SimulatedTxt};

use crate::support::{check_client, handler_for, unpaced};
use Direction::{Ccw, Cw, Halt};
use Motor::{M1, M2, M3, M4};

/// Many more exchanges than any test needs.
const CYCLES: usize = 100_000;

/// The most pulses by which a count may pass its distance, for motors of the default inertia.
const FEW: u16 = 3;

/// The most pulses by which synchronised motors may differ.
const APART: u16 = 6;

/// Encoder motors with these loads on M1 to M4, and something on most inputs.
fn world() -> World {
    let loads = [0.0, 0.3, 0.1, 0.2];
    let motors = Motor::ALL.into_iter().zip(loads);
    let motors = motors.map(|(motor, load)| (motor, encoder_motor().load(load)));
    let inputs = [
        (Input::I1, Sensor::BUTTON),
        (Input::I2, Sensor::Ultrasonic { cm: 30.0 }),
        (Input::I3, Sensor::Voltage { mv: 12_000 }),
        (Input::I4, Sensor::Resistor { ohms: 6_000 }),
        (Input::I5, Sensor::Resistor { ohms: 20_000 }),
    ];
    let mut master = Board::default();
    (master.inputs, master.motors) = (BTreeMap::from(inputs), motors.collect());
    World::new().master(master)
}

fn encoder_motor() -> MotorModel {
    MotorModel::encoder_motor()
}

/// A transfer with a world.
fn begin(world: World) -> (SimulatedTxt, TransferAreaComHandler) {
    let txt = unpaced().extensions(1).world(world).start().unwrap();
    let handler = handler_for(&txt).areas(2).build().unwrap();
    handler.begin_transfer().unwrap();
    (txt, handler)
}

/// Ends the transfer, and checks that the client has made no mistake.
fn end(txt: &SimulatedTxt, handler: TransferAreaComHandler) {
    handler.end_transfer().unwrap();
    check_client(txt);
}

/// Looks at the master's area in each cycle until the condition holds there.
fn until(
    handler: &TransferAreaComHandler,
    what: &str,
    mut condition: impl FnMut(&mut FishX1Transfer) -> bool,
) {
    for _ in 0..CYCLES {
        if condition(&mut handler.areas().wait_cycle().unwrap()[LOCAL_IO]) {
            return;
        }
    }
    panic!("{what} did not happen");
}

/// Makes a call on the master's area.
fn call<R>(handler: &TransferAreaComHandler, f: impl FnOnce(&mut FishX1Transfer) -> R) -> R {
    f(&mut handler.areas().lock()[LOCAL_IO])
}

fn count(handler: &TransferAreaComHandler, motor: Motor) -> u16 {
    call(handler, |area| area.get_in_cnt_count(motor.counter()))
}

/// Waits until the motors have stopped.
fn come_to_rest(txt: &SimulatedTxt, handler: &TransferAreaComHandler) {
    until(handler, "rest", |_| {
        let speed = |machine: &Machine, motor| machine.world().unwrap().motor_speed(0, motor);
        txt.with_machine(|machine| {
            Motor::ALL.iter().all(|motor| speed(machine, *motor).unwrap().abs() < 0.01)
        })
    });
}

#[test]
fn an_input_reports_in_its_new_mode_after_a_configuration() {
    let (txt, handler) = begin(world());
    let value = |value, over_range| IoValue { value, over_range };
    for (input, mode, expected) in [
        (Input::I2, InputMode::Ultrasonic, value(30, false)),
        (Input::I1, InputMode::Ultrasonic, value(NO_ULTRASONIC, true)),
        (Input::I3, InputMode::Voltage, value(U_OVR, true)),
        (Input::I4, InputMode::Resistance, value(R_OVR, true)),
        (Input::I4, InputMode::Resistance15k, value(6_000, false)),
        (Input::I5, InputMode::Resistance15k, value(R2_OVR, true)),
    ] {
        call(&handler, |area| {
            area.set_ft_uni_config(input, mode, false);
            assert_eq!(area.get_in_io_value(input), value(0, false), "nothing stale");
        });
        handler.areas().update_config().unwrap();
        assert_eq!(
            call(&handler, |area| area.get_in_io_value(input)),
            expected,
            "{input} {mode:?}"
        );
        let analogue = call(&handler, |area| area.get_in_io_value_analogue(input));
        assert_eq!(analogue, Ok(expected.value));
    }
    call(&handler, |area| area.set_ft_uni_config(Input::I1, InputMode::Resistance, true));
    txt.with_machine(|machine| machine.world_mut().unwrap().press(0, Input::I1, true));
    until(&handler, "the button", |area| area.get_in_io_value_binary(Input::I1).unwrap());
    call(&handler, |area| area.set_ft_cnt_config(Counter::C3, CounterMode::Inverted));
    call(&handler, |area| area.set_ft_motor_config(M4, false));
    handler.areas().update_config().unwrap();
    txt.with_machine(|machine| {
        let config = &machine.controllers[0].config;
        assert_eq!((config.cnt[2].mode, *config.motor), (0, [1, 1, 1, 0]));
    });
    end(&txt, handler);
}

#[test]
fn motors_turn_and_lamps_shine_as_they_are_set() {
    let mut world = world();
    world.master.motors.remove(&M4);
    world.master.lamps.insert(Output::O7);
    let (txt, handler) = begin(world);
    let speed = |motor| txt.with_machine(|machine| machine.world()?.motor_speed(0, motor)).unwrap();
    call(&handler, |area| area.set_out_motor_values(M1, 512, Cw)).unwrap();
    call(&handler, |area| area.set_out_motor_power(M2, -512)).unwrap();
    until(&handler, "forward and backward", |_| speed(M1) > 2.0 && speed(M2) < -1.5);
    call(&handler, |area| area.set_out_motor_inverse(M1)).unwrap();
    until(&handler, "the other way", |_| speed(M1) < -2.0);
    assert_eq!(call(&handler, |area| area.get_out_motor_values(M1)), Ok(-512));
    call(&handler, |area| area.set_out_motor_values(M1, 512, Halt)).unwrap();
    call(&handler, |area| area.set_out_motor_values(M2, 0, Cw)).unwrap();
    until(&handler, "halt", |_| speed(M1).abs() < 0.01 && speed(M2).abs() < 0.01);

    let lamp = || txt.with_machine(|machine| machine.world()?.lamp(0, Output::O7)).unwrap();
    let refused = call(&handler, |area| area.set_out_pwm_values(Output::O7, 256));
    assert_eq!(refused, Err(InvalidCall::NotAnOutput { output: Output::O7 }));
    call(&handler, |area| area.set_ft_motor_config(M4, false));
    call(&handler, |area| area.set_out_pwm_values(Output::O7, 256)).unwrap();
    until(&handler, "light", |_| lamp() > 0.0);
    assert_eq!(call(&handler, |area| area.get_out_pwm_values(Output::O7)), Ok(256));
    end(&txt, handler);
}

#[test]
fn a_distance_ends_within_a_few_pulses_and_is_ready_exactly_once() {
    let (txt, handler) = begin(world());
    call(&handler, |area| area.start_motor_ex_cmd(M2, 512, Cw, &[], 1000)).unwrap();
    let (mut was_ready, mut reached, mut cycles_after) = (false, 0, 0);
    until(&handler, "the distance and 200 cycles more", |area| {
        let ready = area.is_motor_ex_ready(M2);
        assert!(ready || !was_ready, "it stays ready");
        assert_eq!(ready, area.get_in_cnt_count(Counter::C2) >= 1000, "neither early nor late");
        // Clears the flag, as C programs do.
        reached += std::mem::take(&mut area.input.motor_ex_reached[1]);
        cycles_after += usize::from(ready);
        was_ready = ready;
        cycles_after == 200
    });
    assert_eq!(reached, 1);
    let pulses = count(&handler, M2);
    assert!((1000..=1000 + FEW).contains(&pulses), "{pulses} pulses");
    end(&txt, handler);
}

#[test]
fn motors_of_different_load_stay_together() {
    for slaves in [&[(M2, Ccw)][..], &[(M3, Cw), (M4, Cw), (M2, Ccw)]] {
        let (txt, handler) = begin(world());
        call(&handler, |area| area.start_motor_ex_cmd(M1, 450, Cw, slaves, 800)).unwrap();
        let motors = || slaves.iter().map(|(motor, _)| *motor).chain([M1]);
        until(&handler, "the distance of all", |area| {
            let counts = motors().map(|motor| area.get_in_cnt_count(motor.counter()));
            let (least, most) = (counts.clone().min().unwrap(), counts.max().unwrap());
            assert!(most - least <= APART, "{least} and {most} pulses");
            motors().all(|motor| area.is_motor_ex_ready(motor))
        });
        come_to_rest(&txt, &handler);
        for motor in motors() {
            let pulses = count(&handler, motor);
            assert!((800..=800 + FEW).contains(&pulses), "{motor}: {pulses} pulses");
        }
        end(&txt, handler);
    }
}

#[test]
fn motors_turn_together_without_an_end_until_they_are_stopped() {
    let (txt, handler) = begin(world());
    // First a distance; the motors are held at its end.
    call(&handler, |area| area.start_motor_ex_cmd(M1, 512, Cw, &[(M2, Cw)], 50)).unwrap();
    let both = |area: &FishX1Transfer| area.is_motor_ex_ready(M1) && area.is_motor_ex_ready(M2);
    until(&handler, "the distance", |area| both(area));
    come_to_rest(&txt, &handler);
    let apart = i32::from(count(&handler, M1)) - i32::from(count(&handler, M2));

    call(&handler, |area| area.start_synchronised(M1, 450, Cw, &[(M2, Ccw)])).unwrap();
    until(&handler, "a long way", |area| {
        let [first, second] = [M1, M2].map(|motor| area.get_in_cnt_count(motor.counter()));
        let apart = i32::from(first) - i32::from(second) - apart;
        assert!(apart.unsigned_abs() <= APART.into(), "{first} and {second} pulses");
        assert!(!area.is_motor_ex_ready(M2), "there is no end");
        first > 1000
    });
    for motor in [M1, M2] {
        call(&handler, |area| area.stop_motor_ex_cmd(motor)).unwrap();
    }
    until(&handler, "the end of the mode", |area| both(area));
    come_to_rest(&txt, &handler);
    end(&txt, handler);
}

#[test]
fn three_hundred_distances_in_a_row_are_never_ready_early() {
    let (txt, handler) = begin(world());
    for command in 1..=300_u32 {
        let pulses = 1 + command * 7919 % 60;
        let direction = if command % 2 == 0 { Cw } else { Ccw };
        call(&handler, |area| {
            area.start_motor_ex_cmd(M1, 512, direction, &[], pulses).unwrap();
            assert!(!area.is_motor_ex_ready(M1), "command {command} has only just begun");
        });
        until(&handler, "a distance", |area| {
            let ready = area.is_motor_ex_ready(M1);
            let counted = u32::from(area.get_in_cnt_count(Counter::C1));
            assert!(!ready || counted >= pulses, "command {command}: {counted} of {pulses}");
            ready
        });
    }
    end(&txt, handler);
}

#[test]
fn a_command_that_replaces_a_running_one_is_the_only_one_that_is_done() {
    let (txt, handler) = begin(world());
    call(&handler, |area| area.start_motor_ex_cmd(M1, 512, Cw, &[], 2000)).unwrap();
    until(&handler, "some way", |area| area.get_in_cnt_count(Counter::C1) > 100);
    call(&handler, |area| area.start_motor_ex_cmd(M1, 512, Ccw, &[], 50)).unwrap();
    until(&handler, "the second distance", |area| area.is_motor_ex_ready(M1));
    come_to_rest(&txt, &handler);
    let pulses = count(&handler, M1);
    assert!((50..=50 + FEW).contains(&pulses), "{pulses} pulses");
    end(&txt, handler);
}

#[test]
fn a_motor_that_has_arrived_turns_freely_only_after_leaving_the_mode() {
    let (txt, handler) = begin(world());
    call(&handler, |area| area.start_motor_ex_cmd(M1, 512, Cw, &[(M2, Cw)], 100)).unwrap();
    let both = |area: &FishX1Transfer| area.is_motor_ex_ready(M1) && area.is_motor_ex_ready(M2);
    until(&handler, "the distance", |area| both(area));
    come_to_rest(&txt, &handler);
    let held = count(&handler, M1);
    call(&handler, |area| area.set_out_motor_values(M1, 512, Cw)).unwrap();
    for _ in 0..100 {
        handler.areas().wait_cycle().unwrap();
    }
    assert_eq!(count(&handler, M1), held, "it is held at its distance");

    call(&handler, |area| area.stop_motor_ex_cmd(M1)).unwrap();
    call(&handler, |area| area.stop_motor_ex_cmd(M2)).unwrap();
    until(&handler, "the end of the mode", |area| both(area));
    call(&handler, |area| area.set_out_motor_values(M1, 512, Cw)).unwrap();
    until(&handler, "free running", |area| area.get_in_cnt_count(Counter::C1) > held + 1000);
    call(&handler, FishX1Transfer::stop_all_motor_ex_cmd);
    come_to_rest(&txt, &handler);
    assert!(count(&handler, M2) <= 100 + FEW, "M2 does not follow any more");
    end(&txt, handler);
}

#[test]
fn a_counter_is_reset_and_reports_it() {
    let (txt, handler) = begin(world());
    call(&handler, |area| area.set_out_motor_values(M3, 512, Cw)).unwrap();
    until(&handler, "pulses", |area| area.get_in_cnt_count(Counter::C3) > 50);
    call(&handler, |area| area.set_out_motor_values(M3, 0, Halt)).unwrap();
    come_to_rest(&txt, &handler);
    call(&handler, |area| {
        area.start_counter_reset(Counter::C3);
        assert!(!area.is_cnt_reset_ready(Counter::C3));
    });
    until(&handler, "the reset", |area| area.is_cnt_reset_ready(Counter::C3));
    call(&handler, |area| {
        assert_eq!(area.get_in_counter_value(Counter::C3).0, 0);
        assert_eq!(area.input.cnt_resetted, [0, 0, 1, 0]);
        assert_eq!(area.get_in_cnt_state(Counter::C3), area.input.cnt_in[2] == 1);
    });
    end(&txt, handler);
}

#[test]
fn a_sound_is_ready_when_it_has_been_played_as_often_as_asked() {
    let (txt, handler) = begin(world());
    call(&handler, |area| area.set_sound(Sound::Bell, 2)).unwrap();
    let before = handler.areas().statistics().cycles;
    until(&handler, "the end of the sound", |area| area.is_sound_ready());
    let cycles = handler.areas().statistics().cycles - before;
    assert!(cycles >= 190, "two times 0.95 s are 190 cycles, not {cycles}");
    call(&handler, |area| area.set_sound(Sound::Alarm, 9)).unwrap();
    // Nine times half a second.
    for _ in 0..400 {
        assert!(!handler.areas().wait_cycle().unwrap()[LOCAL_IO].is_sound_ready());
    }
    call(&handler, |area| area.set_sound(SILENCE, 1)).unwrap();
    until(&handler, "silence", |area| area.is_sound_ready());
    end(&txt, handler);
}

#[test]
fn remotes_microphone_and_extensions_are_read() {
    let mut world = world();
    let left = Remote { dip1: true, left_x: -15, left_y: 7, on: true, ..Remote::default() };
    world.remotes = vec![left];
    let (txt, handler) = begin(world);
    until(&handler, "the remote", |area| {
        area.get_joystick_full(IrDevice::OnOff, JoystickAxis::LeftX) == -15
    });
    call(&handler, |area| {
        assert_eq!(area.get_joystick_part(IrDevice::Any, JoystickPart::LeftXToLeft), 15);
        assert_eq!(area.get_joystick_part(IrDevice::OnOff, JoystickPart::LeftYToForward), 7);
        assert!(area.get_joystick_but_swi(IrDevice::OnOff, JoystickSwitch::On));
        assert!(area.get_joystick_but_swi(IrDevice::OnOff, JoystickSwitch::Dip1));
        assert!(!area.get_joystick_but_swi(IrDevice::OnOff, JoystickSwitch::Off));
        assert_eq!(area.get_joystick_full(IrDevice::OffOff, JoystickAxis::LeftX), 0);
        assert_eq!(area.slaves_alive(), 1);
    });
    txt.with_machine(|machine| {
        machine.alive[0] = false;
        (machine.controllers[0].mic_lin, machine.controllers[0].mic_log) = (20, 30);
    });
    until(&handler, "the loss of the extension", |area| area.slaves_alive() == 0);
    until(&handler, "the loudness", |area| (area.get_mic_lin(), area.get_mic_log()) == (20, 30));
    end(&txt, handler);
}
