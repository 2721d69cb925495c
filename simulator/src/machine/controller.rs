//! One controller of the simulated machine.

use std::mem;

use ft_transfer_area::transfer_area::{Config, DUTY_MAX, IZ_COUNTER, IZ_MOTOR};
use ft_transfer_area::tx::Counter;
use ft_transfer_area::wire::{ExchangeData, ExchangeDataResponse, IrRemote};

use crate::machine::motor::{Motor, Pulses, Shift, Turning};
use crate::machine::oddity::Task;
use crate::machine::positions::{Leaders, Positions};
use crate::machine::sound::Sound;

/// The master or one extension: what its inputs report, and the outputs it has received.
///
/// The inputs may be set at any time and keep their value, except that motors change
/// [`counter`](Self::counter) and [`counter_input`](Self::counter_input). A
/// [world](crate::world::World) sets [`uni`](Self::uni) and [`ir`](Self::ir) whenever time passes.
#[derive(Clone, Debug, Default)]
pub struct Controller {
    /// What I1 to I8 report, in the unit of the configured mode (0 or 1, Ω, mV, cm). The
    /// simulated TXT does not convert it.
    pub uni: [i16; 8],
    /// The levels of C1 to C4, 0 or 1. A motor sets the level of its counter to 1 at each pulse, and to 0 half a pulse
    /// later. A level that is set here counts nothing; [`set_counter_level`](Self::set_counter_level) counts.
    pub counter_input: [i16; 4],
    /// The pulses that C1 to C4 have counted. Wraps from 32767 to −32768. It stays when the
    /// connection ends.
    pub counter: [i16; 4],
    /// What the infrared remotes send: “any remote”, then the four switch settings.
    pub ir: [IrRemote; 5],
    /// Loudness, linear. Reported from firmware 4.2.4 on, by the compressed exchange.
    pub mic_lin: u16,
    /// Loudness, logarithmic. Reported from firmware 4.2.4 on, by the compressed exchange.
    pub mic_log: u16,
    /// The last received outputs. They are kept after StopOnline and when the client is lost, until the first exchange
    /// after the next StartOnline, or until the [watchdog](crate::SimulatedTxtBuilder::board_watchdog) of the board
    /// clears them. (Measured on the maker's firmware 4.7.0 under emulation.)
    pub outputs: ExchangeData,
    /// The last accepted configuration; the default before the first.
    pub config: Config,
    /// The id of that configuration; 0 before the first one after StartOnline.
    pub config_id: i16,
    motors: [Motor; IZ_MOTOR],
    /// Where they are for their synchronisation.
    positions: Positions,
    motor_ids: [CommandIds; IZ_MOTOR],
    sound: Sound,
    /// Whether there was no exchange since StartOnline.
    is_new_session: bool,
    /// Ids of the counter resets that were done before this exchange.
    finished_resets: [u16; IZ_COUNTER],
    /// Ids of the counter resets of this exchange; the next one reports them.
    latest_resets: [u16; IZ_COUNTER],
    /// What it reports instead.
    report_override: Option<ExchangeDataResponse>,
}

/// The ids of the last commands of a motor. The board knows a command only by its number, of which it gets three bits.
#[derive(Clone, Copy, Debug, Default)]
struct CommandIds {
    ids: [u16; 8],
    newest: u16,
}

impl CommandIds {
    /// The number of a new command.
    fn add(&mut self, id: u16) -> u16 {
        self.newest = (self.newest + 1) % 8;
        self.ids[usize::from(self.newest)] = id;
        self.newest
    }

    /// The id of the last command that has this number.
    fn id(&self, number: u16) -> u16 {
        self.ids[usize::from(number % 8)]
    }
}

impl Controller {
    /// Reports this from now on, whatever is plugged in and whatever its outputs do, for a script that
    /// repeats what a real controller has reported. With `None`, the default, it reports its own inputs and the
    /// commands that it has finished.
    ///
    /// ```
    /// use ft_transfer_area_simulator::Machine;
    /// use ft_transfer_area::wire::ExchangeDataResponse;
    ///
    /// let mut machine = Machine::new(0);
    /// let recorded = ExchangeDataResponse { motor_command_id: [7; 4], ..Default::default() };
    /// machine.controllers[0].report_as(Some(recorded));
    /// assert_eq!(machine.report(0), Some(recorded));
    /// ```
    pub fn report_as(&mut self, report: Option<ExchangeDataResponse>) {
        self.report_override = report;
    }

    /// Id of the sound command that is playing, `None` when no sound plays.
    pub fn playing_sound(&self) -> Option<u16> {
        self.sound.playing_id()
    }

