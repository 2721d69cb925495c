//! FtTxtLib's calls that write: each as a whole, so that no request has only a part of it.
#![allow(unreachable_pub, reason = "the linker exports it")]

use ft_transfer_area::transfer_area::{CounterMode, FishX1Transfer, InputMode};
use ft_transfer_area::tx::{Counter, Direction, Input, InvalidCall, Motor, Output};
use ft_transfer_area::Error;

use super::handler::Ex2;
use super::{call, Handle};
use crate::memory::{AreaArray, Cell};

/// `NoMotor`.
const NO_MOTOR: i32 = 15;

impl Ex2 {
    /// Runs a call of the library on a copy of one area, and writes what it has changed.
    fn edit(
        &self,
        area: i32,
        edit: impl FnOnce(&mut FishX1Transfer) -> Result<(), InvalidCall>,
    ) -> Result<(), Error> {
        let most = self.count() as i64 - 1;
        let index = usize::try_from(area).ok().filter(|index| *index < self.count());
        let index = index.ok_or(Error::OutOfRange {
            what: "transfer area's index",
            given: area.into(),
            least: 0,
            most,
        })?;
        match self.session() {
            Some(session) => session.write_whole(|array| edit_area(array, index, edit)),
            None => edit_area(&self.array, index, edit),
        }
    }
}

fn edit_area(
    array: &AreaArray<FishX1Transfer>,
    index: usize,
    edit: impl FnOnce(&mut FishX1Transfer) -> Result<(), InvalidCall>,
) -> Result<(), Error> {
    let places = array.places(index);
    let mut area = FishX1Transfer::default();
    area.state.config_id = array.load(places.config_id);
    area.config = array.load(places.config);
    area.input = array.load(places.input);
    area.output = array.load(places.output);
    area.txt_inputs = array.load(places.txt_inputs);
    area.txt_outputs = array.load(places.txt_outputs);
    let before = area;
    edit(&mut area)?;
    if area.config != before.config {
        array.store(places.config, area.config);
    }
    let (output, old) = (area.output, before.output);
    // SAFETY: computes addresses within the output and the inputs only.
    unsafe {
        store_changed(array, &raw mut (*places.output).master, old.master, output.master);
        store_changed(array, &raw mut (*places.output).duty, old.duty, output.duty);
        store_changed(array, &raw mut (*places.output).distance, old.distance, output.distance);
        let (old_id, id) = (old.motor_ex_cmd_id, output.motor_ex_cmd_id);
        store_changed(array, &raw mut (*places.output).motor_ex_cmd_id, old_id, id);
        let (old_id, id) = (old.cnt_reset_cmd_id, output.cnt_reset_cmd_id);
        store_changed(array, &raw mut (*places.output).cnt_reset_cmd_id, old_id, id);
        let (input, old) = (area.input, before.input);
        store_changed(array, &raw mut (*places.input).uni, old.uni, input.uni);
        let (old_flags, flags) = (old.cnt_resetted, input.cnt_resetted);
        store_changed(array, &raw mut (*places.input).cnt_resetted, old_flags, flags);
        let (old_flags, flags) = (old.motor_ex_reached, input.motor_ex_reached);
        store_changed(array, &raw mut (*places.input).motor_ex_reached, old_flags, flags);
    }
    if area.txt_outputs != before.txt_outputs {
        array.store(places.txt_outputs, area.txt_outputs);
    }
    if area.state.config_id != before.state.config_id {
        // Last, because it says that the configuration is written.
        array.store(places.config_id, area.state.config_id);
    }
    Ok(())
}

/// Writes the elements that have changed: others may be written by another thread.
fn store_changed<T: Cell + PartialEq, A: IntoIterator<Item = T>>(
    array: &AreaArray<FishX1Transfer>,
    at: *mut A,
    before: A,
    after: A,
) {
    for (index, (before, after)) in before.into_iter().zip(after).enumerate() {
        if before != after {
            array.store(at.cast::<T>().wrapping_add(index), after);
        }
    }
}

