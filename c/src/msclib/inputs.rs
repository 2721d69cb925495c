//! Values of inputs and counters.

use std::ffi::c_int;

use ft_transfer_area::transfer_area::{IZ_COUNTER, IZ_UNI_INPUT};

use super::arguments::{Handle, Out};
use super::{index, with_area};

/// The value of a universal input, and whether it is an overrun: of what its mode measures, and never for a
/// digital one.
#[no_mangle]
pub(crate) extern "C" fn GetInIOValue(
    handle: Handle,
    controller: c_int,
    input: c_int,
    value: Out<i16>,
    overrun: Out<u32>,
) -> u32 {
    with_area(handle, controller, |device, places| {
        let input = index(input, IZ_UNI_INPUT)?;
        value.check()?;
        let measured = device.array().load(places.input).uni[input];
        let config = device.array().load(places.config).uni[input];
        overrun.put(config.is_over_range(measured).into())?;
        value.put(measured)
    })
}

/// The count of a counter, and the level of its input.
#[no_mangle]
pub(crate) extern "C" fn GetInCounterValue(
    handle: Handle,
    controller: c_int,
    counter: c_int,
    count: Out<i16>,
    level: Out<i16>,
) -> u32 {
    with_area(handle, controller, |device, places| {
        let counter = index(counter, IZ_COUNTER)?;
        let input = device.array().load(places.input);
        count.check()?;
        level.put(input.cnt_in[counter])?;
        count.put(input.counter[counter])
    })
}

/// For how long the display's two buttons have been pressed, in milliseconds. A TXT does not send it online, so
/// this is 0 unless the program writes something else there.
#[no_mangle]
pub(crate) extern "C" fn GetInDisplayButtonValue(
    handle: Handle,
    controller: c_int,
    left: Out<i16>,
    right: Out<i16>,
) -> u32 {
    with_area(handle, controller, |device, places| {
        let input = device.array().load(places.input);
        left.check()?;
        right.put(input.display_button_right)?;
        left.put(input.display_button_left)
    })
}
