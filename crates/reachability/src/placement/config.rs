//! Settings of the base placement search.

use crate::line::Roll;
use crate::steps::Steps;
use std::f64::consts::FRAC_PI_4;

/// Which positions to try, and what counts as reached.
#[derive(Debug, Clone, PartialEq)]
pub struct PlacementConfig {
    /// Positions of the base along the room's x axis, m.
    pub x: Steps,
    /// Positions along y, m.
    pub y: Steps,
    /// Height of the base (floor or pedestal) in the room, m.
    pub z_m: f64,
    /// Headings of the base, rad: rotation of its x axis from the room's about the vertical.
    pub headings_rad: Vec<f64>,
    /// Allowed rolls of the board about the normal; default fixed at 0.
    pub roll: Roll,
    /// Number of positions to return with margins; default 10. Each costs about 1 ms for 100 targets.
    pub best: usize,
    /// Minimum distance of the base axis behind the wall of each target it serves, m; default `None`. Walls
    /// are not obstacles here, so an arm may reach a target from the person's side, around the board. With
    /// `Some(0.3)` a target counts only for bases with `normal · (point - base)` of at least 0.3 m.
    pub least_behind_m: Option<f64>,
}

impl PlacementConfig {
    /// Eight headings, the ten best, no constraint on the side of the wall.
    #[must_use]
    pub fn new(x: Steps, y: Steps, z_m: f64) -> Self {
        Self {
            x,
            y,
            z_m,
            headings_rad: (0..8).map(|i| f64::from(i) * FRAC_PI_4).collect(),
            roll: Roll::Fixed(0.0),
            best: 10,
            least_behind_m: None,
        }
    }
}
