//! The drawing of a simulated machine: where its parts are now, in mm to the right and downwards. Parts that the world's
//! file does not place are only in the lists.

use std::collections::{HashMap, HashSet};

use ft_transfer_area::tx::{Motor, Output};
use ft_transfer_area_simulator::world::{
    Drawn, Grip, Gripper, MotorModel, Piece, Place, Plug, Point, Whereabouts, World, WorldState,
};
use ft_transfer_area_simulator::Machine;
use serde::Serialize;

/// The parts that move, apart from belts and what lies at places.
#[derive(Serialize)]
pub(super) struct Drawing {
    slides: Vec<SlideDrawing>,
    grippers: Vec<GripperDrawing>,
    ejectors: Vec<EjectorDrawing>,
    wheels: Vec<WheelDrawing>,
}

/// Where a line of the drawing begins and ends, and by how many degrees it turns.
#[derive(Serialize)]
pub(super) struct Line {
    from: Point,
    to: Point,
    turn: f64,
}

/// A piece, and what is in it if it is a container.
#[derive(Clone, Copy, Default, Serialize)]
pub(super) struct Lying {
    pub(super) piece: Option<&'static str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) content: Option<&'static str>,
}

/// A slide with a seat for a piece.
#[derive(Serialize)]
struct SlideDrawing {
    motor: String,
    line: Line,
    /// Where it is on its travel, 0 to 1.
    part: f64,
    #[serde(flatten)]
    lying: Lying,
}

#[derive(Serialize)]
struct GripperDrawing {
    /// The motors of the axes that are drawn.
    motors: Vec<String>,
    /// What its first axis moves along, if it does not turn.
    rail: Option<[Point; 2]>,
    /// From its rail, or what it turns around, to its end.
    arm: [Point; 2],
    /// Where the axes are that are not drawn, 0 to 1, such as the height of one that is seen from above.
    heights: Vec<HeightDrawing>,
    /// Whether it sucks, or its fork is out.
    on: bool,
    low: bool,
    #[serde(flatten)]
    lying: Lying,
}

#[derive(Serialize)]
struct HeightDrawing {
    motor: String,
    part: f64,
}

#[derive(Serialize)]
struct EjectorDrawing {
    valve: String,
    from: Point,
    to: Point,
    on: bool,
}

/// A motor that moves nothing.
#[derive(Serialize)]
struct WheelDrawing {
    motor: String,
    at: Point,
    speed: f64,
}

impl From<Drawn> for Line {
    fn from(drawn: Drawn) -> Self {
        Self { from: drawn.from, to: drawn.to, turn: drawn.turn }
    }
}

/// A world, what is in it now, and what names of its own begin with.
pub(super) struct Scene<'a> {
    pub(super) world: &'a World,
    pub(super) state: &'a WorldState,
    machine: &'a Machine,
    pub(super) prefix: &'a str,
    pub(super) pieces: &'a [(Piece, Whereabouts)],
    /// What is in a container, by the container's index in `pieces`.
    contents: HashMap<usize, Piece>,
    /// Where a gripper that is drawn reaches a place first, by the place's name.
    reached: HashMap<&'a str, Point>,
}

impl<'a> Scene<'a> {
    pub(super) fn new(
        world: &'a World,
        state: &'a WorldState,
        machine: &'a Machine,
        prefix: &'a str,
        pieces: &'a [(Piece, Whereabouts)],
    ) -> Self {
        let contents = pieces.iter().filter_map(|(piece, at)| match at {
            Whereabouts::Container(container) => Some((*container, *piece)),
            _ => None,
        });
        let contents = contents.collect();
        let reached = HashMap::new();
        let mut scene = Self { world, state, machine, prefix, pieces, contents, reached };
        for gripper in &world.grippers {
            for position in &gripper.positions {
                let axes = scene.axes(gripper, position.at.iter().copied());
                if let Some(point) = joints(axes).pop() {
                    scene.reached.entry(&*position.place).or_insert(point);
                }
            }
        }
        scene
    }

    /// The drawing; `None` if the file places nothing.
    pub(super) fn draw(&self) -> Option<Drawing> {
        let is_drawn = |(_, model): (_, &MotorModel)| model.drawn.is_some();
        let mut places = self.world.places.iter();
        if !self.motors().any(is_drawn) && places.all(|place| place.drawn.is_none()) {
            return None;
        }
        Some(Drawing {
            slides: self.motors().filter_map(|(motor, model)| self.slide(motor, model)).collect(),
            grippers: self.world.grippers.iter().filter_map(|it| self.gripper(it)).collect(),
            ejectors: self.ejectors(),
            wheels: self.motors().filter_map(|(motor, model)| self.wheel(motor, model)).collect(),
        })
    }

