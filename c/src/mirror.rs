//! Between a program's areas and the handler's: outputs of the program to the controller, inputs of the
//! controller to the program.

mod commands;
mod marks;

use std::hint;
use std::sync::Arc;
use std::time::Instant;

use ft_transfer_area::transfer_area::{
    Change, Config, CounterMode, FishX1Transfer, InputMode, InputValues, OutputValues, PerCounter,
    PerInput, PerMotor, Timer, UniConfig,
};
use ft_transfer_area::FirmwareVersion;

use crate::memory::{Area, AreaArray, Places, AREAS};
use crate::report;
use crate::supply::Supply;
use commands::{ContinuedId, MotorCommand};
use marks::Marks;

/// The program runs on the controller, as far as it knows.
pub(crate) const DEV_MODE_LOCAL: u8 = 0;
/// The program runs on a PC.
pub(crate) const DEV_MODE_ONLINE: u8 = 1;

/// The version of the area, as programs of the TX compare it.
const TA_VERSION: u32 = 0x0801_0101;

/// What a program may want to be called for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum AreaEvent {
    /// A counter has been reset.
    CounterReset { area: usize, counter: usize },
    /// A motor has done its command: its distance, or the stop of one that was not done.
    MotorReached { area: usize, motor: usize },
    /// An extension has come or gone.
    Extension { area: usize, online: bool },
    /// Inputs have other values than the program's area had.
    Inputs { area: usize, change: Change },
}

/// Keeps a program's areas in step with a handler's.
///
/// Nothing but what a program may not write is written: inputs, flags that become 1, timers, changes, status
/// and information about the controllers.
pub(crate) struct Mirror<A: Area> {
    array: Arc<AreaArray<A>>,
    /// One of `DEV_MODE_…`.
    dev_mode: u8,
    known: [Known; AREAS],
    /// For a program on a TXT itself, as far as it knows. Its areas have only values of the inputs and timers:
    /// neither names, marks of what has changed, nor the microphone.
    supply: Option<Supply>,
    begun: Instant,
}

/// What is known of one area.
#[derive(Clone, Copy, Default)]
struct Known {
    /// The program's id when the configuration was sent last.
    config_id: Option<u8>,
    counters: [ContinuedId; 4],
    motors: [MotorCommand; 4],
    sound: ContinuedId,
    marks: Marks,
    online: bool,
}

impl<A: Area> Mirror<A> {
    /// For a program that runs where `dev_mode` says, one of `DEV_MODE_…`.
    pub(crate) fn new(array: Arc<AreaArray<A>>, dev_mode: u8) -> Self {
        let known = [Known::default(); AREAS];
        Self { array, dev_mode, known, supply: None, begun: Instant::now() }
    }

    /// For a program that runs on a TXT itself, as far as it knows.
    pub(crate) fn on_txt(array: Arc<AreaArray<A>>) -> Self {
        let supply = Some(Supply::of_environment());
        Self { supply, ..Self::new(array, DEV_MODE_LOCAL) }
    }

    /// Whether the program runs on a TXT itself, as far as it knows.
    pub(crate) fn is_on_txt(&self) -> bool {
        self.supply.is_some()
    }

    /// For the same areas and a handler that has not sent their configuration.
    pub(crate) fn for_other_handler(&self) -> Self {
        let known = self.known.map(|known| Known { config_id: None, ..known });
        Self { array: Arc::clone(&self.array), known, ..*self }
    }

    /// The areas were made 0.
    pub(crate) fn forget(&mut self) {
        (self.known, self.begun) = ([Known::default(); AREAS], Instant::now());
    }

    /// The areas were made 0 during a transfer. As with the library on a TXT, the controller keeps the configuration,
    /// and 0 ends the commands.
    pub(crate) fn renew(&mut self) {
        self.begun = Instant::now();
        for known in &mut self.known {
            known.config_id = Some(0);
            known.counters.iter_mut().for_each(ContinuedId::renew);
            known.motors.iter_mut().for_each(MotorCommand::renew);
            known.sound.renew();
        }
    }

