//! C programs, through `tx_run`.

use std::path::{Path, PathBuf};

use ft_transfer_area_simulator::world::World;

use super::{check, stopped, Check, ADDRESS};
use crate::controller::Controller;
use crate::program::{output_in_time, tx_run};

const KELIB: &str = "tests/kits/programs/kelib.cpp";

/// A program in the folder `c` with its argument if it has one, what is plugged in, and a part of what it prints.
const PROGRAMS: [(&str, &str, &str, &str); 13] = [
    ("examples/gate.c", "", "examples/gate.toml", " pulses"),
    ("examples/pc_slide.c", "", "slide", " pulses back"),
    ("examples/txt_button.cpp", "", "default", "press 3"),
    ("examples/kit_loop.cpp", "", "kit", "600 cycles"),
    ("examples/kit_callbacks.cpp", "", "default", "M2 has done 1"),
    ("examples/warehouse.cpp", "", "high_bay_warehouse", ""),
    ("tests/tx_run/programs/i2c_missing.c", "", "default", ""),
    (KELIB, "again", "default", "1 0 1 0\n1 1\n"),
    (KELIB, "motor", "default", "1\nsound\n"),
    (KELIB, "flags", "default", "stayed\n"),
    (KELIB, "reset in a distance", "default", "0 1\n"),
    (KELIB, "end sounds", "default", "0 0 3 3 3 3 7 8 \n"),
    (KELIB, "i2c", "default", "170F"),
];

pub(super) fn checks() -> impl Iterator<Item = (String, Check)> {
    let programs = PROGRAMS.iter().map(|(program, argument, world, said)| {
        let check: Check =
            Box::new(move |controller| run(controller, program, argument, world, said));
        (format!("tx_run {program} {argument}").trim_end().to_owned(), check)
    });
    programs.chain([check("tx_run, whose program is killed", killed)])
}

/// `tx_run` switches off what a killed program has left on.
fn killed(controller: &Controller) {
    controller.plug_in(World::default());
    let program = folder().join("tests/tx_run/programs/killed.c");
    let output = output_in_time(tx_run().arg(program).args(["--host", ADDRESS]));
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(said.contains("tx_run has sent it: all outputs are off"), "{said}");
    let has_turned = |duty: &[i16; 8]| duty[0] == 300;
    assert!(controller.board.state().duties.iter().any(has_turned), "the motor has not turned");
    stopped(controller);
}

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../c")
}

fn run(controller: &Controller, program: &str, argument: &str, world: &str, said: &str) {
    let folder = folder();
    let file = folder.join(world);
    match world {
        // It has to go far, and counts cycles.
        "high_bay_warehouse" => controller.plug_in_unpaced(World::shipped(world).unwrap()),
        _ if file.is_file() => controller.plug_in(World::load(file).unwrap()),
        _ => controller.plug_in(World::shipped(world).unwrap()),
    }
    let argument = Some(argument).filter(|argument| !argument.is_empty());
    let mut command = tx_run();
    command.arg(folder.join(program)).args(["--host", ADDRESS, "--"]).args(argument);
    let output = output_in_time(&mut command);
    let said_by = |bytes| String::from_utf8(bytes).unwrap();
    let (out, err) = (said_by(output.stdout), said_by(output.stderr));
    assert!(output.status.success(), "{out}{err}");
    assert!(out.contains(said), "{out}{err}");
    stopped(controller);
}
