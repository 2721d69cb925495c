//! The exchange of a program's transfer areas with a machine, without a connection.

use std::time::Duration;

use ft_transfer_area::wire::{CmprHeader, Compressor, ExchangeData};
use ft_transfer_area::{Exchange, FirmwareVersion, FishX1Transfer, TransferMode};

use super::controller::Controller;
use super::{words, Machine};

impl Machine {
    /// Gives the controller with this index (0 the master) the values of a transfer area: the
    /// configuration, if its id differs from the last one, and the outputs. If the controller does
    /// not exist or is cut off, nothing happens.
    pub fn set_area(&mut self, controller: usize, area: &FishX1Transfer) {
        if !self.reaches(controller) {
            return;
        }
        let config_id = i16::from(area.state.config_id);
        if self.controllers[controller].config_id as u8 != area.state.config_id {
            self.controllers[controller].config_id = config_id;
            self.set_config(controller, area.config);
        }
        if let Some(outputs) = outputs(area) {
            self.set_outputs(controller, outputs);
        }
    }

    /// Writes what the controller with this index (0 the master) reports into a transfer area: inputs,
    /// commands that are done, the timers in machine time, and in the master's area which extensions
    /// are alive. If the controller does not exist or is cut off, nothing is written.
    pub fn report_into(&self, controller: usize, area: &mut FishX1Transfer) {
        if !self.reaches(controller) {
            return;
        }
        apply(&self.controllers[controller], area);
        area.timer.set_elapsed(self.time());
        if controller == 0 {
            for (extension, is_alive) in area.state.io_slave_alive.iter_mut().enumerate() {
                *is_alive = u8::from(self.alive_mask() & 1 << extension != 0);
            }
        }
    }

    /// The transfer area of the controller with this index (0 the master) as its client has it: the configuration
    /// and the outputs that it has sent, and what [`report_into`](Self::report_into) writes. The default one if
    /// the controller does not exist.
    pub fn area(&self, controller: usize) -> FishX1Transfer {
        let mut area = FishX1Transfer::default();
        let Some(known) = self.controllers.get(controller) else { return area };
        area.config = known.config;
        let ExchangeData {
            duty,
            master,
            distance,
            motor_command_id,
            counter_reset_id,
            sound_command_id,
            sound_index,
            sound_repeat,
        } = known.outputs;
        *area.output.duty = duty;
        *area.output.master = master.map(|motor| u8::try_from(motor).unwrap_or_default());
        *area.output.distance = distance;
        *area.output.motor_ex_cmd_id = motor_command_id;
        *area.output.cnt_reset_cmd_id = counter_reset_id;
        area.txt_outputs.sound_cmd_id = sound_command_id;
        area.txt_outputs.sound_index = sound_index;
        area.txt_outputs.sound_repeat = sound_repeat;
        self.report_into(controller, &mut area);
        area
    }

    /// Does what an exchange does, without a connection: takes the outputs of all areas, lets time
    /// pass, and writes the inputs into the areas. The first area is the master's. So a test of a
    /// control function needs no simulated TXT and no handler, and has the same result in every run.
    ///
    /// ```
    /// use std::time::Duration;
    ///
    /// use ft_transfer_area_simulator::world::World;
    /// use ft_transfer_area_simulator::Machine;
    /// use ft_transfer_area::prelude::*;
    ///
    /// /// Drives the slide to its end.
    /// fn control(area: &mut FishX1Transfer) {
    ///     let is_at_end = area.input.uni[I2] != 0;
    ///     area.output.duty[O1] = if is_at_end { 0 } else { 512 }; // M1
    /// }
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// let mut machine = Machine::with_world(0, World::shipped("slide")?)?;
    /// let mut areas = [FishX1Transfer::default()];
    /// machine.report_into(0, &mut areas[0]); // what the sensors measure at first
    /// while areas[0].input.uni[I2] == 0 {
    ///     control(&mut areas[0]);
    ///     machine.exchange(&mut areas, Duration::from_millis(10));
    /// }
    /// assert_eq!(areas[0].timer.timer_1s, 2);
    /// # Ok(())
    /// # }
    /// ```
    pub fn exchange(&mut self, areas: &mut [FishX1Transfer], step: Duration) {
        for (controller, area) in areas.iter().enumerate() {
            self.set_area(controller, area);
        }
        self.step(step);
        for (controller, area) in areas.iter_mut().enumerate() {
            self.report_into(controller, area);
        }
    }
}

/// Newer than any, so its responses have all words.
const FIRMWARE: FirmwareVersion = FirmwareVersion::from_code(u32::MAX);

/// The client's side of an exchange with the master alone.
fn exchange(mode: TransferMode) -> Exchange {
    Exchange::new(mode, FIRMWARE)
}

/// The outputs of an area as a client sends them.
fn outputs(area: &FishX1Transfer) -> Option<ExchangeData> {
    let mut request = Vec::new();
    exchange(TransferMode::Simple).request(std::slice::from_ref(area), &mut request).ok()?;
    ExchangeData::parse(&request).ok()
}

/// Writes a controller's response into an area as a client does.
fn apply(controller: &Controller, area: &mut FishX1Transfer) {
    let (mut words, mut data, mut response) = (Vec::new(), Vec::new(), Vec::new());
    words::push_report(controller, FIRMWARE.response_words(), &mut words);
    let crc = Compressor::new().compress(&words, &mut data);
    // At most 18 bits for each word.
    let extra_size = data.len() as u32;
    CmprHeader { extra_size, crc, active_extensions: 0 }.emit_response(&mut response);
    response.extend(data);
    let mut exchange = exchange(TransferMode::Compressed);
    if let Ok(inputs) = exchange.receive(&response) {
        // This response knows of no extensions.
        let alive = area.state.io_slave_alive;
        inputs.apply(std::slice::from_mut(area));
        area.state.io_slave_alive = alive;
    }
}