    /// Where a place of this world is.
    pub(super) fn place(&self, place: &Place) -> Option<Point> {
        let Some(motor) = place.on else {
            return place.drawn.or_else(|| self.reached.get(&*place.name).copied());
        };
        let model = self.model(motor)?;
        match (&model.belt, model.drawn) {
            (Some(belt), Some(line)) => Some(between(line, place.at / belt.length)),
            _ => joints([(model, place.at)]).last().copied(),
        }
    }

    /// Places of other controllers where grippers of this one are drawn, each with its name.
    pub(super) fn others(&self) -> impl Iterator<Item = (&'a str, Point)> + '_ {
        let mut known: HashSet<&str> = self.world.places.iter().map(|place| &*place.name).collect();
        let positions = self.world.grippers.iter().flat_map(|gripper| &gripper.positions);
        let names = positions.map(|position| &*position.place);
        names
            .filter(move |name| known.insert(name))
            .filter_map(|name| Some((name, *self.reached.get(name)?)))
    }

    /// What lies there.
    fn lying(&self, at: &Whereabouts) -> Lying {
        let found = self.pieces.iter().position(|(_, whereabouts)| whereabouts == at);
        found.map(|index| self.piece(index)).unwrap_or_default()
    }

    /// The piece with this index, and what is in it.
    pub(super) fn piece(&self, index: usize) -> Lying {
        let content = self.contents.get(&index).map(|piece| piece.name());
        Lying { piece: Some(self.pieces[index].0.name()), content }
    }

    pub(super) fn full(&self, name: &str) -> String {
        format!("{}{name}", self.prefix)
    }

    fn model(&self, motor: Plug<Motor>) -> Option<&MotorModel> {
        let board = match motor.controller.checked_sub(1) {
            None => &self.world.master,
            Some(extension) => self.world.extensions.get(extension)?,
        };
        board.motors.get(&motor.terminal)
    }

    pub(super) fn motors(&self) -> impl Iterator<Item = (Plug<Motor>, &MotorModel)> {
        let boards = std::iter::once(&self.world.master).chain(&self.world.extensions);
        boards.enumerate().flat_map(|(controller, board)| {
            let motors = board.motors.iter();
            motors.map(move |(terminal, model)| (Plug { controller, terminal: *terminal }, model))
        })
    }

    fn position(&self, motor: Plug<Motor>) -> Option<f64> {
        self.state.slide(motor.controller, motor.terminal)
    }

    fn is_on(&self, output: Plug<Output>) -> bool {
        let controller = self.machine.controllers.get(output.controller);
        controller.is_some_and(|it| it.outputs.duty[output.terminal.index()] > 0)
    }

    /// The axes of a gripper at these positions.
    fn axes<'b>(
        &'b self,
        gripper: &'b Gripper,
        at: impl Iterator<Item = f64> + 'b,
    ) -> impl Iterator<Item = (&'b MotorModel, f64)> {
        let axes = gripper.axes.iter().zip(at);
        axes.filter_map(|(axis, position)| Some((self.model(*axis)?, position)))
    }

    fn slide(&self, motor: Plug<Motor>, model: &MotorModel) -> Option<SlideDrawing> {
        let (line, part) = (model.drawn?, part(model, self.position(motor)?)?);
        // The seat of others is a gripper.
        self.world.places.iter().any(|place| place.on == Some(motor)).then_some(())?;
        let name = motor.to_string();
        let lying = self.lying(&Whereabouts::Slide(self.full(&name)));
        Some(SlideDrawing { motor: name, line: line.into(), part, lying })
    }

    fn gripper(&self, gripper: &Gripper) -> Option<GripperDrawing> {
        let now = || gripper.axes.iter().map(|axis| self.position(*axis).unwrap_or_default());
        let joints = joints(self.axes(gripper, now()));
        let [from, first, ..] = joints[..] else { return None };
        let drawn = gripper.axes.iter().find_map(|axis| self.model(*axis)?.drawn)?;
        let moves = drawn.turn == 0.0;
        let is_drawn = |motor| self.model(motor).is_some_and(|model| model.drawn.is_some());
        let (seen, hidden): (Vec<Plug<Motor>>, Vec<_>) =
            gripper.axes.iter().copied().partition(|it| is_drawn(*it));
        let heights = hidden.into_iter().filter_map(|axis| {
            let part = part(self.model(axis)?, self.position(axis)?)?;
            Some(HeightDrawing { motor: axis.to_string(), part })
        });
        let (on, low) = match gripper.grip {
            Grip::Vacuum { valve, lower, .. } => {
                (self.is_on(valve), lower.is_some_and(|lower| self.is_on(lower)))
            }
            Grip::Fork { motor, .. } => {
                let out = self.model(motor).zip(self.position(motor));
                (out.and_then(|(model, at)| part(model, at)).is_some_and(|out| out >= 0.5), false)
            }
            // What the drawing does not know yet is drawn without it.
            _ => (false, false),
        };
        Some(GripperDrawing {
            motors: seen.iter().map(Plug::to_string).collect(),
            rail: moves.then_some([drawn.from, drawn.to]),
            arm: [if moves { first } else { from }, *joints.last()?],
            heights: heights.collect(),
            on,
            low,
            lying: self.lying(&Whereabouts::Gripper(self.full(&gripper.name))),
        })
    }

