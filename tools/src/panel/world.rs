//! The simulated TXT, and the world that is plugged into it.

use std::net::SocketAddr;
use std::sync::Arc;

use ft_transfer_area::transfer_area::InputMode;
use ft_transfer_area::tx::{Input, Motor, Output};
use ft_transfer_area::FishX1Transfer;
use ft_transfer_area_simulator::world::{Board, Remote, Sensor, SensorValue, World, WorldState};
use ft_transfer_area_simulator::{Machine, SimulatedTxt};
use serde::Serialize;

use super::course::Course;
use super::floor::{self, FloorReport};
use super::problem::Problem;
use super::request::{RemoteRequest, WorldRequest};
use crate::values::RemoteValue;
use crate::web;

/// A simulated TXT that the panel shows.
pub(crate) struct Simulated {
    /// All controllers of its world, with their names, and which of them it is.
    txts: Arc<Vec<(String, SimulatedTxt)>>,
    index: usize,
    /// What people call it.
    label: Option<String>,
    /// As it was at the start: how long the slides are. That of a lesson is the course's.
    world: Option<World>,
    /// The lesson of its pupil.
    course: Option<Arc<dyn Course>>,
}

#[derive(Serialize)]
pub(super) struct WorldReport {
    boards: Vec<BoardReport>,
    remotes: Vec<RemoteValue>,
    floor: Option<FloorReport>,
}

#[derive(Serialize)]
struct BoardReport {
    alive: bool,
    inputs: Vec<SensorReport>,
    motors: Vec<MotorReport>,
    lamps: Vec<LampReport>,
}

#[derive(Serialize)]
struct SensorReport {
    input: usize,
    kind: &'static str,
    value: f64,
    min: f64,
    max: f64,
    unit: &'static str,
    moved_by: Option<usize>,
    /// The place of workpieces that it sees.
    place: Option<String>,
}

#[derive(Serialize)]
struct MotorReport {
    motor: usize,
    /// Turns per second.
    speed: f64,
    /// From 0, the start, to 1, the end.
    slide: Option<f64>,
}

#[derive(Serialize)]
struct LampReport {
    output: usize,
    glow: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    colour: Option<&'static str>,
}

impl Simulated {
    pub(super) fn start(
        world: Option<World>,
        extensions: Option<usize>,
    ) -> Result<Self, ft_transfer_area_simulator::Error> {
        let mut builder = SimulatedTxt::builder();
        if let Some(extensions) = extensions {
            builder = builder.extensions(extensions);
        }
        if let Some(world) = &world {
            builder = builder.world(world.clone());
        }
        let txts = Arc::new(vec![(String::new(), builder.start()?)]);
        Ok(Self { txts, index: 0, label: None, world, course: None })
    }

    /// Simulated TXTs that run already, with the worlds that were plugged in at their start.
    pub(crate) fn all(
        txts: &Arc<Vec<(String, SimulatedTxt)>>,
        worlds: Vec<Option<World>>,
    ) -> Vec<Self> {
        let numbered = worlds.into_iter().enumerate();
        let label = |index: usize| Some(txts[index].0.clone()).filter(|name| !name.is_empty());
        numbered
            .map(|(index, world)| Self {
                txts: Arc::clone(txts),
                index,
                label: label(index),
                world,
                course: None,
            })
            .collect()
    }

    /// A simulated TXT of its own that runs already, with what people call it.
    pub(crate) fn alone(txt: SimulatedTxt, world: Option<World>, label: String) -> Self {
        let txts = Arc::new(vec![(String::new(), txt)]);
        Self { txts, index: 0, label: Some(label), world, course: None }
    }

    /// One that runs already, in a lesson.
    pub(crate) fn of_course(
        txts: Arc<Vec<(String, SimulatedTxt)>>,
        label: Option<String>,
        course: Arc<dyn Course>,
    ) -> Self {
        Self { txts, index: 0, label, world: None, course: Some(course) }
    }

    /// The lesson of its pupil.
    pub(super) fn course(&self) -> Option<Arc<dyn Course>> {
        self.course.clone()
    }

    fn txt(&self) -> &SimulatedTxt {
        &self.txts[self.index].1
    }