    /// Takes the configurations into the areas that go out, also those whose id is not new.
    pub(crate) fn put_out_configs(&mut self, areas: &mut [FishX1Transfer]) {
        for (index, area) in areas.iter_mut().enumerate().take(AREAS) {
            let places = self.array.places(index);
            // The id first: the program raises it when the configuration is written.
            self.known[index].config_id = Some(self.array.load(places.config_id));
            area.config = sent::<A>(self.array.load(places.config), self.is_on_txt(), index);
            area.raise_config_id();
        }
    }

    /// Writes what stays as it is while a controller is online: its name, its firmware, and where the program
    /// runs.
    pub(crate) fn introduce(&self, name: &str, firmware: FirmwareVersion) {
        if self.is_on_txt() {
            return;
        }
        for index in 0..AREAS {
            let places = self.array.places(index);
            let mut info = self.array.load(places.info);
            // part.a to part.d of `FT_VERSION.firmware`.
            info.version.firmware = u32::from_ne_bytes(ta_firmware(firmware));
            info.version.shm_if = TA_VERSION;
            if index == 0 {
                info.hostname.fill(0);
                let length = info.hostname.len() - 1;
                info.hostname[..length]
                    .iter_mut()
                    .zip(name.bytes())
                    .for_each(|(to, from)| *to = from);
            }
            info.btaddr = *b"00:00:00:00:00:00\0";
            self.array.store(places.info, info);
            self.array.store(places.dev_mode, self.dev_mode);
            self.array.store(places.id, index as u8);
        }
    }

    /// A transfer has begun, and these are the areas with the first response.
    pub(crate) fn begin(&mut self, areas: &[FishX1Transfer]) {
        for (known, area) in self.known.iter_mut().zip(areas) {
            let FishX1Transfer { input, output, txt_inputs, txt_outputs, .. } = area;
            for i in 0..4 {
                let (given, echo) = (output.cnt_reset_cmd_id[i], input.cnt_reset_cmd_id[i]);
                known.counters[i].begin(given, echo);
                let (given, echo) = (output.motor_ex_cmd_id[i], input.motor_ex_cmd_id[i]);
                known.motors[i].begin(given, echo);
            }
            known.sound.begin(txt_outputs.sound_cmd_id, txt_inputs.sound_cmd_id);
        }
    }

    /// All outputs were off for a while. These are the areas as they are now.
    pub(crate) fn go_on(&mut self, areas: &[FishX1Transfer]) {
        for (known, FishX1Transfer { input, output, .. }) in self.known.iter_mut().zip(areas) {
            for (i, motor) in known.motors.iter_mut().enumerate() {
                let (stop, echo) = (output.motor_ex_cmd_id[i], input.motor_ex_cmd_id[i]);
                motor.go_on(stop, echo, input.counter[i]);
            }
        }
    }

    /// Writes the inputs of a response into the program's areas, and reports what has happened.
    pub(crate) fn take_in(
        &mut self,
        areas: &[FishX1Transfer],
        mut reported: impl FnMut(AreaEvent),
    ) {
        self.count_time();
        self.take_in_extensions(areas, &mut reported);
        for (index, area) in areas.iter().enumerate().take(AREAS) {
            self.take_in_area(index, area, &mut reported);
        }
    }

    /// Lets the timers go on.
    pub(crate) fn count_time(&self) {
        let mut timer = Timer::default();
        timer.set_elapsed(self.begun.elapsed());
        for index in 0..AREAS {
            self.array.store(self.array.places(index).timer, timer);
        }
    }

