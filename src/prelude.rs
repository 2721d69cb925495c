//! What most programs need: `use ft_transfer_area::prelude::*`.
//!
//! The terminals have their names here: `I1` to `I8`, `C1` to `C4`, `M1` to `M4` and `O1` to `O8`.
//!
//! ```
//! use ft_transfer_area::prelude::*;
//!
//! let mut area = FishX1Transfer::default(); // in a handler: areas.lock()[LOCAL_IO]
//! if area.input.uni[I1] == 0 {
//!     area.output.duty[O1] = DUTY_MAX;
//! }
//! ```

pub use crate::error::Error;
pub use crate::handler::{TransferAreaComHandler, TransferAreas};
pub use crate::terminals::Counter::{self, *};
pub use crate::terminals::Input::{self, *};
pub use crate::terminals::Motor::{self, *};
pub use crate::terminals::Output::{self, *};
pub use crate::transfer_area::{
    FishX1Transfer, InputMode, UniConfig, DUTY_MAX, LOCAL_IO, REMOTE_IO_1,
};
pub use crate::tx::Direction;