    /// Its name in a world with several controllers.
    fn name(&self) -> Option<&str> {
        Some(self.txts[self.index].0.as_str()).filter(|name| !name.is_empty())
    }

    /// What people call it.
    pub(super) fn label(&self) -> Option<&str> {
        self.label.as_deref()
    }

    pub(super) fn address(&self) -> String {
        let address = self.txt().address();
        SocketAddr::new(web::reachable(address.ip()), address.port()).to_string()
    }

    /// What its client sees and sends: whether one is online, how many exchanges there were, and the areas.
    pub(super) fn look(&self) -> (bool, u64, Vec<FishX1Transfer>) {
        self.txt().with_machine(|machine| {
            let areas = (0..machine.controllers.len()).map(|index| machine.area(index));
            (machine.online(), machine.exchanges(), areas.collect())
        })
    }

    /// How many extensions there are, plugged in or not.
    pub(super) fn extensions(&self) -> usize {
        self.txt().with_machine(|machine| machine.controllers.len() - 1)
    }

    pub(super) fn report(&self) -> Option<WorldReport> {
        let of_lesson = self.course.as_ref().and_then(|course| course.world());
        let world = of_lesson.as_deref().or(self.world.as_ref())?;
        self.txt().with_machine(|machine| report(machine, world, self.name()))
    }

    /// Configures the areas for what is plugged in, so that the first look shows it.
    pub(super) fn configure(&self, areas: &mut [FishX1Transfer]) {
        self.txt().with_machine(|machine| {
            let Some(world) = machine.world() else { return };
            for (index, area) in areas.iter_mut().enumerate() {
                configure(world, index, area);
            }
        });
    }

    /// Changes the world as the page asks for.
    pub(super) fn change(&self, area: usize, request: &WorldRequest) -> Result<(), Problem> {
        // The program would be told that it answers what nobody has pressed.
        let lets_go = matches!(request, WorldRequest::Press { pressed: false, .. });
        if !lets_go && self.course.as_ref().is_some_and(|course| course.is_checking()) {
            let text = "a check is running, and presses the buttons itself; end it first";
            return Err(Problem::new("checked", text));
        }
        self.txt().with_machine(|machine| match request {
            WorldRequest::Plug { alive } => plug(machine, area, *alive),
            WorldRequest::Press { input, pressed } => {
                press(world_of(machine)?, area, Input::try_from(*input)?, *pressed)
            }
            WorldRequest::Sensor { input, value } => {
                set(world_of(machine)?, area, Input::try_from(*input)?, *value)
            }
            WorldRequest::Remote(request) => set_remote(world_of(machine)?, request),
            WorldRequest::Put { piece, place } => floor::put(world_of(machine)?, piece, place),
            WorldRequest::TakeAway { place } => floor::take(world_of(machine)?, place),
        })
    }
}

fn configure(world: &WorldState, index: usize, area: &mut FishX1Transfer) {
    for input in Input::ALL {
        let sensor = world.sensor(index, input);
        // A light barrier is light or dark, like a button.
        let is_barrier = matches!(sensor, Some(Sensor::PhotoTransistor { .. }))
            && world.place_seen(index, input).is_some();
        let sensor = sensor.filter(|_| !is_barrier);
        let (mode, digital) = sensor.map_or((InputMode::Resistance, true), Sensor::input_mode);
        area.set_ft_uni_config(input, mode, digital);
    }
    for motor in Motor::ALL {
        let lamps = motor.outputs().iter().any(|output| world.lamp(index, *output).is_some());
        area.set_ft_motor_config(motor, !lamps);
    }
}

fn world_of(machine: &mut Machine) -> Result<&mut WorldState, Problem> {
    machine.world_mut().ok_or_else(|| Problem::new("no_world", "this simulated TXT has no world"))
}

fn plug(machine: &mut Machine, area: usize, alive: bool) -> Result<(), Problem> {
    let extensions = machine.controllers.len() - 1;
    let extension = area.checked_sub(1).filter(|extension| *extension < extensions);
    let place = extension.and_then(|extension| machine.alive.get_mut(extension));
    let text = || format!("there is no extension {area} to plug in");
    *place.ok_or_else(|| Problem::new("no_extension", text()))? = alive;
    Ok(())
}

