//! The pages of the folder `docs`, which are in the package too.
//!
//! The pages write links to files as `[name]` and define the targets at their end. Of two definitions of
//! one name the first counts, so a definition before a page here replaces the page's own.

/// [simulator.md]: simulator
#[doc = include_str!("../docs/c_programs.md")]
pub mod c_programs {}

/// [c_programs.md]: c_programs
/// [simulator.md]: simulator
#[doc = include_str!("../docs/porting.md")]
pub mod porting {}

#[doc = include_str!("../docs/protocol.md")]
pub mod protocol {}

#[doc = include_str!("../docs/reliability.md")]
pub mod reliability {}

/// [default.toml]: https://docs.rs/ft-transfer-area-simulator/latest/ft_transfer_area_simulator/world/struct.World.html#associatedconstant.SHIPPED
/// [slide.toml]: https://docs.rs/ft-transfer-area-simulator/latest/ft_transfer_area_simulator/world/struct.World.html#associatedconstant.SHIPPED
/// [kit.toml]: https://docs.rs/ft-transfer-area-simulator/latest/ft_transfer_area_simulator/world/struct.World.html#associatedconstant.SHIPPED
/// [car.toml]: https://docs.rs/ft-transfer-area-simulator/latest/ft_transfer_area_simulator/world/struct.World.html#associatedconstant.SHIPPED
/// [everything.toml]: https://docs.rs/ft-transfer-area-simulator/latest/ft_transfer_area_simulator/world/struct.World.html#associatedconstant.SHIPPED
#[doc = include_str!("../docs/simulator.md")]
pub mod simulator {}

#[doc = include_str!("../docs/txt40.md")]
pub mod txt40 {}

/// [txt40.md]: txt40
#[doc = include_str!("../docs/on-the-controller.md")]
pub mod on_the_controller {}

// Its programs use other crates, so the package of the tests, which has these, tests them.
#[cfg(not(doctest))]
/// [txt40.md]: txt40
#[doc = include_str!("../docs/camera.md")]
pub mod camera {}
