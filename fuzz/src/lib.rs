//! What the fuzzers do with their bytes. Each function panics when it finds a mistake.
//!
//! The programs in `fuzz_targets/` give them the bytes that libFuzzer makes up. The tests in
//! `tests/system/fuzz_replay` give them the files in `corpus/` and `findings/`.

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
use ft_transfer_area_simulator::world::World;

/// The next bytes of the input. Their number is read from the input, and is at most `most`.
fn take<'a>(input: &mut Unstructured<'a>, most: usize) -> Result<&'a [u8]> {
    let count = input.int_in_range(0..=most)?;
    input.bytes(count.min(input.len()))
}

/// The shipped world that has everything.
fn everything() -> World {
    static WORLD: LazyLock<World> =
        LazyLock::new(|| World::shipped("everything").expect("it is shipped"));
    WORLD.clone()
}
