//! Hands outputs from the program to the transfer, and inputs back.

use std::time::Duration;

use crate::exchange::{Inputs, Outgoing};
use crate::handler::parts::unfinished::{CommandIds, Cut, Unfinished};
use crate::transfer_area::FishX1Transfer;

/// The outputs as the last guard left them, and the inputs that have come in since.
///
/// A guard may keep the areas for any time, so the transfer does not use them: it takes the outputs from
/// here and puts the inputs here. Each guard gets and leaves them as a whole.
#[derive(Debug, Default)]
pub(crate) struct HandOver {
    /// What the last guard left to be sent.
    outgoing: Vec<Outgoing>,
    incoming: Inputs,
    /// Whether `incoming` has something that is not yet in the areas.
    inputs_due: bool,
    /// Whether the outputs were stopped or refused, and that is not yet in the areas.
    outputs_due: bool,
    unfinished: Unfinished,
    /// The ids of the commands in the areas that a guard has, if the outputs were stopped since it got them.
    ids_of_guard: Option<CommandIds>,
}

impl HandOver {
    pub(crate) fn new(areas: &[FishX1Transfer]) -> Self {
        Self { outgoing: areas.iter().map(Outgoing::from).collect(), ..Self::default() }
    }

    // The program's side.

    /// Brings the areas up to date for a guard: copies what has come in into them, and sets the
    /// master's timers to the time since the transfer began.
    pub(crate) fn bring_up_to_date(&mut self, areas: &mut [FishX1Transfer], elapsed: Duration) {
        self.ids_of_guard = None;
        if std::mem::take(&mut self.outputs_due) {
            for (area, outgoing) in areas.iter_mut().zip(&self.outgoing) {
                area.output = outgoing.output;
                area.txt_outputs = outgoing.txt_outputs;
            }
        }
        if std::mem::take(&mut self.inputs_due) {
            self.incoming.apply(areas);
        }
        if let Some(master) = areas.first_mut() {
            master.timer.set_elapsed(elapsed);
        }
    }

    /// Takes the areas as a guard leaves them; the outputs only if they count. Commands that are refused by
    /// this are never reported as done.
    pub(crate) fn put_back(&mut self, areas: &[FishX1Transfer], outputs_count: bool) {
        if !outputs_count {
            let ids = self.ids_of_guard.unwrap_or_else(|| CommandIds::of(&self.outgoing));
            self.unfinished.refuse(&ids, areas, &self.outgoing, &mut self.incoming);
            self.inputs_due = true;
            self.outputs_due = true;
        }
        for (outgoing, area) in self.outgoing.iter_mut().zip(areas) {
            (outgoing.state, outgoing.config) = (area.state, area.config);
            if outputs_count {
                (outgoing.output, outgoing.txt_outputs) = (area.output, area.txt_outputs);
            }
        }
    }

    /// Whether a guard has changed outputs.
    pub(crate) fn differs(&self, areas: &[FishX1Transfer]) -> bool {
        self.outgoing.iter().zip(areas).any(|(outgoing, area)| {
            outgoing.output != area.output || outgoing.txt_outputs != area.txt_outputs
        })
    }

    /// Undoes what a guard wrote that was dropped by a panic, as far as it is sent.
    pub(crate) fn restore(&mut self, areas: &mut [FishX1Transfer]) {
        for (area, outgoing) in areas.iter_mut().zip(&self.outgoing) {
            let Outgoing { state, config, output, txt_outputs } = *outgoing;
            *area = FishX1Transfer { state, config, output, txt_outputs, ..*area };
        }
        self.inputs_due = true;
    }

    // The transfer's side.

    /// What the last guard left to be sent.
    pub(crate) fn outgoing(&self) -> &[Outgoing] {
        &self.outgoing
    }

    /// Takes the inputs of a response.
    pub(crate) fn deliver(&mut self, inputs: &Inputs) {
        self.incoming.clone_from(inputs);
        // Stopping the outputs leaves silence, too; a sound that was cut off is hidden afterwards.
        self.incoming.finish_silence();
        self.unfinished.hide(&mut self.incoming, &self.outgoing);
        self.inputs_due = true;
    }

    /// The newest inputs, as the program sees them.
    pub(crate) fn incoming(&self) -> &Inputs {
        &self.incoming
    }

