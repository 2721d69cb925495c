//! Motors, outputs and counters.

use std::ffi::c_int;

use ft_transfer_area::transfer_area::{DUTY_MAX, IZ_COUNTER, IZ_MOTOR, IZ_PWM_CHAN};
use ft_transfer_area::tx::check_duty;

use super::arguments::Handle;
use super::callbacks;
use super::device::Device;
use super::kinds::{Event, EventCallback, EventCallback1};
use super::library::LIBRARY;
use super::{index, number, with_area};
use crate::errors::FTLIB_ERR_INVALID_PARAM;
use crate::ffi::guarded;
use crate::memory::{AreaArray, Places, Ta};

/// The fields of one area that make up a motor's commands.
struct Outputs<'a> {
    array: &'a AreaArray<Ta>,
    duty: *mut i16,
    distance: *mut u16,
    master: *mut u8,
    motor_id: *mut u16,
    counter_id: *mut u16,
    reached: *mut u16,
    resetted: *mut u16,
}

impl<'a> Outputs<'a> {
    fn of(array: &'a AreaArray<Ta>, places: Places) -> Self {
        let Places { output, input, .. } = places;
        // SAFETY: computes addresses within the outputs and inputs only.
        unsafe {
            Self {
                array,
                duty: (&raw mut (*output).duty).cast(),
                distance: (&raw mut (*output).distance).cast(),
                master: (&raw mut (*output).master).cast(),
                motor_id: (&raw mut (*output).motor_ex_cmd_id).cast(),
                counter_id: (&raw mut (*output).cnt_reset_cmd_id).cast(),
                reached: (&raw mut (*input).motor_ex_reached).cast(),
                resetted: (&raw mut (*input).cnt_resetted).cast(),
            }
        }
    }

    /// Sets one output.
    fn set_duty(&self, channel: usize, duty: i16) {
        self.array.store(self.duty.wrapping_add(channel), duty);
    }

    /// Gives a motor a new command; `master` is 0 or the number of the motor to follow, from 1.
    fn command(&self, motor: usize, duties: [i16; 2], distance: u16, master: u8) {
        self.set_duty(2 * motor, duties[0]);
        self.set_duty(2 * motor + 1, duties[1]);
        self.array.store(self.distance.wrapping_add(motor), distance);
        self.array.store(self.master.wrapping_add(motor), master);
        self.raise(self.motor_id, motor);
        self.array.store(self.reached.wrapping_add(motor), 0);
    }

    fn reset_counter(&self, counter: usize) {
        self.raise(self.counter_id, counter);
        self.array.store(self.resetted.wrapping_add(counter), 0);
    }

    fn raise(&self, ids: *mut u16, index: usize) {
        let id = ids.wrapping_add(index);
        self.array.store(id, self.array.load(id).wrapping_add(1));
    }
}

