//! The configuration follows the area.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::Arc;

use ft_transfer_area::transfer_area::{InputMode, UniConfig, LOCAL_IO, REMOTE_IO_1};
use ft_transfer_area::wire::CommandId;
use ft_transfer_area::Error;

use crate::support::{handler_for, unpaced, wait_until};

#[test]
fn all_areas_are_configured_before_the_first_exchange() {
    let txt = unpaced().extensions(1).start().unwrap();
    let mut handler = handler_for(&txt).areas(2).build().unwrap();
    handler.lock()[REMOTE_IO_1].config.motor = [0; 4];
    handler.begin_transfer().unwrap();
    txt.with_machine(|machine| {
        use CommandId::{QueryStatus, StartOnline, UpdateConfig};
        let commands: Vec<CommandId> = machine.commands().collect();
        assert_eq!(commands, [QueryStatus, StartOnline, UpdateConfig, UpdateConfig]);
        assert_eq!(machine.controllers[0].config.motor, [1; 4]);
        assert_eq!(machine.controllers[1].config.motor, [0; 4]);
    });
    handler.wait_cycle().unwrap();
    assert_eq!(handler.statistics().config_updates, 2);
}

#[test]
fn a_new_config_id_goes_out_before_the_outputs_written_with_it() {
    let ultrasonic = UniConfig::analog(InputMode::Ultrasonic);
    let in_order = Arc::new(AtomicBool::new(false));
    let txt = unpaced().on_exchange({
        let in_order = Arc::clone(&in_order);
        move |machine| {
            let controller = &machine.controllers[0];
            if controller.outputs.duty[0] == 1 {
                in_order.store(controller.config.uni[1] == ultrasonic, Ordering::Relaxed);
            }
        }
    });
    let txt = txt.start().unwrap();
    let mut handler = handler_for(&txt).build().unwrap();
    handler.begin_transfer().unwrap();
    handler.wait_cycle().unwrap();

    let mut areas = handler.lock();
    areas[LOCAL_IO].config.uni[1] = ultrasonic;
    areas[LOCAL_IO].state.config_id += 1;
    areas[LOCAL_IO].output.duty[0] = 1;
    drop(areas);
    wait_until(&txt, "the duty", |machine| machine.controllers[0].outputs.duty[0] == 1);
    handler.update_config().unwrap();
    assert!(in_order.load(Ordering::Relaxed), "the outputs came before the configuration");
    assert_eq!(handler.statistics().config_updates, 2);
    handler.end_transfer().unwrap();
}

#[test]
fn update_config_returns_when_the_controller_has_the_configuration() {
    let txt = unpaced().start().unwrap();
    let mut handler = handler_for(&txt).build().unwrap();
    handler.begin_transfer().unwrap();
    for id in 2..50 {
        let mut areas = handler.lock();
        areas[LOCAL_IO].config.uni[0].mode = id % 4;
        areas[LOCAL_IO].state.config_id = id;
        drop(areas);
        handler.update_config().unwrap();
        let (sent, mode) = txt.with_machine(|machine| {
            let controller = &machine.controllers[0];
            (controller.config_id, controller.config.uni[0].mode)
        });
        assert_eq!((sent, mode), (i16::from(id), id % 4));
    }
    handler.end_transfer().unwrap();
    assert_eq!(handler.update_config(), Err(Error::NotStarted));
}

#[test]
fn a_config_without_a_new_id_stays_where_it_is() {
    let txt = unpaced().start().unwrap();
    let mut handler = handler_for(&txt).build().unwrap();
    handler.begin_transfer().unwrap();
    handler.lock()[LOCAL_IO].config.motor = [0; 4];
    handler.update_config().unwrap();
    assert_eq!(txt.with_machine(|machine| machine.controllers[0].config.motor), [1; 4]);
    assert_eq!(handler.statistics().config_updates, 1);
}
