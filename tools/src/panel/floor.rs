//! The workpieces of a simulated TXT's world: where they are, and what hands do with them.

use ft_transfer_area::tx::Motor;
use ft_transfer_area_simulator::world::{Board, Piece, Plug, Whereabouts, World, WorldState};
use serde::Serialize;

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
    mishap: Option<String>,
}

#[derive(Serialize)]
struct BeltReport {
    motor: String,
    length: f64,
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
    piece: &'static str,
    mm: f64,
}

#[derive(Serialize)]
struct PlaceReport {
    name: String,
    piece: Option<&'static str>,
}

#[derive(Serialize)]
struct CarriedReport {
    piece: &'static str,
    by: String,
}

/// What is to be seen of the workpieces; `None` in a world without places.
/// Of the controller with this name, if there are several.
pub(super) fn report(state: &WorldState, world: &World, name: Option<&str>) -> Option<FloorReport> {
    if world.places.is_empty() {
        return None;
    }
    let prefix = name.map(|name| format!("{name}.")).unwrap_or_default();
    let own = |name: &str| name.strip_prefix(&prefix).map(str::to_owned);
    let pieces = state.pieces();
    let carried = pieces.iter().filter_map(|(piece, whereabouts)| {
        let by = match whereabouts {
            Whereabouts::Slide(name) | Whereabouts::Gripper(name) => own(name)?,
            // Places and belts show what is there.
            _ => return None,
        };
        Some(CarriedReport { piece: piece.name(), by })
    });
    Some(FloorReport {
        belts: belts(world, &prefix, &pieces),
        places: state
            .places()
            .into_iter()
            .filter_map(|(name, piece)| {
                Some(PlaceReport { name: own(&name)?, piece: piece.map(Piece::name) })
            })
            .collect(),
        carried: carried.collect(),
        fallen: state.fallen(),
        mishap: state.mishaps().pop(),
    })
}

fn belts(world: &World, prefix: &str, pieces: &[(Piece, Whereabouts)]) -> Vec<BeltReport> {
    let boards = std::iter::once(&world.master).chain(&world.extensions).enumerate();
    let motors = boards.flat_map(|(controller, board): (usize, &Board)| {
        let belts = board.motors.iter();
        belts.filter_map(move |(terminal, motor)| {
            Some((Plug { controller, terminal: *terminal }, motor.belt.as_ref()?.length))
        })
    });
    motors.map(|(motor, length)| belt(world, motor, length, prefix, pieces)).collect()
}

fn belt(
    world: &World,
    motor: Plug<Motor>,
    length: f64,
    prefix: &str,
    pieces: &[(Piece, Whereabouts)],
) -> BeltReport {
    let name = motor.to_string();
    let full_name = format!("{prefix}{name}");
    let places = world.places.iter().filter(|place| place.on == Some(motor));
    let on_it = pieces.iter().filter_map(|(piece, whereabouts)| match whereabouts {
        Whereabouts::Belt { motor, mm } if *motor == full_name => {
            Some(BeltPiece { piece: piece.name(), mm: *mm })
        }
        _ => None,
    });
    BeltReport {
        length,
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
