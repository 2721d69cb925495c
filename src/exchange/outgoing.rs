//! What a program sends for an area.

use crate::transfer_area::{Config, FishX1Transfer, OutputValues, State, TxtOutputs};

/// The parts of an area that are sent.
pub(crate) trait Sends {
    fn config_id(&self) -> u8;
    fn config(&self) -> &Config;
    fn output(&self) -> &OutputValues;
    fn txt_outputs(&self) -> &TxtOutputs;
}

/// A copy of these parts. A whole area is several times as large.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Outgoing {
    pub(crate) state: State,
    pub(crate) config: Config,
    pub(crate) output: OutputValues,
    pub(crate) txt_outputs: TxtOutputs,
}

impl From<&FishX1Transfer> for Outgoing {
    fn from(area: &FishX1Transfer) -> Self {
        let FishX1Transfer { state, config, output, txt_outputs, .. } = *area;
        Self { state, config, output, txt_outputs }
    }
}

/// Areas of these types have their parts under the same names.
macro_rules! sends {
    ($($area:ty),*) => {
        $(impl Sends for $area {
            fn config_id(&self) -> u8 {
                self.state.config_id
            }

            fn config(&self) -> &Config {
                &self.config
            }

            fn output(&self) -> &OutputValues {
                &self.output
            }

            fn txt_outputs(&self) -> &TxtOutputs {
                &self.txt_outputs
            }
        })*
    };
}

sends!(Outgoing, FishX1Transfer);
