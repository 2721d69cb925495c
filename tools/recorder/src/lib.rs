//! A flight recorder for [`ft_transfer_area`]: every cycle of a handler into an MCAP file, and back.
//!
//! MCAP is the container that Foxglove, Lichtblick and PlotJuggler open. The values have schemas, so they can be
//! plotted without any set-up. `docs/recording.md` in the repository lists the channels.
//!
//! | task | use |
//! |---|---|
//! | record what a program does | [`Recorder`] |
//! | record what another program does | [`Recorder::fed`] |
//! | record for days, into several files | [`Parts`] |
//! | begin with what came before | [`History`] |
//! | read a recording | [`Recording`] |
//! | make tables and plots of it | [`Column`] |
//! | compare two of them | [`Cycle::values`] |

mod beginning;
mod column;
mod damage;
mod error;
mod feed;
#[doc(hidden)]
pub mod file;
mod format;
mod frames;
mod history;
mod options;
mod origin;
mod output;
mod part;
mod parts;
mod reader;
mod recorder;
mod records;
mod source;
mod state;
mod target;
mod under_way;
mod worker;
mod writer;

pub use column::{Column, UNKNOWN_UNIT};
pub use damage::Damage;
pub use error::Error;
pub use feed::Feed;
pub use format::{Failure, FailureKind, RecordedEvent, RecordedStatistics, Transfer};
pub use frames::FrameSink;
pub use history::{Follow, History};
pub use options::Options;
pub use part::value_names;
#[doc(hidden)]
pub use parts::parts_of;
pub use parts::Parts;
pub use reader::{Cycle, Entry, Place, Recorded, Recording};
pub use recorder::Recorder;
pub use state::Totals;

/// The programs in the document and in the README are tested with the documentation.
#[cfg(doctest)]
#[doc = include_str!("../../../docs/recording.md")]
#[doc = include_str!("../README.md")]
struct Document;