fn press(world: &mut WorldState, area: usize, input: Input, pressed: bool) -> Result<(), Problem> {
    if world.press(area, input, pressed) {
        return Ok(());
    }
    Err(Problem::new("no_button", format!("nothing to press is plugged into {input}")))
}

fn set(world: &mut WorldState, area: usize, input: Input, value: f64) -> Result<(), Problem> {
    let Some(mut sensor) = world.sensor(area, input).cloned() else {
        return Err(Problem::new("no_sensor", format!("no sensor is plugged into {input}")));
    };
    let SensorValue { min, max, .. } = sensor.value();
    if !(min..=max).contains(&value) {
        let text = format!("the value of {input} is {value}, but has to be {min} to {max}");
        return Err(Problem::new("out_of_range", text));
    }
    sensor.set_value(value);
    world.set_sensor(area, input, Some(sensor));
    Ok(())
}

fn set_remote(world: &mut WorldState, request: &RemoteRequest) -> Result<(), Problem> {
    let Some(remote) = world.remotes().get(request.remote).copied() else {
        return Err(Problem::new("no_remote", format!("there is no remote {}", request.remote)));
    };
    // The switches say which remote it is, so they stay.
    world.set_remote(Remote {
        left_x: request.left_x,
        left_y: request.left_y,
        right_x: request.right_x,
        right_y: request.right_y,
        on: request.on,
        off: request.off,
        ..remote
    });
    Ok(())
}

fn report(machine: &Machine, world: &World, name: Option<&str>) -> Option<WorldReport> {
    let state = machine.world()?;
    let nothing = Board::default();
    let board = |controller: usize| match controller.checked_sub(1) {
        None => &world.master,
        Some(extension) => world.extensions.get(extension).unwrap_or(&nothing),
    };
    let alive = |controller: usize| match controller.checked_sub(1) {
        None => true,
        Some(extension) => machine.alive.get(extension).is_some_and(|alive| *alive),
    };
    let boards = (0..machine.controllers.len())
        .map(|index| board_report(state, index, board(index), alive(index)))
        .collect();
    let remotes = state.remotes().iter().map(RemoteValue::from).collect();
    Some(WorldReport { boards, remotes, floor: floor::report(machine, state, world, name) })
}

fn board_report(state: &WorldState, index: usize, board: &Board, alive: bool) -> BoardReport {
    let sensor = |input: Input| {
        let sensor = state.sensor(index, input)?;
        let SensorValue { value, min, max, unit, .. } = sensor.value();
        let moved_by = state.moved_by(index, input).map(Motor::index);
        Some(SensorReport {
            input: input.index(),
            kind: sensor.kind(),
            value,
            min,
            max,
            unit,
            moved_by,
            place: state.place_seen(index, input),
        })
    };
    let motor = |motor: Motor| {
        let speed = state.motor_speed(index, motor)?;
        let slide = board.motors.get(&motor).and_then(|model| model.slide.as_ref());
        let length = slide.map(|slide| slide.travel.length());
        let slide = length.and_then(|length| Some(state.slide(index, motor)? / length));
        Some(MotorReport { motor: motor.index(), speed, slide })
    };
    let lamp = |output: Output| {
        let glow = state.lamp(index, output)?;
        let colour = board.lamp_colours.get(&output).map(|colour| colour.name());
        Some(LampReport { output: output.index(), glow, colour })
    };
    BoardReport {
        alive,
        inputs: Input::ALL.into_iter().filter_map(sensor).collect(),
        motors: Motor::ALL.into_iter().filter_map(motor).collect(),
        lamps: Output::ALL.into_iter().filter_map(lamp).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn light_barriers_are_light_or_dark() {
        let world = World::shipped("sorting_line").unwrap();
        let simulated = Simulated::start(Some(world), None).unwrap();
        let mut areas = vec![FishX1Transfer::default()];
        simulated.configure(&mut areas);
        let is_digital = |input: Input| areas[0].config.uni[input.index()].is_digital();
        // The colour sensor between them has a voltage.
        assert_eq!([Input::I1, Input::I2, Input::I3].map(is_digital), [true, false, true]);
    }
}
