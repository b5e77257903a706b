//! Settings of the exact solver.

use serde::{Deserialize, Serialize};
use std::f64::consts::{FRAC_PI_2, PI};

/// How the board may be rotated about the wall's normal.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Roll {
    /// One roll, rad; at 0 the tool's y axis points up.
    Fixed(f64),
    /// Any of these rolls, rad: a square board covers the same area at four rolls.
    AnyOf(Vec<f64>),
    /// Any roll: a round board, or point contact.
    Free,
}

impl Roll {
    /// The four rolls of a square board.
    #[must_use]
    pub fn quarter_turns() -> Self {
        Self::AnyOf(vec![0.0, FRAC_PI_2, PI, -FRAC_PI_2])
    }
}

/// Which part of the board must be at the queried point of the wall.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum BoardPart {
    /// The tool point: the middle of the board.
    Middle,
    /// Any point of a rectangle centred on the tool point, up to its corners. Its sides must be horizontal and vertical
    /// at every roll of the solver: rolls are multiples of a quarter turn for a square, of half a turn otherwise.
    Any {
        /// Half of the horizontal side, m.
        half_width_m: f64,
        /// Half of the vertical side, m.
        half_height_m: f64,
    },
}

/// Settings of the exact solver.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ExactConfig {
    /// Accuracy of each end, m; every hole or island wider than this is found or covered by a band.
    /// Default 1e-6. Must be between 1e-10 and 0.1 arm lengths, and at least 5e-7 arm lengths if a
    /// free height or a free roll of a tilted tool must be searched.
    pub accuracy_m: f64,
    /// Allowed rolls of the board; default fixed at 0.
    pub roll: Roll,
    /// Which part of the board counts; default its middle. [`BoardPart::Any`] is about fifty times slower.
    pub board_part: BoardPart,
}

impl Default for ExactConfig {
    fn default() -> Self {
        Self {
            accuracy_m: 1e-6,
            roll: Roll::Fixed(0.0),
            board_part: BoardPart::Middle,
        }
    }
}
