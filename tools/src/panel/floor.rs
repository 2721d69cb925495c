//! The workpieces of a simulated TXT's world: where they are, and what hands do with them.

use std::collections::HashMap;

use ft_transfer_area::tx::Motor;
use ft_transfer_area_simulator::world::{
    Mishap, Piece, Plug, Point, Whereabouts, World, WorldState,
};
use ft_transfer_area_simulator::Machine;
use serde::Serialize;

use super::drawing::{Drawing, Line, Lying, Scene};
use super::problem::Problem;

/// All places and belts, with what is there.
#[derive(Serialize)]
pub(super) struct FloorReport {
    belts: Vec<BeltReport>,
    places: Vec<PlaceReport>,
    /// What is on the seat of a slide, in a gripper or in a container.
    carried: Vec<CarriedReport>,
    fallen: u64,
    /// The newest thing that went wrong.
    mishap: Option<MishapReport>,
    drawing: Option<Drawing>,
}

/// What went wrong, as a sentence in English and for one in the page's language.
#[derive(Serialize)]
struct MishapReport {
    text: String,
    code: &'static str,
    piece: &'static str,
    place: Option<String>,
    /// The belt, ejector or gripper.
    by: Option<String>,
    /// The gripper that holds it.
    holder: Option<String>,
}

impl MishapReport {
    fn of(mishap: Mishap) -> Self {
        let text = mishap.to_string();
        let (code, piece, place, by, holder) = match mishap {
            Mishap::NotPutIn { piece, place } => ("not_put_in", piece, Some(place), None, None),
            Mishap::JamsOnBelt { piece, motor, place } => {
                ("jams_on_belt", piece, Some(place), Some(motor), None)
            }
            Mishap::JamsAtEjector { piece, ejector, place } => {
                ("jams_at_ejector", piece, Some(place), Some(ejector), None)
            }
            Mishap::NotGripped { piece, gripper, holder } => {
                ("not_gripped", piece, None, Some(gripper), Some(holder))
            }
            Mishap::FallsBesides { piece, gripper } => {
                ("falls_besides", piece, None, Some(gripper), None)
            }
            Mishap::FallsAt { piece, place } => ("falls_at", piece, Some(place), None, None),
            Mishap::NotPutDown { gripper, place } => {
                ("not_put_down", Piece::Container, Some(place), Some(gripper), None)
            }
            // One of a later simulated TXT is shown in English.
            _ => ("", Piece::Container, None, None, None),
        };
        Self { text, code, piece: piece.name(), place, by, holder }
    }
}

#[derive(Serialize)]
struct BeltReport {
    motor: String,
    length: f64,
    /// Where it is drawn.
    line: Option<Line>,
    places: Vec<BeltPlace>,
    pieces: Vec<BeltPiece>,
}

/// A place on a belt, in mm from its start.
#[derive(Serialize)]
struct BeltPlace {
    name: String,
    mm: f64,
}

#[derive(Serialize)]
struct BeltPiece {
    #[serde(flatten)]
    lying: Lying,
    mm: f64,
}

#[derive(Serialize)]
struct PlaceReport {
    name: String,
    #[serde(flatten)]
    lying: Lying,
    /// Where it is drawn.
    #[serde(skip_serializing_if = "Option::is_none")]
    at: Option<Point>,
    /// Whether a belt or a slide shows what lies there.
    moves: bool,
    /// Whether it is one of another controller.
    other: bool,
}

#[derive(Serialize)]
struct CarriedReport {
    piece: &'static str,
    by: String,
}

/// What is to be seen of the workpieces; `None` in a world without places.
/// Of the controller with this name, if there are several.
pub(super) fn report(
    machine: &Machine,
    state: &WorldState,
    world: &World,
    name: Option<&str>,
) -> Option<FloorReport> {
    if world.places.is_empty() {
        return None;
    }
    let prefix = name.map(|name| format!("{name}.")).unwrap_or_default();
    let pieces = &state.pieces()[..];
    let carried = pieces.iter().filter_map(|(piece, whereabouts)| {
        let by = match whereabouts {
            Whereabouts::Slide(name) | Whereabouts::Gripper(name) => {
                name.strip_prefix(&prefix)?.to_owned()
            }
            // Places and belts show what is there.
            _ => return None,
        };
        Some(CarriedReport { piece: piece.name(), by })
    });
    let scene = Scene::new(world, state, machine, &prefix, pieces);
    Some(FloorReport {
        belts: belts(&scene),
        places: places(&scene),
        carried: carried.collect(),
        fallen: state.fallen(),
        mishap: state.mishaps().pop().map(MishapReport::of),
        drawing: scene.draw(),
    })
}

