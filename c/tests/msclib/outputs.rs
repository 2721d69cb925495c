//! Motors, outputs, counters and their configuration.

use super::api::*;
use super::bench::*;

#[test]
fn duties_go_to_the_outputs_in_both_exchanges() {
    let library = initialized();
    library.in_both_exchanges(|txt, device| {
        assert_eq!(SetOutMotorValues(device.0, 0, 1, 0, 512), SUCCESS);
        assert_eq!(SetOutPwmValues(device.0, 0, 7, 100), SUCCESS);
        device.set_duty(0, 0, 33);
        machine(txt, "the duties", |it| {
            it.controllers[0].outputs.duty == [33, 0, 0, 512, 0, 0, 0, 100]
        });
        assert_eq!(ftxStopTransferArea(device.0), SUCCESS);
        stands(txt);
        assert_eq!(device.output(0).duty, [0; 8]);
    });
}

#[test]
fn a_distance_is_driven_by_two_motors_and_reported() {
    let library = initialized();
    library.in_both_exchanges(|txt, device| {
        assert_eq!(StartMotorExCmd(device.0, 0, 0, 512, 0, 1, 1, 50), SUCCESS);
        let output = device.output(0);
        assert_eq!(
            (*output.duty, *output.distance),
            ([512, 0, 0, 512, 0, 0, 0, 0], [50, 50, 0, 0])
        );
        assert_eq!((*output.master, *output.motor_ex_cmd_id), ([0, 1, 0, 0], [1, 1, 0, 0]));
        wait("the distance", || device.input(0).motor_ex_reached == [1, 1, 0, 0]);
        assert!(device.input(0).counter[0] >= 50);
        // Another one begins with its flag set back.
        assert_eq!(StartMotorExCmd(device.0, 0, 0, 512, 1, 0, 0, 60_000), SUCCESS);
        assert_eq!(device.input(0).motor_ex_reached, [0, 1, 0, 0]);
        machine(txt, "the other way", |it| it.controllers[0].outputs.duty[1] == 512);
        assert_eq!(StopMotorExCmd(device.0, 0, 0), SUCCESS);
        machine(txt, "the stop", |it| it.controllers[0].outputs.duty[..2] == [0, 0]);
        assert_eq!(StopAllMotorExCmd(device.0, 0), SUCCESS);
        machine(txt, "the end of the mode", |it| it.controllers[0].outputs.master == [0; 4]);
    });
}

#[test]
fn without_pulses_a_motor_turns_until_it_is_stopped() {
    let library = initialized();
    library.in_both_exchanges(|txt, device| {
        assert_eq!(StartMotorExCmd(device.0, 0, 2, 400, 0, -1, 7, 0), SUCCESS);
        machine(txt, "the motor", |it| it.controllers[0].outputs.duty[4] == 400);
        assert_eq!(device.output(0).distance, [0; 4]);
        wait("pulses", || device.input(0).counter[2] > 20);
        assert_eq!(StartCounterReset(device.0, 0, 2), SUCCESS);
        wait("the reset", || device.input(0).cnt_resetted[2] == 1);
    });
}

/// By the manual of ftMscLib 1.5.11 (3.13, 9.6, 9.7), a motor without a distance has no target.
#[test]
fn a_command_without_a_distance_reaches_nothing() {
    let library = initialized();
    library.in_both_exchanges(|_, device| {
        assert_eq!(StartMotorExCmd(device.0, 0, 0, 512, 0, 1, 0, 0), SUCCESS);
        wait("pulses", || device.input(0).counter[..2].iter().all(|count| *count > 20));
        assert_eq!(device.input(0).motor_ex_reached, [0; 4]);
        // The order of published libraries: stop, distance 0, a moment, the new distance.
        let command = |duty, distance| {
            device.change_output(0, |it| {
                (it.duty[0], it.distance[0]) = (duty, distance);
                it.motor_ex_cmd_id[0] += 1;
            });
            let id = device.output(0).motor_ex_cmd_id[0];
            wait("the command", || device.input(0).motor_ex_cmd_id[0] == id);
        };
        command(0, 0);
        assert_eq!(device.input(0).motor_ex_reached, [0; 4]);
        command(512, 50);
        assert_eq!(device.input(0).motor_ex_reached, [1, 0, 0, 0]);
        assert!(device.input(0).counter[0] >= 50);
    });
}

/// Programs compute duties, such as 100 * 5.2.
#[test]
fn a_duty_above_512_is_limited() {
    let library = initialized();
    library.in_both_exchanges(|txt, device| {
        assert_eq!(SetOutMotorValues(device.0, 0, 0, 520, i32::MAX), SUCCESS);
        assert_eq!(SetOutPwmValues(device.0, 0, 7, 513), SUCCESS);
        assert_eq!(StartMotorExCmd(device.0, 0, 1, 1000, 0, 2, 1, 0), SUCCESS);
        let full = [512, 512, 512, 0, 0, 512, 0, 512];
        assert_eq!(device.output(0).duty, full);
        machine(txt, "the duties", |it| it.controllers[0].outputs.duty == full);
    });
}

