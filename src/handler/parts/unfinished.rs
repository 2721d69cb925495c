//! Commands that were not finished when the outputs were stopped, and so are never done.

use std::ops::Range;

use crate::exchange::{Inputs, Outgoing, Sends};
use crate::transfer_area::{FishX1Transfer, IZ_COUNTER, IZ_MOTOR, MAX_AREAS};
use crate::wire::ExchangeDataResponse;

/// What has stopped the outputs; it decides which commands are cut off.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Cut {
    /// The connection has ended, or is about to: the controller forgets all commands.
    Connection,
    /// Only the motors were stopped.
    Motors,
}

/// A command that was cut off.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct CutOff {
    /// Its id in the output part since then.
    id: u16,
    /// The id of the last command that was done before it.
    done: u16,
}

/// The commands of an area: its motors, its resets, its sound.
const COMMANDS: usize = IZ_MOTOR + IZ_COUNTER + 1;
const RESETS: Range<usize> = IZ_MOTOR..COMMANDS - 1;
const SOUND: usize = COMMANDS - 1;

/// The ids of all commands in areas.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CommandIds([[u16; COMMANDS]; MAX_AREAS]);

impl CommandIds {
    pub(crate) fn of(areas: &[Outgoing]) -> Self {
        let mut ids = Self([[0; COMMANDS]; MAX_AREAS]);
        for (ids, area) in ids.0.iter_mut().zip(areas) {
            *ids = ids_of(area);
        }
        ids
    }
}

fn ids_of(area: &impl Sends) -> [u16; COMMANDS] {
    let mut ids = [0; COMMANDS];
    ids[..IZ_MOTOR].copy_from_slice(&area.output().motor_ex_cmd_id);
    ids[RESETS].copy_from_slice(&area.output().cnt_reset_cmd_id);
    ids[SOUND] = area.txt_outputs().sound_cmd_id;
    ids
}

/// The ids of the last commands that are done, in the order of [`ids_of`].
fn done_of(reported: &mut ExchangeDataResponse) -> impl Iterator<Item = &mut u16> {
    let motors_and_resets =
        reported.motor_command_id.iter_mut().chain(&mut reported.counter_reset_id);
    motors_and_resets.chain([&mut reported.sound_command_id])
}

/// The commands of all areas that were cut off and not replaced since then.
///
/// The controller still reports them as done: a motor command because leaving the extended mode is a
/// command, too, and others because a controller that has forgotten them gets their ids again. The program
/// must not take this for its own command, so this hides it.
#[derive(Debug, Default)]
pub(crate) struct Unfinished {
    areas: [[Option<CutOff>; COMMANDS]; MAX_AREAS],
    any: bool,
}

impl Unfinished {
    /// Stops the outputs, and notes which commands this cuts off: those that are not done in the newest
    /// inputs.
    pub(crate) fn stop(&mut self, cut: Cut, inputs: &Inputs, areas: &mut [Outgoing]) {
        self.any = true;
        for (index, area) in areas.iter_mut().enumerate() {
            let mut reported = inputs.area(index).copied().unwrap_or_default();
            let ordered = ids_of(area);
            area.output.stop_motors();
            let ids = ordered.into_iter().zip(ids_of(area));
            let commands = self.areas[index].iter_mut().zip(done_of(&mut reported)).zip(ids);
            let cut_off = match cut {
                Cut::Connection => COMMANDS,
                Cut::Motors => IZ_MOTOR,
            };
            for ((command, done), (ordered, id)) in commands.take(cut_off) {
                note(command, ordered, *done, id);
            }
            // A controller that has forgotten the command would play it again.
            if cut == Cut::Connection {
                area.txt_outputs.sound_index = 0;
            }
        }
    }