    fn take_in_extensions(
        &mut self,
        areas: &[FishX1Transfer],
        reported: &mut impl FnMut(AreaEvent),
    ) {
        let Some(master) = areas.first() else { return };
        let alive = master.state.io_slave_alive;
        self.array.store(self.array.places(0).extensions, alive);
        for (index, (known, alive)) in self.known.iter_mut().skip(1).zip(alive).enumerate() {
            let online = alive != 0;
            if known.online != online {
                known.online = online;
                reported(AreaEvent::Extension { area: index + 1, online });
            }
        }
    }

    fn take_in_area(
        &mut self,
        index: usize,
        area: &FishX1Transfer,
        reported: &mut impl FnMut(AreaEvent),
    ) {
        let (array, places, known) =
            (&self.array, self.array.places(index), &mut self.known[index]);
        let mut input = area.input;
        if self.dev_mode == DEV_MODE_ONLINE && known.config_id != Some(array.load(places.config_id))
        {
            keep_configured(array, places, &area.config, &mut input.uni);
        }
        let newest = array.load(places.output);
        let mut done = Done::default();
        for i in 0..4 {
            (input.cnt_reset_cmd_id[i], done.resets[i]) =
                known.counters[i].receive(input.cnt_reset_cmd_id[i], newest.cnt_reset_cmd_id[i]);
            let (motor, echo, newest) =
                (&mut known.motors[i], input.motor_ex_cmd_id[i], newest.motor_ex_cmd_id[i]);
            (input.motor_ex_cmd_id[i], done.distances[i]) = match self.supply {
                Some(_) => motor.receive_on_txt(echo, newest),
                None => motor.id.receive(echo, newest),
            };
            // A program with ftMscLib is called for a distance that it has stopped, too.
            let tells_stops = A::REACHED_IS_A_DISTANCE && self.dev_mode == DEV_MODE_ONLINE;
            done.stops[i] = done.distances[i] && tells_stops && known.motors[i].is_stop();
            done.distances[i] &= !A::REACHED_IS_A_DISTANCE || known.motors[i].has_distance();
        }
        let mut txt_inputs = area.txt_inputs;
        let id = txt_inputs.sound_cmd_id;
        txt_inputs.sound_cmd_id = known.sound.receive(id, id).0;

        let fields = InputFields::of(places.input);
        let change = marks::change(&array.load(places.input), &input);
        fields.store_values(array, &input);
        match self.supply {
            // An extension has none of its own.
            Some(supply) if index == 0 => supply.fill(&mut txt_inputs),
            Some(_) => {}
            None => {
                let marks = match self.dev_mode {
                    DEV_MODE_ONLINE => known.marks.at(Instant::now(), &change),
                    _ => change,
                };
                array.store(places.change, marks);
                array.store(places.txt_inputs2, area.txt_inputs2);
            }
        }
        array.store(places.txt_inputs, txt_inputs);

        // A program that sees a flag also sees the values, and one that sees an id also sees the flag: otherwise it
        // could set a flag back before it is set.
        for i in (0..4).filter(|i| done.resets[*i]) {
            fields.set_flag(array, fields.cnt_resetted, i);
        }
        for i in (0..4).filter(|i| done.distances[*i]) {
            fields.set_flag(array, fields.motor_ex_reached, i);
        }
        fields.store_ids(array, &input);
        for i in 0..4 {
            if done.resets[i] {
                reported(AreaEvent::CounterReset { area: index, counter: i });
            }
            if done.distances[i] || done.stops[i] {
                reported(AreaEvent::MotorReached { area: index, motor: i });
            }
        }
        if change.change_status != 0 {
            reported(AreaEvent::Inputs { area: index, change });
        }
    }

    /// Takes the program's outputs and new configurations into the areas that go out.
    pub(crate) fn put_out(&mut self, areas: &mut [FishX1Transfer]) {
        self.put_out_read(areas, |array, output| settled(|| array.load(output)));
    }

    /// The same at a moment when the program does not run, so nothing has to settle.
    pub(crate) fn put_out_whole(&mut self, areas: &mut [FishX1Transfer]) {
        self.put_out_read(areas, AreaArray::load);
    }

