//! What the connections do with the machine, and what it remembers of them.

use std::time::Duration;

use ft_transfer_area::transfer_area::Config;
use ft_transfer_area::wire::{CommandId, ExchangeData, StartCameraOnline};

use super::Machine;
use crate::camera::CameraRun;
use crate::fault::FaultKind;
use crate::i2c::{I2cBus, I2cSession, PATIENCE};
use crate::machine::controller::Controller;
use crate::machine::journal;
use crate::machine::oddity::{Encoder, Oddity};
use crate::server::command::{is_exchange, Misbehaviour};

/// How many commands are remembered.
const COMMANDS_KEPT: usize = 1000;

/// How long time goes on at most when the client is gone and something is on.
const LONGEST_REST: Duration = Duration::from_secs(60);

impl Machine {
    /// The I2C bus, as its port uses it.
    pub(crate) fn i2c(&mut self) -> &mut I2cBus {
        &mut self.i2c
    }

    /// Remembers a command that came in.
    pub(crate) fn note_command(&mut self, command: CommandId) {
        if is_exchange(command) {
            return;
        }
        if self.commands.len() == COMMANDS_KEPT {
            self.commands.pop_front();
        }
        self.commands.push_back(command);
    }

    /// Remembers something that a correct client does not do.
    pub(crate) fn note_oddity(&mut self, oddity: &Oddity) {
        self.oddities.note(oddity);
    }

    /// An exchange with these extensions came in, with an output on or not.
    pub(crate) fn note_mask(&mut self, mask: u16, drives: impl FnOnce() -> bool) {
        self.oddities.check_mask(mask, drives);
    }

    /// A response says which extensions can be reached.
    pub(crate) fn note_offer(&mut self) {
        self.oddities.offer(self.alive_mask());
    }

    /// The client may ignore the latest exchange response.
    pub(crate) fn doubt_offer(&mut self) {
        self.oddities.doubt_offer();
    }

    /// Counts an answered exchange.
    pub(crate) fn note_exchange(&mut self) {
        self.exchanges += 1;
    }

    /// What happens to the response that is sent now.
    pub(crate) fn take_disturbances(&mut self) -> Vec<FaultKind> {
        std::mem::take(&mut self.disturbances)
    }

    /// A client has connected.
    pub(crate) fn client_came(&mut self) {
        self.connections += 1;
        self.oddities.client_came(self.connections);
        self.connected = true;
    }

    /// Sets after which time without an exchange the board clears its outputs.
    pub(crate) fn set_watchdog(&mut self, limit: Option<Duration>) {
        let micros = |limit: Duration| u64::try_from(limit.as_micros()).unwrap_or(u64::MAX);
        self.watchdog.limit = limit.map(micros);
    }

    /// How long it is by the clock until the watchdog clears the outputs, if it does.
    pub(crate) fn watchdog_limit(&self) -> Option<Duration> {
        let left = self.watchdog.left().filter(|_| self.clock.is_running())?;
        Some(Duration::from_micros(left))
    }

    /// The client is gone, with or without StopOnline.
    pub(crate) fn client_left(&mut self) {
        self.connected = false;
        self.stop_online();
    }

    /// Does what the firmware does, and refuses what it refuses, from now on.
    pub(crate) fn be_strict(&mut self) {
        self.strict = true;
    }

    /// Something ends the program of a real TXT. If it is strict, it does here, too.
    pub(crate) fn end_program(&mut self, why: &Oddity) -> Result<(), Misbehaviour> {
        if self.strict {
            return Err(Misbehaviour::EndsProgram(why.to_string()));
        }
        self.note_oddity(why);
        Ok(())
    }

    /// The program of the controller has ended.
    pub(crate) fn program_ended(&mut self) {
        self.stop_online();
        self.camera.forget();
        self.i2c.session.end();
    }

    /// Whether a command in pieces ends the connection. Otherwise it is odd.
    pub(crate) fn piece_came(&mut self) -> Result<(), Misbehaviour> {
        if self.strict {
            return Err(Misbehaviour::InPieces);
        }
        self.note_oddity(&Oddity::InPieces);
        Ok(())
    }

    /// The I2C server of the present session.
    pub(crate) fn i2c_session(&self) -> I2cSession {
        self.i2c.session
    }

    /// An I2C client has connected.
    pub(crate) fn i2c_client_came(&mut self) {
        if !self.i2c.client_came() && self.clock.is_system() {
            self.note_oddity(&Oddity::I2cUnexpected);
        }
    }

    /// Whether StartOnline would end the program of a real TXT.
    pub(crate) fn check_start(&mut self) -> Result<(), Misbehaviour> {
        if self.i2c.session.is_busy() && (self.strict || self.clock.is_system()) {
            self.end_program(&Oddity::StartedTooSoon)?;
        }
        Ok(())
    }

    /// Begins online mode: the next exchange clears the outputs of the session before, and the next configuration is
    /// taken over.
    pub(crate) fn start_online(&mut self) {
        self.online = false;
        self.oddities.begin_session();
        self.camera.forget();
        for controller in &mut self.controllers {
            controller.begin_session();
        }
        self.stand_still();
        self.found = self.strict.then(|| self.reached_mask());
        self.i2c.session.begin();
        self.online = true;
        self.sessions += 1;
        self.clock.begin();
    }

