//! Two models that wait for each other, one with a program in C and one in Rust.

use std::path::Path;

use ft_transfer_area_simulator::world::{Factory, Piece};
use ft_transfer_area_simulator::SimulatedFactory;

use super::run::Run;
use crate::program::{has_compiler, tx_run};

#[cfg_attr(windows, ignore = "no C compiler is expected there")]
#[test]
fn a_disc_goes_round_between_a_program_in_c_and_one_in_rust() {
    if !has_compiler("c++") {
        return;
    }
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/two_models");
    let world = Factory::load(folder.join("world.toml")).unwrap();
    let factory = SimulatedFactory::start(world, 0, |_, builder| builder).unwrap();
    let address = |name| factory.txt(name).unwrap().address().to_string();

    let back = Run::start("two_models", &[&address("back")]);
    let mut there = tx_run();
    there.arg(folder.join("there.c")).args(["--host", &address("there")]);
    // Not with what this machine's user has compiled.
    there.env("XDG_CACHE_HOME", Path::new(env!("CARGO_TARGET_TMPDIR")).join("cache"));
    let there = Run::of(&mut there).finish();
    let back = back.finish();

    let turns = |name: &str| [1, 2, 3].map(|turn| format!("{name}: turn {turn}"));
    assert_eq!((there, back), (turns("there").to_vec(), turns("back").to_vec()));
    let (places, mishaps) = factory.txt("there").unwrap().with_machine(|machine| {
        let world = machine.world().unwrap();
        (world.places(), world.mishaps())
    });
    let start = (String::from("there.start"), Some(Piece::White));
    assert!(places.contains(&start), "it is not back: {places:?}");
    assert!(mishaps.is_empty(), "{mishaps:?}");
}