/// Declares the C functions for such calls.
macro_rules! calls {
    ($($(#[doc = $doc:literal])+ $name:ident($($argument:ident: $type:ty),*) |$area:ident| $run:expr;)+) => {$(
        $(#[doc = $doc])+
        #[no_mangle]
        pub extern "C" fn $name(handler: Handle<'_>, area: i32, $($argument: $type),*) -> u32 {
            call(handler, |handler| handler.edit(area, |$area| $run))
        }
    )+};
}

calls! {
    /// `SetFtUniConfig`.
    ft_ex2_set_uni(input: i32, mode: i32, digital: i32) |area| {
        area.set_ft_uni_config(Input::try_from(input)?, InputMode::try_from(mode)?, digital != 0);
        Ok(())
    };
    /// `SetFtCntConfig`.
    ft_ex2_set_counter(counter: i32, mode: i32) |area| {
        area.set_ft_cnt_config(Counter::try_from(counter)?, CounterMode::try_from(mode)?);
        Ok(())
    };
    /// `SetFtMotorConfig`.
    ft_ex2_set_motor(motor: i32, status: i32) |area| {
        area.set_ft_motor_config(Motor::try_from(motor)?, status != 0);
        Ok(())
    };
    /// `SetOutMotorValues` with a direction.
    ft_ex2_motor_values(motor: i32, duty: i32, direction: i32) |area| {
        let (motor, direction) = (Motor::try_from(motor)?, Direction::try_from(direction)?);
        area.set_out_motor_values(motor, number(duty), direction)
    };
    /// `SetOutMotorValues` with a power.
    ft_ex2_motor_power(motor: i32, power: i32) |area| {
        area.set_out_motor_power(Motor::try_from(motor)?, number(power))
    };
    /// `SetOutMotorInverse`.
    ft_ex2_motor_inverse(motor: i32) |area| area.set_out_motor_inverse(Motor::try_from(motor)?);
    /// `SetOutPwmValues`.
    ft_ex2_set_pwm(output: i32, duty: i32) |area| {
        area.set_out_pwm_values(Output::try_from(output)?, number(duty))
    };
    /// `StartMotorExCmd` with up to three slaves; `NoMotor` is none. With 0 pulses they turn without end.
    ft_ex2_start_motor_ex(
        motor: i32, duty: i32, direction: i32,
        slave1: i32, direction1: i32, slave2: i32, direction2: i32, slave3: i32, direction3: i32,
        pulses: i32
    ) |area| {
        let (motor, direction) = (Motor::try_from(motor)?, Direction::try_from(direction)?);
        let mut slaves = Vec::new();
        for (slave, direction) in [(slave1, direction1), (slave2, direction2), (slave3, direction3)] {
            if slave != NO_MOTOR {
                slaves.push((Motor::try_from(slave)?, Direction::try_from(direction)?));
            }
        }
        match pulses {
            0 => area.start_synchronised(motor, number(duty), direction, &slaves),
            // Too many are out of range, like a negative number.
            _ => {
                let pulses = u32::try_from(pulses).unwrap_or(u32::MAX);
                area.start_motor_ex_cmd(motor, number(duty), direction, &slaves, pulses)
            }
        }
    };
    /// `StopMotorExCmd`.
    ft_ex2_stop_motor_ex(motor: i32) |area| area.stop_motor_ex_cmd(Motor::try_from(motor)?);
    /// `StopAllMotorExCmd`.
    ft_ex2_stop_all_motor_ex() |area| {
        area.stop_all_motor_ex_cmd();
        Ok(())
    };
    /// `StartCounterReset`.
    ft_ex2_reset_counter(counter: i32) |area| {
        area.start_counter_reset(Counter::try_from(counter)?);
        Ok(())
    };
    /// `SetSound`.
    ft_ex2_set_sound(index: u16, repeat: u16) |area| area.set_sound(index, repeat);
}

/// A duty or power; one that does not fit is out of range in any case.
fn number(value: i32) -> i16 {
    value.clamp(i16::MIN.into(), i16::MAX.into()) as i16
}