    /// The duties as they reach the I/O board, in 8 bits each: 512 is 255, others are halved, modulo 256. So 1 is 0,
    /// 511 is the same as 512, and 600 is 44. (Measured on the maker's firmware 4.7.0 under emulation.)
    pub fn board_duty(&self) -> [u8; 8] {
        self.outputs.duty.map(|duty| if duty == DUTY_MAX { u8::MAX } else { (duty / 2) as u8 })
    }

    /// The duty that an output has, 0..=512, after its way to the board.
    pub(crate) fn effective_duty(&self, output: usize) -> i16 {
        match self.board_duty()[output] {
            u8::MAX => DUTY_MAX,
            half => 2 * i16::from(half),
        }
    }

    /// Whether an output is on or a sound plays.
    pub(crate) fn is_active(&self) -> bool {
        self.outputs.duty != [0; 8] || self.sound.playing_id().is_some()
    }

    /// Forgets the configuration's id. Motors go on until the first exchange, and a sound plays on.
    pub(crate) fn begin_session(&mut self) {
        self.is_new_session = true;
        self.sound.forget_ids();
        self.config_id = 0;
    }

    /// Stops motors and sounds and forgets all commands.
    pub(crate) fn stop(&mut self) {
        self.stop_outputs();
        self.sound = Sound::default();
    }

    /// Stops motors and forgets all commands, but sounds play on.
    pub(crate) fn stop_outputs(&mut self) {
        self.outputs = ExchangeData::default();
        self.motors = Default::default();
        self.positions = Positions::default();
        self.motor_ids = Default::default();
        self.finished_resets = [0; IZ_COUNTER];
        self.latest_resets = [0; IZ_COUNTER];
    }

    /// Takes over outputs. A command is new when its id differs from the one before; in a new session all are
    /// forgotten.
    pub(crate) fn take_over(&mut self, outputs: ExchangeData) {
        if mem::take(&mut self.is_new_session) {
            self.stop_outputs();
        }
        let before = mem::replace(&mut self.outputs, outputs);
        for index in 0..IZ_MOTOR {
            let id = outputs.motor_command_id[index];
            if id != before.motor_command_id[index] {
                self.begin_motor(index, id);
            }
        }
        for index in 0..IZ_COUNTER {
            if outputs.counter_reset_id[index] != before.counter_reset_id[index] {
                self.counter[index] = 0;
                self.motors[index].reset_counter();
            }
        }
        let id = outputs.sound_command_id;
        if id != before.sound_command_id {
            self.sound.begin(id, outputs.sound_index, outputs.sound_repeat);
        }
    }

