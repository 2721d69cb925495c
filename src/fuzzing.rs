//! Entry points for the programs in `fuzz/`, to code that otherwise only a connection reaches.
//!
//! This is not part of the public interface and may change with any version.

pub use crate::camera::read_frames;
pub use crate::i2c::i2c_client;