    fn put_out_read(
        &mut self,
        areas: &mut [FishX1Transfer],
        read: impl Fn(&AreaArray<A>, *mut OutputValues) -> OutputValues,
    ) {
        for (index, area) in areas.iter_mut().enumerate().take(AREAS) {
            let (array, places, known) =
                (&self.array, self.array.places(index), &mut self.known[index]);
            // The id first: the program raises it when the configuration is written.
            let config_id = array.load(places.config_id);
            if known.config_id != Some(config_id) {
                known.config_id = Some(config_id);
                area.config = sent::<A>(array.load(places.config), self.supply.is_some(), index);
                area.raise_config_id();
            }
            let output = read(array, places.output);
            area.output.duty = output.duty;
            area.output.master = output.master;
            for i in 0..4 {
                let (counter, motor) = (&mut known.counters[i], &mut known.motors[i]);
                let to = &mut area.output;
                let id = counter.send(output.cnt_reset_cmd_id[i]);
                to.cnt_reset_cmd_id[i] = id.unwrap_or(to.cnt_reset_cmd_id[i]);
                let (master, distance) = (output.master[i], output.distance[i]);
                let is_off = output.duty[2 * i..][..2] == [0, 0];
                let (id, distance) =
                    motor.send(output.motor_ex_cmd_id[i], master, distance, is_off);
                to.motor_ex_cmd_id[i] = id.unwrap_or(to.motor_ex_cmd_id[i]);
                to.distance[i] = distance;
                if motor.is_still() {
                    to.duty[2 * i..][..2].fill(0);
                }
            }
            let mut txt_outputs = array.load(places.txt_outputs);
            let sound = known.sound.send(txt_outputs.sound_cmd_id);
            txt_outputs.sound_cmd_id = sound.unwrap_or(area.txt_outputs.sound_cmd_id);
            area.txt_outputs = txt_outputs;
        }
    }

    /// Says in each area how the transfer stands: `TA_STATUS_STOP`, `TA_STATUS_RUN` or `TA_STATUS_SYNC`.
    pub(crate) fn set_status(&self, status: u8) {
        if self.is_on_txt() {
            return;
        }
        for index in 0..AREAS {
            // SAFETY: computes an address within the area only.
            let at = unsafe { &raw mut (*self.array.places(index).status).status };
            self.array.store(at, status);
        }
    }
}

/// Which commands of an area are done with a response.
#[derive(Default)]
struct Done {
    /// Of counters.
    resets: [bool; 4],
    /// Of motors.
    distances: [bool; 4],
    /// Of motors whose distance was not done.
    stops: [bool; 4],
}

/// The fields of the inputs, which do not all belong to the controller: programs of the TX set flags back,
/// and the display's buttons are not the TXT's.
struct InputFields {
    uni: *mut PerInput<i16>,
    cnt_in: *mut PerCounter<i16>,
    counter: *mut PerCounter<i16>,
    /// The first of four.
    cnt_resetted: *mut u16,
    /// The first of four.
    motor_ex_reached: *mut u16,
    cnt_reset_cmd_id: *mut PerCounter<u16>,
    motor_ex_cmd_id: *mut PerMotor<u16>,
}

impl InputFields {
    fn of(input: *mut InputValues) -> Self {
        // SAFETY: computes addresses within the inputs only.
        unsafe {
            Self {
                uni: &raw mut (*input).uni,
                cnt_in: &raw mut (*input).cnt_in,
                counter: &raw mut (*input).counter,
                cnt_resetted: (&raw mut (*input).cnt_resetted).cast(),
                motor_ex_reached: (&raw mut (*input).motor_ex_reached).cast(),
                cnt_reset_cmd_id: &raw mut (*input).cnt_reset_cmd_id,
                motor_ex_cmd_id: &raw mut (*input).motor_ex_cmd_id,
            }
        }
    }

