//! What is plugged in where.

use std::ffi::c_int;

use ft_transfer_area::transfer_area::{
    CounterConfig, UniConfig, IZ_COUNTER, IZ_MOTOR, IZ_UNI_INPUT,
};

use super::arguments::{Bool, Handle};
use super::{index, number, with_area};
use crate::memory::{AreaArray, Places, Ta};

/// `MODE_ULTRASONIC`. A TXT knows all modes up to it; 2 is its resistance up to 15 kΩ.
const MODE_MAX: u16 = 3;

/// Runs a call that writes a configuration, which goes out before the next exchange.
fn with_config(
    handle: Handle,
    controller: c_int,
    write: impl FnOnce(&AreaArray<Ta>, Places) -> Result<(), u32>,
) -> u32 {
    with_area(handle, controller, |device, places| {
        device.session().write_whole(|array| {
            write(array, places)?;
            let id = array.load(places.config_id);
            array.store(places.config_id, id.wrapping_add(1));
            Ok(())
        })
    })
}

/// Configures a universal input. Its value is 0 until the next response.
#[no_mangle]
pub(crate) extern "C" fn SetFtUniConfig(
    handle: Handle,
    controller: c_int,
    input: c_int,
    mode: c_int,
    digital: Bool,
) -> u32 {
    with_config(handle, controller, |array, places| {
        let (input, mode) = (index(input, IZ_UNI_INPUT)?, number(mode, MODE_MAX)? as u8);
        // SAFETY: computes an address within the configuration only.
        let configs = unsafe { &raw mut (*places.config).uni }.cast::<UniConfig>();
        let config = UniConfig { mode, digital: digital.get().into(), dummy: [0; 2] };
        array.store(configs.wrapping_add(input), config);
        // SAFETY: computes an address within the inputs only.
        let values = unsafe { &raw mut (*places.input).uni }.cast::<i16>();
        array.store(values.wrapping_add(input), 0);
        Ok(())
    })
}

/// Configures a counter: 0 normal, 1 inverted.
#[no_mangle]
pub(crate) extern "C" fn SetFtCntConfig(
    handle: Handle,
    controller: c_int,
    counter: c_int,
    mode: c_int,
) -> u32 {
    with_config(handle, controller, |array, places| {
        let (counter, mode) = (index(counter, IZ_COUNTER)?, number(mode, 1)? as u8);
        // SAFETY: computes an address within the configuration only.
        let configs = unsafe { &raw mut (*places.config).cnt }.cast::<CounterConfig>();
        array.store(configs.wrapping_add(counter), CounterConfig { mode, dummy: [0; 3] });
        Ok(())
    })
}

/// Makes a pair of outputs a motor, or two single outputs.
#[no_mangle]
pub(crate) extern "C" fn SetFtMotorConfig(
    handle: Handle,
    controller: c_int,
    motor: c_int,
    is_motor: Bool,
) -> u32 {
    with_config(handle, controller, |array, places| {
        let motor = index(motor, IZ_MOTOR)?;
        // SAFETY: computes an address within the configuration only.
        let configs = unsafe { &raw mut (*places.config).motor }.cast::<u8>();
        array.store(configs.wrapping_add(motor), is_motor.get().into());
        Ok(())
    })
}