/// Runs a call that writes outputs, which go out together.
fn with_outputs(
    handle: Handle,
    controller: c_int,
    write: impl FnOnce(&Outputs<'_>) -> Result<(), u32>,
) -> u32 {
    with_area(handle, controller, |device: &Device, places| {
        device.session().write_whole(|array| write(&Outputs::of(array, places)))
    })
}

/// A duty that an output can have. A program that computes one, such as 5.2 times a percentage, gets full power above
/// it.
fn duty_of(given: c_int) -> Result<i16, u32> {
    check_duty(given.min(DUTY_MAX.into())).map_err(|_| FTLIB_ERR_INVALID_PARAM)
}

/// The duties of a motor's two outputs: 0 is clockwise, 1 counter-clockwise.
fn duties(duty: i16, direction: c_int) -> Result<[i16; 2], u32> {
    match direction {
        0 => Ok([duty, 0]),
        1 => Ok([0, duty]),
        _ => Err(FTLIB_ERR_INVALID_PARAM),
    }
}

/// Resets a counter.
#[no_mangle]
pub(crate) extern "C" fn StartCounterReset(
    handle: Handle,
    controller: c_int,
    counter: c_int,
) -> u32 {
    with_outputs(handle, controller, |outputs| {
        outputs.reset_counter(index(counter, IZ_COUNTER)?);
        Ok(())
    })
}

/// Sets the two duties of a motor.
#[no_mangle]
pub(crate) extern "C" fn SetOutMotorValues(
    handle: Handle,
    controller: c_int,
    motor: c_int,
    duty_plus: c_int,
    duty_minus: c_int,
) -> u32 {
    with_outputs(handle, controller, |outputs| {
        let motor = index(motor, IZ_MOTOR)?;
        let (plus, minus) = (duty_of(duty_plus)?, duty_of(duty_minus)?);
        outputs.set_duty(2 * motor, plus);
        outputs.set_duty(2 * motor + 1, minus);
        Ok(())
    })
}

/// Sets the duty of one output.
#[no_mangle]
pub(crate) extern "C" fn SetOutPwmValues(
    handle: Handle,
    controller: c_int,
    channel: c_int,
    duty: c_int,
) -> u32 {
    with_outputs(handle, controller, |outputs| {
        outputs.set_duty(index(channel, IZ_PWM_CHAN)?, duty_of(duty)?);
        Ok(())
    })
}

/// Turns a motor, and one that follows it, for a number of pulses, or without end for 0 pulses. There is no
/// second motor when `slave` is the motor itself or out of range.
#[no_mangle]
pub(crate) extern "C" fn StartMotorExCmd(
    handle: Handle,
    controller: c_int,
    motor: c_int,
    duty: c_int,
    direction: c_int,
    slave: c_int,
    slave_direction: c_int,
    pulses: c_int,
) -> u32 {
    let slaves = [(slave, slave_direction)];
    start_motors(handle, controller, (motor, direction), &slaves, duty, pulses)
}

/// Turns a motor and those that follow it; each is given with its direction.
pub(super) fn start_motors(
    handle: Handle,
    controller: c_int,
    (motor, direction): (c_int, c_int),
    slaves: &[(c_int, c_int)],
    duty: c_int,
    pulses: c_int,
) -> u32 {
    with_outputs(handle, controller, |outputs| {
        let motor = index(motor, IZ_MOTOR)?;
        let (duty, pulses) = (duty_of(duty)?, number(pulses, u16::MAX)?);
        let own_duties = duties(duty, direction)?;
        let mut followers = [None; IZ_MOTOR];
        for (slave, direction) in slaves {
            let is_other = |slave: &usize| *slave != motor;
            let Some(slave) = index(*slave, IZ_MOTOR).ok().filter(is_other) else { continue };
            if followers[slave].replace(duties(duty, *direction)?).is_some() {
                return Err(FTLIB_ERR_INVALID_PARAM);
            }
        }
        outputs.command(motor, own_duties, pulses, 0);
        for (slave, duties) in followers.into_iter().enumerate() {
            if let Some(duties) = duties {
                outputs.command(slave, duties, pulses, motor as u8 + 1);
            }
        }
        Ok(())
    })
}

/// Stops all motors of a controller and ends their extended mode.
#[no_mangle]
pub(crate) extern "C" fn StopAllMotorExCmd(handle: Handle, controller: c_int) -> u32 {
    with_outputs(handle, controller, |outputs| {
        (0..IZ_MOTOR).for_each(|motor| outputs.command(motor, [0; 2], 0, 0));
        Ok(())
    })
}

/// Stops a motor and ends its extended mode.
#[no_mangle]
pub(crate) extern "C" fn StopMotorExCmd(handle: Handle, controller: c_int, motor: c_int) -> u32 {
    with_outputs(handle, controller, |outputs| {
        outputs.command(index(motor, IZ_MOTOR)?, [0; 2], 0, 0);
        Ok(())
    })
}

/// Has this called when a counter has been reset; null takes it away.
#[no_mangle]
pub(crate) extern "C" fn SetCBCounterResetted(callback: Option<EventCallback1>) {
    set(Event::CounterResetted, callback.map(EventCallback::Alone));
}

/// Has this called when a motor has done its distance; null takes it away.
#[no_mangle]
pub(crate) extern "C" fn SetCBMotorExReached(callback: Option<EventCallback1>) {
    set(Event::MotorExReached, callback.map(EventCallback::Alone));
}

/// Has this called when an extension has come (1) or gone (0); null takes it away.
#[no_mangle]
pub(crate) extern "C" fn SetCBRoboExtState(callback: Option<EventCallback1>) {
    set(Event::RoboExtState, callback.map(EventCallback::Alone));
}

/// Sets a callback. When it returns, the one before is not running, unless this is called by it.
pub(super) fn set(event: Event, callback: Option<EventCallback>) {
    guarded((), || callbacks::set(event, callback, || LIBRARY.callbacks()));
}
