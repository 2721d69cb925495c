//! Which changes of inputs a program is told, and what it is told of them.

use std::sync::Weak;

use ft_transfer_area::transfer_area::{Change, Config, InputValues, IZ_UNI_INPUT};

use super::callbacks::Callbacks;
use super::device::Device;
use super::kinds::{Event, InputNow, Told};

/// The kinds of inputs, each with a mask for each controller.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Input {
    /// I1 to I8.
    Uni,
    /// The levels of C1 to C4.
    CntIn,
    /// The counts of C1 to C4.
    Counter,
}

impl Input {
    pub(super) const ALL: [Self; 3] = [Self::Uni, Self::CntIn, Self::Counter];

    /// The bits of all inputs.
    pub(super) fn all_bits(self) -> u8 {
        match self {
            Self::Uni => 0xFF,
            Self::CntIn | Self::Counter => 0xF,
        }
    }

    fn event(self) -> Event {
        match self {
            Self::Uni => Event::UniChanged,
            Self::CntIn => Event::CntInChanged,
            Self::Counter => Event::CounterChanged,
        }
    }

    fn changed(self, change: &Change) -> u8 {
        match self {
            Self::Uni => change.change_uni,
            Self::CntIn => change.change_cnt_in,
            Self::Counter => change.change_counter,
        }
    }

    /// One of the inputs of this kind. As an unsigned number, because nothing is measured below 0, and a counter goes
    /// up to 65535.
    fn now(self, index: usize, values: &InputValues, config: &Config) -> InputNow {
        let unsigned = |value: i16| u32::from(value as u16);
        let of_counter =
            |value| InputNow { value, overrun: 0, mode: config.cnt[index].mode, digital: 0 };
        match self {
            Self::Uni => InputNow {
                value: unsigned(values.uni[index]),
                overrun: config.uni[index].is_over_range(values.uni[index]).into(),
                mode: config.uni[index].mode,
                digital: config.uni[index].digital,
            },
            Self::CntIn => of_counter(unsigned(values.cnt_in[index])),
            Self::Counter => of_counter(unsigned(values.counter[index])),
        }
    }
}

/// The same input with its value now; `None` when the event is none of an input.
pub(super) fn now(device: &Device, event: Event, told: Told) -> Option<Told> {
    let input = Input::ALL.into_iter().find(|input| input.event() == event)?;
    let places = device.array().places(told.controller as usize);
    let (values, config) = (device.array().load(places.input), device.array().load(places.config));
    Some(Told { input: input.now(told.what as usize, &values, &config), ..told })
}

/// Tells the program which inputs of an area have changed, if it has chosen them.
pub(super) fn tell(own: &Weak<Device>, callbacks: &Callbacks, area: usize, change: &Change) {
    let Some(device) = own.upgrade() else { return };
    let chosen = |input: Input| input.changed(change) & device.mask(area, input);
    let chosen = Input::ALL.map(chosen);
    if chosen == [0; 3] {
        return;
    }
    let places = device.array().places(area);
    let (values, config) = (device.array().load(places.input), device.array().load(places.config));
    for (input, bits) in Input::ALL.into_iter().zip(chosen) {
        for index in (0..IZ_UNI_INPUT).filter(|index| bits >> index & 1 != 0) {
            let told = Told {
                controller: area as u32,
                what: index as u32,
                input: input.now(index, &values, &config),
            };
            callbacks.event(own.clone(), input.event(), told);
        }
    }
}
