//! Configuration: what is plugged in where.

use super::{Counter, Input, Motor};
use crate::transfer_area::{CounterConfig, CounterMode, FishX1Transfer, InputMode, UniConfig};

impl FishX1Transfer {
    /// Configures a universal input: what it measures, and whether it reports 0 or 1 or the
    /// measured value.
    ///
    /// Raises the [`config_id`](crate::transfer_area::State::config_id), so that the configuration
    /// goes out before the next exchange. The input's value, measured with the old configuration,
    /// becomes 0 until a response brings a new one. The response of the exchange under way may still
    /// have an old value; after [`update_config`](crate::TransferAreas::update_config) there
    /// is none.
    ///
    /// ```
    /// use ft_transfer_area::transfer_area::InputMode;
    /// use ft_transfer_area::tx::Input;
    /// use ft_transfer_area::FishX1Transfer;
    ///
    /// let mut area = FishX1Transfer::default();
    /// area.set_ft_uni_config(Input::I2, InputMode::Ultrasonic, false);
    /// assert_eq!((area.config.uni[1].mode, area.state.config_id), (3, 2));
    /// ```
    #[doc(alias = "SetFtUniConfig")]
    pub fn set_ft_uni_config(&mut self, input: Input, mode: InputMode, digital: bool) {
        let config = if digital { UniConfig::digital(mode) } else { UniConfig::analog(mode) };
        self.config.uni[input.index()] = config;
        self.input.uni[input.index()] = 0;
        self.raise_config_id();
    }

    /// Configures a counter input: normal or inverted. On the maker's firmware 4.7.0 (measured under emulation) it has
    /// no effect.
    ///
    /// Raises the [`config_id`](crate::transfer_area::State::config_id).
    #[doc(alias = "SetFtCntConfig")]
    pub fn set_ft_cnt_config(&mut self, counter: Counter, mode: CounterMode) {
        self.config.cnt[counter.index()] = CounterConfig::new(mode);
        self.raise_config_id();
    }

    /// Configures a pair of outputs: `true` makes it a motor, the kit's default, `false` two
    /// single outputs.
    ///
    /// Raises the [`config_id`](crate::transfer_area::State::config_id). A pair that changes its kind is
    /// switched off first: its duties become 0, and a motor leaves the extended mode, because no call
    /// could end that mode afterwards.
    #[doc(alias = "SetFtMotorConfig")]
    pub fn set_ft_motor_config(&mut self, motor: Motor, status: bool) {
        if self.is_motor(motor) != status {
            self.leave_motor_ex(motor);
        }
        self.config.motor[motor.index()] = u8::from(status);
        self.raise_config_id();
    }

    /// Whether this pair of outputs is configured as a motor.
    pub(super) fn is_motor(&self, motor: Motor) -> bool {
        self.config.motor[motor.index()] != 0
    }

    /// Switches a motor off and back to plain speed control.
    pub(super) fn leave_motor_ex(&mut self, motor: Motor) {
        let index = motor.index();
        for output in motor.outputs() {
            self.output.duty[output.index()] = 0;
        }
        self.output.distance[index] = 0;
        self.output.master[index] = 0;
        self.raise_motor_ex_cmd_id(motor);
    }

    /// Makes the [`config`](Self::config) go out before the next exchange. Call it after the program
    /// has changed `config` itself; the `set_ft_…_config` calls do it themselves.
    ///
    /// Raises the [`config_id`](crate::transfer_area::State::config_id) by one, and after 255 to 1: 0 is
    /// the id of the configuration that a controller has from the start.
    ///
    /// ```
    /// use ft_transfer_area::transfer_area::{InputMode, UniConfig};
    /// use ft_transfer_area::FishX1Transfer;
    ///
    /// let mut area = FishX1Transfer::default();
    /// area.config.uni[1] = UniConfig::analog(InputMode::Ultrasonic);
    /// area.raise_config_id();
    /// assert_eq!(area.state.config_id, 2);
    /// ```
    pub fn raise_config_id(&mut self) {
        self.state.config_id = self.state.config_id.checked_add(1).unwrap_or(1);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_configuration_raises_the_id_and_never_to_0() {
        let mut area = FishX1Transfer::default();
        area.set_ft_uni_config(Input::I8, InputMode::Voltage, true);
        area.set_ft_cnt_config(Counter::C4, CounterMode::Inverted);
        area.set_ft_motor_config(Motor::M4, false);
        assert_eq!(area.state.config_id, 4);
        assert_eq!(area.config.uni[7], UniConfig::digital(InputMode::Voltage));
        assert_eq!((area.config.cnt[3].mode, *area.config.motor), (0, [1, 1, 1, 0]));
        area.state.config_id = u8::MAX;
        area.set_ft_motor_config(Motor::M4, true);
        assert_eq!((area.state.config_id, *area.config.motor), (1, [1; 4]));
    }

    #[test]
    fn a_value_measured_by_the_old_configuration_is_cleared() {
        let mut area = FishX1Transfer::default();
        *area.input.uni = [5000; 8];
        area.set_ft_uni_config(Input::I3, InputMode::Ultrasonic, false);
        assert_eq!(area.input.uni, [5000, 5000, 0, 5000, 5000, 5000, 5000, 5000]);
    }

    #[test]
    fn a_pair_that_changes_its_kind_is_switched_off_first() {
        let mut area = FishX1Transfer::default();
        *area.output.duty = [1, 2, 3, 4, 5, 6, 7, 8];
        *area.output.distance = [100; 4];
        *area.output.master = [1, 1, 0, 0];
        area.set_ft_motor_config(Motor::M2, true);
        assert_eq!(area.output.duty, [1, 2, 3, 4, 5, 6, 7, 8], "it is a motor already");
        area.set_ft_motor_config(Motor::M2, false);
        assert_eq!(area.output.duty, [1, 2, 0, 0, 5, 6, 7, 8]);
        assert_eq!(area.output.distance, [100, 0, 100, 100]);
        assert_eq!(area.output.master, [1, 0, 0, 0]);
        assert_eq!(area.output.motor_ex_cmd_id, [0, 1, 0, 0]);
        area.output.duty[3] = 200;
        area.set_ft_motor_config(Motor::M2, true);
        assert_eq!(area.output.duty[3], 0);
    }
}
