//! Mistakes of the lessons with one lamp.

use ft_transfer_area::transfer_area::{DUTY_MAX, LOCAL_IO};
use ft_transfer_area::tx::{Input, Output};
use ft_transfer_area::{Error, TransferAreaComHandler};

use crate::{each_cycle, seconds, stand_still};

pub(crate) fn lamp(handler: &TransferAreaComHandler, mistake: &str) -> Result<(), Error> {
    if mistake == "ends" {
        handler.areas().wait_cycle()?[LOCAL_IO].set_out_pwm_values(Output::O8, 0)?;
        seconds(0.1);
        return handler.end_transfer();
    }
    if mistake == "kept_guard" {
        let mut areas = handler.areas().wait_cycle()?;
        loop {
            let pressed = areas[LOCAL_IO].get_in_io_value_binary(Input::I1)?;
            areas[LOCAL_IO].set_out_pwm_values(Output::O8, if pressed { DUTY_MAX } else { 0 })?;
            seconds(0.01);
        }
    }
    each_cycle(handler, |area| {
        let pressed = area.get_in_io_value_binary(Input::I1)?;
        match mistake {
            "inverted" => area.set_out_pwm_values(Output::O8, if pressed { 0 } else { DUTY_MAX }),
            "stays_on" if pressed => area.set_out_pwm_values(Output::O8, DUTY_MAX),
            "other_output" => {
                area.set_out_pwm_values(Output::O7, if pressed { DUTY_MAX } else { 0 })
            }
            "copy" => {
                let mut area = *area;
                area.set_out_pwm_values(Output::O8, if pressed { DUTY_MAX } else { 0 })
            }
            "weak" => area.set_out_pwm_values(Output::O8, i16::from(pressed)),
            "half_of_a_motor" => area.set_out_pwm_values(Output::O8, 0),
            _ => Ok(()),
        }
    })
}

pub(crate) fn blink(handler: &TransferAreaComHandler, mistake: &str) -> Result<(), Error> {
    let set = |duty| -> Result<(), Error> {
        handler.areas().wait_cycle()?[LOCAL_IO].set_out_pwm_values(Output::O8, duty)?;
        Ok(())
    };
    let (on, off) = match mistake {
        // A little more than is looked for: on a busy computer the lamp may be seen later.
        "slow" => (1.3, 1.3),
        "no_second_sleep" => (0.5, 0.0),
        _ => (0.5, 0.5),
    };
    for round in 0.. {
        if mistake == "kept_guard" {
            let mut areas = handler.areas().wait_cycle()?;
            areas[LOCAL_IO].set_out_pwm_values(Output::O8, DUTY_MAX)?;
            seconds(on);
            areas[LOCAL_IO].set_out_pwm_values(Output::O8, 0)?;
            seconds(off);
            continue;
        }
        if mistake != "three_times" || round < 3 {
            set(DUTY_MAX)?;
        }
        if mistake == "stands_still" && round == 2 {
            stand_still(1).expect("there is a shell");
        }
        seconds(on);
        if mistake != "only_on" {
            set(0)?;
        }
        seconds(off);
    }
    Ok(())
}
