//! Motors in the extended mode: distances and synchronisation.

use super::output::check_duty;
use super::{next_id, Direction, InvalidCall, Motor};
use crate::transfer_area::{FishX1Transfer, IZ_MOTOR};

impl FishX1Transfer {
    /// The controller turns a motor for 1..=65535 pulses of its counter, alone or together with up
    /// to three others, and holds them there.
    ///
    /// The master turns with this duty, 0..=512, in its direction. The slaves follow it with the same
    /// duty and for the same number of pulses, each in its own direction. The counters of all these
    /// motors are reset. A command under way is replaced. With duty 0 or [`Direction::Halt`] the
    /// motor waits for a duty.
    ///
    /// When a motor has arrived, [`is_motor_ex_ready`](Self::is_motor_ex_ready) is `true` for it and its
    /// [`motor_ex_reached`](crate::transfer_area::InputValues::motor_ex_reached) becomes 1; this call
    /// sets them to `false` and 0. Afterwards the motors stay in the extended mode: before plain speed
    /// control, call [`stop_motor_ex_cmd`](Self::stop_motor_ex_cmd) for each of them.
    ///
    /// FtTxtLib has three calls of this name, for 0, 1 and 3 slaves; in the TX library the call for 3
    /// slaves is `StartMotorExCmd4`.
    ///
    /// ```
    /// use ft_transfer_area::tx::{Direction, Motor};
    /// use ft_transfer_area::{Error, FishX1Transfer};
    ///
    /// # fn main() -> Result<(), Error> {
    /// let mut area = FishX1Transfer::default();
    /// area.start_motor_ex_cmd(Motor::M1, 512, Direction::Cw, &[], 1000)?;
    /// let slaves = [(Motor::M3, Direction::Cw), (Motor::M4, Direction::Ccw)];
    /// area.start_motor_ex_cmd(Motor::M2, 300, Direction::Cw, &slaves, 500)?;
    /// assert_eq!(area.output.distance, [1000, 500, 500, 500]);
    /// assert_eq!(area.output.master, [0, 0, 2, 2]);
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// # Errors
    ///
    /// [`InvalidCall::OutOfRange`] for the duty and the pulses, [`InvalidCall::ZeroPulses`],
    /// [`InvalidCall::MotorTwice`] for a slave that is the master or is given twice, [`InvalidCall::NotAMotor`] for
    /// a pair of single outputs.
    #[doc(alias = "StartMotorExCmd")]
    #[doc(alias = "StartMotorExCmd4")]
    pub fn start_motor_ex_cmd(
        &mut self,
        motor: Motor,
        duty: i16,
        direction: Direction,
        slaves: &[(Motor, Direction)],
        pulses: u32,
    ) -> Result<(), InvalidCall> {
        check_duty(duty)?;
        if pulses == 0 {
            return Err(InvalidCall::ZeroPulses);
        }
        InvalidCall::check_range("number of pulses", pulses.into(), 1..=u16::MAX.into())?;
        self.check_group(motor, slaves)?;
        // Checked above.
        self.begin_group(motor, duty, direction, slaves, pulses as u16);
        Ok(())
    }

    /// Turns motors together without end, as a command with 0 pulses does on the TX.
    ///
    /// The slaves follow the master, each in its own direction, and the controller keeps them together.
    /// Counters are not reset. To change the speed, set a new duty for each of the motors by
    /// [`set_out_motor_values`](Self::set_out_motor_values). Without slaves, this is plain speed
    /// control, and it also ends an earlier command of the motor.
    ///
    /// The command of a slave is never done, so do not wait for it. To end it, call
    /// [`stop_motor_ex_cmd`](Self::stop_motor_ex_cmd) for each motor.
    ///
    /// ```
    /// use ft_transfer_area::tx::{Direction, Motor};
    /// use ft_transfer_area::{Error, FishX1Transfer};
    ///
    /// # fn main() -> Result<(), Error> {
    /// let mut area = FishX1Transfer::default();
    /// let slaves = [(Motor::M2, Direction::Ccw)];
    /// area.start_synchronised(Motor::M1, 512, Direction::Cw, &slaves)?; // M2 follows M1
    /// assert_eq!((*area.output.master, *area.output.distance), ([0, 1, 0, 0], [0; 4]));
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// # Errors
    ///
    /// [`InvalidCall::OutOfRange`] for the duty, [`InvalidCall::MotorTwice`] for a slave that is the master or is
    /// given twice, [`InvalidCall::NotAMotor`] for a pair of single outputs.
    #[doc(alias = "StartMotorExCmd")]
    #[doc(alias = "StartMotorExCmd4")]
    pub fn start_synchronised(
        &mut self,
        motor: Motor,
        duty: i16,
        direction: Direction,
        slaves: &[(Motor, Direction)],
    ) -> Result<(), InvalidCall> {
        check_duty(duty)?;
        self.check_group(motor, slaves)?;
        self.begin_group(motor, duty, direction, slaves, 0);
        Ok(())
    }

