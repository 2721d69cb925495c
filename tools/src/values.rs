//! What the terminals of an area report, for a page and for a broker. The names are those in the page's messages.

use ft_transfer_area::transfer_area::{CounterMode, InputMode, IrInput};
use ft_transfer_area::tx::{Counter, Input};
use ft_transfer_area::FishX1Transfer;
use ft_transfer_area_simulator::world::Remote;
use serde::Serialize;

#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(crate) struct InputValue {
    /// Empty for a number that is not a mode.
    pub(crate) mode: &'static str,
    pub(crate) digital: bool,
    pub(crate) value: i16,
    pub(crate) unit: &'static str,
    #[serde(rename = "overrun")]
    pub(crate) over_range: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(crate) struct CounterValue {
    /// Empty for a number that is not a mode.
    pub(crate) mode: &'static str,
    #[serde(rename = "value")]
    pub(crate) count: u16,
    pub(crate) level: bool,
    pub(crate) resetting: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(crate) struct SoundValue {
    pub(crate) index: u16,
    pub(crate) repeat: u16,
    pub(crate) playing: bool,
}

/// Joysticks are −15..=15 on both axes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(crate) struct RemoteValue {
    pub(crate) left_x: i16,
    pub(crate) left_y: i16,
    pub(crate) right_x: i16,
    pub(crate) right_y: i16,
    pub(crate) on: bool,
    pub(crate) off: bool,
    pub(crate) dip1: bool,
    pub(crate) dip2: bool,
}

impl InputValue {
    pub(crate) fn of(area: &FishX1Transfer, input: Input) -> Self {
        let config = area.config.uni[input.index()];
        let reported = area.get_in_io_value(input);
        Self {
            mode: config.input_mode().map_or("", InputMode::name),
            digital: config.is_digital(),
            value: reported.value,
            unit: config.unit(),
            over_range: reported.over_range,
        }
    }
}

impl CounterValue {
    pub(crate) fn of(area: &FishX1Transfer, counter: Counter) -> Self {
        let mode = CounterMode::try_from(area.config.cnt[counter.index()].mode);
        let (count, level) = area.get_in_counter_value(counter);
        Self {
            mode: mode.map_or("", CounterMode::name),
            count,
            level,
            resetting: !area.is_cnt_reset_ready(counter),
        }
    }
}

impl SoundValue {
    pub(crate) fn of(area: &FishX1Transfer) -> Self {
        let sound = &area.txt_outputs;
        let playing = !area.is_sound_ready();
        Self { index: sound.sound_index, repeat: sound.sound_repeat, playing }
    }
}

impl From<&IrInput> for RemoteValue {
    fn from(remote: &IrInput) -> Self {
        Self {
            left_x: remote.joy_left_x,
            left_y: remote.joy_left_y,
            right_x: remote.joy_right_x,
            right_y: remote.joy_right_y,
            on: remote.button_on != 0,
            off: remote.button_off != 0,
            dip1: remote.dip_switch_1 != 0,
            dip2: remote.dip_switch_2 != 0,
        }
    }
}

impl From<&Remote> for RemoteValue {
    fn from(remote: &Remote) -> Self {
        let Remote { left_x, left_y, right_x, right_y, on, off, dip1, dip2 } = *remote;
        let [left_x, left_y, right_x, right_y] = [left_x, left_y, right_x, right_y].map(i16::from);
        Self { left_x, left_y, right_x, right_y, on, off, dip1, dip2 }
    }
}
