//! The controller's configuration follows the area.

use std::sync::{Arc, Mutex};
use std::thread;
use std::time::Duration;

use ft_transfer_area::transfer_area::{FishX1Transfer, LOCAL_IO, MAX_AREAS, REMOTE_IO_1};
use ft_transfer_area::wire::CommandId;
use ft_transfer_area::{CameraOptions, Error};
use ft_transfer_area_simulator::{Fault, FaultKind, Machine, SimulatedTxtBuilder};

use crate::support::{handler_for, strict, wait_until};

/// How late an answer is.
const LATE: Duration = Duration::from_millis(300);

#[test]
fn all_areas_are_configured_before_the_first_exchange() {
    let txt = strict().extensions(1).start().unwrap();
    let handler = handler_for(&txt).areas(2).build().unwrap();
    *handler.areas().lock()[REMOTE_IO_1].config.motor = [0; 4];
    handler.begin_transfer().unwrap();
    txt.with_machine(|machine| {
        use CommandId::{QueryStatus, StartOnline, UpdateConfig};
        let commands: Vec<CommandId> = machine.commands().collect();
        assert_eq!(commands, [QueryStatus, StartOnline, UpdateConfig, UpdateConfig]);
        assert_eq!(machine.controllers[0].config.motor, [1; 4]);
        assert_eq!(machine.controllers[1].config.motor, [0; 4]);
    });
    handler.areas().wait_cycle().unwrap();
    assert_eq!(handler.areas().statistics().config_updates, 2);
}

#[test]
fn a_new_config_id_goes_out_before_the_outputs_written_with_it() {
    // For each exchange, the duty and the mode of I1 on the controller.
    let seen = Arc::new(Mutex::new(Vec::new()));
    let txt = strict().on_exchange({
        let seen = Arc::clone(&seen);
        move |machine| {
            let controller = &machine.controllers[0];
            seen.lock().unwrap().push((controller.outputs.duty[0], controller.config.uni[0].mode));
        }
    });
    let txt = txt.start().unwrap();
    let handler = handler_for(&txt).reaction_window(Duration::ZERO).build().unwrap();
    handler.begin_transfer().unwrap();
    for number in 2..50 {
        let mut areas = handler.areas().lock();
        areas[LOCAL_IO].config.uni[0].mode = number;
        areas[LOCAL_IO].raise_config_id();
        areas[LOCAL_IO].output.duty[0] = number.into();
        drop(areas);
        wait_until(&txt, "the duty", |machine| {
            machine.controllers[0].outputs.duty[0] == i16::from(number)
        });
    }
    for (duty, mode) in seen.lock().unwrap().iter().filter(|(duty, _)| *duty != 0) {
        assert_eq!(*duty, i16::from(*mode), "the outputs came before the configuration");
    }
    // The response to the exchange that the machine has just seen may not have come in yet.
    handler.areas().update_config().unwrap();
    assert_eq!(handler.areas().statistics().config_updates, 49);
    handler.end_transfer().unwrap();
}

#[test]
fn update_config_returns_when_the_controller_has_the_configuration() {
    let txt = strict().start().unwrap();
    let handler = handler_for(&txt).build().unwrap();
    handler.begin_transfer().unwrap();
    for id in 2..50 {
        let mut areas = handler.areas().lock();
        areas[LOCAL_IO].config.uni[0].mode = id % 4;
        areas[LOCAL_IO].state.config_id = id;
        drop(areas);
        handler.areas().update_config().unwrap();
        let (sent, mode) = txt.with_machine(|machine| {
            let controller = &machine.controllers[0];
            (controller.config_id, controller.config.uni[0].mode)
        });
        assert_eq!((sent, mode), (i16::from(id), id % 4));
    }
    handler.end_transfer().unwrap();
    assert_eq!(handler.areas().update_config(), Err(Error::NotStarted));
}