    /// Stops all outputs. Commands that are cut off by this are never reported as done.
    pub(crate) fn stop(&mut self, cut: Cut) {
        self.ids_of_guard.get_or_insert_with(|| CommandIds::of(&self.outgoing));
        self.unfinished.stop(cut, &self.incoming, &mut self.outgoing);
        self.outputs_due = true;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::exchange::{Exchange, Sends, TransferMode};
    use crate::firmware::FirmwareVersion;
    use crate::wire::ExchangeDataResponse;

    fn hand_over() -> (HandOver, Vec<FishX1Transfer>) {
        let areas = vec![FishX1Transfer::default()];
        (HandOver::new(&areas), areas)
    }

    fn deliver(hand_over: &mut HandOver, first_input: i16) {
        let mut inputs = Inputs::default();
        let uni = [first_input; 8];
        inputs.take_simple(ExchangeDataResponse { uni, ..Default::default() });
        hand_over.deliver(&inputs);
    }

    #[test]
    fn a_guard_finds_the_newest_inputs_and_leaves_outputs() {
        let (mut hand_over, mut areas) = hand_over();
        deliver(&mut hand_over, 1);
        deliver(&mut hand_over, 2);
        hand_over.bring_up_to_date(&mut areas, Duration::from_millis(1234));
        assert_eq!((areas[0].input.uni[0], areas[0].timer.timer_1ms), (2, 1234));
        areas[0].output.duty[0] = 512;
        hand_over.put_back(&areas, true);
        assert_eq!(hand_over.outgoing(), [Outgoing::from(&areas[0])]);
    }

    #[test]
    fn outputs_that_do_not_count_are_undone_but_a_configuration_stays() {
        let (mut hand_over, mut areas) = hand_over();
        areas[0].output.duty[0] = 512;
        areas[0].txt_outputs.sound_cmd_id = 1;
        areas[0].state.config_id = 2;
        hand_over.put_back(&areas, false);
        assert_eq!(hand_over.outgoing()[0].output.duty[0], 0);
        assert_eq!(hand_over.outgoing()[0].txt_outputs.sound_cmd_id, 0);
        assert_eq!(hand_over.outgoing()[0].state.config_id, 2);
        hand_over.bring_up_to_date(&mut areas, Duration::ZERO);
        assert_eq!([Outgoing::from(&areas[0])], hand_over.outgoing());
    }

    /// The id of the sound that is done, after a response to the areas' outputs that says 0.
    fn done_sound(hand_over: &mut HandOver, areas: &[impl Sends]) -> u16 {
        let mut exchange = Exchange::new(TransferMode::Simple, FirmwareVersion::OLDEST_SUPPORTED);
        exchange.tell_silence(true);
        exchange.request_of(areas, &mut Vec::new()).unwrap();
        let mut response = Vec::new();
        ExchangeDataResponse::default().emit(&mut response);
        hand_over.deliver(exchange.receive(&response).unwrap());
        hand_over.incoming().area(0).unwrap().sound_command_id
    }

    #[test]
    fn silence_is_done_when_it_is_answered_but_a_sound_that_was_cut_off_is_not() {
        let (mut hand_over, mut areas) = hand_over();
        areas[0].txt_outputs.sound_cmd_id = 1;
        hand_over.put_back(&areas, true);
        // It was not sent yet.
        assert_eq!(done_sound(&mut hand_over, &[FishX1Transfer::default()]), 0);
        assert_eq!(done_sound(&mut hand_over, &areas), 1);
        (areas[0].txt_outputs.sound_cmd_id, areas[0].txt_outputs.sound_index) = (2, 3);
        hand_over.put_back(&areas, true);
        assert_eq!(done_sound(&mut hand_over, &areas), 0);
        hand_over.stop(Cut::Connection);
        let stopped = hand_over.outgoing().to_vec();
        assert_eq!(stopped[0].txt_outputs.sound_index, 0);
        assert_eq!(done_sound(&mut hand_over, &stopped), 0);
    }

    #[test]
    fn writes_before_a_panic_are_undone() {
        let (mut hand_over, mut areas) = hand_over();
        deliver(&mut hand_over, 1);
        hand_over.bring_up_to_date(&mut areas, Duration::ZERO);
        areas[0].state.config_id = 9;
        areas[0].input.uni[0] = 99;
        hand_over.restore(&mut areas);
        hand_over.bring_up_to_date(&mut areas, Duration::ZERO);
        assert_eq!((areas[0].state.config_id, areas[0].input.uni[0]), (1, 1));
    }

    #[test]
    fn stopped_outputs_reach_the_areas_and_an_older_guard_does_not_undo_that() {
        let (mut hand_over, mut areas) = hand_over();
        areas[0].output.duty[0] = 512;
        hand_over.put_back(&areas, true);
        hand_over.stop(Cut::Connection);
        assert_eq!(hand_over.outgoing()[0].output.duty[0], 0);
        hand_over.put_back(&areas, false);
        hand_over.bring_up_to_date(&mut areas, Duration::ZERO);
        assert_eq!(areas[0].output.duty[0], 0);
    }
}
