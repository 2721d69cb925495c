//! Mistakes of the lessons with states.

use std::time::{Duration, Instant};

use ft_transfer_area::transfer_area::{DUTY_MAX, LOCAL_IO};
use ft_transfer_area::tx::{Counter, Direction, Input, Motor, Output};
use ft_transfer_area::{Error, FishX1Transfer, TransferAreaComHandler};

use crate::{each_cycle, seconds};

fn duty(is_on: bool) -> i16 {
    if is_on {
        DUTY_MAX
    } else {
        0
    }
}

pub(crate) fn thermostat(handler: &TransferAreaComHandler, mistake: &str) -> Result<(), Error> {
    each_cycle(handler, |area| {
        let ohms = area.get_in_io_value_analogue(Input::I1)?;
        let runs = match mistake {
            "inverted" => ohms > 1350,
            "one_low_limit" => ohms < 1210,
            "one_high_limit" if area.output.duty[0] != 0 => ohms < 1500,
            "one_high_limit" => ohms < 1450,
            _ => false,
        };
        area.set_out_motor_values(Motor::M1, duty(runs), Direction::Cw)
    })
}

pub(crate) fn traffic_light(handler: &TransferAreaComHandler, mistake: &str) -> Result<(), Error> {
    let show = |lights: [bool; 3]| -> Result<(), Error> {
        let area = &mut handler.areas().wait_cycle()?[LOCAL_IO];
        for (output, is_on) in [Output::O1, Output::O2, Output::O3].into_iter().zip(lights) {
            // Nothing is ever switched off.
            if is_on || mistake != "stays_lit" {
                area.set_out_pwm_values(output, duty(is_on))?;
            }
        }
        Ok(())
    };
    if mistake != "dark_at_first" {
        show([false, false, true])?;
    }
    loop {
        handler.areas().wait_until(|areas| areas[LOCAL_IO].input.uni[0] != 0, Duration::MAX)?;
        if mistake == "deaf" {
            continue;
        }
        show([false, true, false])?;
        seconds(1.0);
        show([true, false, false])?;
        seconds(if mistake == "short" { 1.0 } else { 3.0 });
        if mistake != "no_red_yellow" {
            show([true, true, false])?;
            seconds(1.0);
        }
        show([false, false, true])?;
    }
}

#[derive(Clone, Copy)]
enum Gate {
    Stopped,
    Opens,
    Open(Instant),
    Closes,
}

pub(crate) fn gate(handler: &TransferAreaComHandler, mistake: &str) -> Result<(), Error> {
    let mut state = Gate::Stopped;
    loop {
        let mut areas = handler.areas().wait_cycle()?;
        let now = areas.arrived();
        let area = &mut areas[LOCAL_IO];
        let is = |input: Input| area.input.uni[input.index()] != 0;
        let stop = match mistake {
            "stop_is_no_opener" => is(Input::I5),
            "no_stop" => false,
            _ => !is(Input::I5),
        };
        let pause = Duration::from_millis(if mistake == "no_pause" { 500 } else { 2000 });
        state = match state {
            _ if stop && mistake != "goes_on" => Gate::Stopped,
            Gate::Stopped if is(Input::I3) => Gate::Opens,
            Gate::Opens if is(Input::I2) && mistake != "pushes" => Gate::Open(now),
            Gate::Open(since) if now - since >= pause && mistake != "stays_open" => Gate::Closes,
            Gate::Closes if !is(Input::I4) && mistake != "no_barrier" => Gate::Opens,
            Gate::Closes if is(Input::I1) => Gate::Stopped,
            same => same,
        };
        let direction = match state {
            _ if stop => Direction::Halt,
            Gate::Opens => Direction::Cw,
            Gate::Closes => Direction::Ccw,
            Gate::Stopped | Gate::Open(_) => Direction::Halt,
        };
        area.set_out_motor_values(Motor::M1, DUTY_MAX, direction)?;
    }
}

#[derive(Clone, Copy)]
enum Line {
    Waits,
    Measures,
    Travels { from: u16 },
    Blows,
    RunsOff,
}

pub(crate) fn sorting(handler: &TransferAreaComHandler, mistake: &str) -> Result<(), Error> {
    let mut state = Line::Waits;
    let mut lowest = i16::MAX;
    each_cycle(handler, |area: &mut FishX1Transfer| {
        let light_means_disc = mistake == "light_means_disc";
        let has_disc = |input: Input| (area.input.uni[input.index()] != 0) == light_means_disc;
        let pulses = area.get_in_cnt_count(Counter::C1);
        let white = if mistake == "colour_blind" { 0 } else { 940 };
        state = match state {
            Line::Waits if has_disc(Input::I1) => {
                if mistake != "old_colour" {
                    lowest = i16::MAX;
                }
                Line::Measures
            }
            Line::Measures if has_disc(Input::I3) && lowest < white => {
                Line::Travels { from: pulses }
            }
            Line::Measures if has_disc(Input::I3) => Line::RunsOff,
            Line::Travels { from } if pulses.wrapping_sub(from) >= 8 => Line::Blows,
            Line::Blows if has_disc(Input::I6) => Line::Waits,
            Line::RunsOff if has_disc(Input::I7) => Line::Waits,
            same => same,
        };
        if matches!(state, Line::Measures) {
            lowest = lowest.min(area.get_in_io_value_analogue(Input::I2)?);
        }
        let waits = matches!(state, Line::Waits);
        let runs = match mistake {
            "never_starts" => false,
            "runs_on" => !waits || area.output.duty[0] != 0,
            _ => !waits,
        };
        let blows =
            matches!(state, Line::Blows) || (mistake == "valve_stays" && area.output.duty[2] != 0);
        area.set_out_motor_values(Motor::M1, duty(runs), Direction::Cw)?;
        area.set_out_pwm_values(Output::O3, duty(blows))?;
        area.set_out_pwm_values(Output::O4, duty(blows && mistake != "no_air"))
    })
}