/// The places of this controller, and those of others that its drawing has.
fn places(scene: &Scene<'_>) -> Vec<PlaceReport> {
    let all: HashMap<_, _> = scene.state.places().into_iter().collect();
    // Only what lies at a place that does not move is known by the place's name.
    let by_name = scene.pieces.iter().enumerate().filter_map(|(index, (_, at))| match at {
        Whereabouts::Place(name) => Some((&**name, scene.piece(index))),
        _ => None,
    });
    let by_name: HashMap<_, _> = by_name.collect();
    let report = |name: &str, full: &str, at, moves, other| {
        let piece = all.get(full).copied().flatten().map(Piece::name);
        let lying = Lying { piece, ..by_name.get(full).copied().unwrap_or_default() };
        PlaceReport { name: name.to_owned(), lying, at, moves, other }
    };
    let own = scene.world.places.iter().map(|place| {
        let full = scene.full(&place.name);
        report(&place.name, &full, scene.place(place), place.on.is_some(), false)
    });
    own.chain(scene.others().map(|(name, at)| report(name, name, Some(at), false, true))).collect()
}

fn belts(scene: &Scene<'_>) -> Vec<BeltReport> {
    let belts = scene.motors().filter_map(|(motor, model)| {
        Some(belt(scene, motor, model.belt.as_ref()?.length, model.drawn.map(Line::from)))
    });
    belts.collect()
}

fn belt(scene: &Scene<'_>, motor: Plug<Motor>, length: f64, line: Option<Line>) -> BeltReport {
    let name = motor.to_string();
    let full_name = scene.full(&name);
    let places = scene.world.places.iter().filter(|place| place.on == Some(motor));
    let on_it = scene.pieces.iter().enumerate().filter_map(|(index, (_, at))| match at {
        Whereabouts::Belt { motor, mm } if *motor == full_name => {
            Some(BeltPiece { lying: scene.piece(index), mm: *mm })
        }
        _ => None,
    });
    BeltReport {
        length,
        line,
        places: places.map(|place| BeltPlace { name: place.name.clone(), mm: place.at }).collect(),
        pieces: on_it.collect(),
        motor: name,
    }
}

/// Puts a new workpiece at a place.
pub(super) fn put(world: &mut WorldState, piece: &str, place: &str) -> Result<(), Problem> {
    let Some(piece) = Piece::ALL.into_iter().find(|known| known.name() == piece) else {
        return Err(Problem::bad_message(format!("there is no workpiece {piece:?}")));
    };
    if world.put(piece, place) {
        return Ok(());
    }
    Err(Problem::new("no_room", format!("there is no room at {place:?}")))
}

/// Takes away what is at a place.
pub(super) fn take(world: &mut WorldState, place: &str) -> Result<(), Problem> {
    let taken = world.take(place);
    taken
        .map(drop)
        .ok_or_else(|| Problem::new("no_piece", format!("there is nothing at {place:?}")))
}

#[cfg(test)]
mod tests {
    use ft_transfer_area_simulator::world::Factory;
    use serde_json::{json, Value};

    use super::*;

    /// The report of a controller of the factory at the start.
    fn floor_of(name: &str) -> Value {
        let factory = Factory::shipped("factory").unwrap();
        let machines = factory.machines().unwrap();
        let (_, machine) = machines.iter().find(|(known, _)| known == name).unwrap();
        let (_, world) = factory.controllers.iter().find(|(known, _)| known == name).unwrap();
        let report = report(machine, machine.world().unwrap(), world, Some(name));
        serde_json::to_value(report).unwrap()
    }

    fn place(floor: &Value, name: &str) -> Value {
        let places = floor["places"].as_array().unwrap();
        places.iter().find(|place| place["name"] == name).unwrap().clone()
    }

    #[test]
    fn shelves_are_where_the_gripper_reaches_them_with_what_is_in_their_containers() {
        let floor = floor_of("warehouse");
        let expected = json!({"name": "B3", "piece": "container", "content": "red",
            "at": [317.5, 84.7], "moves": false, "other": false});
        assert_eq!(place(&floor, "B3"), expected);
        assert_eq!(place(&floor, "belt_inside")["at"], json!([120.0, 125.0]));
        // The axes are at 400 and 300 pulses.
        assert_eq!(floor["drawing"]["grippers"][0]["arm"], json!([[158.0, 20.0], [158.0, 63.6]]));
    }

    #[test]
    fn a_robot_has_the_places_of_other_controllers_and_its_height() {
        let floor = floor_of("robot");
        let oven = place(&floor, "processing.oven");
        assert_eq!((&oven["other"], &oven["piece"]), (&json!(true), &json!(null)));
        // It is straight above what the robot turns around.
        let gripper = &floor["drawing"]["grippers"][0];
        assert!((oven["at"][0].as_f64().unwrap() - 190.0).abs() < 1.0, "{oven}");
        assert_eq!(gripper["arm"][0], json!([190.0, 220.0]));
        assert_eq!(gripper["heights"], json!([{"motor": "M2", "part": 0.211}]));
    }

    #[test]
    fn a_world_that_places_nothing_has_no_drawing() {
        let world = World::new().place(ft_transfer_area_simulator::world::Place::new("table"));
        let machine = Machine::with_world(0, world.clone()).unwrap();
        let floor = report(&machine, machine.world().unwrap(), &world, None);
        let floor = serde_json::to_value(floor).unwrap();
        assert_eq!((&floor["drawing"], place(&floor, "table").get("at")), (&json!(null), None));
    }
}