    /// Outputs of a guard that began with these ids do not count: notes its new commands, and hides in the
    /// inputs that the commands which have their places are done.
    pub(crate) fn refuse(
        &mut self,
        ids: &CommandIds,
        refused: &[FishX1Transfer],
        areas: &[Outgoing],
        inputs: &mut Inputs,
    ) {
        let guards = refused.iter().map(ids_of).zip(&ids.0);
        for (index, ((refused, began), area)) in guards.zip(areas).enumerate() {
            if refused == *began {
                continue;
            }
            self.any = true;
            let mut nothing = ExchangeDataResponse::default();
            let reported = inputs.area_mut(index).unwrap_or(&mut nothing);
            let kept = ids_of(area);
            let commands = self.areas[index].iter_mut().zip(done_of(reported)).enumerate();
            for (at, (command, reported)) in commands.filter(|(at, _)| refused[*at] != began[*at]) {
                refuse_one(command, kept[at], reported);
            }
        }
    }

    /// Hides in the inputs that a command which was cut off is done, unless the program has
    /// given another one since then.
    pub(crate) fn hide(&mut self, inputs: &mut Inputs, areas: &[Outgoing]) {
        if !self.any {
            return;
        }
        self.any = false;
        for (index, (area, commands)) in areas.iter().zip(&mut self.areas).enumerate() {
            let mut nothing = ExchangeDataResponse::default();
            let reported = inputs.area_mut(index).unwrap_or(&mut nothing);
            for ((command, ordered), reported) in
                commands.iter_mut().zip(ids_of(area)).zip(done_of(reported))
            {
                self.any |= hide_one(command, ordered, reported);
            }
        }
    }
}

/// Notes a command unless it is done. One that was cut off before stays so, with its current id.
fn note(command: &mut Option<CutOff>, ordered: u16, done: u16, id: u16) {
    *command = match *command {
        Some(before) if before.id == ordered => Some(CutOff { id, ..before }),
        _ if ordered != done => Some(CutOff { id, done }),
        _ => None,
    };
}

/// A new command was refused, and the output part keeps `id`: for the program this is the new one.
fn refuse_one(command: &mut Option<CutOff>, id: u16, reported: &mut u16) {
    // The id before it, when this one is done already.
    let done = if *reported == id { id.wrapping_sub(1) } else { *reported };
    *command = Some(CutOff { id, done });
    *reported = done;
}