    /// Writes all but the flags and the ids.
    fn store_values<A: Area>(&self, array: &AreaArray<A>, input: &InputValues) {
        array.store(self.uni, input.uni);
        array.store(self.cnt_in, input.cnt_in);
        array.store(self.counter, input.counter);
    }

    /// Writes which commands are done.
    fn store_ids<A: Area>(&self, array: &AreaArray<A>, input: &InputValues) {
        array.store(self.cnt_reset_cmd_id, input.cnt_reset_cmd_id);
        array.store(self.motor_ex_cmd_id, input.motor_ex_cmd_id);
    }

    /// Sets one of four flags. Only the program sets it back.
    fn set_flag<A: Area>(&self, array: &AreaArray<A>, flags: *mut u16, index: usize) {
        array.store(flags.wrapping_add(index), 1);
    }
}

/// Keeps the program's values of inputs whose configuration is still to be sent: what a response has measured there is
/// of another kind. `ftMscLib` sets them 0.
fn keep_configured<A: Area>(
    array: &AreaArray<A>,
    places: Places,
    sent: &Config,
    values: &mut PerInput<i16>,
) {
    let (config, before) = (array.load(places.config), array.load(places.input));
    for (i, value) in values.iter_mut().enumerate() {
        if config.uni[i] != sent.uni[i] {
            *value = before.uni[i];
        }
    }
}

/// A program's configuration of this area as a TXT in online mode understands it.
fn sent<A: Area>(mut config: Config, is_on_txt: bool, area: usize) -> Config {
    if A::COUNTERS_NORMAL_AT_0 {
        for counter in &mut config.cnt {
            counter.mode = u8::from(counter.mode == 0);
        }
    }
    if is_on_txt {
        let inputs = config.uni.iter_mut().enumerate();
        inputs.for_each(|(index, input)| *input = on_txt(area, index, *input));
        // There is no other.
        config.cnt.iter_mut().for_each(|counter| counter.mode = CounterMode::Normal as u8);
    }
    config
}

/// The number of `ROBOLIB.DLL`, which the TX's newest firmware, 1.30, has and a TXT has not. Programs compare it before
/// the firmware's own number.
pub(crate) const ROBOLIB_DLL: u8 = 6;

/// The firmware as programs of the TX read it: 0, the DLL's number and the firmware's, 00 06 04 06 for 4.6.6.
pub(crate) fn ta_firmware(firmware: FirmwareVersion) -> [u8; 4] {
    let [major, minor, ..] = firmware.code().to_be_bytes();
    [0, ROBOLIB_DLL, major, minor]
}

/// The configuration of an input of this area as the library on a TXT itself understands it: it does not know all modes,
/// and a distance is never digital.
fn on_txt(area: usize, index: usize, input: UniConfig) -> UniConfig {
    match input.input_mode() {
        Some(InputMode::Voltage | InputMode::Resistance) => input,
        Some(InputMode::Ultrasonic) => UniConfig::analog(InputMode::Ultrasonic),
        _ => {
            let (number, mode) = (index + 1, input.mode);
            let of = if area == 0 { String::new() } else { format!(" of extension {area}") };
            report::warning(format_args!(
                "I{number}{of} measures a voltage, because a program on a TXT can't use the mode {mode}"
            ));
            UniConfig::analog(InputMode::Voltage)
        }
    }
}

/// The outputs as they are while the program does not write them. A program without a lock sets a motor's
/// fields one after another, within nanoseconds; one that never stops writing is not waited for.
pub(crate) fn settled(read: impl Fn() -> OutputValues) -> OutputValues {
    const LOOKS: usize = 4;
    let mut seen = read();
    for _ in 0..LOOKS {
        (0..50).for_each(|_| hint::spin_loop());
        let now = read();
        if now == seen {
            break;
        }
        seen = now;
    }
    seen
}

#[cfg(test)]
mod tests;
