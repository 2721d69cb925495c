//! Mistakes of the lessons with motors.

use std::time::Duration;

use ft_transfer_area::transfer_area::{DUTY_MAX, LOCAL_IO};
use ft_transfer_area::tx::{Counter, Direction, Input, Motor};
use ft_transfer_area::{Error, FishX1Transfer, TransferAreaComHandler};

use crate::{each_cycle, is_first, seconds, stand_still};

const LIMIT: Duration = Duration::from_secs(60);

pub(crate) fn motor(handler: &TransferAreaComHandler, mistake: &str) -> Result<(), Error> {
    each_cycle(handler, |area| {
        let i1 = area.get_in_io_value_binary(Input::I1)?;
        let i2 = area.get_in_io_value_binary(Input::I2)?;
        let direction = match (mistake, i1, i2) {
            ("runs_at_once", false, false) => Direction::Cw,
            ("swapped", true, false) => Direction::Ccw,
            ("swapped", false, true) => Direction::Cw,
            ("first_wins", true, true) => Direction::Cw,
            ("second_if_undoes", _, false) => Direction::Halt,
            ("other_motor", _, _) => {
                let duty = if i1 { DUTY_MAX } else { 0 };
                return area.set_out_motor_values(Motor::M2, duty, Direction::Cw);
            }
            ("no_halt", false, false) => return Ok(()),
            ("both_outputs", _, _) => {
                area.output.duty[0] = if i1 { DUTY_MAX } else { 0 };
                area.output.duty[1] = if i2 { DUTY_MAX } else { 0 };
                return Ok(());
            }
            (_, true, false) => Direction::Cw,
            (_, false, true) => Direction::Ccw,
            (_, false, false) | (_, true, true) => Direction::Halt,
        };
        area.set_out_motor_values(Motor::M1, DUTY_MAX, direction)
    })
}

pub(crate) fn end_switch(handler: &TransferAreaComHandler, mistake: &str) -> Result<(), Error> {
    let turn = |direction| {
        handler.areas().lock()[LOCAL_IO].set_out_motor_values(Motor::M1, DUTY_MAX, direction)
    };
    let wait_for = |input: Input, wanted: bool| {
        let is = move |areas: &[FishX1Transfer]| {
            (areas[LOCAL_IO].input.uni[input.index()] != 0) == wanted
        };
        handler.areas().wait_until(is, Duration::MAX).map(drop)
    };
    let (there, back) = match mistake {
        "wrong_direction" => (Direction::Ccw, Direction::Cw),
        _ => (Direction::Cw, Direction::Ccw),
    };
    loop {
        if mistake != "no_button" {
            wait_for(Input::I3, true)?;
        }
        turn(there)?;
        match mistake {
            "while_pressed" => wait_for(Input::I3, false)?,
            "by_time" => seconds(1.0),
            _ => wait_for(Input::I2, true)?,
        }
        if mistake == "no_stop" {
            wait_for(Input::I2, false)?;
        }
        turn(Direction::Halt)?;
        if mistake == "one_way" {
            wait_for(Input::I2, false)?;
        }
        if mistake != "back_at_once" {
            wait_for(Input::I3, true)?;
        }
        turn(back)?;
        wait_for(Input::I1, true)?;
        turn(Direction::Halt)?;
    }
}

pub(crate) fn counter(handler: &TransferAreaComHandler, mistake: &str) -> Result<(), Error> {
    let pressed = |areas: &[FishX1Transfer]| areas[LOCAL_IO].input.uni[0] != 0;
    let arrived = |areas: &[FishX1Transfer]| areas[LOCAL_IO].get_in_cnt_count(Counter::C1) >= 100;
    let is_100 = |areas: &[FishX1Transfer]| areas[LOCAL_IO].get_in_cnt_count(Counter::C1) == 100;
    let turn = |direction| {
        handler.areas().lock()[LOCAL_IO].set_out_motor_values(Motor::M1, DUTY_MAX, direction)
    };
    // So long that the controller ends the connection; once longer than the check waits for an exchange.
    let stands_still = match mistake {
        "stands_still" => Some(8),
        "stands_still_once" => {
            is_first().expect("there is a folder for temporary files").then_some(12)
        }
        _ => None,
    };
    loop {
        handler.areas().wait_until(pressed, Duration::MAX)?;
        if mistake != "no_reset" {
            handler.areas().lock()[LOCAL_IO].start_counter_reset(Counter::C1);
            handler.areas().wait_counter_reset(LOCAL_IO, Counter::C1, LIMIT)?;
        }
        turn(if mistake == "up" { Direction::Ccw } else { Direction::Cw })?;
        if let Some(seconds) = stands_still {
            stand_still(seconds).expect("there is a shell");
        }
        match mistake {
            "by_time" => seconds(1.0),
            "no_stop" => seconds(60.0),
            "exactly" => drop(handler.areas().wait_until(is_100, LIMIT)?),
            _ => drop(handler.areas().wait_until(arrived, LIMIT)?),
        }
        turn(Direction::Halt)?;
        handler.areas().wait_until(|areas| !pressed(areas), Duration::MAX)?;
    }
}

pub(crate) fn distance(handler: &TransferAreaComHandler, mistake: &str) -> Result<(), Error> {
    for direction in [Direction::Cw, Direction::Ccw] {
        let together = [(Motor::M2, direction)];
        let slaves: &[_] = if matches!(mistake, "one_wheel" | "curve") { &[] } else { &together };
        let mut areas = handler.areas().lock();
        let area = &mut areas[LOCAL_IO];
        area.start_motor_ex_cmd(Motor::M1, DUTY_MAX, direction, slaves, 500)?;
        if mistake == "curve" {
            area.start_motor_ex_cmd(Motor::M2, DUTY_MAX, direction, &[], 500)?;
        }
        if mistake == "kept_guard" {
            drop(handler.areas().wait_motor_ex(LOCAL_IO, Motor::M1, LIMIT)?);
        }
        drop(areas);
        if mistake == "short_limit" {
            drop(handler.areas().wait_motor_ex(LOCAL_IO, Motor::M1, Duration::from_millis(100))?);
        }
        if mistake == "no_wait" {
            seconds(1.0);
            continue;
        }
        handler.areas().wait_motor_ex(LOCAL_IO, Motor::M1, LIMIT)?;
        if mistake != "only_m1" {
            handler.areas().wait_motor_ex(LOCAL_IO, Motor::M2, LIMIT)?;
        }
        if mistake == "no_return" {
            break;
        }
    }
    handler.end_transfer()
}
