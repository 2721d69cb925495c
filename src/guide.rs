//! The pages of the folder `docs`, which are in the package too. Tables with measured times (`reliability_matrix.md`,
//! `measurements.md`) are only in that folder.
//!
//! The pages write links to files as `[name]` and define the targets at their end. Of two definitions of
//! one name the first counts, so a definition before a page here replaces the page's own.

/// [c_functions.md]: c_functions
/// [porting.md]: porting
/// [reliability.md]: reliability
/// [simulator.md]: simulator
/// [systems.md]: crate::guide
/// [training_factory.md]: crate::guide
/// [two_models.md]: crate::guide
#[doc = include_str!("../docs/c_programs.md")]
pub mod c_programs {}

/// [c_programs.md]: c_programs
#[doc = include_str!("../docs/c_functions.md")]
pub mod c_functions {}

/// [c_programs.md]: c_programs
/// [names.md]: names
/// [protocol.md]: protocol#the-compressed-exchange
/// [reliability.md]: reliability
/// [simulator.md]: simulator
#[doc = include_str!("../docs/porting.md")]
pub mod porting {}

/// [porting.md]: porting
#[doc = include_str!("../docs/names.md")]
pub mod names {}

/// [porting.md]: porting
#[doc = include_str!("../docs/protocol.md")]
pub mod protocol {}

/// [reliability_matrix.md]: crate::guide
/// [txt40.md]: txt40
#[doc = include_str!("../docs/reliability.md")]
pub mod reliability {}

/// [reliability.md]: reliability#what-stops-the-motors
/// [txt40.md]: txt40
/// [worlds.md]: worlds
#[doc = include_str!("../docs/simulator.md")]
pub mod simulator {}

/// [simulator.md]: simulator
#[doc = include_str!("../docs/worlds.md")]
pub mod worlds {}

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
