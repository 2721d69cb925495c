//! The samples, each with the world that it is written for.

use ft_transfer_area_simulator::world::World;

use super::{stopped, Check, ADDRESS};
use crate::controller::Controller;
use crate::examples::run::Run;
use crate::examples::sample::{quick_sorting_line, Sample, SAMPLES};

pub(super) fn checks() -> impl Iterator<Item = (String, Check)> {
    SAMPLES.iter().map(|sample| {
        let check: Check = Box::new(|controller| run(controller, sample));
        (format!("sample {}", sample.name), check)
    })
}

fn run(controller: &Controller, Sample { name, shows, endless, check }: &Sample) {
    match *name {
        // It has to go far, and counts cycles.
        "warehouse" => controller.plug_in_unpaced(World::shipped("high_bay_warehouse").unwrap()),
        "sorting_line" => controller.plug_in(World::from_toml(&quick_sorting_line()).unwrap()),
        _ => controller.plug_in(World::default()),
    }
    let mut run = Run::start(name, &[ADDRESS]);
    shows.iter().for_each(|part| run.wait_for(part));
    if *endless {
        run.interrupt();
    }
    check(&run.finish());
    stopped(controller);
}