    /// Ends online mode. The board gets nothing, so it keeps its outputs; the camera is off.
    pub(crate) fn stop_online(&mut self) {
        self.online = false;
        self.oddities.begin_session();
        self.camera.stop();
        if !self.clock.is_system() {
            // Only exchanges let time pass, and there are no more. The watchdog's time passes at once.
            self.move_on(self.watchdog.left().unwrap_or(0));
        } else if self.controllers.iter().any(Controller::is_active) {
            self.clock.go_on(LONGEST_REST);
            return;
        }
        if !self.controllers.iter().any(Controller::is_active) {
            self.stand_still();
        }
    }

    /// Stops everything that still moves. Time stands still.
    fn stand_still(&mut self) {
        self.clock.end();
        if let Some(world) = &mut self.world {
            world.halt();
        }
    }

    /// Starts the camera, in place of an earlier start.
    pub(crate) fn start_camera(&mut self, settings: StartCameraOnline) {
        let odd = match self.camera.run() {
            Some(_) => Some(Oddity::CameraStartedTwice),
            None => self.camera.is_left_open().then_some(Oddity::CameraLeftOpen),
        };
        if let Some(odd) = odd {
            // The firmware answers this before it ends.
            self.end = self.end_program(&odd).err();
        }
        self.camera.start(settings, self.now());
    }

    /// What ends the program after the answer.
    pub(crate) fn take_end(&mut self) -> Option<Misbehaviour> {
        self.end.take()
    }

    /// Whether the camera serves. Until then, how long that takes at most without a change.
    pub(crate) fn camera_serves(&self, start_up: Duration) -> Result<(), Duration> {
        let run = self.camera.run().ok_or(Duration::MAX)?;
        if self.strict && self.camera.had_client() {
            return Err(Duration::MAX);
        }
        self.time_until(run.since.saturating_add(start_up)).map_or(Ok(()), Err)
    }

    /// How long the camera waits for a client, if it is strict.
    pub(crate) fn camera_client_limit(&self) -> Option<Duration> {
        let run = self.camera.run().filter(|_| self.strict)?;
        let waits_until = run.since.saturating_add(PATIENCE);
        Some(waits_until.saturating_sub(self.now()))
    }

    /// The camera has got its client, or waits for none any more.
    pub(crate) fn note_camera_client(&mut self) {
        self.camera.note_client();
    }

    /// How long the camera waits for an acknowledgement, if it is strict. Then it has to come in one segment.
    pub(crate) fn acknowledgement_limit(&self) -> Option<Duration> {
        self.strict.then_some(PATIENCE)
    }

    /// The camera was stopped while its client was connected.
    pub(crate) fn note_camera_left_open(&mut self) {
        self.camera.leave_open();
    }

    /// Stops the camera, if it was started.
    pub(crate) fn stop_camera(&mut self) {
        self.camera.stop_by_command();
    }

    /// The present start of the camera.
    pub(crate) fn camera_run(&self) -> Option<CameraRun> {
        self.camera.run()
    }

    /// Counts a camera frame.
    pub(crate) fn note_camera_frame(&mut self) {
        self.camera.frames += 1;
    }

    /// Counts an acknowledgement of a camera frame.
    pub(crate) fn note_camera_acknowledgement(&mut self) {
        self.camera.acknowledgements += 1;
    }

    /// Takes over a configuration, unless its id is the last one or the controller does not exist. Only the low byte of
    /// the id counts.
    pub(crate) fn configure(&mut self, index: i16, config_id: i16, config: Config) {
        let Ok(index) = usize::try_from(index) else { return };
        self.oddities.configured(index);
        let controller = self.controllers.get_mut(index);
        if let Some(controller) =
            controller.filter(|known| known.config_id as u8 != config_id as u8)
        {
            controller.config_id = config_id;
            controller.config = config;
        }
    }

    /// Gives outputs to the controller with this index (0 the master), if it can be reached.
    pub(crate) fn take_over(&mut self, index: usize, outputs: ExchangeData) {
        self.watchdog.passed = 0;
        self.clock.begin_if_still();
        let config = self.controllers.get(index).map(|controller| &controller.config);
        let has_motor = |motor| {
            let encoder = self.world.as_ref().map(|world| world.encoder(index, motor));
            encoder.is_some_and(|encoder| encoder != Encoder::NoMotor)
        };
        self.oddities.check_outputs(index, &outputs, config, has_motor);
        if self.reaches(index) {
            journal::log_changes(index, &self.controllers[index].outputs, &outputs);
        }
        self.set_outputs(index, outputs);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_configuration_is_taken_once_per_id() {
        let mut machine = Machine::new(0);
        let [first, second] = [2, 3].map(|mode| {
            let mut config = Config::default();
            config.uni[0].mode = mode;
            config
        });
        machine.configure(0, 1, first);
        machine.configure(0, 1, second);
        machine.configure(0, 257, second);
        machine.configure(1, 2, second);
        machine.configure(-1, 2, second);
        assert_eq!(machine.controllers[0].config, first);
        machine.start_online();
        machine.configure(0, 0, second);
        machine.configure(0, 256, second);
        assert_eq!(machine.controllers[0].config, first);
        machine.configure(0, 1, second);
        assert_eq!(machine.controllers[0].config, second);
    }

    #[test]
    fn the_newest_thousand_commands_are_kept() {
        let mut machine = Machine::new(0);
        machine.note_command(CommandId::QueryStatus);
        for _ in 0..1000 {
            machine.note_command(CommandId::ExchangeData);
            machine.note_command(CommandId::UpdateConfig);
        }
        assert_eq!(machine.commands().count(), 1000);
        assert!(machine.commands().all(|command| command == CommandId::UpdateConfig));
    }
}
