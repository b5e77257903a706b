//! What the exact solver is asked for.

use serde::{Deserialize, Serialize};
use std::f64::consts::{FRAC_PI_2, PI};

/// How the board may be turned about the wall's normal.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Roll {
    /// One roll, rad; at 0 the tool's y axis points up.
    Fixed(f64),
    /// Any of these, rad: a square board covers the same area at four rolls.
    AnyOf(Vec<f64>),
    /// Any roll at all: a round board, or a contact at a point.
    Free,
}

impl Roll {
    /// The four rolls of a square board.
    #[must_use]
    pub fn quarter_turns() -> Self {
        Self::AnyOf(vec![0.0, FRAC_PI_2, PI, -FRAC_PI_2])
    }
}

/// Which part of the board must be at the place of the wall that is asked about.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum BoardPart {
    /// The tool point: the middle of the board.
    Middle,
    /// Any point of a rectangle about the tool point, up to its corners. The sides are horizontal
    /// and vertical at the rolls that the solver is given: multiples of a quarter turn, and of half
    /// a turn for a rectangle that is no square.
    Any {
        /// Half of the horizontal side, m.
        half_width_m: f64,
        /// Half of the vertical side, m.
        half_height_m: f64,
    },
}

/// What the exact solver is asked for.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ExactConfig {
    /// Each end is known to this, m, and a hole or an island wider than this is found or covered
    /// by a band; default 1e-6. Below 1e-10 or above 0.1 arm lengths is an error, and so is less
    /// than 5e-7 arm lengths where a free height or a free roll of a tilted tool must be searched.
    pub accuracy_m: f64,
    /// How the board may be turned; default fixed at 0.
    pub roll: Roll,
    /// Which part of the board counts; default its middle. [`BoardPart::Any`] takes about fifty
    /// times as long.
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
