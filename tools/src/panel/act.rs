//! Carries out what a page asks for, on the area of one controller.

use ft_transfer_area::transfer_area::{CounterMode, InputMode};
use ft_transfer_area::tx::{Counter, Direction, Input, Motor, Output};
use ft_transfer_area::{Error, FishX1Transfer};

use super::trouble::Trouble;
use super::wish::{AreaWish, Counting, Mode};

impl From<Mode> for InputMode {
    fn from(mode: Mode) -> Self {
        match mode {
            Mode::Voltage => Self::Voltage,
            Mode::Resistance => Self::Resistance,
            Mode::Resistance15k => Self::Resistance15k,
            Mode::Ultrasonic => Self::Ultrasonic,
        }
    }
}

impl From<Counting> for CounterMode {
    fn from(counting: Counting) -> Self {
        match counting {
            Counting::Normal => Self::Normal,
            Counting::Inverted => Self::Inverted,
        }
    }
}

/// Changes the area as the wish says, or leaves it as it is.
pub(super) fn act(area: &mut FishX1Transfer, wish: &AreaWish) -> Result<(), Trouble> {
    match *wish {
        AreaWish::Uni { input, mode, digital } => {
            area.set_ft_uni_config(Input::try_from(input)?, mode.into(), digital);
        }
        AreaWish::CounterMode { counter, mode } => {
            area.set_ft_cnt_config(Counter::try_from(counter)?, mode.into());
        }
        AreaWish::ResetCounter { counter } => {
            area.start_counter_reset(Counter::try_from(counter)?);
        }
        AreaWish::MotorKind { motor, outputs } => {
            area.set_ft_motor_config(Motor::try_from(motor)?, !outputs);
        }
        AreaWish::Motor { motor, duty } => set_power(area, Motor::try_from(motor)?, duty)?,
        AreaWish::Output { output, duty } => {
            area.set_out_pwm_values(Output::try_from(output)?, duty)?;
        }
        AreaWish::Distance { motor, duty, pulses, with, opposite } => {
            let with = with.map(Motor::try_from).transpose()?;
            go(area, Motor::try_from(motor)?, duty, pulses, with, opposite)?;
        }
        AreaWish::Sound { index, repeat } => area.set_sound(index, repeat)?,
    }
    Ok(())
}

/// Plain speed control. It ends a distance, and lets go of the motors that follow this one.
fn set_power(area: &mut FishX1Transfer, motor: Motor, duty: i16) -> Result<(), Error> {
    let mut wanted = *area;
    let extended = |area: &FishX1Transfer, motor: Motor| {
        area.output.distance[motor.index()] != 0 || area.output.master[motor.index()] != 0
    };
    for other in Motor::ALL {
        let follows = usize::from(area.output.master[other.index()]) == motor.index() + 1;
        if follows || (other == motor && extended(area, other)) {
            wanted.stop_motor_ex_cmd(other)?;
        }
    }
    wanted.set_out_motor_power(motor, duty)?;
    *area = wanted;
    Ok(())
}

/// A distance, or without one two motors that turn together.
fn go(
    area: &mut FishX1Transfer,
    motor: Motor,
    duty: i16,
    pulses: u32,
    with: Option<Motor>,
    opposite: bool,
) -> Result<(), Error> {
    let (ahead, back) = (Direction::Cw, Direction::Ccw);
    let (direction, other) = if duty < 0 { (back, ahead) } else { (ahead, back) };
    let slave = with.map(|slave| (slave, if opposite { other } else { direction }));
    let slaves: Vec<_> = slave.into_iter().collect();
    // The least i16 has no opposite. It is out of range in any case.
    let duty = duty.checked_abs().unwrap_or(i16::MAX);
    if pulses == 0 && with.is_some() {
        return area.start_synchronised(motor, duty, direction, &slaves);
    }
    area.start_motor_ex_cmd(motor, duty, direction, &slaves, pulses)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn done(area: &mut FishX1Transfer, wish: &AreaWish) {
        act(area, wish).unwrap();
    }

    #[test]
    fn plain_speed_ends_a_distance_and_lets_go_of_the_followers() {
        let mut area = FishX1Transfer::default();
        let together =
            AreaWish::Distance { motor: 0, duty: -300, pulses: 50, with: Some(2), opposite: true };
        done(&mut area, &together);
        assert_eq!((area.output.distance, area.output.master), ([50, 0, 50, 0], [0, 0, 1, 0]));
        assert_eq!(area.output.duty, [0, 300, 0, 0, 300, 0, 0, 0]);
        done(&mut area, &AreaWish::Motor { motor: 0, duty: 100 });
        assert_eq!((area.output.distance, area.output.master), ([0; 4], [0; 4]));
        assert_eq!(area.output.duty, [100, 0, 0, 0, 0, 0, 0, 0]);
        let commands = area.output.motor_ex_cmd_id;
        done(&mut area, &AreaWish::Motor { motor: 0, duty: 200 });
        assert_eq!(area.output.motor_ex_cmd_id, commands, "it is at plain speed control already");
    }

    #[test]
    fn without_pulses_two_motors_turn_together_and_one_has_no_distance() {
        let mut area = FishX1Transfer::default();
        let wish =
            |with| AreaWish::Distance { motor: 1, duty: 9, pulses: 0, with, opposite: false };
        done(&mut area, &wish(Some(3)));
        assert_eq!((area.output.master, area.output.distance), ([0, 0, 0, 2], [0; 4]));
        assert_eq!(act(&mut area, &wish(None)).unwrap_err().code, "zero_pulses");
    }

    #[test]
    fn what_is_out_of_range_changes_nothing() {
        for wish in [
            AreaWish::Motor { motor: 4, duty: 0 },
            AreaWish::Motor { motor: 0, duty: 513 },
            AreaWish::Motor { motor: 0, duty: i16::MIN },
            AreaWish::Output { output: 8, duty: 1 },
            AreaWish::Distance { motor: 0, duty: i16::MIN, pulses: 5, with: None, opposite: false },
            AreaWish::Distance { motor: 0, duty: 5, pulses: 65_536, with: None, opposite: false },
            AreaWish::Uni { input: -1, mode: Mode::Voltage, digital: false },
            AreaWish::Sound { index: 100, repeat: 1 },
        ] {
            let mut area = FishX1Transfer::default();
            let trouble = act(&mut area, &wish).unwrap_err();
            assert_eq!(
                (trouble.code, area),
                ("out_of_range", FishX1Transfer::default()),
                "{wish:?}"
            );
        }
    }
}