#[test]
fn a_config_without_a_new_id_is_not_sent() {
    let txt = strict().start().unwrap();
    let handler = handler_for(&txt).build().unwrap();
    handler.begin_transfer().unwrap();
    *handler.areas().lock()[LOCAL_IO].config.motor = [0; 4];
    handler.areas().update_config().unwrap();
    assert_eq!(txt.with_machine(|machine| machine.controllers[0].config.motor), [1; 4]);
    assert_eq!(handler.areas().statistics().config_updates, 1);
}

#[test]
fn no_configuration_is_sent_any_more_when_the_transfer_is_to_end() {
    // The answers to configurations that the program changes below.
    let late = (13..=21).map(|response| Fault::at_response(response, FaultKind::Delay(LATE)));
    let txt = late.fold(strict(), SimulatedTxtBuilder::fault).start().unwrap();
    let handler = handler_for(&txt).areas(MAX_AREAS).lock_step().build().unwrap();
    handler.begin_transfer().unwrap();
    drop(handler.areas().wait_cycle().unwrap());
    let mut areas = handler.areas().lock();
    areas.iter_mut().for_each(FishX1Transfer::raise_config_id);
    areas[LOCAL_IO].output.duty[0] = 512;
    drop(areas);
    let configurations = |machine: &Machine| {
        machine.commands().filter(|command| *command == CommandId::UpdateConfig).count()
    };
    thread::scope(|scope| {
        scope.spawn(|| handler.areas().wait_cycle().map(drop));
        wait_until(&txt, "a second configuration", |machine| configurations(machine) > MAX_AREAS);
        handler.end_transfer().unwrap();
    });
    txt.with_machine(|machine| {
        assert!(configurations(machine) < 2 * MAX_AREAS, "all of them came first");
        assert_eq!(machine.commands().last(), Some(CommandId::StopOnline));
        // The first one and the last: none with the new outputs came between.
        assert_eq!(machine.exchanges(), 2);
        assert_eq!(machine.controllers[0].outputs.duty[0], 0);
    });
}

/// A stop that comes during a command before, here that of the camera.
#[test]
fn outputs_do_not_go_out_without_their_configuration_when_the_transfer_is_to_end() {
    // The camera has to be asked for before the outputs are taken, which a busy machine may not do at once.
    assert!((0..10).any(|_| ends_during_the_cameras_command()));
}

/// Whether it could be tried.
fn ends_during_the_cameras_command() -> bool {
    let late = (6..40).map(|response| Fault::at_response(response, FaultKind::Delay(LATE)));
    let txt = late.fold(strict(), SimulatedTxtBuilder::fault).start().unwrap();
    let handler = handler_for(&txt).reaction_window(LATE).build().unwrap();
    handler.begin_transfer().unwrap();
    drop(handler.areas().wait_cycle().unwrap());
    thread::scope(|scope| {
        let mut areas = handler.areas().wait_cycle().unwrap();
        scope.spawn(|| handler.start_camera(CameraOptions::default()).map(drop));
        thread::sleep(Duration::from_millis(50));
        areas[LOCAL_IO].raise_config_id();
        areas[LOCAL_IO].output.duty[0] = 512;
        drop(areas);
        wait_until(&txt, "the camera's command", |machine| {
            machine.commands().any(|one| one == CommandId::StopCameraOnline)
        });
        let (exchanges, was_tried) = txt.with_machine(|machine| {
            let configurations =
                machine.commands().filter(|one| *one == CommandId::UpdateConfig).count();
            // Its answer is late, so it is still waited for.
            let is_last = machine.commands().last() == Some(CommandId::StopCameraOnline);
            (machine.exchanges(), is_last && configurations == 1)
        });
        handler.end_transfer().unwrap();
        let last = txt.with_machine(|machine| machine.exchanges());
        assert!(!was_tried || last == exchanges + 1, "an exchange came before the last one");
        was_tried
    })
}