    fn begin_group(
        &mut self,
        motor: Motor,
        duty: i16,
        direction: Direction,
        slaves: &[(Motor, Direction)],
        distance: u16,
    ) {
        self.begin_motor_ex(motor, duty, direction, distance, 0);
        for &(slave, direction) in slaves {
            // The area counts motors from 1; 0 is no master.
            self.begin_motor_ex(slave, duty, direction, distance, motor.index() as u8 + 1);
        }
    }

    /// An error unless these are different motors.
    fn check_group(&self, motor: Motor, slaves: &[(Motor, Direction)]) -> Result<(), InvalidCall> {
        self.check_motor(motor)?;
        let mut named = [false; IZ_MOTOR];
        named[motor.index()] = true;
        for &(slave, _) in slaves {
            if std::mem::replace(&mut named[slave.index()], true) {
                return Err(InvalidCall::MotorTwice { motor: slave });
            }
            self.check_motor(slave)?;
        }
        Ok(())
    }

    fn begin_motor_ex(
        &mut self,
        motor: Motor,
        duty: i16,
        direction: Direction,
        distance: u16,
        master: u8,
    ) {
        self.set_duties(motor, duty, direction);
        self.output.distance[motor.index()] = distance;
        self.output.master[motor.index()] = master;
        self.raise_motor_ex_cmd_id(motor);
    }

    /// Makes the controller take over a motor's [`distance`](crate::transfer_area::OutputValues::distance)
    /// and [`master`](crate::transfer_area::OutputValues::master) as a new command. Call it after the
    /// program has changed them itself; the other calls do it themselves.
    ///
    /// Raises the [`motor_ex_cmd_id`](crate::transfer_area::OutputValues::motor_ex_cmd_id) by one, and
    /// after 65535 to 0; if that is the id last reported as done, by one more. The motor's
    /// [`motor_ex_reached`](crate::transfer_area::InputValues::motor_ex_reached) becomes 0.
    ///
    /// ```
    /// use ft_transfer_area::tx::Motor;
    /// use ft_transfer_area::FishX1Transfer;
    ///
    /// let mut area = FishX1Transfer::default();
    /// area.output.duty[0] = 512;
    /// area.output.distance[0] = 600;
    /// area.raise_motor_ex_cmd_id(Motor::M1);
    /// assert!(!area.is_motor_ex_ready(Motor::M1));
    /// ```
    pub fn raise_motor_ex_cmd_id(&mut self, motor: Motor) {
        let index = motor.index();
        self.output.motor_ex_cmd_id[index] =
            next_id(self.output.motor_ex_cmd_id[index], self.input.motor_ex_cmd_id[index]);
        self.input.motor_ex_reached[index] = 0;
    }

    /// Whether the last command of a motor is done: a distance, or the end of the extended mode. Also
    /// `true` for a motor that has never had a command.
    ///
    /// A command that has just been started is never reported as done because of an older one.
    #[doc(alias = "IsMotorExReady")]
    #[doc(alias = "IsMotorExCmdReady")]
    #[must_use]
    pub fn is_motor_ex_ready(&self, motor: Motor) -> bool {
        let index = motor.index();
        self.input.motor_ex_cmd_id[index] == self.output.motor_ex_cmd_id[index]
    }

    /// Stops a motor and ends the extended mode: duty, distance and master 0, as a new command.
    ///
    /// Motors that follow this motor stay in the mode and wait for it; stop them too.
    ///
    /// # Errors
    ///
    /// [`InvalidCall::NotAMotor`] for a pair of single outputs.
    #[doc(alias = "StopMotorExCmd")]
    pub fn stop_motor_ex_cmd(&mut self, motor: Motor) -> Result<(), InvalidCall> {
        self.check_motor(motor)?;
        self.leave_motor_ex(motor);
        Ok(())
    }

