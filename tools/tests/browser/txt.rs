//! A simulated TXT of this process, and what it sees of the page.

use anyhow::{ensure, Result};
use ft_transfer_area::tx::Motor;
use ft_transfer_area_simulator::world::{Script, World};
use ft_transfer_area_simulator::{Machine, SimulatedTxt};

use super::page::LIMIT;

pub(crate) const FORWARD: &str = "[aria-label='M1 forward']";
/// The duty of a first click.
pub(crate) const FIRST: i16 = 160;
pub(crate) const STOPPED: &str = ".directions [aria-label='Stop M1'][aria-pressed=true]";

pub(crate) fn simulated_txt() -> Result<SimulatedTxt> {
    let world = World::default().script(Script::default());
    Ok(SimulatedTxt::builder().world(world).start()?)
}

pub(crate) fn turns(machine: &Machine) -> bool {
    machine
        .world()
        .and_then(|world| world.motor_speed(0, Motor::M1))
        .is_some_and(|speed| speed > 0.5)
}

pub(crate) fn all_off(machine: &Machine) -> bool {
    machine.controllers.iter().all(|controller| controller.outputs.duty == [0; 8])
}

pub(crate) fn ensure_seen(
    txt: &SimulatedTxt,
    what: &str,
    condition: fn(&Machine) -> bool,
) -> Result<()> {
    ensure!(txt.wait_until(condition, LIMIT), "the TXT did not see: {what}");
    Ok(())
}