/// Hides a command if it is still to be hidden; returns whether it is.
fn hide_one(command: &mut Option<CutOff>, ordered: u16, reported: &mut u16) -> bool {
    *command = command.filter(|command| command.id == ordered);
    if let Some(command) = command {
        *reported = command.done;
    }
    command.is_some()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The inputs from a controller that has done these commands.
    fn inputs(motor: u16, reset: u16, sound: u16) -> Inputs {
        let mut inputs = Inputs::default();
        inputs.take_simple(ExchangeDataResponse {
            motor_command_id: [motor, 0, 0, 0],
            counter_reset_id: [reset, 0, 0, 0],
            sound_command_id: sound,
            ..ExchangeDataResponse::default()
        });
        inputs
    }

    fn reported(inputs: &Inputs) -> (u16, u16, u16) {
        let reported = inputs.area(0).unwrap();
        (reported.motor_command_id[0], reported.counter_reset_id[0], reported.sound_command_id)
    }

    /// An area with these commands.
    fn area(motor: u16, reset: u16, sound: u16) -> [Outgoing; 1] {
        let mut area = Outgoing::default();
        area.output.motor_ex_cmd_id[0] = motor;
        area.output.distance[0] = 900;
        area.output.cnt_reset_cmd_id[0] = reset;
        area.txt_outputs.sound_cmd_id = sound;
        area.txt_outputs.sound_index = 3;
        [area]
    }

    /// As a guard has it.
    fn whole([area]: [Outgoing; 1]) -> [FishX1Transfer; 1] {
        let Outgoing { output, txt_outputs, .. } = area;
        [FishX1Transfer { output, txt_outputs, ..FishX1Transfer::default() }]
    }

    #[test]
    fn commands_that_were_cut_off_are_never_reported_as_done() {
        let mut unfinished = Unfinished::default();
        let mut areas = area(5, 6, 7);
        unfinished.stop(Cut::Connection, &inputs(4, 5, 6), &mut areas);
        assert_eq!(areas[0].output.distance[0], 0);
        assert_eq!(areas[0].txt_outputs.sound_index, 0, "it is not played again");
        for _ in 0..3 {
            // Leaving the extended mode was done, and the others were done again.
            let mut inputs = inputs(6, 6, 7);
            unfinished.hide(&mut inputs, &areas);
            assert_eq!(reported(&inputs), (4, 5, 6));
        }
    }

    #[test]
    fn commands_that_were_done_before_stay_done() {
        let mut unfinished = Unfinished::default();
        let mut areas = area(5, 6, 7);
        unfinished.stop(Cut::Connection, &inputs(5, 6, 7), &mut areas);
        let mut inputs = inputs(6, 6, 7);
        unfinished.hide(&mut inputs, &areas);
        assert_eq!(reported(&inputs), (6, 6, 7));
        assert!(!unfinished.any, "later responses need no check");
    }

    #[test]
    fn a_new_command_can_be_done_again() {
        let mut unfinished = Unfinished::default();
        let mut areas = area(5, 6, 7);
        unfinished.stop(Cut::Connection, &inputs(4, 5, 6), &mut areas);
        areas[0].output.motor_ex_cmd_id[0] += 1;
        areas[0].txt_outputs.sound_cmd_id += 1;
        let mut inputs = inputs(7, 6, 8);
        unfinished.hide(&mut inputs, &areas);
        assert_eq!(reported(&inputs), (7, 5, 8));
    }

    #[test]
    fn a_second_cut_leaves_them_unfinished() {
        let mut unfinished = Unfinished::default();
        let mut areas = area(5, 6, 7);
        unfinished.stop(Cut::Connection, &inputs(4, 5, 6), &mut areas);
        // What was hidden is not in the inputs that the program has.
        unfinished.stop(Cut::Connection, &inputs(4, 5, 6), &mut areas);
        let mut inputs = inputs(7, 6, 7);
        unfinished.hide(&mut inputs, &areas);
        assert_eq!(reported(&inputs), (4, 5, 6));
    }

    #[test]
    fn stopping_the_motors_leaves_resets_and_sounds_to_the_controller() {
        let mut unfinished = Unfinished::default();
        let mut areas = area(5, 6, 7);
        unfinished.stop(Cut::Motors, &inputs(4, 5, 6), &mut areas);
        assert_eq!(areas[0].txt_outputs.sound_index, 3);
        let mut inputs = inputs(6, 6, 7);
        unfinished.hide(&mut inputs, &areas);
        assert_eq!(reported(&inputs), (4, 6, 7));
    }

    #[test]
    fn a_command_that_was_refused_is_never_reported_as_done() {
        let began = CommandIds::of(&area(4, 5, 6));
        // The stop has raised the motor's id, and this was reported as done or not.
        for motor_done in [4, 5] {
            let mut unfinished = Unfinished::default();
            let (refused, mut kept) = (area(5, 6, 7), area(5, 5, 6));
            let mut seen = inputs(motor_done, 5, 6);
            unfinished.refuse(&began, &whole(refused), &kept, &mut seen);
            assert_eq!(reported(&seen), (4, 4, 5));
            let mut later = inputs(5, 5, 6);
            unfinished.hide(&mut later, &kept);
            assert_eq!(reported(&later), (4, 4, 5));
            // The next commands are reported.
            kept[0].output.motor_ex_cmd_id[0] = 6;
            let mut later = inputs(6, 5, 6);
            unfinished.hide(&mut later, &kept);
            assert_eq!(reported(&later), (6, 4, 5));
        }
    }

    #[test]
    fn what_a_guard_without_new_commands_leaves_hides_nothing() {
        let began = CommandIds::of(&area(4, 5, 6));
        let mut unfinished = Unfinished::default();
        let mut seen = inputs(5, 5, 6);
        unfinished.refuse(&began, &whole(area(4, 5, 6)), &area(5, 5, 6), &mut seen);
        assert_eq!(reported(&seen), (5, 5, 6));
        assert!(!unfinished.any);
    }
}
