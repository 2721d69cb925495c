//! Where a program does not do what the recorded one did.

use std::time::Duration;

use ft_transfer_area::transfer_area::{
    InputMode, IrInput, OutputValues, UniConfig, IZ_COUNTER, IZ_MOTOR,
};
use ft_transfer_area::tx::{Counter, Input, Motor, Output};
use ft_transfer_area::wire::{ExchangeDataResponse, IrRemote};
use ft_transfer_area::FishX1Transfer;
use ft_transfer_area_simulator::Controller;

use super::ids::Commands;

/// The commands of one controller on a connection.
#[derive(Debug, Default)]
pub(super) struct Terminals {
    motors: [Commands; IZ_MOTOR],
    resets: [Commands; IZ_COUNTER],
    sound: Commands,
}

/// The first difference of a run.
#[derive(Clone, Debug)]
pub(super) struct Difference {
    pub(super) cycle: u64,
    pub(super) at: Duration,
    pub(super) what: String,
}

impl Terminals {
    /// Compares a recorded request, and how its inputs were configured, with the program's; returns the first difference.
    pub(super) fn compare(
        &mut self,
        recorded: &FishX1Transfer,
        controller: &Controller,
    ) -> Option<String> {
        let given = &controller.outputs;
        let mut found = None;
        let mut note = |differs: bool, what: &dyn Fn() -> String| {
            if differs && found.is_none() {
                found = Some(what());
            }
        };
        for input in Input::ALL {
            let [was, is] = [&recorded.config, &controller.config]
                .map(|config| config.uni[input.index()])
                .map(measures);
            // A client that has configured nothing reads what it gets.
            let differs = controller.config_id != 0 && was != is;
            note(differs, &|| format!("{input} was for {was} and is for {is}"));
        }
        let output = &recorded.output;
        // A client of another kind may send any number.
        let sent = OutputValues { duty: given.duty.into(), ..OutputValues::default() }.sent_duty();
        for terminal in Output::ALL {
            let index = terminal.index();
            let (was, is) = (output.duty[index], sent[index]);
            note(was != is, &|| format!("{terminal} was {was} and is {is}"));
        }
        for (motor, commands) in Motor::ALL.into_iter().zip(&mut self.motors) {
            let index = motor.index();
            let same = commands.note(output.motor_ex_cmd_id[index], given.motor_command_id[index]);
            note(!same, &|| format!("only one of the two has a new command for {motor}"));
            let (was, is) = (output.distance[index], given.distance[index]);
            note(was != is, &|| format!("the distance of {motor} was {was} and is {is}"));
            let (was, is) = (i16::from(output.master[index]), given.master[index]);
            note(was != is, &|| format!("the synchronisation of {motor} was {was} and is {is}"));
        }
        for (counter, commands) in Counter::ALL.into_iter().zip(&mut self.resets) {
            let index = counter.index();
            let same = commands.note(output.cnt_reset_cmd_id[index], given.counter_reset_id[index]);
            note(!same, &|| format!("only one of the two resets {counter}"));
        }
        let sound = &recorded.txt_outputs;
        let same = self.sound.note(sound.sound_cmd_id, given.sound_command_id);
        note(!same, &|| "only one of the two plays a sound".to_owned());
        let (was, is) = (sound.sound_index, given.sound_index);
        note(was != is, &|| format!("the sound was {was} and is {is}"));
        found
    }

    /// What the controller reported, with the ids of the program's commands.
    pub(super) fn report(&mut self, recorded: &FishX1Transfer) -> ExchangeDataResponse {
        let input = &recorded.input;
        let mut report = ExchangeDataResponse {
            uni: *input.uni,
            counter_input: *input.cnt_in,
            counter: *input.counter,
            counter_reset_id: *input.cnt_reset_cmd_id,
            motor_command_id: *input.motor_ex_cmd_id,
            sound_command_id: self.sound.report(recorded.txt_inputs.sound_cmd_id),
            ir: recorded.txt_inputs.ir_input.map(|remote| sent(&remote)),
        };
        for (commands, id) in self.resets.iter_mut().zip(&mut report.counter_reset_id) {
            *id = commands.report(*id);
        }
        for (commands, id) in self.motors.iter_mut().zip(&mut report.motor_command_id) {
            *id = commands.report(*id);
        }
        report
    }
}

/// What an input is configured for.
fn measures(config: UniConfig) -> String {
    let mode = config.input_mode().map_or("an unknown mode", InputMode::name);
    match config.is_digital() {
        true => format!("{mode}, digital"),
        false => mode.to_owned(),
    }
}

/// A remote as a controller sends it.
fn sent(remote: &IrInput) -> IrRemote {
    let axis = |value: i16| i8::try_from(value).unwrap_or_default();
    let bits = [remote.button_on, remote.button_off, remote.dip_switch_1, remote.dip_switch_2];
    IrRemote {
        left_x: axis(remote.joy_left_x),
        left_y: axis(remote.joy_left_y),
        right_x: axis(remote.joy_right_x),
        right_y: axis(remote.joy_right_y),
        bits: (0..).zip(bits).fold(0, |all, (bit, set)| all | u8::from(set != 0) << bit),
    }
}