    /// The tasks that need a motor's count at present, each with the motor's index.
    pub(crate) fn tasks(&self) -> impl Iterator<Item = (usize, Task)> + '_ {
        let numbered = self.motors.iter().zip(self.leaders()).enumerate();
        numbered.flat_map(|(index, (motor, leader))| {
            let distance = motor.has_distance().then_some((index, Task::Distance));
            let follow = leader.map(|leader| (index, Task::Follow { leader }));
            let lead = leader.map(|leader| (leader, Task::Lead { follower: index }));
            [distance, follow, lead].into_iter().flatten()
        })
    }

    fn begin_motor(&mut self, index: usize, id: u16) {
        let (motor, number) = (&mut self.motors[index], self.motor_ids[index].add(id));
        // 4 bits of it reach the board.
        let master = self.outputs.master[index] & 0xF;
        let shift = motor.begin(number, master, self.outputs.distance[index]);
        if motor.has_distance() {
            self.counter[index] = 0;
        }
        self.shift(index, shift);
    }

    /// Sets where a motor counts as being, if it follows another one.
    fn shift(&mut self, index: usize, shift: Shift) {
        let leaders = self.leaders();
        let Some(leader) = leaders[index] else { return };
        if let Shift::Join | Shift::JoinWithError(_) = shift {
            self.positions.join(index, leader, &leaders);
        }
        if let Shift::Error(error) | Shift::JoinWithError(error) = shift {
            self.positions.inject(index, error);
        }
    }

    /// The motors that follow another one, each with its leader.
    fn leaders(&self) -> Leaders {
        std::array::from_fn(|index| self.motors[index].leader().filter(|leader| *leader != index))
    }

    /// Reports the resets of the exchange before, and remembers those of this one.
    pub(crate) fn finish_resets(&mut self) {
        self.finished_resets = self.latest_resets;
        self.latest_resets = self.outputs.counter_reset_id;
    }

    /// Lets this many µs pass for all but the motors.
    pub(crate) fn pass_time(&mut self, micros: u64) {
        self.sound.play(micros);
    }

    /// Sets the level of a counter input, as what is plugged in there does. The counter counts when the level rises
    /// from 0 to 1.
    pub fn set_counter_level(&mut self, counter: Counter, is_high: bool) {
        let rises = is_high && self.counter_input[counter.index()] == 0;
        let pulses = Pulses { count: rises.into(), level: Some(is_high) };
        self.add_pulses(counter.index(), pulses);
    }

    fn add_pulses(&mut self, index: usize, Pulses { count, level }: Pulses) {
        self.counter[index] = self.counter[index].wrapping_add_unsigned(count);
        if let Some(is_high) = level {
            self.counter_input[index] = is_high.into();
        }
    }

    /// The power for each motor, −1.0..=1.0, while they turn so.
    pub(crate) fn powers(&self, turning: [Turning; IZ_MOTOR]) -> [f64; IZ_MOTOR] {
        let mut powers: [f64; IZ_MOTOR] = std::array::from_fn(|index| {
            let power = f64::from(self.signed_duty(index)) / f64::from(DUTY_MAX);
            power * self.motors[index].allowed(turning[index])
        });
        let mut parts = [1.0_f64; IZ_MOTOR];
        for (follower, leader) in self.pairs() {
            let [own, leaders] = self.positions.parts((follower, leader), &turning);
            parts[follower] = parts[follower].min(own);
            if !self.motors[follower].has_reached() {
                parts[leader] = parts[leader].min(leaders);
            }
        }
        powers.iter_mut().zip(parts).for_each(|(power, part)| *power *= part);
        powers
    }

    /// Counts the pulses that the motors have given.
    pub(crate) fn count(&mut self, pulses: [Pulses; IZ_MOTOR]) {
        self.count_positions(pulses);
        for (index, pulses) in pulses.into_iter().enumerate() {
            self.motors[index].count(pulses.count);
            self.add_pulses(index, pulses);
        }
    }

    /// The motors that are synchronised at present, each follower with its leader.
    fn pairs(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        let followers = self.leaders().into_iter().enumerate();
        let pairs = followers.filter_map(|(follower, leader)| Some((follower, leader?)));
        pairs.filter(|(follower, leader)| !self.is_set_free(*follower, *leader))
    }

    /// Whether a follower goes on alone: a leader that has finished its distance lets its followers finish theirs.
    fn is_set_free(&self, follower: usize, leader: usize) -> bool {
        self.motors[leader].has_reached() && self.motors[follower].has_distance()
    }

    /// Counts where the motors are for their synchronisation. What a follower does alone does not count.
    fn count_positions(&mut self, mut pulses: [Pulses; IZ_MOTOR]) {
        let leaders = self.leaders();
        for (follower, leader) in leaders.into_iter().enumerate() {
            if let Some(leader) = leader.filter(|leader| self.is_set_free(follower, *leader)) {
                pulses[follower] = pulses[leader];
            }
        }
        self.positions.count(&pulses, &leaders);
    }

    /// The duty of a motor, negative for backwards, −512..=512.
    fn signed_duty(&self, index: usize) -> i16 {
        let [forward, backward] =
            [2 * index, 2 * index + 1].map(|output| self.effective_duty(output));
        forward - backward
    }

    /// The inputs and the finished commands, as they are reported.
    pub(crate) fn report(&self) -> ExchangeDataResponse {
        self.report_override.unwrap_or_else(|| ExchangeDataResponse {
            uni: self.uni,
            counter_input: self.counter_input,
            counter: self.counter,
            counter_reset_id: self.finished_resets,
            motor_command_id: std::array::from_fn(|index| {
                self.motor_ids[index].id(self.motors[index].finished_id())
            }),
            sound_command_id: self.sound.finished_id(),
            ir: self.ir,
        })
    }

    /// The words that newer firmware reports after these, the oldest first.
    pub(crate) fn later_words(&self) -> [u16; 2] {
        [self.mic_lin, self.mic_log]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::IdealMotors;

    const STEP: u64 = 10_000;

    /// Exchanges this many times, with new ideal motors, and gives the last report.
    fn exchange(
        controller: &mut Controller,
        outputs: ExchangeData,
        times: u32,
    ) -> ExchangeDataResponse {
        let mut motors = IdealMotors::new(1);
        for _ in 0..times {
            controller.take_over(outputs);
            controller.finish_resets();
            motors.move_on(STEP, std::slice::from_mut(controller));
        }
        controller.report()
    }

    #[test]
    fn either_direction_counts_up_and_a_pulse_raises_the_level() {
        let mut controller = Controller::default();
        let outputs = ExchangeData { duty: [512, 0, 0, 256, 0, 0, 0, 0], ..Default::default() };
        let report = exchange(&mut controller, outputs, 5);
        assert_eq!(report.counter, [10, 5, 0, 0]);
        assert_eq!(report.counter_input, [1, 1, 0, 0]);
    }

    #[test]
    fn a_counter_wraps() {
        let mut controller = Controller::default();
        controller.counter[0] = i16::MAX;
        let outputs = ExchangeData { duty: [512, 0, 0, 0, 0, 0, 0, 0], ..Default::default() };
        assert_eq!(exchange(&mut controller, outputs, 1).counter[0], i16::MIN + 1);
    }

    #[test]
    fn a_counter_reset_is_reported_one_exchange_later() {
        let mut controller = Controller { counter: [5; 4], ..Controller::default() };
        let outputs = ExchangeData { counter_reset_id: [0, 9, 0, 0], ..Default::default() };
        let report = exchange(&mut controller, outputs, 1);
        assert_eq!((report.counter, report.counter_reset_id), ([5, 0, 5, 5], [0; 4]));
        controller.counter[1] = 3;
        let report = exchange(&mut controller, outputs, 1);
        assert_eq!((report.counter, report.counter_reset_id), ([5, 3, 5, 5], [0, 9, 0, 0]));
    }

    #[test]
    fn stopping_forgets_all_commands_but_not_the_counters() {
        let mut controller = Controller::default();
        let outputs = ExchangeData {
            duty: [512, 0, 0, 0, 0, 0, 0, 0],
            distance: [2, 0, 0, 0],
            motor_command_id: [1, 0, 0, 0],
            counter_reset_id: [0, 1, 0, 0],
            ..Default::default()
        };
        let report = exchange(&mut controller, outputs, 2);
        assert_eq!((report.motor_command_id[0], report.counter_reset_id[1]), (1, 1));
        controller.stop();
        // The motor stands at the beginning of a pulse.
        let (counter, counter_input) = ([2, 0, 0, 0], [1, 0, 0, 0]);
        let expected = ExchangeDataResponse { counter, counter_input, ..Default::default() };
        assert_eq!(controller.report(), expected);
        let outputs = ExchangeData { duty: outputs.duty, ..Default::default() };
        assert_eq!(exchange(&mut controller, outputs, 1).counter, [4, 0, 0, 0]);
    }

    #[test]
    fn a_pair_stays_together_and_both_finish_their_distance() {
        let mut controller = Controller::default();
        let outputs = ExchangeData {
            duty: [256, 0, 0, 512, 0, 0, 0, 0],
            master: [0, 1, 0, 0],
            distance: [10, 20, 0, 0],
            motor_command_id: [1, 1, 0, 0],
            ..Default::default()
        };
        let report = exchange(&mut controller, outputs, 12);
        assert_eq!((report.counter[0], report.motor_command_id), (10, [1, 0, 0, 0]));
        let report = exchange(&mut controller, outputs, 50);
        assert_eq!((report.counter, report.motor_command_id), ([10, 20, 0, 0], [1, 1, 0, 0]));
    }

    #[test]
    fn a_follower_that_is_switched_off_stands_still_and_its_leader_waits() {
        let mut controller = Controller::default();
        let outputs = ExchangeData {
            duty: [512, 0, 0, 0, 0, 0, 0, 0],
            master: [0, 1, 0, 0],
            motor_command_id: [0, 1, 0, 0],
            ..Default::default()
        };
        assert_eq!(exchange(&mut controller, outputs, 100).counter, [4, 0, 0, 0]);
    }

    #[test]
    fn a_duty_reaches_the_board_in_8_bits() {
        let duty = [1, 2, 3, 511, 512, 513, 600, -1];
        let outputs = ExchangeData { duty, ..Default::default() };
        let controller = Controller { outputs, ..Controller::default() };
        assert_eq!(controller.board_duty(), [0, 1, 1, 255, 255, 0, 44, 0]);
        let effective = [0, 2, 2, 512, 512, 0, 88, 0];
        assert_eq!(std::array::from_fn(|output| controller.effective_duty(output)), effective);
    }

    #[test]
    fn the_eighth_command_after_one_that_is_done_reads_as_done_at_once() {
        let mut controller = Controller::default();
        let finished = [10, 20, 30, 40, 50, 60, 70, 80, 90].map(|id| {
            let outputs = ExchangeData {
                distance: [1000, 0, 0, 0],
                motor_command_id: [id, 0, 0, 0],
                ..Default::default()
            };
            exchange(&mut controller, outputs, 1).motor_command_id[0]
        });
        assert_eq!(finished, [0, 0, 0, 0, 0, 0, 0, 80, 80]);
    }

    #[test]
    fn a_master_has_4_bits() {
        let mut controller = Controller::default();
        let outputs = ExchangeData {
            master: [16, 17, 0, -1],
            motor_command_id: [1; 4],
            ..Default::default()
        };
        controller.take_over(outputs);
        let leaders = controller.motors.each_ref().map(Motor::leader);
        assert_eq!(leaders, [None, Some(0), None, None]);
    }
}
