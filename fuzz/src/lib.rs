//! What the fuzzers do with their bytes. Each function panics when it finds something wrong.
//!
//! The programs in `fuzz_targets/` hand them what libFuzzer makes up; the test program
//! `tests/fuzz_replay` of the library hands them the files in `corpus/` and `findings/`.

mod camera;
mod exchange;
mod i2c;
mod session;
mod text;
mod wire;
mod worlds;

pub use camera::{camera_stream, decode, repair};
pub use exchange::exchange;
pub use i2c::{i2c_client, i2c_server};
pub use session::session;
pub use text::{fault_text, typed_lines};
pub use wire::{expansion, wire};
pub use worlds::{built_worlds, worlds};

use std::sync::LazyLock;

use arbitrary::{Result, Unstructured};
use ft_transfer_area::simulator::world::World;

/// The next bytes of the input, at most so many, in a number that the input tells.
fn take<'a>(input: &mut Unstructured<'a>, most: usize) -> Result<&'a [u8]> {
    let count = input.int_in_range(0..=most)?;
    input.bytes(count.min(input.len()))
}

/// The shipped world that has everything.
fn everything() -> World {
    static WORLD: LazyLock<World> = LazyLock::new(|| {
        let text = include_str!("../../examples/worlds/everything.toml");
        World::from_toml(text).expect("it is shipped")
    });
    WORLD.clone()
}