    fn ejectors(&self) -> Vec<EjectorDrawing> {
        let point = |name: &str| {
            let place = self.world.places.iter().find(|place| place.name == name)?;
            self.place(place)
        };
        let drawn = self.world.ejectors.iter().filter_map(|ejector| {
            Some(EjectorDrawing {
                valve: ejector.valve.to_string(),
                from: point(&ejector.from)?,
                to: point(&ejector.to)?,
                on: self.is_on(ejector.valve) && ejector.compressor.is_none_or(|it| self.is_on(it)),
            })
        });
        drawn.collect()
    }

    fn wheel(&self, motor: Plug<Motor>, model: &MotorModel) -> Option<WheelDrawing> {
        let at = model.drawn?.from;
        let speed = self.state.motor_speed(motor.controller, motor.terminal)?;
        let is_wheel = model.belt.is_none() && model.slide.is_none();
        is_wheel.then(|| WheelDrawing { motor: motor.to_string(), at, speed })
    }
}

/// Where this part of a line is.
fn between(line: Drawn, part: f64) -> Point {
    std::array::from_fn(|index| {
        rounded(line.from[index] + part * (line.to[index] - line.from[index]))
    })
}

/// Where the slide of a motor is on its travel, 0 to 1.
fn part(model: &MotorModel, position: f64) -> Option<f64> {
    let slide = model.slide.as_ref()?;
    Some((1000.0 * position / slide.travel.length()).round() / 1000.0)
}

/// Where slides begin, and to where each one, moved and turned by those before it, carries what is on it. Those that are
/// not drawn are left out.
fn joints<'a>(axes: impl IntoIterator<Item = (&'a MotorModel, f64)>) -> Vec<Point> {
    let mut joints = Vec::new();
    let ([mut x, mut y], mut angle) = ([0.0; 2], 0.0_f64);
    for (model, position) in axes {
        let (Some(line), Some(slide)) = (model.drawn, &model.slide) else { continue };
        if joints.is_empty() {
            [x, y] = line.from;
            joints.push(line.from);
        }
        let part = position / slide.travel.length();
        let length = if line.turn == 0.0 { part } else { 1.0 };
        angle += part * line.turn;
        let [right, down] = [0, 1].map(|index| length * (line.to[index] - line.from[index]));
        let (sin, cos) = angle.to_radians().sin_cos();
        (x, y) = (x + right * cos - down * sin, y + right * sin + down * cos);
        joints.push([x, y].map(rounded));
    }
    joints
}

/// So that the state is not longer than what is to be seen.
fn rounded(mm: f64) -> f64 {
    (10.0 * mm).round() / 10.0
}

#[cfg(test)]
mod tests {
    use ft_transfer_area_simulator::world::{Slide, Travel};

    use super::*;

    fn axis(line: Drawn) -> MotorModel {
        let slide = Slide::new(Travel::Pulses(1000.0));
        MotorModel::encoder_motor().slide(slide).drawn(line)
    }

    #[test]
    fn axes_carry_those_behind_them() {
        let right = axis(Drawn::new([100.0, 20.0], [300.0, 20.0]));
        let down = axis(Drawn::new([0.0, 0.0], [0.0, 50.0]));
        let hidden = MotorModel::default();
        let at = joints([(&right, 500.0), (&hidden, 1.0), (&down, 200.0)]);
        assert_eq!(at, [[100.0, 20.0], [200.0, 20.0], [200.0, 30.0]]);
    }

    #[test]
    fn what_turns_takes_those_behind_it_along() {
        let turn = axis(Drawn::new([200.0, 200.0], [300.0, 200.0]).turn(180.0));
        let out = axis(Drawn::new([0.0, 0.0], [50.0, 0.0]));
        let at = |turned, is_out| joints([(&turn, turned), (&out, is_out)]).pop();
        assert_eq!(at(0.0, 0.0), Some([300.0, 200.0]));
        // Clockwise, as y goes downwards.
        assert_eq!(at(500.0, 1000.0), Some([200.0, 350.0]));
        assert_eq!(at(1000.0, 0.0), Some([100.0, 200.0]));
    }

    #[test]
    fn nothing_is_drawn_without_its_keys() {
        assert!(joints([(&MotorModel::encoder_motor(), 5.0)]).is_empty());
    }
}
