//! A machine with a world of motors that a test steps, without sockets and without a clock.

use std::time::Duration;

use ft_transfer_area::tx::Motor;
use ft_transfer_area::wire::{ExchangeData, ExchangeDataResponse};
use ft_transfer_area_simulator::world::{MotorModel, World};
use ft_transfer_area_simulator::Machine;

/// Machine time of an exchange.
pub(crate) const STEP: Duration = Duration::from_millis(10);

/// A machine with these motors, from M1 on.
pub(crate) fn machine_with(motors: &[MotorModel]) -> Machine {
    let mut world = World::new();
    world.master.motors = Motor::ALL.into_iter().zip(motors.iter().cloned()).collect();
    Machine::with_world(0, world).unwrap()
}

/// A machine with encoder motors that have these loads, from M1 on.
pub(crate) fn machine(loads: &[f64]) -> Machine {
    let motors = loads.iter().map(|&load| MotorModel::encoder_motor().load(load));
    machine_with(&motors.collect::<Vec<_>>())
}

/// All motors forward at this duty.
pub(crate) fn forward(duty: i16) -> ExchangeData {
    ExchangeData { duty: [duty, 0, duty, 0, duty, 0, duty, 0], ..Default::default() }
}

/// Steps until the condition holds for the report.
pub(crate) fn run_until(
    machine: &mut Machine,
    outputs: ExchangeData,
    mut condition: impl FnMut(&ExchangeDataResponse) -> bool,
) -> ExchangeDataResponse {
    for _ in 0..100_000 {
        machine.set_outputs(0, outputs);
        machine.step(STEP);
        let report = machine.report(0).unwrap();
        if condition(&report) {
            return report;
        }
    }
    panic!("the condition never held: {:?}", machine.report(0));
}

pub(crate) fn steps(
    machine: &mut Machine,
    outputs: ExchangeData,
    count: usize,
) -> ExchangeDataResponse {
    let mut left = count;
    run_until(machine, outputs, |_| {
        left -= 1;
        left == 0
    })
}