/// Finished programs of 2009 import them.
#[test]
fn the_functions_of_the_first_library_do_what_their_successors_do() {
    let _library = initialized();
    let txt = txt();
    let device = Device::open(&txt);
    device.start();
    let h = device.0;
    assert_eq!(GetIF08TransferAddress(h), GetTransferAreasArrayAddr(h));
    assert_eq!(GetFtX1TransferStatusAddr(h, 3), GetTransferAreaStatusAddr(h, 3));
    assert!(GetFtX1TransferStatusAddr(h, 9).is_null());
    for stop in [ResetMotorExConfig, StopMotorExConfig] {
        assert_eq!(SetMotorExConfig(h, 0, 2, 400, 1, 3, 0, 60_000), SUCCESS);
        machine(&txt, "both motors", |it| it.controllers[0].outputs.duty[4..] == [0, 400, 400, 0]);
        assert_eq!(device.output(0).master, [0, 0, 0, 3]);
        assert_eq!([stop(h, 0, 2), stop(h, 0, 3)], [SUCCESS; 2]);
        machine(&txt, "the stop", |it| it.controllers[0].outputs.duty == [0; 8]);
        assert_eq!(stop(h, 0, 4), INVALID_PARAM);
    }
    txt.with_machine(|it| it.controllers[0].counter[1] = 7);
    wait("the count", || device.input(0).counter[1] == 7);
    assert_eq!(SetOutCounterReset(h, 0, 1), SUCCESS);
    wait("the reset", || device.input(0).cnt_resetted[1] == 1 && device.input(0).counter[1] == 0);
}

#[test]
fn configurations_are_sent() {
    let library = initialized();
    library.in_both_exchanges(|txt, device| {
        assert_eq!(SetFtUniConfig(device.0, 0, 3, 3, false), SUCCESS);
        assert_eq!(SetFtUniConfig(device.0, 0, 4, 0, true), SUCCESS);
        assert_eq!(SetFtCntConfig(device.0, 0, 1, 1), SUCCESS);
        assert_eq!(SetFtMotorConfig(device.0, 0, 3, false), SUCCESS);
        machine(txt, "the configuration", |it| {
            let config = it.controllers[0].config;
            let (uni, cnt) = (config.uni, config.cnt);
            (uni[3].mode, uni[3].digital, uni[4].mode, uni[4].digital) == (3, 0, 0, 1)
                && [cnt[0].mode, cnt[1].mode] == [1, 0]
                && config.motor == [1, 1, 1, 0]
        });
    });
}

/// What it has measured in its old mode says nothing any more.
#[test]
fn an_input_that_is_configured_has_no_value_yet() {
    let library = initialized();
    library.in_both_exchanges(|txt, device| {
        txt.with_machine(|it| it.controllers[0].uni = [77; 8]);
        wait("the inputs", || device.input(0).uni == [77; 8]);
        // So that no new value comes in.
        assert_eq!(ftxStopTransferArea(device.0), SUCCESS);
        assert_eq!(SetFtUniConfig(device.0, 0, 2, 0, false), SUCCESS);
        assert_eq!(device.input(0).uni, [77, 77, 0, 77, 77, 77, 77, 77]);
        device.start();
        assert_eq!(device.input(0).uni, [77; 8]);
    });
}

#[test]
fn an_extension_has_outputs_and_inputs_of_its_own() {
    let _library = initialized();
    let txt = start(ft_transfer_area_simulator::SimulatedTxt::builder().extensions(2));
    let device = Device::open(&txt);
    device.start();
    let (mut bits, mut alive) = (0, 7);
    assert_eq!((GetRoboTxSlaveState(device.0, &mut bits), bits), (SUCCESS, 0b11));
    assert_eq!((GetRoboTxSlaveAlive(device.0, 2, &mut alive), alive), (SUCCESS, 1));
    assert_eq!((GetRoboTxSlaveAlive(device.0, 3, &mut alive), alive), (SUCCESS, 0));
    for wrong in [0, 9, -1] {
        assert_eq!(GetRoboTxSlaveAlive(device.0, wrong, &mut alive), INVALID_PARAM);
    }
    assert_eq!(SetOutMotorValues(device.0, 2, 3, 200, 0), SUCCESS);
    machine(&txt, "the extension's motor", |it| it.controllers[2].outputs.duty[6] == 200);
    txt.with_machine(|it| it.controllers[2].uni[4] = 1234);
    wait("the extension's input", || device.input(2).uni[4] == 1234);
}