    /// Stops all motors of this controller and ends the extended mode. Single outputs stay as they
    /// are; [`OutputValues::stop_motors`](crate::transfer_area::OutputValues::stop_motors) switches them
    /// off too.
    #[doc(alias = "StopAllMotorExCmd")]
    pub fn stop_all_motor_ex_cmd(&mut self) {
        for motor in Motor::ALL {
            if self.is_motor(motor) {
                self.leave_motor_ex(motor);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use Direction::{Ccw, Cw};
    use Motor::{M1, M2, M3, M4};

    #[test]
    fn a_command_sets_distance_master_duty_and_a_new_id_for_the_whole_group() {
        let mut area = FishX1Transfer::default();
        *area.input.motor_ex_reached = [1; 4];
        *area.output.master = [4; 4];
        area.start_motor_ex_cmd(M3, 400, Ccw, &[(M1, Cw), (M4, Ccw)], 65_535).unwrap();
        assert_eq!(area.output.duty, [400, 0, 0, 0, 0, 400, 0, 400]);
        assert_eq!(area.output.distance, [65_535, 0, 65_535, 65_535]);
        assert_eq!(area.output.master, [3, 4, 0, 3]);
        assert_eq!(area.output.motor_ex_cmd_id, [1, 0, 1, 1]);
        assert_eq!(area.input.motor_ex_reached, [0, 1, 0, 0]);
        assert_eq!(
            Motor::ALL.map(|motor| area.is_motor_ex_ready(motor)),
            [false, true, false, false]
        );
    }

    #[test]
    fn motors_turn_together_without_a_distance_by_new_commands() {
        let mut area = FishX1Transfer::default();
        area.start_motor_ex_cmd(M1, 512, Cw, &[(M2, Cw)], 100).unwrap();
        area.start_synchronised(M2, 300, Ccw, &[(M1, Cw), (M4, Ccw)]).unwrap();
        assert_eq!(area.output.duty, [300, 0, 0, 300, 0, 0, 0, 300]);
        assert_eq!((*area.output.distance, *area.output.master), ([0; 4], [2, 0, 0, 2]));
        assert_eq!(area.output.motor_ex_cmd_id, [2, 2, 0, 1]);
    }

    #[test]
    fn what_makes_no_sense_is_refused_and_changes_nothing() {
        let mut area = FishX1Transfer::default();
        area.set_ft_motor_config(M4, false);
        let before = area;
        assert_eq!(area.start_motor_ex_cmd(M1, 512, Cw, &[], 0), Err(InvalidCall::ZeroPulses));
        for pulses in [65_536, u32::MAX] {
            let given = pulses.into();
            assert_eq!(
                area.start_motor_ex_cmd(M1, 512, Cw, &[], pulses),
                Err(InvalidCall::OutOfRange {
                    what: "number of pulses",
                    given,
                    least: 1,
                    most: 65_535
                })
            );
        }
        for duty in [-1, 513] {
            for error in [
                area.start_motor_ex_cmd(M1, duty, Cw, &[], 1).unwrap_err(),
                area.start_synchronised(M1, duty, Cw, &[]).unwrap_err(),
            ] {
                assert!(matches!(error, InvalidCall::OutOfRange { what: "duty", .. }), "{error}");
            }
        }
        for (master, slaves, error) in [
            (M1, &[(M1, Cw)][..], InvalidCall::MotorTwice { motor: M1 }),
            (M1, &[(M2, Cw), (M2, Ccw)], InvalidCall::MotorTwice { motor: M2 }),
            (M1, &[(M2, Cw), (M3, Cw), (M1, Cw), (M3, Cw)], InvalidCall::MotorTwice { motor: M1 }),
            (M4, &[], InvalidCall::NotAMotor { motor: M4 }),
            (M1, &[(M2, Cw), (M4, Cw)], InvalidCall::NotAMotor { motor: M4 }),
        ] {
            assert_eq!(area.start_synchronised(master, 512, Cw, slaves), Err(error));
            assert_eq!(area.start_motor_ex_cmd(master, 512, Cw, slaves, 1), Err(error));
        }
        assert_eq!(area.stop_motor_ex_cmd(M4), Err(InvalidCall::NotAMotor { motor: M4 }));
        assert_eq!(area, before);
    }

    #[test]
    fn leaving_the_mode_is_a_command_of_its_own() {
        let mut area = FishX1Transfer::default();
        area.start_motor_ex_cmd(M1, 512, Cw, &[(M2, Cw)], 100).unwrap();
        area.input.motor_ex_cmd_id = area.output.motor_ex_cmd_id;
        area.stop_motor_ex_cmd(M2).unwrap();
        assert!(area.is_motor_ex_ready(M1) && !area.is_motor_ex_ready(M2));
        assert_eq!(area.output.distance, [100, 0, 0, 0]);
        assert_eq!(area.output.master, [0; 4]);
        assert_eq!(area.output.duty, [512, 0, 0, 0, 0, 0, 0, 0]);
        assert_eq!(area.output.motor_ex_cmd_id, [1, 2, 0, 0]);
    }

    #[test]
    fn stopping_all_motors_leaves_single_outputs_on() {
        let mut area = FishX1Transfer::default();
        area.set_ft_motor_config(M4, false);
        let ids = area.output.motor_ex_cmd_id;
        *area.output.duty = [512; 8];
        *area.output.distance = [7; 4];
        area.stop_all_motor_ex_cmd();
        assert_eq!(area.output.duty, [0, 0, 0, 0, 0, 0, 512, 512]);
        assert_eq!(area.output.distance, [0, 0, 0, 7]);
        let is_new = |motor: Motor| {
            let index = motor.index();
            area.output.motor_ex_cmd_id[index] != ids[index]
        };
        assert_eq!(Motor::ALL.map(is_new), [true, true, true, false]);
    }

    #[test]
    fn a_new_command_never_has_the_id_of_an_old_one_that_comes_back() {
        let mut area = FishX1Transfer::default();
        // A controller that remembers an earlier program's command.
        area.input.motor_ex_cmd_id[0] = 3;
        for _ in 0..70_000 {
            area.start_motor_ex_cmd(M1, 512, Cw, &[], 1).unwrap();
            assert!(!area.is_motor_ex_ready(M1));
        }
    }
}
