//! What goes wrong with workpieces.

use std::fmt;

use super::piece::Piece;

/// What has gone wrong with a workpiece; as a text, a sentence. Places, motors and grippers have their names in the
/// world's file.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Mishap {
    /// The script wanted to put a piece where there is no room.
    NotPutIn {
        /// The piece.
        piece: Piece,
        /// The place that can't take it.
        place: String,
    },
    /// A belt has brought a piece to a place that can't take it.
    JamsOnBelt {
        /// The piece.
        piece: Piece,
        /// The belt's motor.
        motor: String,
        /// The place that can't take it.
        place: String,
    },
    /// An ejector has brought a piece to a place that can't take it.
    JamsAtEjector {
        /// The piece.
        piece: Piece,
        /// The ejector's place.
        ejector: String,
        /// The place that can't take it.
        place: String,
    },
    /// A gripper should take what another one holds.
    NotGripped {
        /// The piece.
        piece: Piece,
        /// The gripper that should take it.
        gripper: String,
        /// The gripper that holds it.
        holder: String,
    },
    /// A gripper has let a piece go where there is no place.
    FallsBesides {
        /// The piece.
        piece: Piece,
        /// The gripper.
        gripper: String,
    },
    /// A gripper has let a piece go at a place that can't take it.
    FallsAt {
        /// The piece.
        piece: Piece,
        /// The place that can't take it.
        place: String,
    },
    /// A fork can't put its container down.
    NotPutDown {
        /// The fork.
        gripper: String,
        /// The place that can't take it.
        place: String,
    },
}

impl fmt::Display for Mishap {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotPutIn { piece, place } => {
                write!(f, "{piece} can't be put in: {place} can't take it")
            }
            Self::JamsOnBelt { piece, motor, place } => {
                write!(f, "{piece} jams on the belt of {motor}: {place} can't take it")
            }
            Self::JamsAtEjector { piece, ejector, place } => {
                write!(f, "{piece} jams at {ejector}: {place} can't take it")
            }
            Self::NotGripped { piece, gripper, holder } => {
                write!(f, "{gripper} can't grip {piece}: {holder} holds it")
            }
            Self::FallsBesides { piece, gripper } => {
                write!(f, "{piece} falls: {gripper} lets go of it where there is no place")
            }
            Self::FallsAt { piece, place } => write!(f, "{piece} falls: {place} can't take it"),
            Self::NotPutDown { gripper, place } => {
                write!(f, "{gripper} can't put the container down: {place} can't take it")
            }
        }
    }
}
